// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>

#include "palpate/rendering/structure.hpp"

namespace palpate {

/// Short small pushes to either side. They show the sign of a device's force, its delay and its mechanics. Two sizes
/// of push separate friction from damping: both take a share of the force, but only damping grows with the speed.
struct PulseSettings {
    double force = 0.02;    ///< of a push, the sign alternates [N or N*m]
    double smaller = 0.6;   ///< size of every second three pushes, over `force` [-]
    double push_s = 0.03;   ///< how long it lasts [s]
    double rest_s = 0.17;   ///< how long nothing follows [s]
    double farthest = 0.2;  ///< a handle that got this far from its start is pushed no more [m or rad]
};

class Pulses {
  public:
    Pulses(const PulseSettings& settings, double period_s) : settings_{settings} {
        if (!(std::isfinite(settings.force) && settings.force > 0.0)) {
            throw std::invalid_argument("push is " + std::to_string(settings.force) + ", must be > 0");
        }
        push_ = static_cast<std::uint64_t>(std::llround(settings.push_s / period_s));
        rest_ = static_cast<std::uint64_t>(std::llround(settings.rest_s / period_s));
    }

    void reset(double position) noexcept {
        start_ = position;
        tick_ = 0;
    }

    [[nodiscard]] Rendered step(double position) noexcept {
        if (!std::isfinite(position)) {
            return detail::refused(start_);
        }
        const std::uint64_t cycle = tick_ / (rest_ + push_);
        const bool pushes =
            tick_++ % (rest_ + push_) >= rest_ && std::abs(position - start_) < settings_.farthest;
        const double size = settings_.force * (cycle / 3 % 2 == 0 ? 1.0 : settings_.smaller);
        const double force = cycle % 2 == 0 ? size : -size;
        return {pushes ? force : 0.0, position, 0, Status::Ok, false};
    }

  private:
    PulseSettings settings_;
    std::uint64_t push_;
    std::uint64_t rest_;
    std::uint64_t tick_ = 0;
    double start_ = 0.0;
};

}  // namespace palpate
