// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

namespace emulator {

/// Mechanics of the emulated device: a handle with a motor, a hand that moves it, and optionally a real spring on the
/// same shaft.
///
///     J dv/dt = torque - b v - k x + K_h (target(t) - x) - B_h v - f_c sgn v
///
/// Positive torques accelerate towards growing positions, as on the wire.
struct Plant {
    double inertia = 2e-4;         ///< moment of inertia J of handle and motor [kg*m^2]
    double damping = 0.06;         ///< damping b of the handle [N*m*s/rad]
    double friction = 0.0;         ///< Coulomb friction f_c of the handle [N*m]
    double spring = 0.0;           ///< stiffness k of the real object; 0: no object [N*m/rad]
    double hand_stiffness = 15.0;  ///< stiffness K_h of the hand; 0: no hand [N*m/rad]
    double hand_damping = 0.05;    ///< damping B_h of the hand [N*m*s/rad]
    double hand_lower = 0.02;      ///< smallest target position of the hand [rad]
    double hand_upper = 0.47;      ///< largest target position of the hand [rad]
    double hand_hz = 0.5;          ///< strokes of the hand back and forth in a second

    double position = 0.0;  ///< [rad]
    double velocity = 0.0;  ///< [rad/s]
    double time = 0.0;      ///< [s]

    /// Moves the handle for the time `seconds` under a constant motor torque [N*m].
    void advance(double torque, double seconds) {
        constexpr double longest_step = 50e-6;
        const long substeps = std::max(1L, std::lround(seconds / longest_step));
        const double step = seconds / static_cast<double>(substeps);
        for (long k = 0; k < substeps; ++k) {
            const double phase = 2.0 * std::numbers::pi * hand_hz * time;
            const double target = hand_lower + 0.5 * (hand_upper - hand_lower) * (1.0 - std::cos(phase));
            const double hand =
                hand_stiffness > 0.0 ? hand_stiffness * (target - position) - hand_damping * velocity : 0.0;
            velocity += step / inertia * (torque + object_torque() + hand - damping * velocity);
            // Coulomb friction reduces the speed of the handle to zero but does not reverse the motion.
            velocity = std::copysign(std::max(0.0, std::abs(velocity) - step / inertia * friction), velocity);
            position += step * velocity;
            time += step;
        }
    }

    /// Returns the torque of the real object on the handle [N*m].
    [[nodiscard]] double object_torque() const { return -spring * position; }
};

}  // namespace emulator
