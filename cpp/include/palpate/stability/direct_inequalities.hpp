// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "palpate/device/device_profile.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/stability/force_bounds.hpp"
#include "palpate/stability/held_force.hpp"
#include "palpate/stability/inequality.hpp"
#include "palpate/stability/predicted_force.hpp"

namespace palpate {

namespace detail {

/// Returns the line for friction, which must exceed the errors of the force: `gain` times half an encoder step, half a
/// force step, and the mean force of a periodic model.
[[nodiscard]] inline Inequality friction_inequality(const DeviceProfile& device, double gain,
                                                    double mean_force, const std::string& formula) {
    // Without encoder steps a steep force needs no friction.
    const double encoder = device.encoder_step > 0.0 ? 0.5 * gain * device.encoder_step : 0.0;
    return {"friction-steps",
            "Coulomb friction against encoder and force steps",
            "f_c >= " + formula + " + Delta_F / 2" + (mean_force > 0.0 ? " + |mean c(f)|" : ""),
            device.coulomb_friction,
            encoder + 0.5 * device.force_step + mean_force,
            Basis::Proved,
            "Abbott and Okamura 2005; Diolaiti et al. 2006; docs/certificate.md"};
}

/// Returns the line h >= 0 for hysteresis.
[[nodiscard]] inline Inequality nonnegative_hysteresis(const ForceBounds& bounds) {
    return {"loss-nonnegative",
            "hysteresis that never generates energy",
            "min h >= 0",
            bounds.hysteresis_force.lower,
            0.0,
            Basis::Proved,
            "docs/certificate.md"};
}

/// Returns the line for damping, which must exceed the effects of hold and delay on a force with these slopes, and B_v
/// of its dependence on velocity.
[[nodiscard]] inline Inequality hold_inequality(const DeviceProfile& device, SlopeRange slopes, double drag,
                                                const std::string& formula) {
    const double T = device.longest_period_s();
    const bool late = device.late_samples() > 0;
    return {"damping-hold", "viscous damping against hold and delay", formula, device.viscous_damping,
            // Velocities are differences over the nominal period.
            T * device_need(device, slopes) + T / device.period_s * drag, Basis::Proved,
            late ? "docs/certificate.md" : "Colgate and Schenkel 1997; docs/certificate.md"};
}

/// Returns the line for damping with prediction.
[[nodiscard]] inline Inequality prediction_inequality(const DeviceProfile& device, double need,
                                                      const std::string& formula) {
    return {"damping-hold",
            "viscous damping against hold, delay and prediction",
            formula,
            device.viscous_damping,
            device.longest_period_s() * need,
            Basis::Proved,
            "docs/certificate.md"};
}

}  // namespace detail

/// Returns the lines of a static force that is held for a sample, with any motion within it. M and s_ bound the slopes
/// of f. B is `device_need`; with a prediction from m samples it is `predicted_need`.
[[nodiscard]] inline std::vector<Inequality> direct_inequalities(const ForceBounds& bounds,
                                                                 const DeviceProfile& device,
                                                                 int predict = 0) {
    if (predict > 0) {
        return {detail::prediction_inequality(
                    device, predicted_need(device, predict, {bounds.rising(), bounds.falling()}),
                    device.late_samples() > 0 ? "b >= T B(M, s_, m, t_d)" : "b >= T B(M, s_, m)"),
                detail::friction_inequality(device, predicted_encoder_gain(predict) * bounds.steepest,
                                            bounds.mean_force, "(m + 3) / (m + 1) L Delta / 2")};
    }
    return {detail::hold_inequality(device, {bounds.rising(), bounds.falling()}, 0.0,
                                    device.late_samples() > 0 ? "b >= T B(M, s_, t_d)" : "b >= T M / 2"),
            detail::friction_inequality(device, bounds.steepest, bounds.mean_force, "L Delta / 2")};
}

/// Returns the lines of a force with hysteresis, f = g + s h with a play of radius r, rendered directly. While it
/// sticks, h / r adds to its slope. The encoder has errors in x and in the play. Without delay the play of the reading
/// is treated as exact, for a slightly larger slope. With a prediction the play follows the measured position.
[[nodiscard]] inline std::vector<Inequality> hysteresis_inequalities(const ForceBounds& bounds,
                                                                     const DeviceProfile& device,
                                                                     int predict = 0) {
    const Inequality nonnegative = detail::nonnegative_hysteresis(bounds);
    const bool late = device.late_samples() > 0;
    if (predict > 0) {
        const double gain = predicted_encoder_gain(predict);
        return {
            nonnegative,
            detail::prediction_inequality(
                device, predicted_path_need(device, {bounds.rising(), bounds.falling()}),
                late ? "b >= T (B(M_h, s_h, t_d) + L_h / 2)" : "b >= T (M_h + L_h) / 2"),
            detail::friction_inequality(
                device, gain * bounds.sliding + (gain + 1.0) * bounds.hysteresis_per_play, bounds.mean_force,
                "((m + 3) max(|g'| + |h'|) + (2 m + 4) max h / r) / (m + 1) Delta / 2")};
    }
    const auto hold = [&](double more, const std::string& added) {
        return detail::hold_inequality(device, {bounds.rising() + more, bounds.falling() + more}, 0.0,
                                       late ? "b >= T B(M_h, s_h, t_d)" : "b >= T (M_h" + added + ") / 2");
    };
    const Inequality both =
        detail::friction_inequality(device, bounds.sliding + 2.0 * bounds.hysteresis_per_play,
                                    bounds.mean_force, "(max(|g'| + |h'|) + 2 max h / r) Delta / 2");
    if (both.holds() || late || !(2.0 * bounds.play_radius() >= device.encoder_step)) {
        return {nonnegative, hold(0.0, ""), both};
    }
    const double more = 0.5 * bounds.sliding * device.encoder_step / bounds.play_radius();
    return {nonnegative, hold(more, " + e"),
            detail::friction_inequality(device, bounds.sliding + more + bounds.hysteresis_per_play,
                                        bounds.mean_force, "(max(|g'| + |h'|) + e + max h / r) Delta / 2")};
}

/// Returns the lines of a force f(x, v) of position and velocity that is rendered directly, with the velocity as a
/// backward difference or a mean of several. M and s_ are of f(., 0); L_x = max |df/dx| is over all v.
[[nodiscard]] inline std::vector<Inequality> velocity_inequalities(const ForceBounds& bounds,
                                                                   const DeviceProfile& device) {
    return {detail::hold_inequality(
                device, {bounds.rising(), bounds.falling()}, bounds.drag,
                std::string(device.late_samples() > 0 ? "b >= T B(M, s_, t_d)" : "b >= T M / 2") +
                    " + B_v T / period"),
            detail::friction_inequality(device, bounds.sliding + 2.0 * bounds.drag / device.period_s, 0.0,
                                        "L_x Delta / 2 + B_v Delta / T")};
}

[[nodiscard]] inline std::vector<Inequality> inequalities(DirectStructure, const ForceBounds& bounds,
                                                          const Scheme& scheme, const DeviceProfile& device) {
    if (bounds.drag > 0.0) {
        std::vector<Inequality> lines = velocity_inequalities(bounds, device);
        if (scheme.predict > 0) {
            lines.push_back({"velocity-prediction", "prediction of a force of velocity", "B_v = 0", 0.0,
                             bounds.drag, Basis::None, "docs/certificate.md"});
        }
        return lines;
    }
    return bounds.hysteresis ? hysteresis_inequalities(bounds, device, scheme.predict)
                             : direct_inequalities(bounds, device, scheme.predict);
}

}  // namespace palpate
