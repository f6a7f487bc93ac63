// SPDX-License-Identifier: Apache-2.0
// Limits of double precision, by the names that the tests use.
#pragma once

#include <limits>

namespace palpate::test {

inline constexpr double infinity = std::numeric_limits<double>::infinity();
inline constexpr double nan = std::numeric_limits<double>::quiet_NaN();
inline constexpr double epsilon = std::numeric_limits<double>::epsilon();

}  // namespace palpate::test
