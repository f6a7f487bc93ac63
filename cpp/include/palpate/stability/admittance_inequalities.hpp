// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "palpate/device/device_profile.hpp"
#include "palpate/dynamics/coupling.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/stability/admittance_need.hpp"
#include "palpate/stability/coupled_inequalities.hpp"
#include "palpate/stability/force_bounds.hpp"
#include "palpate/stability/inequality.hpp"

namespace palpate {

/// Returns the slope that a step of the object costs on an admittance display [N/m or N*m/rad]: s_ / 2 with the implicit
/// structure, M / 2 with the explicit one, 0 with the energy-consistent one.
[[nodiscard]] inline double step_slope(StructureKind structure, const ForceBounds& bounds) noexcept {
    return structure == StructureKind::Implicit   ? 0.5 * bounds.falling()
           : structure == StructureKind::Explicit ? 0.5 * bounds.rising()
                                                  : 0.0;
}

/// Returns m / T^2 as far as the step of the object dissipates kinetic energy [N/m or N*m/rad]. The midpoint rule of the
/// energy-consistent structure dissipates none. The explicit structure computes the damping from the old velocity,
/// which acts like new damping and a mass that is smaller by B_o T.
[[nodiscard]] inline double dissipating_inertia(StructureKind structure, Inertia object,
                                                double period_s) noexcept {
    const double mass = structure == StructureKind::Implicit   ? object.mass
                        : structure == StructureKind::Explicit ? object.mass - object.damping * period_s
                                                               : 0.0;
    return std::max(0.0, mass) / (period_s * period_s);
}

/// Returns the object damping that an admittance display needs for every hand in its range [N*s/m or N*m*s/rad]:
///
///     B_o >= T max over theta of [need(theta) - (m / T^2)(1 - cos theta)].
///
/// `AdmittanceNeed` defines need(theta). The largest value is almost always at theta = 0, where it is
/// k_h (t_d + lag) + T sigma. The lag is that of the servo, and sigma is `step_slope`.
[[nodiscard]] inline double needed_object_damping(StructureKind structure, const ForceBounds& bounds,
                                                  Inertia object, const DeviceProfile& device) {
    const AdmittanceNeed need{device, step_slope(structure, bounds)};
    return device.period_s * need.largest(dissipating_inertia(structure, object, device.period_s));
}

/// Returns the inequalities of a model that a scheme renders on an admittance display. If they hold, the muscles
/// receive no more energy than object and hand stored at the start, for every hand within the limits of the profile.
/// With a constant force of the muscles every motion comes to rest. docs/certificate.md has the proof.
[[nodiscard]] inline std::vector<Inequality> admittance_inequalities(const ForceBounds& bounds,
                                                                     const Scheme& scheme,
                                                                     const DeviceProfile& device) {
    const Inertia object = scheme.inertia;
    const double T = device.period_s;
    std::vector<Inequality> lines;
    if (!is_uncoupled(scheme)) {
        lines.push_back({"admittance-structure", "structure on an admittance display",
                         "needs an object with mass and without a coupling", 0.0, 1.0, Basis::None,
                         "use the implicit, explicit or energy-consistent structure with K_c = B_c = 0"});
        return lines;
    }
    const bool is_explicit = scheme.structure == StructureKind::Explicit;
    detail::add_hysteresis(lines, bounds);
    lines.push_back({"admittance-damping", "object damping for every hand of the profile",
                     is_explicit ? "B_o >= T max(M / 2 + hand and servo - (m / T^2 - B_o / T)(1 - cos theta))"
                     : scheme.structure == StructureKind::Implicit
                         ? "B_o >= T max(s_ / 2 + hand and servo - (m / T^2)(1 - cos theta))"
                         : "B_o >= T max(hand and servo)",
                     object.damping, needed_object_damping(scheme.structure, bounds, object, device),
                     Basis::Proved, "docs/certificate.md"});
    if (is_explicit) {
        lines.push_back({"admittance-explicit-mass", "mass for the damping of the explicit integration",
                         "m >= B_o T", object.mass, object.damping * T, Basis::Proved,
                         "docs/certificate.md"});
    } else {
        const bool implicit = scheme.structure == StructureKind::Implicit;
        lines.push_back(implicit ? detail::uniqueness(object.load_line_slope(T), bounds.falling(),
                                                      "m / T^2 + B_o / T > s_")
                                 : detail::uniqueness(object.midpoint_slope(T), 0.5 * bounds.falling(),
                                                      "2 m / T^2 + B_o / T > s_ / 2"));
    }
    lines.push_back(detail::unknown("admittance-jitter", "jitter of the samples of an admittance display",
                                    "proved only for jitter_s = 0", 0.0, device.jitter_s,
                                    "sample with a hardware timer"));
    lines.push_back(detail::unknown("admittance-mean", "mean of a periodic force",
                                    "proved only for a mean of 0", 0.0, bounds.mean_force,
                                    "subtract the mean from the model"));
    lines.push_back(detail::unknown("admittance-force-error", "error of the force of another program",
                                    "proved only for epsilon = 0", 0.0, bounds.force_error,
                                    "render with palpate"));
    if (bounds.drag > 0.0 || bounds.memory) {
        lines.push_back(detail::unknown(
            "admittance-velocity", "force that depends on velocity or has a memory",
            "proved only for a force of position", 0.0, 1.0, "identify the force over position alone"));
    }
    return lines;
}

/// Returns mass and damping of the object with which a structure renders a force on an admittance display. The damping
/// is the least that is proved, at least `object.damping`; the mass is the least with which a larger mass does not
/// reduce the damping, at least `object.mass`. A `fixed` value replaces the choice.
[[nodiscard]] inline Inertia admittance_object(StructureKind structure, const ForceBounds& bounds,
                                               Inertia object, const DeviceProfile& device,
                                               std::optional<double> fixed_mass = std::nullopt,
                                               std::optional<double> fixed_damping = std::nullopt) {
    constexpr double rounding =
        1.0 + 1e-9;  // so that a computer that rounds differently finds the same verdict
    constexpr int iterations = 100;
    const double T = device.period_s;
    const AdmittanceNeed need{device, step_slope(structure, bounds)};
    const double inertial = structure == StructureKind::EnergyConsistent ? 0.0 : need.least_inertial();
    Inertia chosen = object;
    for (int k = 0; k < iterations; ++k) {
        const double before = chosen.damping;
        // The part B_o T of the mass is not felt: the object follows a force within a period
        chosen.mass =
            fixed_mass.value_or(std::max(object.mass, rounding * (inertial * T * T + chosen.damping * T)));
        chosen.damping = fixed_damping.value_or(
            std::max(object.damping, rounding * T * need.largest(dissipating_inertia(structure, chosen, T))));
        if (std::abs(chosen.damping - before) <= 1e-12 * chosen.damping) {
            break;
        }
    }
    return chosen;
}

/// Returns the largest stiffness of a hand for which a scheme is proved on an admittance display, with the other limits
/// of the hand unchanged [N/m or N*m/rad]; 0 if none is.
[[nodiscard]] inline double stiffest_hand(const ForceBounds& bounds, const Scheme& scheme,
                                          DeviceProfile device) {
    if (!device.admittance) {
        return 0.0;
    }
    constexpr int doublings = 60;
    constexpr int halvings = 40;
    const auto holds = [&](double stiffness) {
        device.admittance->hand_stiffness = stiffness;
        return all_hold(admittance_inequalities(bounds, scheme, device));
    };
    if (!holds(0.0)) {
        return 0.0;
    }
    double low = 0.0;
    double high = std::max(device.admittance->hand_stiffness, 1.0);
    for (int k = 0; k < doublings && holds(high); ++k) {
        low = high;
        high *= 2.0;
    }
    for (int k = 0; k < halvings; ++k) {
        const double middle = 0.5 * (low + high);
        (holds(middle) ? low : high) = middle;
    }
    return low;
}

}  // namespace palpate
