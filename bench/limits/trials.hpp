// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "hands.hpp"
#include "palpate/model/continuation.hpp"
#include "palpate/model/environment.hpp"
#include "palpate/model/hysteresis.hpp"
#include "palpate/rendering/any_structure.hpp"
#include "palpate/rendering/structure.hpp"
#include "palpate/simulation/closed_loop.hpp"

namespace palpate::bench {

/// Object whose force f is stiffness times position x.
struct LinearObject {
    using State = Stateless;
    double stiffness = 0.0;

    [[nodiscard]] EnvironmentSample at(double x, const State& /*stateless*/) const noexcept {
        return {stiffness * x, stiffness, 0.5 * stiffness * x * x, false};
    }
    void advance(double /*x*/, State& /*stateless*/) const noexcept {}
    [[nodiscard]] State start(double /*x*/) const noexcept { return {}; }
};

/// Object with the force `falling` (x^3 / width^2 - x) at position x: slope -falling at 0, snaps from -width to width.
struct SnappingObject {
    using State = Stateless;
    double falling = 0.0;
    double width = 0.1;

    [[nodiscard]] EnvironmentSample at(double x, const State& /*stateless*/) const noexcept {
        const double u = x / width;
        return {falling * x * (u * u - 1.0), falling * (3.0 * u * u - 1.0),
                0.5 * falling * x * x * (0.5 * u * u - 1.0), false};
    }
    void advance(double /*x*/, State& /*stateless*/) const noexcept {}
    [[nodiscard]] State start(double /*x*/) const noexcept { return {}; }
};

/// A straight line as the mean force or the hysteresis of a model.
struct StraightCurve {
    double slope = 0.0;
    double offset = 0.0;

    [[nodiscard]] Curve at(double x) const noexcept {
        return {slope * x + offset, slope, (0.5 * slope * x + offset) * x,
                (slope * x / 6.0 + 0.5 * offset) * x * x};
    }
    [[nodiscard]] bool extrapolated(double /*x*/) const noexcept { return false; }
};

/// Object with the force g x + s h: spring of stiffness g, constant hysteresis h, direction state s.
using ConstantHysteresis = HysteresisPair<StraightCurve>;

static_assert(Environment<LinearObject> && Environment<ConstantHysteresis> && Environment<SnappingObject>);

inline constexpr double not_finite = std::numeric_limits<double>::infinity();

/// Detects a growing oscillation: the largest amplitude in the last quarter of a motion exceeds the largest in the
/// second quarter.
class Growth {
  public:
    explicit Growth(std::size_t ticks) noexcept : ticks_{ticks} {}

    /// Takes the next value of the oscillating quantity. Returns false if the oscillation has diverged, so that the
    /// simulation can stop.
    [[nodiscard]] bool add(double quantity) noexcept {
        const std::size_t quarter = std::min<std::size_t>(3, 4 * tick_ / ticks_);
        ++tick_;
        if (!std::isfinite(quantity)) {
            diverged_ = true;
            return false;
        }
        largest_[quarter] = std::max(largest_[quarter], std::abs(quantity));
        diverged_ = quarter > 0 && largest_[quarter] > 1e6 * largest_[0];
        return !diverged_;
    }

    [[nodiscard]] bool grows() const noexcept { return diverged_ || largest_[3] > largest_[1]; }

