// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <utility>

#include "palpate/fields/field_table.hpp"
#include "palpate/model/bounds.hpp"
#include "palpate/model/derivatives.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/stability/limited_mean.hpp"
#include "palpate/stability/proved_maximum.hpp"

namespace palpate {

/// Bounds of a memory over all positions: branches of stiffness k_j and time constant tau_j, ratio p with |p| <= P and
/// |p'| <= P', stretches |e_j| <= U_j. U_j is the range of the coordinate, or the yield stretch if it is smaller.
struct MemoryBounds {
    double stiffness = 0.0;  ///< P^2 sum_j k_j, the largest stiffness of the branches [N/m]
    double bending = 0.0;    ///< P' sum_j k_j U_j, the largest slope by a change of the ratio [N/m]
    double bending_per_m =
        0.0;  ///< P P' sum_j k_j, largest increase of `bending` for each metre of U_j [N/m^2]
    double relaxation_per_s =
        0.0;  ///< P^2 sum_j k_j / tau_j, largest decrease of the stiffness by time [N/(m*s)]
};

/// Bounds of the change of a slope over all positions, continuations included: |f'(x) - f'(y)| <= curvature |x - y| +
/// jump.
struct BendBounds {
    double curvature =
        std::numeric_limits<double>::infinity();  ///< C, max |f''| where f' is continuous [N/m^2]
    double jump = 0.0;  ///< J, sum of the jumps of f' at the ends of domain and continuation [N/m]
};

/// Proved bounds of a model's force over all positions, continuations included. The bounds of a force with memory are
/// those at rest, and those of its branches (`memory`). A force with hysteresis is f = g + s h
/// (mean force g, hysteresis h, direction state s, play radius r). Its slope is g' + s h', plus h/r while the play
/// operator does not move (sticks).
struct ForceBounds {
    Interval slope;
    double steepest = 0.0;
    double sliding = 0.0;
    Interval hysteresis_force;
    double hysteresis_per_play = 0.0;
    double mean_force = 0.0;
    double drag = 0.0;
    double force_error = 0.0;
    bool hysteresis = false;
    std::optional<MemoryBounds> memory = std::nullopt;
    std::optional<BendBounds> bend = std::nullopt;

    /// Returns M = max(0, max f'), the steepest rising slope [N/m]; NaN stays NaN.
    [[nodiscard]] double rising() const noexcept { return slope.upper <= 0.0 ? 0.0 : slope.upper; }
    /// Returns s_ = max(0, -min f'), the steepest falling slope [N/m]; NaN stays NaN.
    [[nodiscard]] double falling() const noexcept { return slope.lower >= 0.0 ? 0.0 : -slope.lower; }

