// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "palpate/status.hpp"

namespace palpate {

/// What counts as buzzing.
struct LimitCycleSettings {
    double force_swing =
        std::numeric_limits<double>::infinity();  ///< least force from turn to turn [N or N*m]
    std::uint64_t longest_swing = 25;  ///< from turn to turn [ticks]; hands turn round more slowly than 20 Hz
    double encoder_step = 0.0;         ///< a way back no longer than this is no turn [m or rad]
};

/// Finds a handle that buzzes and makes the object softer. A buzz is ten swings in a row, each from one turn of
/// the handle to the next, each fast, each with a notable change of force, and not dying out: the five last
/// reach at least 0.8 of the five first. A knob turned over its detents makes forces as fast, but does not turn
/// round.
///
/// All forces are then scaled by 0.7, which scales stiffness, coupling and damping of the object alike, and
/// again with every further buzz. They are not scaled up again: that would give energy, and a new buzz.
class LimitCycleDetector {
  public:
    LimitCycleDetector() = default;
    explicit LimitCycleDetector(const LimitCycleSettings& settings) noexcept : settings_{settings} {}

    void watch(double position, double force) noexcept {
        ++ticks_;
        least_force_ = std::min(least_force_, force);
        largest_force_ = std::max(largest_force_, force);
        const double ahead = direction_ * (position - extreme_);
        if (ahead >= 0.0 || std::isnan(extreme_)) {
            extreme_ = position;
        } else if (-ahead > settings_.encoder_step) {
            turn();
            extreme_ = position;
            least_force_ = largest_force_ = force;
        }
    }

    [[nodiscard]] Status apply(double& force) const noexcept {
        force *= scale_;
        return scale_ < 1.0 ? Status::Softened : Status::Ok;
    }

    [[nodiscard]] double scale() const noexcept { return scale_; }
    [[nodiscard]] std::uint64_t buzzes() const noexcept { return buzzes_; }

  private:
    static constexpr std::uint64_t half = 5;  ///< swings
    static constexpr double still_alive = 0.8;
    static constexpr double softer = 0.7;

    void turn() noexcept {
        const double swing = std::abs(extreme_ - last_turn_);
        const bool buzzes =
            ticks_ <= settings_.longest_swing && largest_force_ - least_force_ >= settings_.force_swing;
        last_turn_ = extreme_;
        direction_ = -direction_;
        ticks_ = 0;
        if (!buzzes) {
            swings_ = 0;
        } else {
            ++swings_;
        }
        if (swings_ <= 1) {
            first_ = last_ = 0.0;
        }
        double& reached = swings_ <= half ? first_ : last_;
        reached = std::max(reached, swing);
        if (swings_ == 2 * half) {
            swings_ = 0;
            if (last_ >= still_alive * first_) {
                scale_ *= softer;
                ++buzzes_;
            }
        }
    }

    LimitCycleSettings settings_;
    double scale_ = 1.0;
    std::uint64_t buzzes_ = 0;
    double direction_ = 1.0;
    double extreme_ = std::numeric_limits<double>::quiet_NaN();  ///< of the swing under way
    double last_turn_ = 0.0;
    double least_force_ = std::numeric_limits<double>::infinity();  ///< of the swing under way
    double largest_force_ = -std::numeric_limits<double>::infinity();
    double first_ = 0.0;  ///< longest of the first five swings
    double last_ = 0.0;   ///< longest of the five after them
    std::uint64_t swings_ = 0;
    std::uint64_t ticks_ = 0;  ///< since the last turn
};

}  // namespace palpate
