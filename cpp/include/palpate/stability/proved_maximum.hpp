// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <limits>
#include <queue>

namespace palpate::detail {

/// Returns a proved upper bound of the maximum of a function over [from, to]. `above(low, high)` returns an upper bound
/// over [low, high]; for low = high it is the value at this position. The result is at most `slack` > 0 above the
/// largest value found, unless an interval cannot be divided any more or the number of intervals is too large; the bound
/// is then wider.
template <class Above>
[[nodiscard]] double proved_maximum(double from, double to, double slack, Above above) {
    struct Part {
        double low, high, bound;
        [[nodiscard]] bool operator<(const Part& other) const noexcept { return bound < other.bound; }
    };
    constexpr int most_parts = 200000;
    double largest = std::max(above(from, from), above(to, to));
    std::priority_queue<Part> open;
    open.push({from, to, above(from, to)});
    for (int parts = 1; parts < most_parts; ++parts) {
        const Part part = open.top();
        const double middle = 0.5 * (part.low + part.high);
        // The comparison is also true for a bound that is not a number
        if (!(part.bound > largest + slack) || middle <= part.low || middle >= part.high) {
            break;
        }
        open.pop();
        largest = std::max(largest, above(middle, middle));
        open.push({part.low, middle, above(part.low, middle)});
        open.push({middle, part.high, above(middle, part.high)});
    }
    return std::max(largest, open.top().bound);
}

}  // namespace palpate::detail
