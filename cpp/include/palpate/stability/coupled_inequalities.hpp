// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "palpate/device/device_profile.hpp"
#include "palpate/dynamics/coupling.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/stability/coupling_need.hpp"
#include "palpate/stability/direct_inequalities.hpp"
#include "palpate/stability/force_bounds.hpp"
#include "palpate/stability/inequality.hpp"

namespace palpate {

namespace detail {

/// Returns true if the device has a delay between reading a position and applying its force.
[[nodiscard]] inline bool has_delay(const DeviceProfile& device) noexcept {
    return device.late_samples() > 0;
}

/// Returns the inequality `known` >= `value`. If `value` is larger than `known`, nothing is proved about the rendering;
/// `cure` is a text that says how to avoid this case.
[[nodiscard]] inline Inequality unknown(const char* id, const char* name, const char* formula, double known,
                                        double value, const char* cure) {
    return {id, name, formula, known, value, Basis::None, cure};
}

/// Returns the inequality for the device damping that a virtual coupling needs. The force of the virtual object falls
/// with a slope of at most `falling` [N/m]. With `falling` = 0 the inequality is proved with and without a force limit.
[[nodiscard]] inline Inequality coupling_inequality(VirtualCoupling coupling, double falling,
                                                    const DeviceProfile& device) {
    return {"damping-coupling",
            has_delay(device) ? "viscous damping against the held and delayed coupling"
                              : "viscous damping against the held coupling",
            has_delay(device) ? "b >= T (s_ / 2 + max |H - s_|^2 / (2 (K_c + 2 B_c / T - s_)))"
                              : "b >= K_c T / 2 + B_c",
            device.viscous_damping,
            device.longest_period_s() * coupling_need(coupling, device.period_s, device.whole_delay_samples(),
                                                      device.delay_fraction(), falling),
            Basis::Proved,
            "Colgate, Stanley and Brown 1995; docs/certificate.md"};
}

/// Adds the inequality h >= 0 (hysteresis never negative) if the model has hysteresis.
inline void add_hysteresis(std::vector<Inequality>& lines, const ForceBounds& bounds) {
    if (bounds.hysteresis) {
        lines.push_back(nonnegative_hysteresis(bounds));
    }
}

/// Adds two inequalities for an object for which the effect of encoder steps has no proved bound. The encoder step must
/// be 0. Coulomb friction must be at least half a force step plus the other force errors of `friction_inequality`.
inline void add_no_quantisation(std::vector<Inequality>& lines, const ForceBounds& bounds,
                                const DeviceProfile& device, const char* name, const char* cure) {
    lines.push_back(unknown("encoder-step-coupling", name, "proved only for an encoder step Delta = 0", 0.0,
                            device.encoder_step, cure));
    Inequality friction = friction_inequality(device, 0.0, bounds, "0");
    friction.id = "friction-force-step";
    friction.name = "Coulomb friction against force steps";
    lines.push_back(friction);
}

/// Adds the inequalities for encoder steps and force steps of a virtual object with mass, for which the effect of
/// encoder steps has no proved bound.
inline void add_no_quantisation_of_a_mass(std::vector<Inequality>& lines, const ForceBounds& bounds,
                                          const DeviceProfile& device) {
    add_no_quantisation(lines, bounds, device, "encoder steps with a virtual object with mass",
                        "leave out the mass of the virtual object (mass 0, object damping 0)");
}

/// Returns the inequality p > `falling`: with it the load line of slope p has exactly one solution, because p + min f'
/// > 0.
[[nodiscard]] inline Inequality uniqueness(double p, double falling, const char* formula) {
    return {"unique-solution", "one solution of the load line", formula, p, falling,
            Basis::Proved,     "docs/certificate.md",           true};
}

/// Returns true if the force of a virtual coupling to a mass can reach the force limit of the device. Without a force
/// limit this force is unbounded, because a hand can move any distance in one sample.
[[nodiscard]] inline bool limit_acts(const DeviceProfile& device) noexcept {
    return std::isfinite(device.force_limit);
}

}  // namespace detail

/// If no setting gives the stiffness of a virtual coupling, the stiffness is chosen so that the coupling needs at most
/// this part (95 %) of the device damping.
inline constexpr double usual_coupling_share = 0.95;

/// Returns the largest stiffness of a virtual coupling for which the part `share` of the device damping is sufficient
/// [N/m]. The force of the virtual object falls with a slope of at most `falling` [N/m]. Returns 0 if no stiffness is
/// certified.
[[nodiscard]] inline double stiffest_coupling(double coupling_damping, double falling,
                                              const DeviceProfile& device,
                                              double share = usual_coupling_share) {
    constexpr double finer = 0.97;
    constexpr double softest = 1e-9;
    constexpr int halvings = 40;
    DeviceProfile reduced = device;
    reduced.viscous_damping *= share;
    const auto fits = [&](double stiffness) {
        return detail::coupling_inequality({stiffness, coupling_damping}, falling, reduced).holds();
    };
    const double most = 2.0 * reduced.viscous_damping / device.longest_period_s();
    double low = most;
    while (low > softest * most && !fits(low)) {
        low *= finer;
    }
    if (!(low > softest * most)) {
        return 0.0;
    }
    double high = low / finer;
    for (int k = 0; k < halvings; ++k) {
        const double middle = 0.5 * (low + high);
        (fits(middle) ? low : high) = middle;
    }
    return low;
}

/// Returns the inequalities of the massless structure with or without a force limit. The slopes of the limited force
/// are those of the force f, or 0. Without coupling damping, a force without hysteresis and its coupling act like a
/// directly rendered force of slope K_c f' / (K_c + f').
[[nodiscard]] inline std::vector<Inequality> inequalities(MasslessStructure, const ForceBounds& bounds,
                                                          const Scheme& scheme, const DeviceProfile& device) {
    const VirtualCoupling coupling = scheme.coupling;
    const double p = coupling.load_line_slope(device.period_s);
    std::vector<Inequality> lines;
    detail::add_hysteresis(lines, bounds);
    lines.push_back(
        detail::uniqueness(p, bounds.falling(), coupling.damping == 0.0 ? "K_c > s_" : "K_c + B_c / T > s_"));
    if (!lines.back().holds()) {
        return lines;
    }
    if (coupling.damping == 0.0 && !bounds.hysteresis) {
        ForceBounds series = bounds;
        series.slope = {slope_behind_coupling(bounds.slope.lower, coupling.stiffness),
                        std::isfinite(bounds.slope.upper)
                            ? slope_behind_coupling(bounds.slope.upper, coupling.stiffness)
                            : bounds.slope.upper};
        series.steepest = series.sliding = series.slope.largest();
        for (Inequality& line : direct_inequalities(series, device)) {
            line.formula += ", M and L of K_c f' / (K_c + f')";
            lines.push_back(std::move(line));
        }
        return lines;
    }
    lines.push_back(detail::coupling_inequality(coupling, bounds.falling(), device));
    if (bounds.hysteresis) {
        detail::add_no_quantisation(lines, bounds, device,
                                    "encoder steps with hysteresis behind a virtual coupling",
                                    "use direct rendering");
    } else if (bounds.falling() >= coupling.stiffness) {
        detail::add_no_quantisation(
            lines, bounds, device,
            "encoder steps with a force that falls at least as steeply as the coupling stiffness K_c",
            "use direct rendering");
    } else {
        lines.push_back(detail::friction_inequality(device, massless_gain(bounds, coupling, device.period_s),
                                                    bounds, "gamma Delta / 2"));
    }
    return lines;
}

/// Returns the inequalities of the implicit structure: a virtual object with mass behind a virtual coupling, integrated
/// by backward Euler. The mass does not reduce the damping that a falling force needs.
[[nodiscard]] inline std::vector<Inequality> inequalities(ImplicitStructure, const ForceBounds& bounds,
                                                          const Scheme& scheme, const DeviceProfile& device) {
    const VirtualCoupling coupling = scheme.coupling;
    const double T = device.period_s;
    const double damped = 2.0 * scheme.inertia.damping / T;
    const double uncoupled = scheme.inertia.load_line_slope(T);
    const double coupled = coupling.load_line_slope(T);
    std::vector<Inequality> lines;
    detail::add_hysteresis(lines, bounds);
    if (detail::limit_acts(device)) {
        lines.push_back(detail::coupling_inequality(coupling, 0.0, device));
        lines.push_back(detail::unknown("falling-slope-limit",
                                        "slope of a falling force with object mass and force limit",
                                        "proved only for s_ <= 2 B_o / T", damped, bounds.falling(),
                                        "use the energy-consistent structure"));
        lines.push_back(detail::uniqueness(uncoupled, bounds.falling(), "m / T^2 + B_o / T > s_"));
        detail::add_no_quantisation_of_a_mass(lines, bounds, device);
        return lines;
    }
    lines.push_back({"falling-slope-coupling", "slope of a falling force behind the coupling",
                     "K_c + (B_c + 2 B_o) / T >= s_", coupled + damped, bounds.falling(), Basis::Proved,
                     "docs/certificate.md"});
    lines.push_back(detail::coupling_inequality(coupling, std::max(0.0, bounds.falling() - damped), device));
    lines.push_back(detail::uniqueness(coupled + uncoupled, bounds.falling(), "p > s_"));
    if (!bounds.hysteresis && bounds.slope.lower == bounds.slope.upper) {
        lines.push_back(detail::friction_inequality(
            device, implicit_gain(bounds.slope.lower, scheme.inertia, coupling, T), bounds,
            "||g||_1 Delta / 2"));
    } else {
        detail::add_no_quantisation_of_a_mass(lines, bounds, device);
    }
    return lines;
}

/// Returns the inequalities of the energy-consistent structure: a virtual object with mass behind a virtual coupling,
/// whose integration never generates energy. The object is passive for any slope of the force, and for any solution of
/// a step.
[[nodiscard]] inline std::vector<Inequality> inequalities(EnergyConsistentStructure,
                                                          const ForceBounds& bounds, const Scheme& scheme,
                                                          const DeviceProfile& device) {
    const VirtualCoupling coupling = scheme.coupling;
    const double T = device.period_s;
    const bool limited = detail::limit_acts(device);
    const double uncoupled = scheme.inertia.midpoint_slope(T);
    const double coupled = coupling.load_line_slope(T);
    std::vector<Inequality> lines;
    detail::add_hysteresis(lines, bounds);
    lines.push_back(detail::coupling_inequality(coupling, 0.0, device));
    lines.push_back({"solution-exists", "a solution of every step",
                     limited ? "2 m / T^2 + B_o / T > s_ / 2" : "p > s_ / 2",
                     limited ? uncoupled : uncoupled + coupled, 0.5 * bounds.falling(), Basis::Proved,
                     "docs/certificate.md", true});
    detail::add_no_quantisation_of_a_mass(lines, bounds, device);
    return lines;
}

}  // namespace palpate
