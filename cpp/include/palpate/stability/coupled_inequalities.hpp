// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "palpate/device/device_profile.hpp"
#include "palpate/dynamics/coupling.hpp"
#include "palpate/rendering/inertia.hpp"
#include "palpate/stability/coupling_need.hpp"
#include "palpate/stability/direct_inequalities.hpp"
#include "palpate/stability/force_bounds.hpp"
#include "palpate/stability/inequality.hpp"

namespace palpate {

namespace detail {

/// What holds for every passive object behind a coupling.
[[nodiscard]] inline Inequality coupling_inequality(VirtualCoupling coupling, const DeviceProfile& device) {
    const double need =
        device.longest_period_s() * coupling_need(coupling, device.period_s, device.late_samples());
    if (device.late_samples() == 0) {
        return {"damping-coupling",
                "viscous damping against the held coupling",
                "b > K_c T / 2 + B_c",
                device.viscous_damping,
                need,
                Basis::Proved,
                "Colgate, Stanley and Brown 1995; docs/certificate.md",
                true};
    }
    return {"damping-coupling",
            "viscous damping against the held, late coupling",
            "b >= T max sin^2((n_d + 1) theta / 2) (A^2 + K_c^2 / 4 cot^2(theta / 2)) / A",
            device.viscous_damping,
            need,
            Basis::Proved,
            "docs/certificate.md"};
}

/// A line that says that nothing is known beyond it.
[[nodiscard]] inline Inequality unknown(const char* id, const char* name, const char* formula, double value) {
    return {id, name, formula, 0.0, value, Basis::None, "no bound is known"};
}

/// What the proof of a coupled structure asks of an object whose force falls: `room` is how steeply it may.
inline void add_falling(std::vector<Inequality>& lines, const ForceBounds& bounds,
                        const DeviceProfile& device, double room, const char* formula) {
    lines.push_back({"falling-slope-coupling", "falling force behind the coupling", formula, room,
                     bounds.falling(), Basis::Proved, "docs/certificate.md"});
    if (device.late_samples() > 0) {
        lines.push_back(unknown("falling-slope-delay", "a force that falls, with delay",
                                "known for s_ = 0 only", bounds.falling()));
    }
}

inline void add_loss(std::vector<Inequality>& lines, const ForceBounds& bounds) {
    if (bounds.hysteresis) {
        lines.push_back({"loss-nonnegative", "loss that never generates", "min h >= 0", bounds.loss.lower,
                         0.0, Basis::Proved, "docs/certificate.md"});
    }
}

/// Behind a coupling no bound is known for what encoder steps do to a mass, or to a play.
inline void add_no_quantisation(std::vector<Inequality>& lines, const ForceBounds& bounds,
                                const DeviceProfile& device, const char* name) {
    lines.push_back(unknown("encoder-step-coupling", name,
                            "known for an encoder without steps, Delta = 0, only", device.encoder_step));
    DeviceProfile smooth = device;
    smooth.encoder_step = 0.0;
    Inequality friction = friction_inequality(smooth, 0.0, bounds.mean_force, "0");
    friction.id = "friction-force-step";
    friction.name = "Coulomb friction against force steps";
    lines.push_back(friction);
}

/// p + min f' > 0: the load line has one solution.
[[nodiscard]] inline Inequality uniqueness(double p, double falling, const char* formula) {
    return {"unique-solution", "one solution of the load line", formula, p, falling,
            Basis::Proved,     "docs/certificate.md",           true};
}

/// gamma: what an error of the encoder can become of in the force of a massless object.
[[nodiscard]] inline double massless_gain(const ForceBounds& bounds, VirtualCoupling coupling,
                                          double period_s) noexcept {
    const double falling = bounds.falling();
    if (falling >= coupling.stiffness) {
        return std::numeric_limits<double>::infinity();
    }
    const double beta = coupling.damping / period_s;
    const double p = coupling.stiffness + beta;
    const double carried = std::max(1.0, falling / (coupling.stiffness - falling));
    double gain = 0.0;
    for (const double slope : {-falling, bounds.rising()}) {
        gain = std::max(gain, std::abs(slope) * (p + beta * carried) / (p + slope));
    }
    return gain;
}

}  // namespace detail

/// An object without mass behind a coupling. Without coupling damping a static one is a static force F(x) of
/// slope K_c f' / (K_c + f').
[[nodiscard]] inline std::vector<Inequality> massless_inequalities(const ForceBounds& bounds,
                                                                   VirtualCoupling coupling,
                                                                   const DeviceProfile& device) {
    const double p = coupling.stiffness + coupling.damping / device.period_s;
    std::vector<Inequality> lines;
    if (coupling.damping == 0.0 && !bounds.hysteresis) {
        lines.push_back(detail::uniqueness(p, bounds.falling(), "K_c > s_"));
        if (!lines.front().holds()) {
            return lines;
        }
        ForceBounds felt = bounds;
        felt.slope = {felt_slope(bounds.slope.lower, coupling.stiffness),
                      std::isfinite(bounds.slope.upper) ? felt_slope(bounds.slope.upper, coupling.stiffness)
                                                        : bounds.slope.upper};
        felt.steepest = felt.sliding = felt.slope.largest();
        for (Inequality& line : direct_inequalities(felt, device)) {
            line.formula += ", M and L of K_c f' / (K_c + f')";
            lines.push_back(std::move(line));
        }
        return lines;
    }
    detail::add_loss(lines, bounds);
    lines.push_back(detail::coupling_inequality(coupling, device));
    detail::add_falling(lines, bounds, device, p, "K_c + B_c / T >= s_");
    lines.push_back(detail::uniqueness(p, bounds.falling(), "K_c + B_c / T > s_"));
    if (bounds.hysteresis) {
        detail::add_no_quantisation(lines, bounds, device, "encoder steps and a play behind a coupling");
    } else if (bounds.falling() >= coupling.stiffness) {
        detail::add_no_quantisation(lines, bounds, device, "encoder steps and a force that falls with K_c");
    } else {
        lines.push_back(detail::friction_inequality(device,
                                                    detail::massless_gain(bounds, coupling, device.period_s),
                                                    bounds.mean_force, "gamma Delta / 2"));
    }
    return lines;
}

/// An object with mass behind a coupling, backward Euler. The mass does not help a force that falls.
[[nodiscard]] inline std::vector<Inequality> implicit_inequalities(const ForceBounds& bounds, Inertia inertia,
                                                                   VirtualCoupling coupling,
                                                                   const DeviceProfile& device) {
    const double T = device.period_s;
    const double room = coupling.stiffness + (coupling.damping + 2.0 * inertia.damping) / T;
    const double p = coupling.stiffness + (coupling.damping + inertia.damping + inertia.mass / T) / T;
    std::vector<Inequality> lines;
    detail::add_loss(lines, bounds);
    lines.push_back(detail::coupling_inequality(coupling, device));
    detail::add_falling(lines, bounds, device, room, "K_c + (B_c + 2 B_o) / T >= s_");
    lines.push_back(detail::uniqueness(p, bounds.falling(), "p > s_"));
    detail::add_no_quantisation(lines, bounds, device, "encoder steps and a mass behind a coupling");
    return lines;
}

/// An object with mass behind a coupling, stepped so that it stores what it is given: passive for any slope.
[[nodiscard]] inline std::vector<Inequality> energy_consistent_inequalities(const ForceBounds& bounds,
                                                                            Inertia inertia,
                                                                            VirtualCoupling coupling,
                                                                            const DeviceProfile& device) {
    const double T = device.period_s;
    const double p = coupling.stiffness + (coupling.damping + inertia.damping + 2.0 * inertia.mass / T) / T;
    std::vector<Inequality> lines;
    detail::add_loss(lines, bounds);
    lines.push_back(detail::coupling_inequality(coupling, device));
    lines.push_back(detail::uniqueness(p, 0.5 * bounds.falling(), "p > s_ / 2"));
    detail::add_no_quantisation(lines, bounds, device, "encoder steps and a mass behind a coupling");
    return lines;
}

}  // namespace palpate
