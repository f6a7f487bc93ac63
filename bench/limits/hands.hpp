// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>

#include "palpate/simulation/hand.hpp"

// Simulated hands that try to make a rendering oscillate or give energy.

namespace palpate {

/// Passive hand: a mass on the handle, a spring and a damper between handle and a fixed point. All values are zero if
/// there is no hand.
struct PassiveHand {
    double stiffness = 0.0;  ///< stiffness of the hand's spring [N/m or N*m/rad]
    double damping = 0.0;    ///< damping of the hand's damper [N*s/m or N*m*s/rad]
    double mass = 0.0;       ///< mass of the hand on the handle [kg or kg*m^2]
    double rest = 0.0;       ///< fixed position at the other end of the hand's spring [m or rad]

    [[nodiscard]] Grip grip(double /*time*/, const Motion& /*handle*/) const noexcept {
        return {stiffness, damping, rest, 0.0, mass};
    }
};

/// Hand that oscillates at a share of the Nyquist frequency. At the Nyquist frequency the force of a sampled wall lags
/// by half a cycle.
struct ShakingHand {
    double stiffness = 0.0;  ///< stiffness of the spring between hand and handle [N/m or N*m/rad]
    double centre = 0.0;     ///< mean position of the hand [m or rad]
    double amplitude = 0.0;  ///< amplitude of the hand motion [m or rad]
    double share = 1.0;      ///< hand frequency divided by Nyquist frequency; 1: one cycle in two ticks
    double period_s = 1e-3;  ///< duration of a tick [s]

    [[nodiscard]] Grip grip(double time, const Motion& /*handle*/) const noexcept {
        const double target =
            centre + amplitude * std::cos(std::numbers::pi * share * std::round(time / period_s));
        return {stiffness, 0.0, target, 0.0, 0.0};
    }
};

/// Hand that extracts energy: it moves the handle through the steepest part of the object at constant speed in both
/// directions. In this part the held force lags the object's force most during each tick.
struct GreedyHand {
    /// Force of the hand divided by (desired minus real speed of the handle) [N*s/m or N*m*s/rad].
    double grip_damping = 1.0;
    double centre = 0.0;     ///< position where the object's force is steepest [m or rad]
    double reach = 0.0;      ///< distance from `centre` to each reversal of the motion [m or rad]
    double speed = 0.0;      ///< desired speed of the handle [m/s or rad/s]
    double direction = 1.0;  ///< present direction of the motion, 1 or -1

    [[nodiscard]] Grip grip(double /*time*/, const Motion& handle) noexcept {
        if (direction * (handle.position - centre) >= reach) {
            direction = -direction;
        }
        return {0.0, grip_damping, 0.0, grip_damping * direction * speed, 0.0};
    }
};

/// Hand so firm that it determines the motion of the handle, which follows the samples of a sinusoid:
///
///     x_k = x_0 + reach (1 - cos(pi k turns / ticks)) / 2.
///
/// A turn is a reversal. With 1 tick between turns the hand moves at the Nyquist frequency. Several turns in `ticks`
/// give frequencies between those of whole ticks.
struct PacingHand {
    double reach = 0.0;  ///< Travel of the handle between two reversals [m or rad].
    int ticks = 1;       ///< Number of ticks in which the handle reverses `turns` times, at least 1.
    /// Damping of the grip, far above that of device and object [N*s/m or N*m*s/rad].
    double grip_damping = 1e6;
    double period_s = 1e-3;  ///< Duration of a tick [s].
    /// Ticks before the first motion of the hand, in which the object is placed at the handle.
    int rests = 1;
    int turns = 1;         ///< Number of reversals in `ticks` ticks, from 1 to `ticks`.
    double latest = -1.0;  ///< number of the latest tick in which the hand moved, or -1
    double step = 0.0;     ///< displacement in the latest tick, divided by reach / 2

    [[nodiscard]] Grip grip(double time, const Motion& /*handle*/) noexcept {
        const double tick = std::round(time / period_s) - rests;
        if (tick < 0.0) {
            return {0.0, grip_damping, 0.0, 0.0, 0.0};
        }
        if (tick != latest) {
            const double angle = std::numbers::pi * turns / ticks;
            step = std::cos(angle * tick) - std::cos(angle * (tick + 1.0));
            latest = tick;
        }
        return {0.0, grip_damping, 0.0, grip_damping * 0.5 * reach * step / period_s, 0.0};
    }
};

static_assert(SimulatedHand<PassiveHand> && SimulatedHand<ShakingHand> && SimulatedHand<GreedyHand> &&
              SimulatedHand<PacingHand>);

}  // namespace palpate
