// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
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

/// Returns the inequality for Coulomb friction, which must be at least the sum of four force errors: `gain` times half an
/// encoder step, half a force step, and of `bounds` the mean force of a periodic model and the error of the program that
/// renders the force.
[[nodiscard]] inline Inequality friction_inequality(const DeviceProfile& device, double gain,
                                                    const ForceBounds& bounds, const std::string& formula) {
    // A device without encoder steps needs no friction against encoder steps, even if `gain` is infinite.
    const double encoder = device.encoder_step > 0.0 ? 0.5 * gain * device.encoder_step : 0.0;
    return {"friction-steps",
            "Coulomb friction against encoder and force steps",
            "f_c >= " + formula + " + Delta_F / 2" + (bounds.mean_force > 0.0 ? " + |mean c(f)|" : "") +
                (bounds.force_error > 0.0 ? " + epsilon" : ""),
            device.coulomb_friction,
            encoder + 0.5 * device.force_step + bounds.mean_force + bounds.force_error,
            Basis::Proved,
            "Abbott and Okamura 2005; Diolaiti et al. 2006; docs/certificate.md"};
}

/// Returns the inequality min h >= 0: hysteresis that is never negative does not generate energy.
[[nodiscard]] inline Inequality nonnegative_hysteresis(const ForceBounds& bounds) {
    return {"loss-nonnegative",
            "hysteresis that never generates energy",
            "min h >= 0",
            bounds.hysteresis_force.lower,
            0.0,
            Basis::Proved,
            "docs/certificate.md"};
}

/// Returns the inequality for the device damping that a directly rendered force needs, because the force is held for a
/// sample and delayed. `slopes` are bounds of its slope by position; `drag` is B_v, the bound of its slope by velocity
/// [N*s/m].
[[nodiscard]] inline Inequality hold_inequality(const DeviceProfile& device, SlopeRange slopes, double drag,
                                                const std::string& formula) {
    const double T = device.longest_period_s();
    const bool late = device.late_samples() > 0;
    return {
        "damping-hold", "viscous damping against hold and delay", formula, device.viscous_damping,
        // The rendering computes the velocity with the nominal period; with jitter, the true time between two samples
        // can be longer than this period.
        T * device_need(device, slopes) + T / device.period_s * drag, Basis::Proved,
        late ? "docs/certificate.md" : "Colgate and Schenkel 1997; docs/certificate.md"};
}

/// Returns the inequality for the device damping of direct rendering with prediction; `need` is the damping divided by
/// the longest period [N/m].
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

/// Returns the inequalities of direct rendering of a force without hysteresis that is held for a sample, for any motion
/// of the handle during the sample. M and s_ are bounds of the rising and the falling slope of the force. B is computed
/// by `device_need`, or with a prediction from m samples by `predicted_need`.
[[nodiscard]] inline std::vector<Inequality> direct_inequalities(const ForceBounds& bounds,
                                                                 const DeviceProfile& device,
                                                                 int predict = 0) {
    if (predict > 0) {
        return {detail::prediction_inequality(
                    device, predicted_need(device, predict, {bounds.rising(), bounds.falling()}),
                    device.late_samples() > 0 ? "b >= T B(M, s_, m, t_d)" : "b >= T B(M, s_, m)"),
                detail::friction_inequality(device, predicted_encoder_gain(predict) * bounds.steepest, bounds,
                                            "(m + 3) / (m + 1) L Delta / 2")};
    }
    return {detail::hold_inequality(device, {bounds.rising(), bounds.falling()}, 0.0,
                                    device.late_samples() > 0 ? "b >= T B(M, s_, t_d)" : "b >= T M / 2"),
            detail::friction_inequality(device, bounds.steepest, bounds, "L Delta / 2")};
}

/// Returns the inequalities of direct rendering of a force with hysteresis, f = g + s h with the play radius r. While
/// the play operator sticks, h / r adds to the slope of the force. The encoder causes errors of the position x and of
/// the play operator. Without delay and with r >= Delta / 2, the play operator of the measured position may be treated
/// as exact if the slope is increased slightly. With a prediction, the play operator follows the measured position.
[[nodiscard]] inline std::vector<Inequality> hysteresis_inequalities(const ForceBounds& bounds,
                                                                     const DeviceProfile& device,
                                                                     int predict = 0) {
    const Inequality nonnegative = detail::nonnegative_hysteresis(bounds);
    const bool late = device.late_samples() > 0;
    if (predict > 0) {
        const double gain = predicted_encoder_gain(predict);
        return {nonnegative,
                detail::prediction_inequality(
                    device, predicted_path_need(device, {bounds.rising(), bounds.falling()}),
                    late ? "b >= T (B(M_h, s_h, t_d) + L_h / 2)" : "b >= T (M_h + L_h) / 2"),
                detail::friction_inequality(
                    device, gain * bounds.sliding + (gain + 1.0) * bounds.hysteresis_per_play, bounds,
                    "((m + 3) max(|g'| + |h'|) + (2 m + 4) max h / r) / (m + 1) Delta / 2")};
    }
    const auto hold = [&](double more, const std::string& added) {
        return detail::hold_inequality(device, {bounds.rising() + more, bounds.falling() + more}, 0.0,
                                       late ? "b >= T B(M_h, s_h, t_d)" : "b >= T (M_h" + added + ") / 2");
    };
    const Inequality both =
        detail::friction_inequality(device, bounds.sliding + 2.0 * bounds.hysteresis_per_play, bounds,
                                    "(max(|g'| + |h'|) + 2 max h / r) Delta / 2");
    if (both.holds() || late || !(2.0 * bounds.play_radius() >= device.encoder_step)) {
        return {nonnegative, hold(0.0, ""), both};
    }
    const double more = 0.5 * bounds.sliding * device.encoder_step / bounds.play_radius();
    return {nonnegative, hold(more, " + e"),
            detail::friction_inequality(device, bounds.sliding + more + bounds.hysteresis_per_play, bounds,
                                        "(max(|g'| + |h'|) + e + max h / r) Delta / 2")};
}

