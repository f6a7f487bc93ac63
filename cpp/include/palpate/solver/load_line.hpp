// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace palpate {

/// What a time step asks of the environment: the position y where
///
///     f(y) + slope * y = intercept.
///
/// Inertia, damping and the virtual coupling are all in the two numbers, so every implicit structure ends in
/// the same scalar equation. It has one solution for every intercept where slope + f' > 0.
struct LoadLine {
    double slope = 0.0;      ///< p
    double intercept = 0.0;  ///< q
};

}  // namespace palpate
