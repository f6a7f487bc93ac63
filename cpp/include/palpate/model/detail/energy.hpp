// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "palpate/model/detail/limited_energy.hpp"
#include "palpate/model/energy.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/model/network_curve.hpp"

// Definition of energy_range.
namespace palpate {

PALPATE_INLINE EnergyRange energy_range(const VelocityNetwork& force, double force_limit) {
    const auto at = [&](double x) noexcept {
        return Curve{.value = std::clamp(force.force(x, 0.0), -force_limit, force_limit)};
    };
    const auto work = [&](double from, double at_from, double to, double at_to) noexcept {
        return (to - from) / 6.0 * (at_from + 4.0 * at(0.5 * (from + to)).value + at_to);
    };
    const std::size_t cells = detail::energy_cells(force.travel(), force.finest_width());
    double energy = 0.0;
    double from = force.lower();
    double at_from = at(from).value;
    EnergyRange range;
    for (std::size_t k = 1; k <= cells; ++k) {
        const double to =
            force.lower() + force.travel() * static_cast<double>(k) / static_cast<double>(cells);
        const double at_to = at(to).value;
        if (at_from < 0.0 && at_to >= 0.0) {
            const double rest = detail::rest_between(at, from, to);
            range.least = std::min(range.least, energy + work(from, at_from, rest, 0.0));
        }
        energy += work(from, at_from, to, at_to);
        range.least = std::min(range.least, energy);
        range.largest = std::max(range.largest, energy);
        from = to;
        at_from = at_to;
    }
    const double steepest = force.resting_bounds(0.01).gradient[0].largest();
    const double width = force.travel() / static_cast<double>(cells);
    // As in `limited_energy`, the energy between two samples lies outside the sampled values by at most L w^2 / 4.
    range.missed = (5.0 / 36.0 * static_cast<double>(cells) + 0.25) * steepest * width * width;
    range.least = std::min({range.least, -detail::decrease_beyond(force.below(), -1.0, force_limit),
                            energy - detail::decrease_beyond(force.above(), +1.0, force_limit)});
    return range;
}

PALPATE_INLINE EnergyRange energy_range(const ForceModel& model, double force_limit) {
    require_renderable(model);
    if (const VelocityNetwork* of_velocity = model.velocity()) {
        return energy_range(*of_velocity, force_limit);
    }
    const HysteresisNetwork* pair = model.hysteresis();
    const NetworkCurve& force = pair != nullptr ? pair->force() : model.network()->curve();
    const std::size_t cells = detail::energy_cells(force.upper() - force.lower(), model.finest_width());
    const detail::LimitedEnergy energy =
        detail::limited_energy([&](double x) noexcept { return force.inside(x); }, force.lower(),
                               force.upper(), cells, force.slope_bounds().largest(), force_limit);
    EnergyRange range = energy.range;
    if (pair != nullptr) {
        // With hysteresis the object stores more by at most r max h / 2: the work of the hysteresis force s h while the
        // direction state s grows from 0 to 1 over the play radius r.
        range.largest +=
            0.5 * pair->play_radius() * std::max(0.0, pair->hysteresis_force().value_bounds().upper);
    }
    if (const MemoryNetwork* memory = model.memory()) {
        range.largest += memory->largest_energy();
    }
    if (force.periodic()) {
        if (std::abs(energy.at_upper - energy.at_lower) > 1e-9 * (range.largest - range.least)) {
            range.least = -std::numeric_limits<double>::infinity();
        }
        return range;
    }
    range.least =
        std::min({range.least, energy.at_lower - detail::decrease_beyond(force.below(), -1.0, force_limit),
                  energy.at_upper - detail::decrease_beyond(force.above(), +1.0, force_limit)});
    return range;
}

}  // namespace palpate
