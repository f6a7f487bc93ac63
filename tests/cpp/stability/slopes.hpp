// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "palpate/model/bounds.hpp"

namespace palpate::test {

/// Returns the bounds of a force with slopes in this range.
inline ForceBounds slopes(double lower, double upper) {
    ForceBounds bounds;
    bounds.slope = {lower, upper};
    bounds.steepest = bounds.sliding = bounds.slope.largest();
    return bounds;
}

}  // namespace palpate::test
