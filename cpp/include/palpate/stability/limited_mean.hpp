// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "palpate/model/bounds.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/model/network_curve.hpp"

namespace palpate {

namespace detail {

/// Press force g + h and release force g - h of a periodic model (mean force g, hysteresis h); h is null without
/// hysteresis.
struct PeriodicStrokes {
    const NetworkCurve& g;
    const NetworkCurve* h = nullptr;
    double steepest = 0.0;  ///< proved upper bound of |g'| + |h'| (mean force g, hysteresis h) [N/m]

    /// Returns value and antiderivative of g + `side` * h + `shift` at position x (mean force g, hysteresis h); `side`
    /// is 1 for press, -1 for release.
    [[nodiscard]] std::pair<double, double> at(double x, double side, double shift) const noexcept {
        const Curve force = g.inside(x);
        const Curve hysteresis = h != nullptr ? h->inside(x) : Curve{};
        return {force.value + side * hysteresis.value + shift,
                force.integral + side * hysteresis.integral + shift * x};
    }

    /// Returns a bound of the rounding error of the mean force over one repeat length of a periodic force [N].
    [[nodiscard]] double rounding() const noexcept {
        const double reach = std::max(std::abs(g.lower()), std::abs(g.upper()));
        const auto size = [&](const NetworkParameters& network) {
            double sum = std::abs(network.bias) + std::abs(network.linear[0]) * reach;
            for (const double weight : network.weight) {
                sum += std::abs(weight);
            }
            return sum;
        };
        const double all = size(g.parameters()) + (h != nullptr ? size(h->parameters()) : 0.0);
        return 1e-12 * all * std::max(1.0, reach / (g.upper() - g.lower()));
    }
};

/// Returns proved bounds of the mean force over a period of g + side h + shift, limited to +-`limit` [N]. Cells in
/// which the force limit is certainly active at all positions, or certainly inactive at all positions, are integrated
/// exactly. Other cells are halved until their error is below rounding, or until there are too many; the error of a
/// cell of width w is at most L w^2 / 4 with the steepest slope L.
[[nodiscard]] inline Interval limited_mean(const PeriodicStrokes& strokes, double side, double shift,
                                           double limit) {
    constexpr std::size_t first_cells = 256;
    constexpr std::size_t most_cells = 100'000;
    constexpr int most_halvings = 40;
    const double lower = strokes.g.lower();
    const double period = strokes.g.upper() - lower;
    const auto at = [&](double x) { return strokes.at(x, side, shift); };
    const double whole = at(strokes.g.upper()).second - at(lower).second;
    double beyond = 0.0;  // integral over position of the part of the force that exceeds the force limit
    double uncertain = 0.0;
    if (std::isfinite(limit)) {
        std::vector<std::uint64_t> open(first_cells);
        for (std::size_t k = 0; k < first_cells; ++k) {
            open[k] = k;
        }
        double width = period / first_cells;
        for (int halving = 0; !open.empty(); ++halving, width *= 0.5) {
            std::vector<std::uint64_t> next;
            double guess = 0.0;
            for (const std::uint64_t cell : open) {
                const double from = lower + static_cast<double>(cell) * width;
                const double force = at(from + 0.5 * width).first;
                const double excess = std::abs(force) - limit;
                const double change = 0.5 * strokes.steepest * width;
                if (excess >= change) {
                    beyond += at(from + width).second - at(from).second - std::copysign(limit, force) * width;
                } else if (!(excess <= -change)) {
                    guess += std::copysign(std::max(0.0, excess), force) * width;
                    next.push_back(2 * cell);
                    next.push_back(2 * cell + 1);
                }
            }
            uncertain = 0.125 * strokes.steepest * width * width * static_cast<double>(next.size());
            if (uncertain <= 1e-15 * limit * period || next.size() > most_cells || halving == most_halvings) {
                beyond += guess;
                break;
            }
            open = std::move(next);
        }
    }
    const double mean = (whole - beyond) / period;
    return {mean - uncertain / period, mean + uncertain / period};
}

/// Returns the mean force by which a periodic model with a force limit generates energy [N]: max(0, mean c(g - h),
/// -mean c(g + h)), where c(f) is the force f limited to +-`limit`. If the result is above 0, the model generates
/// energy in each period. Values below rounding count as 0. Returns 0 for a force that is not periodic, NaN if
/// `steepest` is not finite.
[[nodiscard]] inline double active_mean(const PeriodicStrokes& strokes, double limit, double shift = 0.0) {
    if (!strokes.g.periodic()) {
        return 0.0;
    }
    if (!std::isfinite(strokes.steepest)) {
        return std::numeric_limits<double>::quiet_NaN();
    }
    const double excess = std::max(limited_mean(strokes, -1.0, shift, limit).upper,
                                   -limited_mean(strokes, 1.0, shift, limit).lower);
    return excess <= strokes.rounding() ? 0.0 : excess;
}

/// Returns the constant force [N] with the smallest absolute value that must be added to a periodic model so that it
/// does not generate energy in a period. The mean of the limited force never decreases if this constant increases, and
/// it is zero for one constant.
[[nodiscard]] inline double passive_shift(const PeriodicStrokes& strokes, double limit) {
    if (active_mean(strokes, limit) == 0.0) {
        return 0.0;
    }
    // Direction of motion in which the model generates energy: release if the mean of g - h is above 0, press if the
    // mean of g + h is below 0.
    const double side = limited_mean(strokes, -1.0, 0.0, limit).upper > 0.0 ? -1.0 : 1.0;
    const auto is_active = [&](double shift) {
        const Interval mean = limited_mean(strokes, side, side * shift, limit);
        return side * (mean.lower + mean.upper) < 0.0;
    };
    double low = 0.0;
    double high = active_mean(strokes, limit);
    while (is_active(high)) {
        low = high;
        high *= 2.0;
    }
    constexpr int halvings = 1100;  // halvings after which no double lies between `low` and `high`
    for (int k = 0; k < halvings; ++k) {
        const double middle = 0.5 * (low + high);
        if (!(middle > low && middle < high)) {
            break;
        }
        (is_active(middle) ? low : high) = middle;
    }
    return side * high;
}

}  // namespace detail

}  // namespace palpate
