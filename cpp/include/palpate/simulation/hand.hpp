// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <concepts>
#include <numbers>
#include <tuple>

#include "palpate/fields/field_table.hpp"

namespace palpate {

/// Position and velocity.
struct Motion {
    double position = 0.0;  ///< [m or rad]
    double velocity = 0.0;  ///< [m/s or rad/s]
};

/// Force of a hand on a handle during one tick: a push, a spring to a target, a damper to ground, and the mass that
/// moves with the handle,
///
///     F = push + stiffness (target - x) - damping v - mass v'.
struct Grip {
    double stiffness = 0.0;  ///< [N/m or N*m/rad]
    double damping = 0.0;    ///< [N*s/m or N*m*s/rad]
    double target = 0.0;     ///< [m or rad]
    double push = 0.0;       ///< [N or N*m]
    double mass = 0.0;       ///< [kg or kg*m^2]

    /// Returns the force without that of the mass, which is in the handle's equation of motion.
    [[nodiscard]] double force(const Motion& handle) const noexcept {
        return push + stiffness * (target - handle.position) - damping * handle.velocity;
    }
};

/// A simulated hand; the simulation calls `grip` once a tick.
template <class H>
concept SimulatedHand = requires(H& hand, double time, const Motion& handle) {
    { hand.grip(time, handle) } noexcept -> std::same_as<Grip>;
};

/// A sweeping hand: a spring to a target that moves between two positions, and a damper to ground,
///
///     target(t) = lower + (upper - lower)(1 - cos 2 pi f t)/2.
struct Hand {
    double stiffness = 15.0;
    double damping = 0.05;
    double lower = 0.02;
    double upper = 0.47;
    double frequency_hz = 0.5;

    /// Returns the target at a time [m or rad].
    [[nodiscard]] double target(double time) const noexcept {
        const double phase = 2.0 * std::numbers::pi * frequency_hz * time;
        return lower + 0.5 * (upper - lower) * (1.0 - std::cos(phase));
    }

    /// Returns the force of the hand at a time.
    [[nodiscard]] Grip grip(double time, const Motion& /*handle*/) const noexcept {
        return {stiffness, damping, target(time), 0.0, 0.0};
    }
};

static_assert(SimulatedHand<Hand>);

template <>
inline constexpr auto fields_of<Hand> =
    std::tuple{Field<&Hand::stiffness>{"stiffness", "Stiffness of the spring [N/m or N*m/rad]."},
               Field<&Hand::damping>{"damping", "Damping to ground [N*s/m or N*m*s/rad]."},
               Field<&Hand::lower>{"lower", "Smallest target [m or rad]."},
               Field<&Hand::upper>{"upper", "Largest target [m or rad]."},
               Field<&Hand::frequency_hz>{"frequency_hz", "Sweeps a second [Hz]."}};

}  // namespace palpate
