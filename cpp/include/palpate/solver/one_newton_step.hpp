// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "palpate/model/environment.hpp"
#include "palpate/solver/newton.hpp"

namespace palpate {

/// One step of Newton's method and no more, from the last position: with it `Implicit` is the linearly
/// implicit Euler scheme. One evaluation a step, exact for a line, no certificate for anything else.
struct OneNewtonStep {
    using Memory = WarmStart;

    [[nodiscard]] static constexpr bool tabulated() noexcept { return false; }

    template <Environment E>
    [[nodiscard]] Solution solve(const E& environment, const typename E::State& state, LoadLine line,
                                 WarmStart& memory) const noexcept {
        const double y = memory.position;
        const EnvironmentSample at = environment.at(y, state);
        const double slope = line.slope + at.slope;
        const double step = (line.intercept - line.slope * y - at.force) / slope;
        if (!std::isfinite(step)) {
            return {y, at, step, 1, Status::NonFinite};
        }
        memory = WarmStart{y + step};
        EnvironmentSample there = at;
        there.force = at.force + at.slope * step;
        return {memory.position, there, 0.0, 1, slope > 0.0 ? Status::Ok : Status::NotUnique};
    }
};

}  // namespace palpate
