// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <limits>

#include "palpate/model/hysteresis.hpp"

namespace palpate {

/// Computes the motion that readings of an encoder of step Delta prove: a play of radius Delta / 2 on the read
/// position,
///
///     pi_k = min(x_k + Delta/2, max(x_k - Delta/2, pi_{k-1})).
///
/// It is the motion of a handle that can have been read as x_k. Every such handle travels at least this distance minus
/// Delta / 2 in a whole run, because |pi_{k+1} - x| <= |pi_k - x'| + |x - x'| - |pi_{k+1} - pi_k| for true positions x'
/// and x. A reading that flickers between two counts moves pi at most once. A slow handle is at pi_k when the reading
/// changes, so the work of a held force over pi is exact there.
class ReadMotion {
  public:
    ReadMotion() = default;
    explicit ReadMotion(double encoder_step) noexcept : radius_{0.5 * encoder_step} {}

    /// Returns the motion since the last reading [m or rad]; NaN for the first one.
    [[nodiscard]] double to(double reading) noexcept {
        const double before = position_;
        position_ = std::isnan(before) ? reading : play(reading, before, radius_);
        return position_ - before;
    }
    /// Marks that the next reading does not follow from this one.
    void interrupt() noexcept { position_ = std::numeric_limits<double>::quiet_NaN(); }

  private:
    double radius_ = 0.0;
    double position_ = std::numeric_limits<double>::quiet_NaN();
};

}  // namespace palpate
