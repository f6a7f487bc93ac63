// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "palpate/model/hysteresis.hpp"
#include "palpate/model/network_curve.hpp"
#include "palpate/model/parameters.hpp"

namespace palpate {

/// Interval of positions outside the domain over which a force is a straight line.
struct OuterLine {
    double length;  ///< length of the interval; infinity for the outermost line [m]
    double slope;   ///< slope of the line [N/m]
};

/// A force over all positions: a network inside the domain, and outside the domain either straight lines or, for a
/// periodic force, the network repeated.
struct PiecewiseForce {
    NetworkParameters network;
    double lower = 0.0;
    double upper = 0.0;
    bool periodic = false;
    /// Straight lines of the force below the domain, the line nearest to the domain first
    std::vector<OuterLine> below;
    /// Straight lines of the force above the domain, the line nearest to the domain first
    std::vector<OuterLine> above;
};

namespace detail {

/// Returns the straight lines of a force outside one edge of the domain, the nearest first. `slope_at(x)` returns the
/// slope of the force, which may change at each distance from the edge in `reaches`.
template <class Slope>
[[nodiscard]] std::vector<OuterLine> outer_lines(double edge, double outward, std::vector<double> reaches,
                                                 Slope slope_at) {
    std::sort(reaches.begin(), reaches.end());
    std::vector<OuterLine> lines;
    double from = 0.0;
    for (const double reach : reaches) {
        if (reach > from && reach < std::numeric_limits<double>::infinity()) {
            lines.push_back({reach - from, slope_at(edge + outward * 0.5 * (from + reach))});
            from = reach;
        }
    }
    lines.push_back({std::numeric_limits<double>::infinity(), slope_at(edge + outward * (2.0 * from + 1.0))});
    return lines;
}

}  // namespace detail

/// Returns the force of a network over all positions: its parameters, and its straight lines outside the domain.
[[nodiscard]] inline PiecewiseForce piecewise(const NetworkCurve& curve) {
    PiecewiseForce force{curve.parameters(), curve.lower(), curve.upper(), curve.periodic(), {}, {}};
    if (!force.periodic) {
        const auto lines = [](const EdgeLine& line, double outward) {
            return detail::outer_lines(line.edge, outward, {line.reach},
                                       [&](double x) { return line.at(x).slope; });
        };
        force.below = lines(curve.below(), -1.0);
        force.above = lines(curve.above(), +1.0);
    }
    return force;
}

/// Returns the force g + s h (mean force g, hysteresis h) over all positions for a fixed direction state s: 1 for
/// press, -1 for release.
[[nodiscard]] inline PiecewiseForce piecewise(const HysteresisNetwork& pair, double s) {
    const NetworkCurve& g = pair.force();
    const NetworkCurve& h = pair.hysteresis_force();
    PiecewiseForce force{g.parameters(), g.lower(), g.upper(), g.periodic(), {}, {}};
    for (std::size_t i = 0; i < force.network.weight.size(); ++i) {
        force.network.weight[i] += s * h.parameters().weight[i];
    }
    force.network.linear[0] += s * h.parameters().linear[0];
    force.network.bias += s * h.parameters().bias;
    if (!force.periodic) {
        const auto lines = [s](const EdgeLine& of_g, const EdgeLine& of_h, double outward) {
            return detail::outer_lines(of_g.edge, outward, {of_g.reach, of_h.reach},
                                       [&](double x) { return of_g.at(x).slope + s * of_h.at(x).slope; });
        };
        force.below = lines(g.below(), h.below(), -1.0);
        force.above = lines(g.above(), h.above(), +1.0);
    }
    return force;
}

/// Returns the hysteresis h over all positions, over the same intervals as the mean force.
[[nodiscard]] inline PiecewiseForce piecewise_hysteresis(const HysteresisNetwork& pair) {
    PiecewiseForce hysteresis = piecewise(pair, 0.0);
    hysteresis.network = pair.hysteresis_force().parameters();
    const PiecewiseForce press = piecewise(pair, 1.0);
    const auto subtract = [](std::vector<OuterLine>& slopes, const std::vector<OuterLine>& of_press) {
        for (std::size_t k = 0; k < slopes.size(); ++k) {
            slopes[k].slope = of_press[k].slope - slopes[k].slope;
        }
    };
    subtract(hysteresis.below, press.below);
    subtract(hysteresis.above, press.above);
    return hysteresis;
}

/// Returns the force multiplied by `factor` at all positions.
[[nodiscard]] inline PiecewiseForce scaled(PiecewiseForce force, double factor) {
    for (double& weight : force.network.weight) {
        weight *= factor;
    }
    force.network.linear[0] *= factor;
    force.network.bias *= factor;
    for (auto* side : {&force.below, &force.above}) {
        for (OuterLine& line : *side) {
            line.slope *= factor;
        }
    }
    return force;
}

}  // namespace palpate
