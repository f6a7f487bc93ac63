// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

#include "palpate/inline.hpp"
#include "palpate/model/force_model.hpp"

namespace palpate {

/// Smallest and largest energy that a virtual object can store.
struct EnergyRange {
    /// Smallest stored energy over all positions, continuation included; -infinity if the energy has no lower bound [J]
    double least = 0.0;
    double largest = 0.0;  ///< largest stored energy over the domain, hysteresis included [J]
    /// Upper bound of the error of `least` and `largest`, which are computed at finitely many positions [J]
    double missed = 0.0;

    /// Returns the energy that the object can give from any position in its domain, plus the error `missed` [J].
    [[nodiscard]] double span() const noexcept { return largest - least + missed; }
};

/// Returns the smallest and largest stored energy of a force of position and velocity, at velocity zero and with a
/// force limit [N]. Uses Simpson's rule, because this force does not have an elementary antiderivative. For slopes up to
/// L, the error of the rule is at most 5/36 L w^2 in a cell of width w. Its three values represent the positions at most
/// w/6, w/3 and w/6 away from them.
[[nodiscard]] PALPATE_INLINE EnergyRange energy_range(const VelocityNetwork& force, double force_limit);

/// Returns the smallest and largest stored energy of a model of position, or of position and velocity, whose force is
/// limited to +-`force_limit` [N].
[[nodiscard]] PALPATE_INLINE EnergyRange
energy_range(const ForceModel& model, double force_limit = std::numeric_limits<double>::infinity());

}  // namespace palpate

#ifndef PALPATE_COMPILED
#include "palpate/model/detail/energy.hpp"
#endif
