// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "palpate/device/device_profile.hpp"
#include "palpate/failure/failure_map.hpp"
#include "palpate/failure/objects.hpp"
#include "palpate/failure/trials.hpp"
#include "palpate/fields/readable.hpp"
#include "palpate/rendering/direct.hpp"
#include "palpate/stability/held_force.hpp"

namespace palpate {

/// The device of the maps: the default knob without encoder or force steps.
[[nodiscard]] inline DeviceProfile smooth_knob() {
    DeviceProfile device;
    device.encoder_step = 0.0;
    return device;
}

/// The hand that fails just past the bound of a directly rendered spring: so heavy that the swing takes 0.03 rad
/// in the time that a force comes late on the average, (1/2 + n_d) T.
[[nodiscard]] inline bool spring_swings_up(const DeviceProfile& device, double stiffness) {
    constexpr double late_phase = 0.03;  // [rad]
    constexpr double radians = 1000.0;   // of the swing that are watched
    const double late = (0.5 + device.delay_s / device.period_s) * device.period_s;
    const double inertia = stiffness * late * late / (late_phase * late_phase);
    const PassiveHand heavy{0.0, 0.0, std::max(0.0, inertia - device.inertia), 0.0};
    const auto ticks = static_cast<std::size_t>(radians / late_phase * late / device.period_s);
    return oscillates_with(Direct{LinearObject{stiffness}}, device, heavy, stiffness, ticks);
}

/// The stiffest spring that is certified for a device without steps: its need is in proportion to its slope.
[[nodiscard]] inline double direct_limit(const DeviceProfile& device) {
    return device.viscous_damping / (device.longest_period_s() * device_need(device, {1.0, 0.0}));
}

/// A limit over the damping of the device, a line for each delay: `limit(device)` says theory, and it is searched
/// up to `reach` times that for where `fails(device, stiffness)`.
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

/// The stiffest spring that a device can render directly, over its damping.
[[nodiscard]] inline FailureMap damping_map(int points) {
    return {"damping", "device damping b [N*m*s/rad]", "stiffness K [N*m/rad]",
            lines_over_damping(points, 10.0, direct_limit, spring_swings_up)};
}

/// Ways over an edge between two encoder counts, most of them far below a count: where friction, damping or the
/// encoder is what counts.
[[nodiscard]] inline std::vector<double> ways_over_an_edge(const DeviceProfile& device) {
    const double balance = device.coulomb_friction * device.period_s / device.viscous_damping;
    const double step = device.encoder_step;
    return logarithmic(std::min(1e-3 * balance, 1e-2 * step), std::max(1e3 * balance, 1e3 * step), 24);
}

/// The stiffest spring over the encoder's step, K <= min(2b/T, 2 f_c/Delta): Abbott and Okamura 2005.
[[nodiscard]] inline FailureMap encoder_map(int points) {
    FailureMap map{"encoder", "encoder step [rad]", "stiffness K [N*m/rad]", {}};
    for (const double friction : {0.002, 0.02}) {
        const auto device = [&](double step) {
            DeviceProfile knob = smooth_knob();
            knob.encoder_step = step;
            knob.coulomb_friction = friction;
            return knob;
        };
        const auto fails = [&](double step, double stiffness) {
            const DeviceProfile knob = device(step);
            for (const double reach : ways_over_an_edge(knob)) {
                const PacedWork work =
                    work_of_pacing(Direct{LinearObject{stiffness}}, knob, {reach, 1, 1e6, knob.period_s},
                                   0.5 * step - 0.5 * reach, 100);
                if (work.negative()) {
                    return true;
                }
            }
            return false;
        };
        map.lines.push_back(failure_line(
            "friction " + readable(friction) + " N*m", logarithmic(2e-6, 2e-2, points),
            [&](double step) { return std::min(direct_limit(device(step)), 2.0 * friction / step); }, fails));
    }
    return map;
}

/// The largest loss h that a device can render of a spring with hysteresis, over the play radius: while it sticks
/// the slope is g' + h/r, and b >= T (g' + h/r) (1/2 + n_d). Without that term there would be no limit.
[[nodiscard]] inline FailureMap play_map(int points) {
    constexpr double spring = 10.0;  // g' [N*m/rad]
    FailureMap map{"play", "play radius r [rad]", "loss h [N*m]", {}};
    for (int delay = 0; delay <= 2; ++delay) {
        DeviceProfile device = smooth_knob();
        device.delay_s = delay * device.period_s;
        map.lines.push_back(failure_line(
            "delay " + std::to_string(delay), logarithmic(1e-4, 1e-2, points),
            [&](double radius) { return radius * (direct_limit(device) - spring); },
            [&](double radius, double loss) {
                const EvenHysteresis object{{spring, 0.0}, {0.0, loss}, radius};
                return loses_balance([&] { return Direct{object}; }, device, 0.5 * radius);
            }));
    }
    return map;
}

}  // namespace palpate
