// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>

#include "palpate/simulation/hand.hpp"

// Hands that drive a rendering to its limits.

namespace palpate {

/// A passive hand: a mass on the handle, a spring and a damper to a fixed point. All zero: no hand.
struct PassiveHand {
    double stiffness = 0.0;  ///< [N/m or N*m/rad]
    double damping = 0.0;    ///< [N*s/m or N*m*s/rad]
    double mass = 0.0;       ///< [kg or kg*m^2]
    double rest = 0.0;       ///< the fixed point [m or rad]

    [[nodiscard]] Grip grip(double /*time*/, const Motion& /*handle*/) const noexcept {
        return {stiffness, damping, rest, 0.0, mass};
    }
};

/// A hand that shakes at a share of the Nyquist frequency, where a sampled wall is half a cycle late.
struct ShakingHand {
    double stiffness = 0.0;  ///< of the grip [N/m or N*m/rad]
    double centre = 0.0;     ///< [m or rad]
    double amplitude = 0.0;  ///< of the target [m or rad]
    double share = 1.0;      ///< of the Nyquist frequency; 1: to and fro in every two ticks
    double period_s = 1e-3;  ///< of the tick [s]

    [[nodiscard]] Grip grip(double time, const Motion& /*handle*/) const noexcept {
        const double target =
            centre + amplitude * std::cos(std::numbers::pi * share * std::round(time / period_s));
        return {stiffness, 0.0, target, 0.0, 0.0};
    }
};

/// A hand that extracts energy: it crosses the object's steepest part at constant speed, to and fro. There the held
/// force lags the object's force during each tick, in both directions.
struct GreedyHand {
    double grip_damping = 1.0;  ///< how firmly it keeps its speed [N*s/m or N*m*s/rad]
    double centre = 0.0;        ///< of the steepest part [m or rad]
    double reach = 0.0;         ///< to either side [m or rad]
    double speed = 0.0;         ///< [m/s or rad/s]
    double direction = 1.0;     ///< of the motion now, 1 or -1

    [[nodiscard]] Grip grip(double /*time*/, const Motion& handle) noexcept {
        if (direction * (handle.position - centre) >= reach) {
            direction = -direction;
        }
        return {0.0, grip_damping, 0.0, grip_damping * direction * speed, 0.0};
    }
};

/// A hand so firm that it alone determines the motion of the handle: from sample to sample of a sinusoid,
///
///     x_k = x_0 + reach (1 - cos(pi k turns / ticks)) / 2.
///
/// With 1 tick from turn to turn it moves at the Nyquist frequency, with many it is slow. Several turns give frequencies
/// between those of whole ticks.
struct PacingHand {
    double reach = 0.0;      ///< from turn to turn [m or rad]
    int ticks = 1;           ///< of `turns` turns, at least 1
    double firmness = 1e6;   ///< far above every damping of device and object [N*s/m or N*m*s/rad]
    double period_s = 1e-3;  ///< of the tick [s]
    int rests = 1;           ///< ticks before the first way, while the object is put under the handle
    int turns = 1;           ///< from 1 to ticks

    [[nodiscard]] Grip grip(double time, const Motion& /*handle*/) const noexcept {
        const double tick = std::round(time / period_s) - rests;
        if (tick < 0.0) {
            return {0.0, firmness, 0.0, 0.0, 0.0};
        }
        const double angle = std::numbers::pi * turns / ticks;
        const double way = std::cos(angle * tick) - std::cos(angle * (tick + 1.0));
        return {0.0, firmness, 0.0, firmness * 0.5 * reach * way / period_s, 0.0};
    }
};

static_assert(SimulatedHand<PassiveHand> && SimulatedHand<ShakingHand> && SimulatedHand<GreedyHand> &&
              SimulatedHand<PacingHand>);

}  // namespace palpate
