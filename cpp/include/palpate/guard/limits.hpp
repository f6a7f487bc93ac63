// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "palpate/status.hpp"

namespace palpate {

/// Replaces a force that is not finite by zero, and clips a larger one to `largest`. This limit comes first, because
/// the energy of an object is that of its clipped force; all scaling comes later.
struct ForceLimit {
    double largest = 5.0;  ///< [N or N*m], > 0

    /// Limits the force.
    [[nodiscard]] Status apply(double& force) const noexcept {
        if (!std::isfinite(force)) {
            force = 0.0;
            return Status::NonFinite;
        }
        const double unlimited = force;
        force = std::clamp(force, -largest, largest);
        return force == unlimited ? Status::Ok : Status::Limited;
    }
};

/// Limits the change of the force between two ticks. Zero, the safe command, is always possible.
struct SlewLimit {
    double largest_step = std::numeric_limits<double>::infinity();  ///< change in a tick [N or N*m], > 0
    double last = 0.0;                                              ///< force sent before [N or N*m]

    /// Limits the force.
    [[nodiscard]] Status apply(double& force) noexcept {
        const double unlimited = force;
        force = std::clamp(force, last - largest_step, last + largest_step);
        return force == unlimited ? Status::Ok : Status::Limited;
    }

    /// Sets the force that was sent, after all guards.
    void sent(double force) noexcept { last = force; }
};

/// Increases the force from zero at the start: scales the first `ticks` forces by 0, 1/ticks, 2/ticks, ...
struct ForceRamp {
    std::uint64_t ticks = 0;  ///< length of the ramp
    std::uint64_t done = 0;   ///< ticks so far

    /// Returns true after the last scaled force.
    [[nodiscard]] bool is_over() const noexcept { return done >= ticks; }

    /// Scales the force.
    [[nodiscard]] Status apply(double& force) noexcept {
        if (is_over()) {
            return Status::Ok;
        }
        force *= static_cast<double>(done++) / static_cast<double>(ticks);
        return Status::Ramp;
    }
};

}  // namespace palpate
