// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

namespace palpate {

/// Where one method fails along one quantity: what simulation measured, and what theory says.
struct FailureLine {
    std::string name;
    std::vector<double> at;        ///< the quantity
    std::vector<double> measured;  ///< the largest value that held; NaN: none failed
    std::vector<double> theory;    ///< NaN: nothing is known
};

/// Lines that share their axes.
struct FailureMap {
    std::string name;   ///< one word or two, for files and options
    std::string along;  ///< the quantity on the horizontal axis, with its unit
    std::string limit;  ///< what is limited, with its unit
    std::vector<FailureLine> lines;
    double searched = 0.0;  ///< where nothing failed: up to how many times the theory it was looked for
    bool linear = false;    ///< the limit spans no decades, and may be negative
};

/// Values from `first` to `last`, evenly spaced on a logarithmic axis.
[[nodiscard]] inline std::vector<double> logarithmic(double first, double last, int points) {
    std::vector<double> values;
    values.reserve(static_cast<std::size_t>(points));
    for (int k = 0; k < points; ++k) {
        values.push_back(points == 1 ? first : first * std::pow(last / first, k / (points - 1.0)));
    }
    return values;
}

/// The value in [lower, upper] up to which `fails(value)` is false and beyond which it is true, by bisection on a
/// logarithmic axis, to `relative`. NaN where nothing fails in between; `lower` where everything does.
template <class Fails>
[[nodiscard]] double failure_boundary(double lower, double upper, Fails fails, double relative = 2e-4) {
    if (!(lower > 0.0 && upper > lower)) {
        throw std::invalid_argument("a boundary is searched from " + std::to_string(lower) + " to " +
                                    std::to_string(upper) + ", must be 0 < from < to");
    }
    if (!fails(upper)) {
        return std::numeric_limits<double>::quiet_NaN();
    }
    if (fails(lower)) {
        return lower;
    }
    while (upper > lower * (1.0 + relative)) {
        const double middle = std::sqrt(lower * upper);
        (fails(middle) ? upper : lower) = middle;
    }
    return std::sqrt(lower * upper);
}

/// A line of measured boundaries: for every value of the quantity, `theory(value)` and the boundary of
/// `fails(value, limit)` around it.
template <class Theory, class Fails>
[[nodiscard]] FailureLine failure_line(std::string name, const std::vector<double>& at, Theory theory,
                                       Fails fails, double reach = 10.0) {
    FailureLine line{std::move(name), at, {}, {}};
    for (const double value : at) {
        const double expected = theory(value);
        line.theory.push_back(expected);
        line.measured.push_back(failure_boundary(expected / reach, expected * reach,
                                                 [&](double limit) { return fails(value, limit); }));
    }
    return line;
}

}  // namespace palpate
