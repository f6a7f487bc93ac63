// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "palpate/device/device_profile.hpp"
#include "palpate/dynamics/coupling.hpp"
#include "palpate/rendering/inertia.hpp"
#include "palpate/stability/explicit_need.hpp"
#include "palpate/stability/force_bounds.hpp"
#include "palpate/stability/inequality.hpp"

namespace palpate {

/// An object with mass behind a coupling, every force one sample old (paper figure 14). No proof covers it: what
/// is known is where its linearisation is stable at a held device, and what damping makes the linearised port
/// passive.
[[nodiscard]] inline std::vector<Inequality> explicit_inequalities(const ForceBounds& bounds, Inertia inertia,
                                                                   VirtualCoupling coupling,
                                                                   const DeviceProfile& device) {
    const double T = device.period_s;
    const double damping = inertia.damping + coupling.damping;
    const char* const poles = "poles of the linearised step; docs/certificate.md";
    const Interval slopes{bounds.slope.lower, bounds.slope.upper};
    return {
        {"explicit-slope", "slope below the step's limit", "(4 m - 2 (B_o + B_c) T) / T^2 > K + K_c",
         (4.0 * inertia.mass - 2.0 * damping * T) / (T * T), slopes.upper + coupling.stiffness, Basis::Linear,
         poles, true},
        {"explicit-damping", "damping that the step can follow", "2 m > (B_o + B_c) T", 2.0 * inertia.mass,
         damping * T, Basis::Linear, poles, true},
        {"explicit-damping-positive", "damping inside the unit circle", "B_o + B_c > 0", damping, 0.0,
         Basis::Linear, poles, true},
        {"explicit-falling-slope", "falling force behind the coupling", "K_c > s_", coupling.stiffness,
         bounds.falling(), Basis::Linear, poles, true},
        {"explicit-port-damping", "viscous damping of the linearised port",
         "b >= max T Re{(1 - 1/z) H} / (2 - 2 cos theta)", device.viscous_damping,
         device.longest_period_s() / T * explicit_need(slopes, inertia, coupling, T, device.late_samples()),
         Basis::Linear, "Colgate and Schenkel 1997, linearised; docs/certificate.md"}};
}

}  // namespace palpate
