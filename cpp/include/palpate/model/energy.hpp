// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "palpate/model/force_model.hpp"
#include "palpate/model/network_curve.hpp"

namespace palpate {

/// The energies that a virtual object can hold.
struct EnergyRange {
    double least = 0.0;    ///< over all positions, continuation included; -infinity: it is a motor [J]
    double largest = 0.0;  ///< over its domain, hysteresis included [J]

    /// The most that it can give.
    [[nodiscard]] double span() const noexcept { return largest - least; }
};

namespace detail {

/// V where f passes from negative to positive between two positions, by bisection: V is flat there.
[[nodiscard]] inline double energy_of_the_rest_between(const NetworkCurve& force, double below,
                                                       double above) noexcept {
    constexpr int halvings = 60;
    for (int k = 0; k < halvings; ++k) {
        const double middle = 0.5 * (below + above);
        (force.at(middle).value < 0.0 ? below : above) = middle;
    }
    return std::min(force.at(below).integral, force.at(above).integral);
}

/// The least V on an edge line: where its force has died out if it drives the tool outward, else at the edge.
[[nodiscard]] inline double least_energy_beyond(const EdgeLine& line, double outward) noexcept {
    const Curve& edge = line.at_edge;
    const bool drives_outward = -outward * edge.value > 0.0;
    return drives_outward ? line.at(line.edge + outward * std::abs(edge.value / edge.slope)).integral
                          : edge.integral;
}

}  // namespace detail

/// The same of a force of position and velocity, at rest: by Simpson's rule, because it has no antiderivative.
[[nodiscard]] inline EnergyRange energy_range(const VelocityNetwork& force) {
    constexpr double cells_per_width = 16.0;
    constexpr double most_cells = 1e5;
    constexpr int halvings = 60;
    const auto at = [&](double x) noexcept { return force.force(x, 0.0); };
    const auto between = [&](double from, double at_from, double to, double at_to) noexcept {
        return (to - from) / 6.0 * (at_from + 4.0 * at(0.5 * (from + to)) + at_to);
    };
    const auto cells = static_cast<int>(
        std::min(most_cells, 64.0 + cells_per_width * force.travel() / force.finest_width()));
    double energy = 0.0;
    double from = force.lower();
    double at_from = at(from);
    EnergyRange range;
    for (int k = 1; k <= cells; ++k) {
        const double to = force.lower() + force.travel() * k / cells;
        const double at_to = at(to);
        if (at_from < 0.0 && at_to >= 0.0) {  // the object rests in between
            double below = from;
            double above = to;
            for (int halving = 0; halving < halvings; ++halving) {
                const double middle = 0.5 * (below + above);
                (at(middle) < 0.0 ? below : above) = middle;
            }
            range.least = std::min(range.least, energy + between(from, at_from, below, 0.0));
        }
        energy += between(from, at_from, to, at_to);
        range.least = std::min(range.least, energy);
        range.largest = std::max(range.largest, energy);
        from = to;
        at_from = at_to;
    }
    EdgeLine above = force.above();
    above.at_edge.integral = energy;
    range.least = std::min({range.least, detail::least_energy_beyond(force.below(), -1.0),
                            detail::least_energy_beyond(above, +1.0)});
    return range;
}

/// The energy range of a model of one position, or of position and velocity.
[[nodiscard]] inline EnergyRange energy_range(const ForceModel& model) {
    require_renderable(model);
    if (const VelocityNetwork* of_velocity = model.velocity()) {
        return energy_range(*of_velocity);
    }
    constexpr double cells_per_width = 16.0;
    constexpr double most_cells = 1e6;
    const HysteresisNetwork* both = model.hysteresis();
    const NetworkCurve& force = both != nullptr ? both->force() : model.network()->curve();
    const double travel = force.upper() - force.lower();
    const auto cells =
        static_cast<int>(std::min(most_cells, 64.0 + cells_per_width * travel / model.finest_width()));
    EnergyRange range{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
    double last = force.lower();
    for (int k = 0; k <= cells; ++k) {
        const double x = force.lower() + travel * k / cells;
        const Curve here = force.inside(x);
        // Bent but not sliding, a hysteresis of play radius r holds at most h r / 2 more.
        const double bent = both != nullptr ? 0.5 * both->play_radius() * both->loss().inside(x).value : 0.0;
        range.least = std::min(range.least, here.integral);
        range.largest = std::max(range.largest, here.integral + bent);
        if (k > 0 && here.value >= 0.0 && force.inside(last).value < 0.0) {
            range.least = std::min(range.least, detail::energy_of_the_rest_between(force, last, x));
        }
        last = x;
    }
    if (force.periodic()) {
        const double turn = force.inside(force.upper()).integral - force.inside(force.lower()).integral;
        if (std::abs(turn) > 1e-9 * (range.largest - range.least)) {
            range.least = -std::numeric_limits<double>::infinity();
        }
        return range;
    }
    range.least = std::min({range.least, detail::least_energy_beyond(force.below(), -1.0),
                            detail::least_energy_beyond(force.above(), +1.0)});
    return range;
}

}  // namespace palpate
