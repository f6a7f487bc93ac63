// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

namespace palpate {

/// Observes the energy that a rendering has absorbed at the motor since its start,
///
///     E_k = E_{k-1} + F (x_k - x_{k-1}),   F the force that acted meanwhile.
///
/// It is exact for a held force, up to the encoder step. It never changes a force.
class PassivityObserver {
  public:
    /// Adds the work of `applied` over the motion `moved` of the handle.
    void book(double applied, double moved) noexcept {
        energy_ += applied * moved;
        least_ = std::min(least_, energy_);
    }

    /// Returns E_k [J].
    [[nodiscard]] double energy() const noexcept { return energy_; }
    /// Returns the least E_k so far [J]. If it is below minus the energy that the object stored at the start, energy
    /// was generated; the device's damping may have dissipated it.
    [[nodiscard]] double least() const noexcept { return least_; }

  private:
    double energy_ = 0.0;  ///< [J]
    double least_ = 0.0;   ///< [J]
};

}  // namespace palpate
