// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "failure_map.hpp"
#include "hands.hpp"
#include "palpate/device/device_profile.hpp"
#include "palpate/fields/readable.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/model/memory.hpp"
#include "palpate/rendering/direct.hpp"
#include "palpate/stability/direct_inequalities.hpp"
#include "palpate/stability/held_force.hpp"
#include "palpate/stability/predicted_force.hpp"
#include "trials.hpp"

namespace palpate::bench {

/// Returns the device of the failure maps: the default knob without encoder steps and without force steps.
[[nodiscard]] inline DeviceProfile smooth_knob() {
    DeviceProfile device;
    device.encoder_step = 0.0;
    return device;
}

/// Returns true if a directly rendered spring oscillates with growing amplitude against a heavy hand. The phase
/// advances by 0.03 rad during the mean delay of the force, (1/2 + n_d) T. The spring fails at a stiffness just above
/// the theoretical bound.
[[nodiscard]] inline bool spring_oscillates(const DeviceProfile& device, double stiffness) {
    constexpr double late_phase = 0.03;  // oscillation phase during the mean force delay [rad]
    constexpr double radians = 1000.0;   // duration of the simulation as oscillation phase [rad]
    const double late = (0.5 + device.delay_s / device.period_s) * device.period_s;
    const double inertia = stiffness * late * late / (late_phase * late_phase);
    const PassiveHand heavy{0.0, 0.0, std::max(0.0, inertia - device.inertia), 0.0};
    const auto ticks = static_cast<std::size_t>(radians / late_phase * late / device.period_s);
    return oscillates_with(Direct{LinearObject{stiffness}}, device, heavy, stiffness, ticks);
}

/// Stiffness of the stiffest spring that is certified for a device without encoder steps. The required damping is
/// proportional to the stiffness.
[[nodiscard]] inline double direct_limit(const DeviceProfile& device) {
    return device.viscous_damping / (device.longest_period_s() * device_need(device, {1.0, 0.0}));
}

/// Measures a stiffness limit over the damping of the device, one line for each delay. `limit(device)` is the
/// theoretical limit; the boundary of `fails(device, stiffness)` is searched up to `reach` times this limit.
template <class Limit, class Fails>
[[nodiscard]] std::vector<FailureLine> lines_over_damping(int points, double reach, Limit limit,
                                                          Fails fails) {
    std::vector<FailureLine> lines;
    for (int delay = 0; delay <= 2; ++delay) {
        const auto device = [&](double damping) {
            DeviceProfile knob = smooth_knob();
            knob.viscous_damping = damping;
            knob.delay_s = delay * knob.period_s;
            return knob;
        };
        lines.push_back(failure_line(
            "delay " + std::to_string(delay), logarithmic(0.005, 0.5, points),
            [&](double damping) { return limit(device(damping)); },
            [&](double damping, double stiffness) { return fails(device(damping), stiffness); }, reach));
    }
    return lines;
}

/// Failure map: largest stiffness of a directly rendered spring as a function of the device damping.
[[nodiscard]] inline FailureMap damping_map(int points) {
    return {"damping", "device damping b [N*m*s/rad]", "stiffness K [N*m/rad]",
            lines_over_damping(points, 10.0, direct_limit, spring_oscillates)};
}

/// Returns amplitudes of a motion over the border between two encoder counts, so that friction, damping or the encoder
/// dominates. Most amplitudes are far below one encoder step.
[[nodiscard]] inline std::vector<double> motions_over_an_edge(const DeviceProfile& device) {
    const double balance = device.coulomb_friction * device.period_s / device.viscous_damping;
    const double step = device.encoder_step;
    return logarithmic(std::min(1e-3 * balance, 1e-2 * step), std::max(1e3 * balance, 1e3 * step), 24);
}

/// Failure map: largest stiffness K of a spring as a function of the encoder step Delta. Theory with device damping b,
/// period T and Coulomb friction f_c: K <= min(2b/T, 2 f_c/Delta): Abbott and Okamura 2005.
[[nodiscard]] inline FailureMap encoder_map(int points) {
    FailureMap map{"encoder", "encoder step [rad]", "stiffness K [N*m/rad]", {}};
    for (const double friction : {0.002, 0.02}) {
        const auto device = [&](double step) {
            DeviceProfile knob = smooth_knob();
            knob.encoder_step = step;
            knob.coulomb_friction = friction;
            return knob;
        };
        const auto fails = [&, any = AnyCase{}](double step, double stiffness) mutable {
            const DeviceProfile knob = device(step);
            const std::vector<double> motions = motions_over_an_edge(knob);
            return any(motions.size(), [&](std::size_t k) {
                return work_of_pacing(Direct{LinearObject{stiffness}}, knob,
                                      {motions[k], 1, 1e6, knob.period_s}, 0.5 * step - 0.5 * motions[k], 100)
                    .negative();
            });
        };
        map.lines.push_back(failure_line(
            "friction " + readable(friction) + " N*m", logarithmic(2e-6, 2e-2, points),
            [&](double step) { return std::min(direct_limit(device(step)), 2.0 * friction / step); }, fails));
    }
    return map;
}

/// Map: hysteresis h of a spring over the play radius r. While the play operator does not move, the slope is g' + h/r,
/// and the required damping is b >= T (g' + h/r) (1/2 + n_d). Without the term h/r the theory would not limit the
/// hysteresis.
[[nodiscard]] inline FailureMap play_map(int points) {
    constexpr double spring = 10.0;  // slope g' of the mean force [N*m/rad]
    FailureMap map{"play", "play radius r [rad]", "hysteresis h [N*m]", {}};
    for (int delay = 0; delay <= 2; ++delay) {
        DeviceProfile device = smooth_knob();
        device.delay_s = delay * device.period_s;
        map.lines.push_back(failure_line(
            "delay " + std::to_string(delay), logarithmic(1e-4, 1e-2, points),
            [&](double radius) { return radius * (direct_limit(device) - spring); },
            [&, any = AnyCase{}](double radius, double hysteresis) mutable {
                const ConstantHysteresis object{{spring, 0.0}, {0.0, hysteresis}, radius};
                return generates_energy([&] { return Direct{object}; }, device, 0.5 * radius, any);
            }));
    }
    return map;
}

/// Returns an object of no force at rest, with one branch of this stiffness and time constant.
[[nodiscard]] inline ForceModel relaxing_branch(double stiffness, double time_constant_s) {
    MemoryParameters memory;
    memory.stiffness = {stiffness};
    memory.time_constant_s = {time_constant_s};
    const Domain domain{{-1.0}, {1.0}, {}, {}, std::nullopt};
    return ForceModel{{1, {}, {}, {}, {0.0}, 0.0}, domain}.with_memory(memory);
}

/// Stiffness of the stiffest branch that is certified for a device without encoder steps. The required damping is
/// proportional to the stiffness.
[[nodiscard]] inline double memory_limit(const DeviceProfile& device, double time_constant_s) {
    const ForceBounds bounds = force_bounds(relaxing_branch(1.0, time_constant_s));
    return device.viscous_damping / memory_inequalities(bounds, device).front().right;
}

/// Failure map: largest stiffness of a branch as a function of its time constant.
[[nodiscard]] inline FailureMap memory_map(int points) {
    FailureMap map{"memory", "time constant [s]", "stiffness K [N*m/rad]", {}};
    for (int delay = 0; delay <= 2; ++delay) {
        DeviceProfile device = smooth_knob();
        device.delay_s = delay * device.period_s;
        map.lines.push_back(failure_line(
            "delay " + std::to_string(delay), logarithmic(1e-3, 1.0, points),
            [&](double time_constant_s) { return memory_limit(device, time_constant_s); },
            [&, any = AnyCase{}](double time_constant_s, double stiffness) mutable {
                const ForceModel model = relaxing_branch(stiffness, time_constant_s);
                const MemoryForce<NetworkCurve> object{model.network()->curve(), model.memory()->ratio(),
                                                       *model.memory(), device.period_s};
                return generates_energy([&] { return Direct{object}; }, device, 0.01, any);
            }));
    }
    return map;
}

/// Stiffness of the stiffest spring that is certified with prediction, for a device without encoder steps.
[[nodiscard]] inline double predicted_limit(const DeviceProfile& device, int predict) {
    return device.viscous_damping / (device.longest_period_s() * predicted_need(device, predict, {1.0, 0.0}));
}

/// Returns true if a firm hand takes energy out in the steady state at one of 60 frequencies up to the Nyquist
/// frequency.
[[nodiscard]] inline bool predicted_spring_generates(const DeviceProfile& device, int predict,
                                                     double stiffness, AnyCase& any) {
    constexpr int frequencies = 60;
    return any(frequencies, [&](std::size_t k) {
        const PacingHand hand{.reach = 0.1,
                              .ticks = frequencies,
                              .grip_damping = 1e6 * device.viscous_damping,
                              .period_s = device.period_s,
                              .turns = static_cast<int>(k) + 1};
        return work_of_pacing(PredictedDirect{LinearObject{stiffness}, predict}, device, hand, 0.0, 0)
            .negative();
    });
}

/// Failure map: largest stiffness of a spring as a function of the number of past samples of the prediction.
[[nodiscard]] inline FailureMap prediction_map(int points) {
    FailureMap map{"prediction", "samples m of the prediction", "stiffness K [N*m/rad]", {}};
    std::vector<double> taps;
    for (const double value : logarithmic(1.0, most_prediction_taps, points)) {
        if (const double m = std::round(value); taps.empty() || m > taps.back()) {
            taps.push_back(m);
        }
    }
    for (int delay = 0; delay <= 2; ++delay) {
        DeviceProfile device = smooth_knob();
        device.delay_s = delay * device.period_s;
        map.lines.push_back(failure_line(
            "delay " + std::to_string(delay), taps,
            [&](double m) { return predicted_limit(device, static_cast<int>(m)); },
            [&, any = AnyCase{}](double m, double stiffness) mutable {
                return predicted_spring_generates(device, static_cast<int>(m), stiffness, any);
            }));
    }
    return map;
}

/// Map: stiffness of a spring without growing oscillation over the mass of a passive hand. The theory is the bound for
/// every hand, so the map shows the margin for a hand of this mass.
[[nodiscard]] inline FailureMap hand_map(int points) {
    FailureMap map{"hand", "mass of the hand [kg*m^2]", "stiffness K [N*m/rad]", {}};
    map.searched = 40.0;
    const auto add = [&](const std::string& name, int delay, double damping, int predict = 0) {
        DeviceProfile device = smooth_knob();
        device.delay_s = delay * device.period_s;
        const double bound = predict > 0 ? predicted_limit(device, predict) : direct_limit(device);
        map.lines.push_back(failure_line(
            name, logarithmic(1e-5, 1e-1, points), [&](double /*mass*/) { return bound; },
            [&](double mass, double stiffness) {
                constexpr double radians = 1000.0;  // duration of the simulation as oscillation phase [rad]
                const double slowness = std::sqrt((mass + device.inertia) / stiffness);
                const auto ticks = static_cast<std::size_t>(radians * slowness / device.period_s);
                const PassiveHand hand{0.0, damping, mass, 0.0};
                return predict > 0
                           ? oscillates_with(PredictedDirect{LinearObject{stiffness}, predict}, device, hand,
                                             stiffness, ticks)
                           : oscillates_with(Direct{LinearObject{stiffness}}, device, hand, stiffness, ticks);
            },
            map.searched));
    };
    for (int delay = 0; delay <= 2; ++delay) {
        add("delay " + std::to_string(delay), delay, 0.0);
    }
    add("delay 0, damping hand", 0, smooth_knob().viscous_damping);
    add("delay 0, predict 4", 0, 0.0, 4);
    return map;
}

}  // namespace palpate::bench
