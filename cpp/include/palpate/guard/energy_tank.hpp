// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "palpate/status.hpp"

namespace palpate {

/// What an energy tank may count on.
struct TankSettings {
    double capacity = std::numeric_limits<double>::infinity();  ///< the most the object can give [J]
    double damping = 0.0;   ///< b of the device, which takes energy that the motor gave [N*s/m or N*m*s/rad]
    double friction = 0.0;  ///< f_c, likewise [N or N*m]
    double encoder_step = 0.0;  ///< a motion below it says nothing [m or rad]
    double period_s = 1e-3;
};

/// A store that every joule a rendering gives is paid from. It is full at the start, with what the object can
/// give and a reserve of a quarter above it; what the handle puts in fills it again, up to the brim, and what
/// the device's damping certainly took is not charged,
///
///     E_k = min(brim, E_{k-1} + F d + b d_r^2 / T + f_c d_r),   d = x_k - x_{k-1},   d_r = max(0, |d| - step).
///
/// An object that generates nothing never reaches the reserve. Within it, forces along the motion, the ones
/// that give, are scaled down to nothing; forces against it are let through.
class EnergyTank {
  public:
    EnergyTank() = default;
    explicit EnergyTank(const TankSettings& settings) noexcept
        : settings_{settings},
          reserve_{0.25 * settings.capacity},
          level_{settings.capacity + reserve_},
          lowest_{level_} {}

    void book(double applied, double moved) noexcept {
        const double surely = std::max(0.0, std::abs(moved) - settings_.encoder_step);
        const double lost =
            settings_.damping * surely * surely / settings_.period_s + settings_.friction * surely;
        level_ = std::min(settings_.capacity + reserve_, level_ + applied * moved + lost);
        lowest_ = std::min(lowest_, level_);
        moved_ = moved;
    }

    [[nodiscard]] Status apply(double& force) const noexcept {
        if (level_ >= reserve_ || force * moved_ >= 0.0) {
            return Status::Ok;
        }
        force *= std::max(0.0, level_) / reserve_;
        return Status::Drained;
    }

    [[nodiscard]] double level() const noexcept { return level_; }
    [[nodiscard]] double lowest() const noexcept { return lowest_; }

  private:
    TankSettings settings_;
    double reserve_ = std::numeric_limits<double>::infinity();
    double level_ = std::numeric_limits<double>::infinity();
    double lowest_ = std::numeric_limits<double>::infinity();
    double moved_ = 0.0;  ///< in the last tick; the next one is expected to go on
};

}  // namespace palpate
