// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "palpate/device/device_profile.hpp"

namespace palpate {

/// Computes the mean force over a motion in one period. A device that holds a force applies it in the whole period. A
/// device that holds a line of slope kappa makes the force F at the end of the period, and F - kappa d / 2 on average
/// over the motion d. With a fraction of a period of delay the mean is an estimate.
class LineWork {
  public:
    LineWork() = default;
    /// `delay` is the number of whole periods from a reading to its line.
    explicit LineWork(int delay) noexcept : delay_{static_cast<std::uint64_t>(delay)} {}

    /// Stores the stiffness of the line that was sent, once in each tick [N/m or N*m/rad].
    void sent(double stiffness) noexcept { sent_[commands_++ % sent_.size()] = stiffness; }

    /// Returns the mean force over the last period, in which the handle moved by `moved` [m or rad] and at whose end the
    /// motor made the force `applied` [N or N*m].
    [[nodiscard]] double mean(double applied, double moved) const noexcept {
        const double stiffness = sent_[(commands_ - 1 - delay_) % sent_.size()];
        return stiffness == 0.0 ? applied : applied - 0.5 * stiffness * moved;
    }

  private:
    std::uint64_t delay_ = 0;
    std::uint64_t commands_ = 0;
    /// Last stiffnesses; the size is a power of two, so that numbers wrap around [N/m or N*m/rad]
    std::array<double, std::bit_ceil(std::size_t{longest_delay_samples} + 2)> sent_{};
};

}  // namespace palpate
