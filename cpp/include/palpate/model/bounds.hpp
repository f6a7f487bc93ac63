// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "palpate/model/parameters.hpp"
#include "palpate/model/wavelet.hpp"

namespace palpate {

/// A closed interval.
struct Interval {
    double lower = 0.0;
    double upper = 0.0;

    [[nodiscard]] double largest() const noexcept { return std::max(std::abs(lower), std::abs(upper)); }
};

namespace detail {

/// A derivative of the Mexican hat with what its range over an interval rests on.
struct HatDerivative {
    double (*value)(double u) noexcept;
    std::array<double, 5> extrema;  ///< where the next derivative vanishes
    double bound;                   ///< of its absolute value
};

/// psi' has its extrema at u^2 = 3 -+ sqrt 6 (the fifth place repeats the first).
inline const HatDerivative hat_slope{
    [](double u) noexcept { return mexican_hat(u).slope; },
    {0.7419637843027259, -0.7419637843027259, 2.3344142183389773, -2.3344142183389773, 0.7419637843027259},
    wavelet_slope_bound};

/// psi'' has its extrema at 0 and u^2 = 5 -+ sqrt 10.
inline const HatDerivative hat_curvature{
    [](double u) noexcept { return mexican_hat_curvature(u); },
    {0.0, 1.3556261799742659, -1.3556261799742659, 2.8569700138728056, -2.8569700138728056},
    wavelet_curvature_bound};

/// The exact range over [from, to].
[[nodiscard]] inline Interval range(const HatDerivative& hat, double from, double to) noexcept {
    const double first = hat.value(from);
    const double last = hat.value(to);
    Interval result{std::min(first, last), std::max(first, last)};
    for (const double u : hat.extrema) {
        if (u > from && u < to) {
            const double extreme = hat.value(u);
            result = {std::min(result.lower, extreme), std::max(result.upper, extreme)};
        }
    }
    return result;
}

/// One cell of the search: a function g known at both ends, its derivative within `rate` in between.
struct Cell {
    double from, to;
    double at_from, at_to;
    Interval rate;

