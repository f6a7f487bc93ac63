// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

namespace palpate {

/// Sums the energy that a rendering absorbs at the motor,
///
///     E_k = E_{k-1} + F (x_k - x_{k-1}),   F the force that acted during the motion.
///
/// x_k is the handle position of sample k, or the position that the readings prove (`ReadMotion`). For a held force the
/// computed energy is exact except for the effect of encoder steps. The observer never changes a force.
class PassivityObserver {
  public:
    /// Adds the energy that the force `applied` absorbed during the motion `moved` of the handle.
    void book(double applied, double moved) noexcept {
        energy_ += applied * moved;
        least_ = std::min(least_, energy_);
    }

    /// Returns the absorbed energy E_k [J].
    [[nodiscard]] double energy() const noexcept { return energy_; }
    /// Returns the smallest energy E_k since the start [J]. If it is less than minus the energy that the virtual object
    /// stored at the start, the rendering has generated energy; the damping of the device may have dissipated this
    /// energy.
    [[nodiscard]] double least() const noexcept { return least_; }

  private:
    double energy_ = 0.0;  ///< [J]
    double least_ = 0.0;   ///< [J]
};

}  // namespace palpate
