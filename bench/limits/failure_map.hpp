// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

namespace palpate::bench {

/// One line of a failure map: limit (for example of a stiffness) as a function of one quantity (for example the
/// device damping), measured in simulation and computed by theory.
struct FailureLine {
    std::string name;
    std::vector<double> at;  ///< values of the quantity on the horizontal axis
    /// Largest tried value of the limited quantity that did not fail; NaN: no tried value failed.
    std::vector<double> measured;
    std::vector<double> theory;  ///< theoretical limit on the vertical axis; NaN: unlimited or unknown
};

/// Figure of simulated and theoretical limits: several lines with common axes.
struct FailureMap {
    std::string name;   ///< name of the map in the names of its files
    std::string along;  ///< the quantity on the horizontal axis, with its unit
    std::string limit;  ///< the quantity whose limit is drawn on the vertical axis, with its unit
    std::vector<FailureLine> lines;
    /// Largest tested value divided by the theoretical limit, for points at which no value failed.
    double searched = 0.0;
    bool linear = false;  ///< true if the vertical axis is linear, because limits may be negative
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

/// Returns the value in [lower, upper] at which `fails(value)` becomes true, by bisection on a logarithmic axis, to
/// `relative`. NaN if `upper` does not fail; `lower` if `lower` fails.
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

/// Measures a line: for every value of the quantity, `theory(value)` and the boundary of `fails(value, limit)`
/// between theory / reach and theory * reach.
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

/// Returns a failure map as JSON; a value NaN is printed as null.
[[nodiscard]] inline nlohmann::ordered_json as_json(const FailureMap& map) {
    nlohmann::ordered_json lines = nlohmann::ordered_json::array();
    for (const FailureLine& line : map.lines) {
        lines.push_back(
            {{"name", line.name}, {"at", line.at}, {"measured", line.measured}, {"theory", line.theory}});
    }
    return {{"name", map.name},         {"along", map.along},   {"limit", map.limit},
            {"searched", map.searched}, {"linear", map.linear}, {"lines", lines}};
}

}  // namespace palpate::bench
