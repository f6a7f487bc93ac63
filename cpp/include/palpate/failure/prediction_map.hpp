// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "palpate/failure/failure_map.hpp"
#include "palpate/failure/held_maps.hpp"
#include "palpate/failure/objects.hpp"
#include "palpate/failure/trials.hpp"
#include "palpate/rendering/predicted.hpp"
#include "palpate/simulation/hand.hpp"
#include "palpate/stability/predicted_force.hpp"

namespace palpate {

/// The stiffest spring that is certified for a device without steps, its force held at a predicted position.
[[nodiscard]] inline double predicted_limit(const DeviceProfile& device, int predict) {
    return device.viscous_damping / (device.longest_period_s() * predicted_need(device, predict, {1.0, 0.0}));
}

/// True if a firm hand gets energy out of a spring, turn after turn, at any of 60 frequencies up to Nyquist's.
[[nodiscard]] inline bool predicted_spring_generates(const DeviceProfile& device, int predict,
                                                     double stiffness) {
    constexpr int frequencies = 60;
    for (int turns = 1; turns <= frequencies; ++turns) {
        const PacingHand hand{.reach = 0.1,
                              .ticks = frequencies,
                              .firmness = 1e6 * device.viscous_damping,
                              .period_s = device.period_s,
                              .turns = turns};
        if (work_of_pacing(PredictedDirect{LinearObject{stiffness}, predict}, device, hand, 0.0, 0)
                .negative()) {
            return true;
        }
    }
    return false;
}

/// The stiffest spring that a device can render at a predicted position, over the number of samples that predict.
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
            [&](double m, double stiffness) {
                return predicted_spring_generates(device, static_cast<int>(m), stiffness);
            }));
    }
    return map;
}

}  // namespace palpate