  private:
    std::size_t ticks_;
    std::size_t tick_ = 0;
    std::array<double, 4> largest_{};
    bool diverged_ = false;
};

/// Returns true if a virtual object that is driven by a force oscillates with growing amplitude after a push.
[[nodiscard]] inline bool oscillates_force_driven(AnyStructure structure, std::size_t ticks) noexcept {
    structure.reset(0.0);
    Growth growth{ticks};
    (void)structure.drive(1.0);
    for (std::size_t k = 0; k < ticks; ++k) {
        const Rendered now = structure.drive(0.0);
        if (!growth.add(now.status == Status::Ok ? now.environment_position : not_finite)) {
            break;
        }
    }
    return growth.grows();
}

inline constexpr Guards unguarded{.limit = {1e9}};

/// Returns true if a passive hand and a rendered spring with rest position 0 oscillate together with growing
/// amplitude.
[[nodiscard]] inline bool oscillates_with(AnyStructure structure, DeviceProfile device,
                                          const PassiveHand& hand, double stiffness, std::size_t ticks) {
    constexpr double endless = 1e150;  // force limit so large that it does not stop the growth [N*m]
    device.force_limit = endless;
    const double inertia = device.inertia + hand.mass;
    Growth growth{ticks};
    (void)closed_loop(std::move(structure), device, hand, ticks, {8, 0.0, 1.0, Guards{.limit = {endless}}},
                      [&](const Tick& /*tick*/, const Motion& now, const EnergyBalance& /*account*/) {
                          return growth.add(inertia * now.velocity * now.velocity +
                                            (stiffness + hand.stiffness) * now.position * now.position);
                      });
    return growth.grows();
}

/// Work of a hand with prescribed motion on the rendering: `whole` in all, `half` in the first half of the reversals.
struct PacedWork {
    double half = 0.0;      ///< [J]
    double whole = 0.0;     ///< [J]
    double rounding = 0.0;  ///< upper limit of the rounding error of `half` and `whole` [J]

    /// Returns true if the hand takes energy out of the rendering in each repetition of the motion.
    [[nodiscard]] bool negative() const noexcept { return whole - half < -rounding; }
};

[[nodiscard]] inline PacedWork work_of_pacing(AnyStructure structure, DeviceProfile device,
                                              const PacingHand& hand, double start,
                                              std::size_t fewest_ticks = 2000) {
    constexpr std::size_t fewest_turns = 16;
    device.force_limit = 1e9;
    const auto turn = 2 * static_cast<std::size_t>(hand.ticks);
    const std::size_t ticks = 2 * turn * std::max(fewest_turns / 2, fewest_ticks / 2 / turn);
    PacedWork work;
    std::size_t tick = 0;
    (void)closed_loop(std::move(structure), device, hand, ticks, {2, start, 0.0, unguarded},
                      [&](const Tick& /*now*/, const Motion& /*handle*/, const EnergyBalance& account) {
                          work.whole = account.motor + account.dissipated;
                          work.rounding = 1e-9 * account.throughput;
                          if (++tick == ticks / 2) {
                              work.half = work.whole;
                          }
                          return true;
                      });
    return work;
}

/// Ticks between two reversals of each prescribed hand motion; 1 is the Nyquist frequency.
inline constexpr std::array<int, 9> paces{1, 2, 3, 4, 6, 10, 20, 60, 500};

/// States if one of several cases fails. The search of a limit calls it again and again, so the case that failed last is
/// tried first.
class AnyCase {
  public:
    /// Returns true if `fails(k)` for one k below `count`, which is the same in each call.
    template <class Fails>
    [[nodiscard]] bool operator()(std::size_t count, Fails fails) {
        if (fails(last_)) {
            return true;
        }
        for (std::size_t k = 0; k < count; ++k) {
            if (k != last_ && fails(k)) {
                last_ = k;
                return true;
            }
        }
        return false;
    }

  private:
    std::size_t last_ = 0;
};

/// Returns true if a hand takes energy out of the rendering in the steady state at a frequency of `paces`.
template <class Build>
[[nodiscard]] bool generates_energy(Build build, const DeviceProfile& device, double reach, AnyCase& any) {
    return any(paces.size(), [&](std::size_t k) {
        const double grip_damping = 1e6 * (device.viscous_damping + 1e-6);
        const PacedWork work =
            work_of_pacing(build(), device, {reach, paces.at(k), grip_damping, device.period_s}, 0.0);
        return work.negative();
    });
}

}  // namespace palpate::bench
