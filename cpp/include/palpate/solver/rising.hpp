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
    const double margin = rounding[1] + std::numeric_limits<double>::epsilon() * std::abs(p);
    const auto slope = [&](double y) { return p + jet(network, y)[1]; };

    // Cells (intervals of positions) that are not examined yet; the cell with the lowest positions is the last element
    std::vector<Interval> cells;
    for (int k = first_cells; k > 0; --k) {
        const auto border = [&](int j) { return lower + (upper - lower) * j / first_cells; };
        cells.push_back({k == 1 ? lower : border(k - 1), k == first_cells ? upper : border(k)});
    }
    std::vector<Interval> intervals;
    const double first_slope = slope(lower);
    if (!(std::abs(first_slope) > margin)) {
        return std::nullopt;
    }
    bool rises = first_slope > 0.0;
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
            const double at_left = slope(left);
            const double at_right = slope(right);
            if (std::abs(at_left) > margin && std::abs(at_right) > margin) {
                if ((at_left > 0.0) == (at_right > 0.0)) {
                    continue;
                }
                double fold = middle;
                while (fold > left && fold < right) {
                    ((slope(fold) > 0.0) == (at_left > 0.0) ? left : right) = fold;
                    fold = 0.5 * (left + right);
                }
                rises = at_right > 0.0;
                if (rises) {
                    start = right;
                } else {
                    intervals.push_back({start, left});
                }
                continue;
            }
        }
        if (examined >= budget || !(radius > 1e-12 * (upper - lower))) {
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
