// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

#include "palpate/failure/coupled_maps.hpp"
#include "palpate/failure/failure_map.hpp"
#include "palpate/failure/held_maps.hpp"
#include "palpate/failure/objects.hpp"
#include "palpate/failure/trials.hpp"
#include "palpate/rendering/explicit.hpp"

namespace palpate {

/// What each structure bears over the sample time, at the default knob's damping.
[[nodiscard]] inline FailureMap period_map(int points) {
    constexpr Inertia inertia{0.001, 0.1};
    constexpr std::size_t ticks = 40'000;
    FailureMap map{"period", "sample time T [s]", "stiffness [N*m/rad]", {}};
    const std::vector<double> periods = logarithmic(2e-4, 5e-3, points);
    const auto device = [](double period, int delay) {
        DeviceProfile knob = smooth_knob();
        knob.period_s = period;
        knob.delay_s = delay * knob.period_s;
        return knob;
    };
    for (int delay = 0; delay <= 2; ++delay) {
        map.lines.push_back(failure_line(
            "direct, delay " + std::to_string(delay), periods,
            [&](double period) { return direct_limit(device(period, delay)); },
            [&](double period, double stiffness) {
                return spring_swings_up(device(period, delay), stiffness);
            }));
    }
    map.lines.push_back(failure_line(
        "coupling, delay 0", periods, [&](double period) { return coupling_limit(device(period, 0)); },
        [&](double period, double stiffness) {
            return detail::coupling_loses_balance({stiffness, coupling_time * stiffness}, device(period, 0));
        },
        3.0));
    map.lines.push_back(failure_line(
        "explicit, driven by a force", periods,
        [&](double period) {
            return (4.0 * inertia.mass - 2.0 * inertia.damping * period) / (period * period);
        },
        [&](double period, double stiffness) {
            return oscillates_force_driven(Explicit{LinearObject{stiffness}, inertia, {}, period}, ticks);
        },
        3.0));
    return map;
}

}  // namespace palpate
