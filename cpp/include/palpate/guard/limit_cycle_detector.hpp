// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "palpate/status.hpp"

namespace palpate {

/// Criteria by which an oscillation of the handle is a limit cycle. A swing is the motion between two reversals of the
/// handle.
struct LimitCycleSettings {
    /// A swing counts for a limit cycle only if the force changes by at least this much during the swing [N or N*m]
    double force_swing = std::numeric_limits<double>::infinity();
    /// A swing counts for a limit cycle only if it takes at most this time [ticks]; slower swings (below 20 Hz) can
    /// come from a hand
    std::uint64_t longest_swing = 25;
    /// Motion against the current direction of at most one encoder step is not a reversal [m or rad]
    double encoder_step = 0.0;
};

/// Detects a limit cycle of the handle and scales all forces down. A limit cycle is ten consecutive swings between
/// reversals of the handle. Each swing is short in time and has a large change of force, and the swings do not decay:
/// the longest of the last five is at least 0.8 of the longest of the first five. Turning a knob over its detents
/// causes forces of the same frequency, but the knob does not reverse.
///
/// After a limit cycle the detector multiplies all forces by 0.7, which reduces stiffness, coupling and damping of the
/// virtual object equally. It does this again after every further limit cycle. It never increases the factor, because
/// an increase would give energy and cause a new limit cycle.
class LimitCycleDetector {
  public:
    LimitCycleDetector() = default;
    explicit LimitCycleDetector(const LimitCycleSettings& settings) noexcept : settings_{settings} {}

    /// Updates the swing in progress with the position and the force of a tick, and detects a limit cycle.
    void watch(double position, double force) noexcept {
        ++ticks_;
        least_force_ = std::min(least_force_, force);
        largest_force_ = std::max(largest_force_, force);
        const double ahead = direction_ * (position - extreme_);
        if (std::isnan(extreme_) || ahead >= 0.0) {
            extreme_ = position;
        } else if (-ahead > settings_.encoder_step) {
            end_swing();
            extreme_ = position;
            least_force_ = largest_force_ = force;
        }
    }

    /// Multiplies the force by the factor of the detector; returns `LimitCycleScaled` if the factor is below 1.
    [[nodiscard]] Status apply(double& force) const noexcept {
        force *= scale_;
        return scale_ < 1.0 ? Status::LimitCycleScaled : Status::Ok;
    }

    /// Returns the factor of all forces: 1 before the first limit cycle, smaller after each limit cycle.
    [[nodiscard]] double scale() const noexcept { return scale_; }
    /// Returns the number of limit cycles detected since the start.
    [[nodiscard]] std::uint64_t limit_cycles() const noexcept { return limit_cycles_; }

  private:
    static constexpr std::uint64_t swings_in_half = 5;  ///< swings in each half of a limit cycle
    /// Smallest ratio in a limit cycle: longest of its last five swings / longest of its first five
    static constexpr double least_last_to_first = 0.8;
    /// After each detected limit cycle, all later forces are multiplied by this factor once more
    static constexpr double force_factor = 0.7;

    void end_swing() noexcept {
        const double swing = std::abs(extreme_ - last_reversal_);
        const bool is_fast_swing =
            ticks_ <= settings_.longest_swing && largest_force_ - least_force_ >= settings_.force_swing;
        last_reversal_ = extreme_;
        direction_ = -direction_;
        ticks_ = 0;
        if (!is_fast_swing) {
            swings_ = 0;
        } else {
            ++swings_;
        }
        if (swings_ <= 1) {
            first_ = last_ = 0.0;
        }
        double& longest = swings_ <= swings_in_half ? first_ : last_;
        longest = std::max(longest, swing);
        if (swings_ == 2 * swings_in_half) {
            swings_ = 0;
            if (last_ >= least_last_to_first * first_) {
                scale_ *= force_factor;
                ++limit_cycles_;
            }
        }
    }

    LimitCycleSettings settings_;
    double scale_ = 1.0;
    std::uint64_t limit_cycles_ = 0;
    double direction_ = 1.0;
    /// Farthest position of the handle in the current swing (motion since the last reversal)
    double extreme_ = std::numeric_limits<double>::quiet_NaN();
    double last_reversal_ = 0.0;
    double least_force_ = std::numeric_limits<double>::infinity();  ///< smallest force in the current swing
    double largest_force_ = -std::numeric_limits<double>::infinity();  ///< largest force in the current swing
    double first_ = 0.0;  ///< longest of the first five swings of a possible limit cycle [m or rad]
    double last_ = 0.0;   ///< longest of the swings six to ten of a possible limit cycle [m or rad]
    std::uint64_t swings_ = 0;
    std::uint64_t ticks_ = 0;  ///< ticks since the last reversal of the handle
};

}  // namespace palpate
