// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "palpate/fields/readable.hpp"
#include "palpate/model/force_model.hpp"

// Definitions of the functions of ForceModel that make, copy and check models.
namespace palpate {

namespace detail {

[[nodiscard]] inline ForceModel::Kind kind_of(NetworkParameters network, Domain domain) {
    if (network.dimension == 1) {
        return WaveletNetwork{network, std::move(domain)};
    }
    return RadialNetwork{std::move(network), std::move(domain)};
}

[[nodiscard]] inline HysteresisNetwork kind_of(const NetworkParameters& network,
                                               const HysteresisParameters& hysteresis, const Domain& domain,
                                               std::optional<double> play_radius) {
    require(domain.lower.size() == 1 && domain.upper.size() == 1, "a hysteresis network has one input");
    const double radius =
        play_radius.value_or(usual_play_radius(std::abs(domain.upper[0] - domain.lower[0])));
    return {network, hysteresis, domain, radius};
}

}  // namespace detail

PALPATE_INLINE ForceModel::ForceModel(NetworkParameters network, Domain domain)
    : kind_{detail::kind_of(std::move(network), std::move(domain))} {}

PALPATE_INLINE ForceModel::ForceModel(const NetworkParameters& network,
                                      const HysteresisParameters& hysteresis, const Domain& domain,
                                      std::optional<double> play_radius)
    : kind_{detail::kind_of(network, hysteresis, domain, play_radius)}, play_radius_{play_radius} {}

PALPATE_INLINE ForceModel::ForceModel(Kind kind) : kind_{std::move(kind)} {}
PALPATE_INLINE ForceModel::ForceModel(const ForceModel&) = default;
PALPATE_INLINE ForceModel::ForceModel(ForceModel&&) noexcept = default;
PALPATE_INLINE ForceModel& ForceModel::operator=(const ForceModel&) = default;
PALPATE_INLINE ForceModel& ForceModel::operator=(ForceModel&&) noexcept = default;
PALPATE_INLINE ForceModel::~ForceModel() = default;

PALPATE_INLINE ForceModel ForceModel::of_velocity(NetworkParameters network, Domain domain) {
    return ForceModel{VelocityNetwork{std::move(network), std::move(domain)}};
}

PALPATE_INLINE Interval ForceModel::slope_bounds(std::optional<double> radius) const {
    if (const WaveletNetwork* single = network()) {
        return single->curve().slope_bounds();
    }
    if (velocity() != nullptr) {
        return velocity()->resting_bounds(0.01).gradient[0];
    }
    require_one_input(parameters());
    const Interval common = hysteresis()->force().slope_bounds();
    const double hysteresis_slope = hysteresis()->hysteresis_force().slope_bounds().largest();
    const double sticking_slope =
        radius ? hysteresis()->hysteresis_force().value_bounds().largest() / *radius : 0.0;
    return {common.lower - hysteresis_slope, common.upper + hysteresis_slope + sticking_slope};
}

PALPATE_INLINE void ForceModel::require_slopes_within(Interval stored) const {
    if (parameters().dimension != 1) {
        return;
    }
    const Interval slopes = slope_bounds();
    const double slack = 0.01 * slopes.largest();
    const auto sentence = [](const char* name, double value, const char* side, double bound) {
        return std::string("slope_bounds.") + name + " is " + readable(value) + ": must be " + side + " " +
               readable(bound) + ", the bound of this network's slope";
    };
    detail::require(stored.lower <= slopes.lower + slack,
                    sentence("min", stored.lower, "at most", slopes.lower));
    detail::require(stored.upper >= slopes.upper - slack,
                    sentence("max", stored.upper, "at least", slopes.upper));
}

PALPATE_INLINE ForceModel ForceModel::with_memory(MemoryParameters parameters) const {
    detail::require(network() != nullptr, "only a force of position without hysteresis can have a memory");
    ForceModel model = *this;
    model.memory_.emplace(std::move(parameters), network()->curve(), domain());
    return model;
}

PALPATE_INLINE ForceModel ForceModel::with_play_radius(double radius) const {
    const HysteresisNetwork* both = hysteresis();
    if (both == nullptr) {
        return *this;
    }
    const NetworkParameters& h = both->hysteresis_force().parameters();
    return ForceModel{both->parameters(), {h.weight, h.linear[0], h.bias}, both->domain(), radius}.with_units(
        units_);
}

PALPATE_INLINE ForceModel ForceModel::with_units(ModelUnits units) const {
    ForceModel model = *this;
    model.units_ = std::move(units);
    return model;
}

}  // namespace palpate
