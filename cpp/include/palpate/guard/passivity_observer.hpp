// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

namespace palpate {

/// What a rendering took in at the motor since it began,
///
///     E_k = E_{k-1} + F (x_k - x_{k-1}),   F the force that acted meanwhile,
///
/// exact for a held force up to the encoder's step. A monitor: it never touches a force.
class PassivityObserver {
  public:
    void book(double applied, double moved) noexcept {
        energy_ += applied * moved;
        least_ = std::min(least_, energy_);
    }

    [[nodiscard]] double energy() const noexcept { return energy_; }
    /// The least it ever was. Below minus what the object held at the start, energy was generated; the device's
    /// own damping may have taken it away.
    [[nodiscard]] double least() const noexcept { return least_; }

  private:
    double energy_ = 0.0;  ///< [J]
    double least_ = 0.0;   ///< [J]
};

}  // namespace palpate