    /// No function with such a derivative leaves the two cones that open from the ends.
    [[nodiscard]] Interval range() const noexcept {
        const double width = to - from;
        Interval result{std::min(at_from, at_to), std::max(at_from, at_to)};
        if (rate.lower < 0.0 && rate.upper > 0.0) {
            const double spread = rate.upper - rate.lower;
            const double rise = (at_to - at_from - rate.lower * width) / spread;
            const double fall = (at_from - at_to + rate.upper * width) / spread;
            result.upper = std::max(result.upper, at_from + rate.upper * rise);
            result.lower = std::min(result.lower, at_from + rate.lower * fall);
        }
        return result;
    }
};

/// Encloses g over [from, to] by bisection: a cell is done when it cannot raise the largest or lower the
/// smallest value seen by more than `relative` times the largest |g| seen. Cells that are still too coarse
/// when the budget ends only make the result wider, never wrong.
template <class Value, class Rate>
[[nodiscard]] Interval enclose(double from, double to, double relative, Value value, Rate rate) {
    constexpr int first_cells = 16;
    constexpr int budget = 20'000;
    std::vector<Cell> open;
    Interval seen{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
    const auto look = [&](double x) {
        const double g = value(x);
        seen = {std::min(seen.lower, g), std::max(seen.upper, g)};
        return g;
    };
    double left = from;
    double at_left = look(from);
    for (int k = 1; k <= first_cells; ++k) {
        const double right = k == first_cells ? to : from + (to - from) * k / first_cells;
        const double at_right = look(right);
        open.push_back({left, right, at_left, at_right, rate(left, right)});
        left = right;
        at_left = at_right;
    }
    Interval enclosed = seen;
    for (int cells = first_cells; !open.empty(); ++cells) {
        const Cell cell = open.back();
        open.pop_back();
        const Interval possible = cell.range();
        const double slack = relative * seen.largest();
        const double middle = 0.5 * (cell.from + cell.to);
        if ((possible.upper <= seen.upper + slack && possible.lower >= seen.lower - slack) ||
            cells >= budget || middle <= cell.from || middle >= cell.to) {
            enclosed = {std::min(enclosed.lower, possible.lower), std::max(enclosed.upper, possible.upper)};
            continue;
        }
        const double at_middle = look(middle);
        open.push_back({cell.from, middle, cell.at_from, at_middle, rate(cell.from, middle)});
        open.push_back({middle, cell.to, at_middle, cell.at_to, rate(middle, cell.to)});
    }
    return {std::min(enclosed.lower, seen.lower), std::max(enclosed.upper, seen.upper)};
}

/// Widens an interval by what rounding may have cost: 64 (N + 8) units of the sum of absolute terms. Each
/// term is right to a few units: u to 2, u^2/2 in the exponent to 4 u^2 times a hat that has fallen by then.
[[nodiscard]] inline Interval with_rounding(Interval interval, double absolute_sum,
                                            std::size_t wavelets) noexcept {
    const double margin =
        64.0 * static_cast<double>(wavelets + 8) * std::numeric_limits<double>::epsilon() * absolute_sum;
    return {interval.lower - margin, interval.upper + margin};
}

/// Sum of w alpha^order times a hat derivative over [from, to], as an interval.
[[nodiscard]] inline Interval sum_of_ranges(const NetworkParameters& network, const HatDerivative& hat,
                                            int order, double from, double to) noexcept {
    Interval sum{0.0, 0.0};
    double absolute = 0.0;
    for (std::size_t i = 0; i < network.weight.size(); ++i) {
        const double alpha = network.alpha[i];
        const double factor = network.weight[i] * (order == 1 ? alpha : alpha * alpha);
        const Interval one = range(hat, alpha * (from - network.beta[i]), alpha * (to - network.beta[i]));
        sum.lower += factor * (factor > 0.0 ? one.lower : one.upper);
        sum.upper += factor * (factor > 0.0 ? one.upper : one.lower);
        absolute += std::abs(factor) * hat.bound;
    }
    return with_rounding(sum, absolute, network.weight.size());
}

}  // namespace detail

/// Highest derivative of f that `derivative_bounds` knows.
inline constexpr std::size_t highest_derivative = 8;

/// Bounds of |f|, |f'|, ... of a network of one input over [from, to].
using DerivativeBounds = std::array<double, highest_derivative + 1>;

namespace detail {

/// Suprema of |psi^(n)|, rounded up. psi^(n) = He_{n+2} E up to its sign, so that for even n they stand at 0.
inline constexpr DerivativeBounds hat_suprema{
    1.0, wavelet_slope_bound, wavelet_curvature_bound, 5.7831, 15.0, 35.539, 105.0, 288.492, 945.0};

/// Cramer's inequality, |He_n(u)| e^{-u^2/4} <= 1.0865 sqrt(n!): what is left of psi^(n) away from its centre
/// is at most this times e^{-u^2/4}.
inline constexpr DerivativeBounds hat_tails{1.5366,  2.6614,   5.3226,   11.9021,  29.1540,
                                            77.1341, 218.1682, 654.5044, 2069.7211};

}  // namespace detail

/// Proved bounds of f and its first eight derivatives over [from, to]: the sum of what each wavelet can
/// contribute at its distance. Coarser than `value_bounds` and `slope_bounds`, but without any search.
[[nodiscard]] inline DerivativeBounds derivative_bounds(const NetworkParameters& network, double from,
                                                        double to) noexcept {
    const double c = std::abs(network.linear[0]);
    DerivativeBounds bounds{std::abs(network.bias) + c * std::max(std::abs(from), std::abs(to)), c};
    for (std::size_t i = 0; i < network.weight.size(); ++i) {
        const double alpha = network.alpha[i];
        const double beta = network.beta[i];
        const double distance = alpha * std::max({from - beta, beta - to, 0.0});
        const double decay = std::exp(-0.25 * std::min(distance * distance, 2800.0));
        double factor = std::abs(network.weight[i]);
        for (std::size_t n = 0; n <= highest_derivative; ++n) {
            bounds[n] += factor * std::min(detail::hat_suprema[n], detail::hat_tails[n] * decay);
            factor *= alpha;
        }
    }
    for (double& bound : bounds) {
        bound *= 1.0 + 1e-9;  // rounding of the sum of absolute terms
    }
    return bounds;
}

/// Proved bounds of f over [from, to] for a network of one input, at most `relative` times max|f| wider than
/// the true range (mean-value form: on every cell the range of psi' is known exactly).
[[nodiscard]] inline Interval value_bounds(const NetworkParameters& network, double from, double to,
                                           double relative = 0.01) {
    const double c = network.linear[0];
    double absolute = std::abs(network.bias) + std::abs(c) * std::max(std::abs(from), std::abs(to));
    for (const double weight : network.weight) {
        absolute += std::abs(weight);
    }
    const auto value = [&](double x) noexcept {
        double sum = c * x + network.bias;
        for (std::size_t i = 0; i < network.weight.size(); ++i) {
            sum += network.weight[i] * mexican_hat(network.alpha[i] * (x - network.beta[i])).value;
        }
        return sum;
    };
    const auto rate = [&](double a, double b) noexcept {
        const Interval sum = detail::sum_of_ranges(network, detail::hat_slope, 1, a, b);
        return Interval{sum.lower + c, sum.upper + c};
    };
    return detail::with_rounding(detail::enclose(from, to, relative, value, rate), absolute,
                                 network.weight.size());
}

/// Proved bounds of f' over [from, to], at most `relative` times max|f'| wider than the true range.
[[nodiscard]] inline Interval slope_bounds(const NetworkParameters& network, double from, double to,
                                           double relative = 0.01) {
    const double c = network.linear[0];
    double absolute = std::abs(c);
    for (std::size_t i = 0; i < network.weight.size(); ++i) {
        absolute += std::abs(network.weight[i]) * network.alpha[i] * wavelet_slope_bound;
    }
    const auto slope = [&](double x) noexcept {
        double sum = c;
        for (std::size_t i = 0; i < network.weight.size(); ++i) {
            const double alpha = network.alpha[i];
            sum += network.weight[i] * alpha * mexican_hat(alpha * (x - network.beta[i])).slope;
        }
        return sum;
    };
    const auto rate = [&](double a, double b) noexcept {
        return detail::sum_of_ranges(network, detail::hat_curvature, 2, a, b);
    };
    return detail::with_rounding(detail::enclose(from, to, relative, slope, rate), absolute,
                                 network.weight.size());
}

}  // namespace palpate