/// Returns the inequalities of direct rendering of a force f(x, v) of position x and velocity v. The velocity is a
/// backward difference of positions or a mean of several differences. M and s_ are bounds of the rising and the falling
/// slope at velocity zero; L_x = max |df/dx| over all velocities.
[[nodiscard]] inline std::vector<Inequality> velocity_inequalities(const ForceBounds& bounds,
                                                                   const DeviceProfile& device) {
    return {detail::hold_inequality(
                device, {bounds.rising(), bounds.falling()}, bounds.drag,
                std::string(device.late_samples() > 0 ? "b >= T B(M, s_, t_d)" : "b >= T M / 2") +
                    " + B_v T / period"),
            detail::friction_inequality(device, bounds.sliding + 2.0 * bounds.drag / device.period_s, bounds,
                                        "L_x Delta / 2 + B_v Delta / T")};
}

/// Returns the largest number of samples that the device takes while a command is on its way. With jitter the samples
/// can be closer than the period.
[[nodiscard]] inline double most_samples_in_delay(const DeviceProfile& device) noexcept {
    const int late = device.late_samples();
    if (late == 0 || device.jitter_s == 0.0) {
        return late;
    }
    return std::floor((device.delay_s + device.jitter_s) / device.period_s + 1e-9) + 1.0;
}

/// Returns the inequalities of direct rendering of a force with memory. M_g and L_g are the bounds M and L of the force
/// at rest. The encoder step Delta increases the largest stretch U of a branch by P Delta. With n samples of delay, the
/// force of the branches also changes by their relaxation.
[[nodiscard]] inline std::vector<Inequality> memory_inequalities(const ForceBounds& bounds,
                                                                 const DeviceProfile& device) {
    const MemoryBounds& memory = *bounds.memory;
    const double bending = memory.bending + device.encoder_step * memory.bending_per_m;
    const double rising = bounds.rising() + memory.stiffness + bending;
    const double steepest = bounds.steepest + memory.stiffness + bending;
    const double n = most_samples_in_delay(device);
    const double relaxation = device.longest_period_s() * memory.relaxation_per_s;
    const double late = n > 0.0 ? n * steepest + (1.0 + 0.5 * n * n) * relaxation : 0.0;
    const double encoder = steepest + memory.stiffness + 2.0 * n * (steepest + relaxation);
    return {
        {"damping-hold", n > 0.0 ? "viscous damping against hold and delay" : "viscous damping against hold",
         n > 0.0 ? "b >= T (M / 2 + n L + (1 + n^2 / 2) R)" : "b >= T (M_g + K (P^2 + U P')) / 2",
         device.viscous_damping, device.longest_period_s() * (0.5 * rising + late), Basis::Proved,
         "docs/certificate.md"},
        detail::friction_inequality(device, encoder, bounds,
                                    n > 0.0 ? "(L_g + K (2 P^2 + U P') + 2 n (L + R)) Delta / 2"
                                            : "(L_g + K (2 P^2 + U P')) Delta / 2")};
}

/// Returns the inequalities of the direct structure for the kind of the force: of velocity, with memory, with
/// hysteresis, or static.
[[nodiscard]] inline std::vector<Inequality> inequalities(DirectStructure, const ForceBounds& bounds,
                                                          const Scheme& scheme, const DeviceProfile& device) {
    if (bounds.drag > 0.0) {
        std::vector<Inequality> lines = velocity_inequalities(bounds, device);
        if (scheme.predict > 0) {
            lines.push_back({"velocity-prediction", "prediction of a force that depends on velocity",
                             "proved only for B_v = 0", 0.0, bounds.drag, Basis::None,
                             "docs/certificate.md"});
        }
        return lines;
    }
    if (bounds.memory) {
        return memory_inequalities(bounds, device);
    }
    return bounds.hysteresis ? hysteresis_inequalities(bounds, device, scheme.predict)
                             : direct_inequalities(bounds, device, scheme.predict);
}

}  // namespace palpate
