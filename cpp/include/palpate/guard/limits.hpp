// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

#include "palpate/status.hpp"

namespace palpate {

/// The last thing between a computed force and the device: a force that is not a number becomes zero, a
/// larger one than `largest` is clipped.
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

}  // namespace palpate
