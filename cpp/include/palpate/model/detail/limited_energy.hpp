// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "palpate/model/energy.hpp"
#include "palpate/model/network_curve.hpp"

namespace palpate::detail {

/// Returns the energy that a force limit removes between two positions [J]: the integral of f - c(f), where c(f) is the
/// force f limited to +-`limit`. `at(x)` returns force and antiderivative at x. The interval is halved until |f| is at
/// most `limit` at both ends, or exceeds `limit` with the same sign at both ends, but at most `halvings` times.
template <class At>
[[nodiscard]] double work_beyond(const At& at, double from, const Curve& at_from, double to,
                                 const Curve& at_to, double limit, int halvings = 40) noexcept {
    const auto side = [&](double force) noexcept { return force > limit ? 1 : force < -limit ? -1 : 0; };
    const int first = side(at_from.value);
    if (first == side(at_to.value) || halvings == 0) {
        return first == 0 ? 0.0 : at_to.integral - at_from.integral - first * limit * (to - from);
    }
    const double middle = 0.5 * (from + to);
    const Curve at_middle = at(middle);
    return work_beyond(at, from, at_from, middle, at_middle, limit, halvings - 1) +
           work_beyond(at, middle, at_middle, to, at_to, limit, halvings - 1);
}

/// Finds by bisection the position between `below` and `above` at which the force f changes from negative to positive:
/// the position of smallest energy.
template <class At>
[[nodiscard]] double rest_between(const At& at, double below, double above) noexcept {
    constexpr int halvings = 60;
    for (int k = 0; k < halvings; ++k) {
        const double middle = 0.5 * (below + above);
        (at(middle).value < 0.0 ? below : above) = middle;
    }
    return below;
}

/// Returns the decrease of the stored energy of the limited force outside an edge of the domain [J]. It is the work of
/// a force that pushes the tool out of the domain, up to the position at which the straight line of the force reaches
/// zero.
[[nodiscard]] inline double decrease_beyond(const EdgeLine& line, double outward, double limit) noexcept {
    const double force = std::abs(line.at_edge.value);
    if (!(-outward * line.at_edge.value > 0.0)) {
        return 0.0;
    }
    const double within = std::min(force, limit);
    return (force - 0.5 * within) * within / std::abs(line.at_edge.slope);
}

/// Smallest and largest stored energy of a force with a force limit over a domain, and the stored energy at both ends
/// of the domain [J].
struct LimitedEnergy {
    EnergyRange range;
    double at_lower = 0.0;
    double at_upper = 0.0;
};

/// Computes the stored energy of a limited force over a domain: the energy of the force f minus the energy that the
/// force limit removes. f is sampled at the borders of cells of width w; L is the largest |f'|. Let |f| be below the
/// force limit at both ends of a cell, or above it with the same sign. Then f can cross the force limit between the
/// samples only if f at one end differs from it by at most L w / 2. Such a crossing changes the energy by at most L w^2
/// / 4. Between the ends of a cell and the position of zero force, the energy lies outside its sampled values by less
/// than L w^2 / 4.
template <class At>
[[nodiscard]] LimitedEnergy limited_energy(const At& at, double lower, double upper, std::size_t cells,
                                           double steepest, double limit) noexcept {
    const double width = (upper - lower) / static_cast<double>(cells);
    const double missed_between_samples = 0.25 * steepest * width * width;
    double from = lower;
    Curve at_from = at(lower);
    LimitedEnergy energy{
        {at_from.integral, at_from.integral, missed_between_samples}, at_from.integral, at_from.integral};
    double beyond = 0.0;
    for (std::size_t k = 1; k <= cells; ++k) {
        const double to = lower + (upper - lower) * static_cast<double>(k) / static_cast<double>(cells);
        const Curve at_to = at(to);
        if (at_from.value < 0.0 && at_to.value >= 0.0) {
            const double rest = rest_between(at, from, to);
            const Curve at_rest = at(rest);
            const double energy_at_rest =
                at_rest.integral - beyond - work_beyond(at, from, at_from, rest, at_rest, limit);
            energy.range.least = std::min(energy.range.least, energy_at_rest);
        }
        const auto is_near = [&](const Curve& end) noexcept {
            return std::abs(std::abs(end.value) - limit) <= 0.5 * steepest * width;
        };
        energy.range.missed += is_near(at_from) || is_near(at_to) ? missed_between_samples : 0.0;
        beyond += work_beyond(at, from, at_from, to, at_to, limit);
        energy.at_upper = at_to.integral - beyond;
        energy.range.least = std::min(energy.range.least, energy.at_upper);
        energy.range.largest = std::max(energy.range.largest, energy.at_upper);
        from = to;
        at_from = at_to;
    }
    return energy;
}

/// Returns the number of cells into which the domain is divided to compute the energy of a model: 1024, plus 16 for
/// each width of the finest wavelet that fits in the domain; at most 10^6.
[[nodiscard]] inline std::size_t energy_cells(double travel, double finest_width) noexcept {
    constexpr double fewest = 1024.0;
    constexpr double most = 1e6;
    return static_cast<std::size_t>(std::min(most, fewest + 16.0 * travel / finest_width));
}

}  // namespace palpate::detail