    /// Returns the play radius r [m]: the largest hysteresis h divided by the largest h/r. Returns infinity for a model
    /// without hysteresis.
    [[nodiscard]] double play_radius() const noexcept {
        return hysteresis_per_play > 0.0 ? hysteresis_force.upper / hysteresis_per_play
                                         : std::numeric_limits<double>::infinity();
    }
};

template <>
inline constexpr auto fields_of<ForceBounds> = FieldTable{
    Field<&ForceBounds::slope, &Interval::lower>{
        "slope_min", "Smallest slope of the force [N/m]: min f', or min(g' - |h'|)."},
    Field<&ForceBounds::slope, &Interval::upper>{
        "slope_max", "Largest slope of the force [N/m]: max f', or max(g' + |h'| + h/r)."},
    Field<&ForceBounds::steepest>{"steepest",
                                  "Steepest slope [N/m]: L = max |f'|, or max(|g'| + |h'| + h/r)."},
    Field<&ForceBounds::sliding>{"sliding", "max |f'|, or max(|g'| + |h'|), over all velocities."},
    Field<&ForceBounds::hysteresis_force, &Interval::lower>{
        "loss_min", "Smallest hysteresis h [N]; 0 for a force without hysteresis."},
    Field<&ForceBounds::hysteresis_force, &Interval::upper>{
        "loss_max", "Largest hysteresis h [N]; 0 for a force without hysteresis."},
    Field<&ForceBounds::hysteresis_per_play>{"loss_per_play",
                                             "Largest slope h/r that the play operator adds, max h/r [N/m]."},
    Field<&ForceBounds::mean_force>{"mean_force",
                                    "Mean of a limited periodic force above its hysteresis [N]; 0: passive."},
    Field<&ForceBounds::drag>{"drag", "B_v = max |f(x, v) - f(x, 0)| / |v|; 0 for a force of position alone.",
                              Rule::NotNegative},
    Field<&ForceBounds::force_error>{
        "force_error",
        "epsilon, largest difference of the rendered force from the force with these bounds [N]; 0 unless\n"
        "another program renders the model.",
        Rule::NotNegative, false},
    Field<&ForceBounds::hysteresis>{"hysteresis", "True if the model has hysteresis.", Rule::Any, false}};

/// Returns true if every bound of the force is finite. A model with an infinite bound cannot be certified.
[[nodiscard]] inline bool finite(const ForceBounds& bounds) noexcept {
    bool all = true;
    for_each_field<ForceBounds>(
        [&](const auto& field) { all = all && std::isfinite(static_cast<double>(field.of(bounds))); });
    return all;
}

/// Returns K_c k / (K_c + k), the slope of the rendered force for a virtual object of slope k > -K_c behind a virtual
/// coupling of stiffness K_c [N/m].
[[nodiscard]] inline double slope_behind_coupling(double slope, double coupling_stiffness) noexcept {
    return coupling_stiffness * slope / (coupling_stiffness + slope);
}

/// Returns the bounds of a compensated force without hysteresis; its slopes are K_c f' / (K_c - f') for the slopes f' <
/// K_c of the model, otherwise infinite.
[[nodiscard]] inline ForceBounds compensated(const ForceBounds& bounds, double coupling_stiffness) noexcept {
    const auto hardened = [&](double slope) {
        return slope < coupling_stiffness ? -slope_behind_coupling(-slope, coupling_stiffness)
                                          : std::numeric_limits<double>::infinity();
    };
    ForceBounds result = bounds;
    result.slope = {hardened(bounds.slope.lower), hardened(bounds.slope.upper)};
    result.steepest = result.sliding = result.slope.largest();
    return result;
}

namespace detail {

/// Accuracy of the bounds of a slope for a force of position and velocity. It is coarser than `slope_slack`, because two
/// inputs need many more cells.
inline constexpr double velocity_slack = 1e-3;

/// Coefficients a, b, c of the slope a g' + b h' + c h of a force with hysteresis (mean force g, hysteresis h).
struct SlopeReading {
    double of_force_slope = 1.0;       ///< a
    double of_hysteresis_slope = 0.0;  ///< b
    double of_hysteresis = 0.0;        ///< c
};

/// Returns proved bounds of the slope a g' + b h' + c h over [from, to] with the coefficients in `reading`. g and h
/// have the same wavelets.
[[nodiscard]] inline Interval reading_bounds(const NetworkParameters& force,
                                             const NetworkParameters& hysteresis, const SlopeReading& reading,
                                             double from, double to, double relative = slope_slack) {
    NetworkParameters slope_of = force;
    NetworkParameters value_of = hysteresis;
    for (std::size_t i = 0; i < force.weight.size(); ++i) {
        slope_of.weight[i] =
            reading.of_force_slope * force.weight[i] + reading.of_hysteresis_slope * hysteresis.weight[i];
        value_of.weight[i] = reading.of_hysteresis * hysteresis.weight[i];
    }
    slope_of.linear[0] =
        reading.of_force_slope * force.linear[0] + reading.of_hysteresis_slope * hysteresis.linear[0];
    value_of.linear[0] = reading.of_hysteresis * hysteresis.linear[0];
    value_of.bias = reading.of_hysteresis * hysteresis.bias;
    return enclose(std::array{Term{slope_of, 1}, Term{value_of, 0}}, from, to, relative);
}

/// Returns proved bounds of the hysteresis h. They are computed again with 1e-6 instead of 1e-4 relative error if the
/// first lower bound is negative. An identified h >= 0 has a minimum near 0, small compared with its largest value.
[[nodiscard]] inline Interval hysteresis_force_bounds(const NetworkParameters& hysteresis, double from,
                                                      double to) {
    Interval bounds;
    for (const double relative : {1e-4, 1e-6}) {
        bounds = value_bounds(hysteresis, from, to, relative);
        if (bounds.lower >= 0.0) {
            break;
        }
    }
    return bounds;
}

/// Returns proved bounds of a force of position without hysteresis, continuations included.
[[nodiscard]] inline ForceBounds static_bounds(const NetworkCurve& curve, double force_limit) {
    ForceBounds bounds;
    bounds.slope = curve.slopes_everywhere();
    bounds.steepest = bounds.sliding = bounds.slope.largest();
    bounds.mean_force = active_mean(PeriodicStrokes{curve, nullptr, bounds.sliding}, force_limit);
    return bounds;
}

/// Returns proved bounds of a force with hysteresis for the play radius `radius` [m], continuations included.
[[nodiscard]] inline ForceBounds hysteresis_bounds(const HysteresisNetwork& pair, double radius,
                                                   double force_limit) {
    const NetworkCurve& g = pair.force();
    const NetworkCurve& h = pair.hysteresis_force();
    const auto over_domain = [&](double a, double b, double c) {
        return reading_bounds(g.parameters(), h.parameters(), {a, b, c}, g.lower(), g.upper());
    };
    constexpr double infinite = std::numeric_limits<double>::infinity();
    ForceBounds bounds;
    bounds.hysteresis = true;
    bounds.slope = {infinite, -infinite};
    for (const double s : {-1.0, 1.0}) {
        const Interval slide = over_domain(1.0, s, 0.0);
        const double rising_stick = over_domain(1.0, s, 1.0 / radius).upper;
        const double falling_stick = over_domain(-1.0, s, 1.0 / radius).upper;
        bounds.slope = {std::min(bounds.slope.lower, slide.lower),
                        std::max({bounds.slope.upper, slide.upper, rising_stick})};
        bounds.sliding = std::max(bounds.sliding, slide.largest());
        bounds.steepest = std::max({bounds.steepest, slide.largest(), rising_stick, falling_stick});
    }
    bounds.hysteresis_force = hysteresis_force_bounds(h.parameters(), g.lower(), g.upper());
    if (!g.periodic()) {
        for (const auto& [line, hysteresis] :
             {std::pair{g.below(), h.below()}, std::pair{g.above(), h.above()}}) {
            const Interval slopes = line_slopes(line);
            const double hysteresis_slope = std::abs(hysteresis.at_edge.slope);
            if (std::isfinite(hysteresis.reach)) {  // outside the domain the hysteresis decreases to zero
                bounds.hysteresis_force.lower = std::min(bounds.hysteresis_force.lower, 0.0);
            }
            const double stick = std::max(0.0, hysteresis.at_edge.value) / radius;
            const double rounding = 1e-12 * (slopes.largest() + hysteresis_slope + stick);
            const double slide = slopes.largest() + hysteresis_slope + rounding;
            bounds.slope = {std::min(bounds.slope.lower, slopes.lower - hysteresis_slope - rounding),
                            std::max(bounds.slope.upper, slopes.upper + hysteresis_slope + stick + rounding)};
            bounds.sliding = std::max(bounds.sliding, slide);
            bounds.steepest = std::max(bounds.steepest, slide + stick);
        }
    }
    bounds.hysteresis_per_play = std::max(0.0, bounds.hysteresis_force.upper) / radius;
    bounds.mean_force = active_mean(PeriodicStrokes{g, &h, bounds.sliding}, force_limit);
    return bounds;
}

/// Returns proved bounds of a force of position and velocity: its slope at velocity zero, continuations included, and
/// over all velocities its slopes by position (`sliding`) and by velocity (`drag`).
[[nodiscard]] inline ForceBounds velocity_bounds(const VelocityNetwork& force) {
    const RadialBounds rest = force.resting_bounds(velocity_slack);
    const RadialBounds moving = force.moving_bounds(velocity_slack);
    ForceBounds bounds;
    bounds.slope = rest.gradient[0];
    for (const EdgeLine& line : {force.below(), force.above()}) {
        bounds.slope = bounds.slope.with(line_slopes(line));
    }
    bounds.steepest = bounds.slope.largest();
    bounds.sliding = std::max(bounds.steepest, moving.gradient[0].largest());
    bounds.drag = moving.gradient[1].largest();
    return bounds;
}

}  // namespace detail

/// Returns proved bounds of the memory of a model; nothing for a model without memory.
[[nodiscard]] inline std::optional<MemoryBounds> memory_bounds(const ForceModel& model) {
    const MemoryNetwork* memory = model.memory();
    if (memory == nullptr) {
        return std::nullopt;
    }
    const double ratio = memory->largest_ratio();
    MemoryBounds bounds;
    for (std::size_t j = 0; j < memory->parameters().stiffness.size(); ++j) {
        const double k = memory->parameters().stiffness[j];
        bounds.stiffness += ratio * ratio * k;
        bounds.bending += memory->largest_stretch(j) * memory->steepest_ratio() * k;
        bounds.bending_per_m += ratio * memory->steepest_ratio() * k;
        bounds.relaxation_per_s += ratio * ratio * k / memory->parameters().time_constant_s[j];
    }
    return bounds;
}

namespace detail {

/// Returns the sum of the jumps of the slope of a curve at the ends of its domain and of its continuation [N/m].
[[nodiscard]] inline double slope_jumps(const NetworkCurve& curve) noexcept {
    const double first = curve.inside(curve.lower()).slope;
    const double last = curve.inside(curve.upper()).slope;
    if (curve.periodic()) {
        return std::abs(last - first);
    }
    double jumps = 0.0;
    for (const auto& [line, slope] : {std::pair{curve.below(), first}, std::pair{curve.above(), last}}) {
        // A line of no length is a jump from the domain to zero slope
        const double begin = line.reach > 0.0 ? line.at_edge.slope : 0.0;
        jumps += std::abs(begin - slope) + (std::isfinite(line.reach) ? std::abs(begin) : 0.0);
    }
    return jumps;
}

/// Returns a proved upper bound of |f''| of a network over [from, to] [N/m^2]. Over a cell of width h, |f''| is at most
/// its larger value at an end of the cell plus h^2 / 8 times the largest fourth derivative.
[[nodiscard]] inline double curvature_bound(const NetworkParameters& network, double from, double to) {
    const double rounding = derivatives_rounding(network, std::max(std::abs(from), std::abs(to)))[2];
    const double size = derivative_bounds(network, from, to)[2];
    return rounding + proved_maximum(from, to, 1e-3 * size, [&](double low, double high) {
               const double ends =
                   std::max(std::abs(derivatives(network, low)[2]), std::abs(derivatives(network, high)[2]));
               const double h = high - low;
               return ends + (h > 0.0 ? derivative_bounds(network, low, high)[4] * h * h / 8.0 : 0.0);
           });
}

}  // namespace detail

/// Returns proved bounds of the change of the slope of a model of position without hysteresis and memory; nothing for
/// other models.
[[nodiscard]] inline std::optional<BendBounds> bend_bounds(const ForceModel& model) {
    const WaveletNetwork* network = model.network();
    if (network == nullptr || model.memory() != nullptr) {
        return std::nullopt;
    }
    const NetworkCurve& curve = network->curve();
    return BendBounds{detail::curvature_bound(curve.parameters(), curve.lower(), curve.upper()),
                      detail::slope_jumps(curve)};
}

/// Returns proved bounds of the force of a model of position, or of position and velocity, on a device with this force
/// limit [N]. A `play_radius` above 0 replaces the play radius of the model [m]. Throws std::invalid_argument for
/// models with other inputs.
[[nodiscard]] inline ForceBounds force_bounds(const ForceModel& model, double play_radius = 0.0,
                                              double force_limit = std::numeric_limits<double>::infinity()) {
    require_renderable(model);
    if (const VelocityNetwork* force = model.velocity()) {
        return detail::velocity_bounds(*force);
    }
    if (const WaveletNetwork* network = model.network()) {
        ForceBounds bounds = detail::static_bounds(network->curve(), force_limit);
        bounds.memory = memory_bounds(model);
        return bounds;
    }
    const HysteresisNetwork& pair = *model.hysteresis();
    return detail::hysteresis_bounds(pair, play_radius > 0.0 ? play_radius : pair.play_radius(), force_limit);
}

/// Returns the constant force [N] that must be added to the bias of a periodic model, so that the force limited to
/// +-`force_limit` does not generate energy in a full period. Returns 0 for other models.
[[nodiscard]] inline double passive_shift(const ForceModel& model, double force_limit) {
    if (const WaveletNetwork* network = model.network()) {
        const NetworkCurve& f = network->curve();
        return detail::passive_shift({f, nullptr, f.slopes_everywhere().largest()}, force_limit);
    }
    if (const HysteresisNetwork* pair = model.hysteresis()) {
        const double wide = pair->force().upper() - pair->force().lower();
        const double sliding = detail::hysteresis_bounds(*pair, wide, force_limit).sliding;
        return detail::passive_shift({pair->force(), &pair->hysteresis_force(), sliding}, force_limit);
    }
    return 0.0;
}

}  // namespace palpate
