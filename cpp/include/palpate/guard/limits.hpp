// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "palpate/status.hpp"

namespace palpate {

/// The first thing after a computed force: one that is not a number becomes zero, a larger one than `largest` is
/// clipped. The energy of an object is that of its clipped force, so everything that scales comes later.
struct ForceLimit {
    double largest = 5.0;  ///< [N or N*m], > 0

    [[nodiscard]] Status apply(double& force) const noexcept {
        if (!std::isfinite(force)) {
            force = 0.0;
            return Status::NonFinite;
        }
        const double wanted = force;
        force = std::clamp(force, -largest, largest);
        return force == wanted ? Status::Ok : Status::Limited;
    }
};

/// How far a force may move from one tick to the next. Zero, the safe command, is always in reach.
struct SlewLimit {
    double largest_step = std::numeric_limits<double>::infinity();  ///< a tick [N or N*m], > 0
    double last = 0.0;                                              ///< what was sent before

    [[nodiscard]] Status apply(double& force) noexcept {
        const double wanted = force;
        force = std::clamp(force, last - largest_step, last + largest_step);
        return force == wanted ? Status::Ok : Status::Limited;
    }

    /// To be told of every force, whoever had a say in it after this limit.
    void sent(double force) noexcept { last = force; }
};

/// The way from no force to all of it: the first `ticks` forces are scaled by 0, 1/ticks, 2/ticks, ...
struct ForceRamp {
    std::uint64_t ticks = 0;
    std::uint64_t done = 0;

    [[nodiscard]] bool is_over() const noexcept { return done >= ticks; }

    [[nodiscard]] Status apply(double& force) noexcept {
        if (is_over()) {
            return Status::Ok;
        }
        force *= static_cast<double>(done++) / static_cast<double>(ticks);
        return Status::Ramp;
    }
};

}  // namespace palpate
