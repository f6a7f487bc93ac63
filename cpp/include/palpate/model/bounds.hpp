// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <queue>

#include "palpate/model/derivatives.hpp"
#include "palpate/model/parameters.hpp"

namespace palpate {

/// A closed interval of numbers, from `lower` to `upper`.
struct Interval {
    double lower = 0.0;
    double upper = 0.0;

    /// Returns the largest absolute value of a number in the interval.
    [[nodiscard]] double largest() const noexcept { return std::max(std::abs(lower), std::abs(upper)); }
    /// Returns the smallest interval that contains this interval and the interval `other`.
    [[nodiscard]] Interval with(Interval other) const noexcept {
        return {std::min(lower, other.lower), std::max(upper, other.upper)};
    }
};

namespace detail {

/// Lower and upper bound of a function g over a cell of width h, from the value and three derivatives of g at both ends
/// of the cell. The polynomial of degree 7 with these values differs from g by at most max|g^(8)| h^8 / (256 * 8!). The
/// polynomial lies between its smallest and its largest Bernstein coefficient. For wavelets that cancel to a millionth,
/// cells of a fifth of a wavelet's width are sufficient; a sum of the bounds of each wavelet would need thousands of
/// cells.
struct BoundedCell {
    double from, to;
    Jet at_from, at_to;
    Interval range;

    /// Makes a cell from the function g at both ends of the cell. `remainder` is an upper bound of |g - polynomial of
    /// the cell| plus the rounding error.
    BoundedCell(double left, double right, const Jet& at_left, const Jet& at_right, double remainder) noexcept
        : from{left}, to{right}, at_from{at_left}, at_to{at_right} {
        const Interval both = coefficients(at_from, to - from).with(coefficients(at_to, from - to));
        range = {both.lower - remainder, both.upper + remainder};
    }

    /// Orders the queue of cells: first the cell in which the absolute value of the function g may be largest.
    [[nodiscard]] bool operator<(const BoundedCell& other) const noexcept {
        return range.largest() < other.range.largest();
    }

  private:
    /// Returns the smallest and the largest of the four Bernstein coefficients that one end of the cell defines; h is
    /// the signed width of the cell.
    [[nodiscard]] static Interval coefficients(const Jet& end, double h) noexcept {
        const double first = h / 7.0 * end[1];
        const double second = h * h / 42.0 * end[2];
        const double third = h * h * h / 210.0 * end[3];
        const auto [lower, upper] = std::minmax({end[0], end[0] + first, end[0] + (2.0 * first + second),
                                                 end[0] + (3.0 * first + 3.0 * second + third)});
        return {lower, upper};
    }
};

/// One term of a sum whose bounds `enclose` computes: the derivative of order `order` of a network.
struct Term {
    const NetworkParameters& network;
    std::size_t order;  ///< 0: the term is the value of the network; 1: the first derivative
};

/// Returns proved lower and upper bounds of g, the sum of the terms, over [from, to] by bisection into cells. A cell is
/// finished if g in this cell cannot exceed the sampled values of g by more than `relative` times the largest sampled
/// |g|. The number of cells is limited; cells that are still too wide at this limit only make the bounds wider.
template <std::size_t terms>
[[nodiscard]] Interval enclose(const std::array<Term, terms>& sum, double from, double to, double relative) {
    constexpr int first_cells = 16;
    constexpr int budget = 20'000;
    constexpr double infinity = std::numeric_limits<double>::infinity();
    constexpr double epsilon = std::numeric_limits<double>::epsilon();
    const auto add = [](Jet& all, const Derivatives& one, std::size_t order) {
        for (std::size_t d = 0; d < all.size(); ++d) {
            all[d] += one[order + d];
        }
    };
    const double reach = std::max(std::abs(from), std::abs(to));
    Jet rounding{};
    for (const auto& [network, order] : sum) {
        add(rounding, derivatives_rounding(network, reach), order);
    }
    Interval sampled{infinity, -infinity};
    const auto sample = [&](double x) {
        Jet value{};
        for (const auto& [network, order] : sum) {
            add(value, derivatives(network, x), order);
        }
        sampled = sampled.with({value[0], value[0]});
        return value;
    };
    const auto cell = [&](double left, double right, const Jet& at_left, const Jet& at_right) {
        const double h = right - left;
        double eighth = 0.0;
        for (const auto& [network, order] : sum) {
            eighth += derivative_bounds(network, left, right)[order + 8];
        }
        double remainder = eighth * std::pow(h, 8) / (256.0 * 40320.0);
        // Factors that multiply the value and the derivatives of g in the Bernstein coefficients of a polynomial. An
        // error of 8 epsilon for each product covers the rounding of the sums.
        const Jet factors{1.0, 3.0 / 7.0 * h, 3.0 / 42.0 * h * h, h * h * h / 210.0};
        for (std::size_t d = 0; d < factors.size(); ++d) {
            const double size = std::max(std::abs(at_left[d]), std::abs(at_right[d]));
            remainder += factors[d] * (rounding[d] + 8.0 * epsilon * size);
        }
        return BoundedCell{left, right, at_left, at_right, remainder};
    };
    std::priority_queue<BoundedCell> open;
    double left = from;
    Jet at_left = sample(from);
    for (int k = 1; k <= first_cells; ++k) {
        const double right = k == first_cells ? to : from + (to - from) * k / first_cells;
        const Jet at_right = sample(right);
        open.push(cell(left, right, at_left, at_right));
        left = right;
        at_left = at_right;
    }
    Interval enclosed{sampled.lower - rounding[0], sampled.upper + rounding[0]};
    for (int cells = first_cells; !open.empty(); ++cells) {
        const BoundedCell one = open.top();
        open.pop();
        const Interval possible = one.range;
        const double slack = relative * sampled.largest() + 4.0 * rounding[0];
        const double middle = 0.5 * (one.from + one.to);
        if ((possible.upper <= sampled.upper + slack && possible.lower >= sampled.lower - slack) ||
            cells >= budget || middle <= one.from || middle >= one.to) {
            enclosed = enclosed.with(possible);
            continue;
        }
        const Jet at_middle = sample(middle);
        open.push(cell(one.from, middle, one.at_from, at_middle));
        open.push(cell(middle, one.to, at_middle, one.at_to));
    }
    return enclosed;
}

}  // namespace detail

/// Returns a proved lower and upper bound of the value f of a network of one input over [from, to], rounding included.
/// Unless the limit of the number of cells is reached, the bounds lie outside the true minimum and maximum of f by at
/// most `relative` times max|f|, plus rounding.
[[nodiscard]] inline Interval value_bounds(const NetworkParameters& network, double from, double to,
                                           double relative = 0.01) {
    return detail::enclose(std::array{detail::Term{network, 0}}, from, to, relative);
}

/// Returns a proved lower and upper bound of the slope f' of a network of one input over [from, to]. They are as
/// accurate as those of `value_bounds`, relative to max|f'|.
[[nodiscard]] inline Interval slope_bounds(const NetworkParameters& network, double from, double to,
                                           double relative = 0.01) {
    return detail::enclose(std::array{detail::Term{network, 1}}, from, to, relative);
}

}  // namespace palpate
