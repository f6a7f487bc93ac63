// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>

namespace palpate {

/// A simulated hand: a spring to a point that sweeps between two positions, and a damper to ground,
///
///     F = stiffness (target(t) - x) - damping v,   target(t) = lower + (upper - lower)(1 - cos 2 pi f t)/2.
struct Hand {
    double stiffness = 15.0;    ///< [N/m or N*m/rad]
    double damping = 0.05;      ///< [N*s/m or N*m*s/rad]
    double lower = 0.02;        ///< least target [m or rad]
    double upper = 0.47;        ///< largest target [m or rad]
    double frequency_hz = 0.5;  ///< sweeps a second [Hz]

    [[nodiscard]] double target(double time) const noexcept {
        const double phase = 2.0 * std::numbers::pi * frequency_hz * time;
        return lower + 0.5 * (upper - lower) * (1.0 - std::cos(phase));
    }

    [[nodiscard]] double force(double target, double position, double velocity) const noexcept {
        return stiffness * (target - position) - damping * velocity;
    }
};

}  // namespace palpate
