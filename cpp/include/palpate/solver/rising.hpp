// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "palpate/model/bounds.hpp"
#include "palpate/model/derivatives.hpp"
#include "palpate/model/parameters.hpp"

namespace palpate {

/// Returns the intervals of positions between `lower` and `upper` over which F(y) = f(y) + p y rises, in the order of
/// position; f is a network of one input without continuation. Each end of an interval is `lower`, `upper` or a fold: a
/// position with p + f' = 0 at which F changes between rising and falling. Each fold is located to the last digit.
///
/// Bisection divides [lower, upper] into cells. For every cell it is proved that the slope p + f' keeps its sign, or
/// that the slope is monotone and has one zero. The proof uses p + f' and f'' in the middle of the cell and a bound of
/// |f'''| over the cell. Returns nothing if rounding hides whether F has a fold at some position, or too many cells are
/// needed.
[[nodiscard]] inline std::optional<std::vector<Interval>> rising_intervals(const NetworkParameters& network,
                                                                           double p, double lower,
                                                                           double upper) {
    constexpr int first_cells = 61;
    constexpr int budget = 20'000;
    const Jet rounding = jet_rounding(network, std::max(std::abs(lower), std::abs(upper)));
    // Twice the rounding error of a slope, so that the sign that the middle of a cell proves is also computed at its ends
    const double margin = 2.0 * (rounding[1] + std::numeric_limits<double>::epsilon() * std::abs(p));
    const auto slope = [&](double y) { return p + jet(network, y)[1]; };
    const auto rises_at = [&](double y) { return slope(y) > 0.0; };
    for (const double edge : {lower, upper}) {
        if (!(std::abs(slope(edge)) > margin)) {
            return std::nullopt;
        }
    }

    // Cells (intervals of positions) that are not examined yet; the cell with the lowest positions is the last element
    std::vector<Interval> cells;
    for (int k = first_cells; k > 0; --k) {
        const auto border = [&](int j) { return lower + (upper - lower) * j / first_cells; };
        cells.push_back({k == 1 ? lower : border(k - 1), k == first_cells ? upper : border(k)});
    }
    std::vector<Interval> intervals;
    bool rises = rises_at(lower);
    // If F rises at the lower end of the examined cell: lower end of the interval over which F rises up to this cell
    double start = lower;
    for (int examined = 0; !cells.empty(); ++examined) {
        const Interval cell = cells.back();
        cells.pop_back();
        const double middle = 0.5 * (cell.lower + cell.upper);
        const double radius = 0.5 * (cell.upper - cell.lower);
        const Jet at_middle = jet(network, middle);
        const double jerk = derivative_bounds(network, cell.lower, cell.upper)[3];
        const double curvature = std::abs(at_middle[2]);
        if (std::abs(p + at_middle[1]) > (curvature + rounding[2] + 0.5 * jerk * radius) * radius + margin) {
            continue;
        }
        if (curvature - rounding[2] > jerk * radius) {
            double left = cell.lower;
            double right = cell.upper;
            if (rises_at(left) == rises_at(right)) {
                continue;
            }
            double fold = middle;
            while (fold > left && fold < right) {
                (rises_at(fold) == rises ? left : right) = fold;
                fold = 0.5 * (left + right);
            }
            rises = !rises;
            if (rises) {
                start = right;
            } else {
                intervals.push_back({start, left});
            }
            continue;
        }
        if (examined >= budget) {
            return std::nullopt;
        }
        cells.push_back({middle, cell.upper});
        cells.push_back({cell.lower, middle});
    }
    if (rises) {
        intervals.push_back({start, upper});
    }
    return intervals;
}

}  // namespace palpate
