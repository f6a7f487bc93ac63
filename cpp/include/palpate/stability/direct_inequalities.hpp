// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "palpate/device/device_profile.hpp"
#include "palpate/stability/force_bounds.hpp"
#include "palpate/stability/inequality.hpp"

namespace palpate {

namespace detail {

/// How large an error of the force the device's friction swallows, and how large it can be: `gain` times half an
/// encoder step, half a force step, and the mean force of a model that repeats.
[[nodiscard]] inline Inequality friction_inequality(const DeviceProfile& device, double gain,
                                                    double mean_force, const std::string& formula) {
    // An encoder that is not quantised asks nothing of any slope, however steep.
    const double encoder = device.encoder_step > 0.0 ? 0.5 * gain * device.encoder_step : 0.0;
    return {"friction-steps",
            "Coulomb friction against encoder and force steps",
            "f_c >= " + formula + " + Delta_F / 2" + (mean_force > 0.0 ? " + |mean f|" : ""),
            device.coulomb_friction,
            encoder + 0.5 * device.force_step + mean_force,
            Basis::Proved,
            "Abbott and Okamura 2005; Diolaiti et al. 2006; docs/certificate.md"};
}

}  // namespace detail

/// A static force held for a sample, any motion within it: b >= T M / 2 + n_d T L, where M and L are of f'.
[[nodiscard]] inline std::vector<Inequality> direct_inequalities(const ForceBounds& bounds,
                                                                 const DeviceProfile& device) {
    const double T = device.longest_period_s();
    return {
        {"damping-hold", "viscous damping against hold and delay", "b >= T M / 2 + n_d T L",
         device.viscous_damping, T * (0.5 * bounds.rising() + device.whole_delay_samples() * bounds.steepest),
         Basis::Proved, "Colgate and Schenkel 1997; Diolaiti et al. 2006; docs/certificate.md"},
        detail::friction_inequality(device, bounds.steepest, bounds.mean_force, "L Delta / 2")};
}

/// A force with hysteresis, f = g + s h with a play of radius r, rendered directly: while it sticks h / r adds to
/// its slope, and the play can be wrong by an encoder step too.
[[nodiscard]] inline std::vector<Inequality> hysteresis_inequalities(const ForceBounds& bounds,
                                                                     const DeviceProfile& device) {
    const double T = device.longest_period_s();
    return {
        {"loss-nonnegative", "loss that never generates", "min h >= 0", bounds.loss.lower, 0.0, Basis::Proved,
         "docs/certificate.md"},
        {"damping-hold", "viscous damping against hold and delay", "b >= T M_h / 2 + n_d T L_h",
         device.viscous_damping, T * (0.5 * bounds.rising() + device.whole_delay_samples() * bounds.steepest),
         Basis::Proved, "docs/certificate.md"},
        detail::friction_inequality(device, bounds.sliding + 2.0 * bounds.loss_per_play, bounds.mean_force,
                                    "(max(|g'| + |h'|) + 2 max h / r) Delta / 2")};
}

/// A force f(x, v) of position and velocity rendered directly, the velocity a backward difference or a mean of
/// several: M and L are of f(., 0), L_x = max |df/dx| is over all v.
[[nodiscard]] inline std::vector<Inequality> velocity_inequalities(const ForceBounds& bounds,
                                                                   const DeviceProfile& device) {
    const double T = device.longest_period_s();
    const double late = T / device.period_s;  // differences are taken over the nominal period
    return {
        {"damping-hold", "viscous damping against hold and delay", "b >= T M / 2 + n_d T L + B_v T / period",
         device.viscous_damping,
         T * (0.5 * bounds.rising() + device.whole_delay_samples() * bounds.steepest) + late * bounds.drag,
         Basis::Proved, "docs/certificate.md"},
        detail::friction_inequality(device, bounds.sliding + 2.0 * bounds.drag / device.period_s, 0.0,
                                    "L_x Delta / 2 + B_v Delta / T")};
}

}  // namespace palpate
