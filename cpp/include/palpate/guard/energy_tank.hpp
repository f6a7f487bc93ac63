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
    double damping = 0.0;       ///< b of the device, which takes what the motor gave [N*s/m or N*m*s/rad]
    double friction = 0.0;      ///< f_c, likewise [N or N*m]
    double encoder_step = 0.0;  ///< a motion below it says nothing [m or rad]
    double period_s = 1e-3;
};

/// A store that every joule a rendering gives is paid from. It is full at the start, with what the object can
/// give and a reserve of a quarter above it. What the handle puts in fills it again, up to the brim, and nine
/// tenths of what the device certainly took are not charged,
///
///     E_k = min(brim, E_{k-1} + F d + 0.9 (b d_r^2 / T + f_c d_r)),   d = x_k - x_{k-1},   d_r = max(0, |d| - step).
///
/// Not all of it: a steady buzz gives exactly what the device takes. An object that generates nothing never
/// reaches the reserve. Within it all forces fade with the level, those against the handle too: one that is held
/// too long turns it round and gives after all. What is given beyond the losses therefore ends with the brim.
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
        const double lost = surely * (settings_.damping * surely / settings_.period_s + settings_.friction);
        level_ = std::min(settings_.capacity + reserve_, level_ + applied * moved + credited * lost);
        lowest_ = std::min(lowest_, level_);
    }

    [[nodiscard]] Status apply(double& force) const noexcept {
        if (level_ >= reserve_ || force == 0.0) {
            return Status::Ok;
        }
        force *= std::max(0.0, level_) / reserve_;
        return Status::Drained;
    }

    [[nodiscard]] double level() const noexcept { return level_; }
    [[nodiscard]] double lowest() const noexcept { return lowest_; }

  private:
    static constexpr double credited = 0.9;

    TankSettings settings_;
    double reserve_ = std::numeric_limits<double>::infinity();
    double level_ = std::numeric_limits<double>::infinity();
    double lowest_ = std::numeric_limits<double>::infinity();
};

}  // namespace palpate
