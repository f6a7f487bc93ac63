// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <limits>

#include "palpate/model/hysteresis.hpp"

namespace palpate {

/// Computes the motion of the handle that the readings x_k of an encoder with the step Delta prove: a play operator pi
/// with the radius Delta / 2 follows the readings,
///
///     pi_k = min(x_k + Delta/2, max(x_k - Delta/2, pi_{k-1})).
///
/// A handle at the positions pi_k gives the readings x_k. Every handle that gives these readings travels in a whole run
/// at least the distance that pi travels minus Delta / 2. The reason is |pi_{k+1} - x| <= |pi_k - x'| + |x - x'| -
/// |pi_{k+1} - pi_k| for the true positions x' and x of the handle in ticks k and k + 1. A reading that alternates
/// between two adjacent encoder positions moves pi at most once. If the handle is slow, it is at pi_k when the reading
/// changes, so the work of a held force computed with pi is exact at this time.
class ReadMotion {
  public:
    ReadMotion() = default;
    explicit ReadMotion(double encoder_step) noexcept : radius_{0.5 * encoder_step} {}

    /// Returns the proved motion of the handle since the last reading [m or rad]; NaN for the first reading.
    [[nodiscard]] double to(double reading) noexcept {
        const double before = position_;
        position_ = std::isnan(before) ? reading : play(reading, before, radius_);
        return position_ - before;
    }
    /// Forgets the last reading, so that no motion is computed between it and the next reading.
    void interrupt() noexcept { position_ = std::numeric_limits<double>::quiet_NaN(); }

  private:
    double radius_ = 0.0;
    double position_ = std::numeric_limits<double>::quiet_NaN();
};

}  // namespace palpate
