// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <concepts>
#include <numbers>

#include "palpate/fields/field_table.hpp"

namespace palpate {

/// Position and velocity of a handle.
struct Motion {
    double position = 0.0;  ///< position [m or rad]
    double velocity = 0.0;  ///< velocity [m/s or rad/s]
};

/// Properties of a hand during one tick. The hand's force F on a handle at position x is a constant push, a spring to a
/// target, a damper, and the mass that moves with the handle,
///
///     F = push + stiffness (target - x) - damping v - mass v'.
struct Grip {
    double stiffness = 0.0;  ///< stiffness of the hand's spring [N/m or N*m/rad]
    double damping = 0.0;    ///< damping between handle and ground [N*s/m or N*m*s/rad]
    double target = 0.0;     ///< position to which the hand's spring pulls the handle [m or rad]
    double push = 0.0;       ///< constant force of the hand on the handle [N or N*m]
    double mass = 0.0;       ///< mass of the hand [kg or kg*m^2]

    /// Returns the force of spring, damper and push on the handle. The integrator adds the hand's mass to the inertia.
    [[nodiscard]] double force(const Motion& handle) const noexcept {
        return push + stiffness * (target - handle.position) - damping * handle.velocity;
    }
};

/// A class that simulates a hand; the simulation calls `grip` once a tick for the hand's properties at that time.
template <class H>
concept SimulatedHand = requires(H& hand, double time, const Motion& handle) {
    { hand.grip(time, handle) } noexcept -> std::same_as<Grip>;
};

/// A simulated hand that moves the handle back and forth: a damper to ground, and a spring to a target that moves
/// between two positions with the frequency f,
///
///     target(t) = lower + (upper - lower)(1 - cos 2 pi f t)/2.
struct Hand {
    double stiffness = 15.0;
    double damping = 0.05;
    double lower = 0.02;
    double upper = 0.47;
    double frequency_hz = 0.5;

    /// Returns the position to which the hand's spring pulls the handle at a time [m or rad].
    [[nodiscard]] double target(double time) const noexcept {
        const double phase = 2.0 * std::numbers::pi * frequency_hz * time;
        return lower + 0.5 * (upper - lower) * (1.0 - std::cos(phase));
    }

    /// Returns the properties of the hand at a time.
    [[nodiscard]] Grip grip(double time, const Motion& /*handle*/) const noexcept {
        return {stiffness, damping, target(time), 0.0, 0.0};
    }
};

static_assert(SimulatedHand<Hand>);

template <>
inline constexpr auto fields_of<Hand> =
    FieldTable{Field<&Hand::stiffness>{"stiffness",
                                       "Stiffness of the spring between target and handle [N/m or N*m/rad]."},
               Field<&Hand::damping>{"damping", "Damping between handle and ground [N*s/m or N*m*s/rad]."},
               Field<&Hand::lower>{"lower", "Smallest position of the spring's target [m or rad]."},
               Field<&Hand::upper>{"upper", "Largest position of the spring's target [m or rad]."},
               Field<&Hand::frequency_hz>{
                   "frequency_hz", "Frequency of the target's motion from lower to upper and back [Hz]."}};

}  // namespace palpate
