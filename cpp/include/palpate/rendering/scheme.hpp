// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <optional>
#include <string>

#include "palpate/dynamics/coupling.hpp"
#include "palpate/fields/field_table.hpp"
#include "palpate/inline.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/rendering/held_slope.hpp"
#include "palpate/rendering/structures.hpp"

namespace palpate {

/// The structure that renders a model, and the numbers of the structure. A structure ignores fields that it does not
/// use.
struct Scheme {
    StructureKind structure = StructureKind::Massless;
    VirtualCoupling coupling{};
    Inertia inertia{};
    bool compensated = false;
    double play_radius = 0.0;
    int predict = 0;
    std::optional<HeldSlope> line = std::nullopt;
};

template <>
inline constexpr auto fields_of<Scheme> = FieldTable{
    Field<&Scheme::structure>{"structure", "Connection of the model to the device."},
    within<&Scheme::coupling>(fields_of<VirtualCoupling>.get<0>(), "coupling_stiffness"),
    within<&Scheme::coupling>(fields_of<VirtualCoupling>.get<1>(), "coupling_damping"),
    within<&Scheme::inertia>(fields_of<Inertia>.get<0>(), "mass"),
    within<&Scheme::inertia>(fields_of<Inertia>.get<1>(), "object_damping"),
    Field<&Scheme::compensated>{
        "compensated",
        "True if the model is made stiffer, so that model and coupling in series give the recorded force."},
    Field<&Scheme::play_radius>{
        "play_radius", "Play radius r of a hysteresis model [m or rad]; 0 = the play radius of the model.",
        Rule::NotNegative},
    Field<&Scheme::predict>{"predict",
                            "m, number of past samples that predict the position half a period ahead, 0 to "
                            "16; 0 = no prediction.",
                            Rule::NotNegative},
    Field<&Scheme::line>{
        "line", "Slope of the line that a tangent holds; absent: the slope of the force, at least 0."}};

/// Returns the scheme with coupling and object mass set to 0 if the structure does not use them.
[[nodiscard]] inline Scheme used_part(Scheme scheme) noexcept {
    if (!has_coupling(scheme.structure)) {
        scheme.coupling = {0.0, 0.0};
    }
    if (!has_mass(scheme.structure)) {
        scheme.inertia = {0.0, 0.0};
    }
    if (!holds_line(scheme.structure)) {
        scheme.line.reset();
    }
    return scheme;
}

/// Returns true if the scheme has no coupling between device and virtual object, but an object with mass: the measured
/// force drives the object, and its position is the command of an admittance display.
[[nodiscard]] constexpr bool is_uncoupled(const Scheme& scheme) noexcept {
    return has_mass(scheme.structure) && scheme.coupling.stiffness == 0.0 && scheme.coupling.damping == 0.0;
}

/// A model can be compensated only if its largest slope is at most this factor times the coupling's stiffness K_c [-].
inline constexpr double compensated_share = 0.9;

/// Checks that a scheme can render a model. Throws std::invalid_argument with the wrong field, its value and the rule.
PALPATE_INLINE void validate(const Scheme& scheme, const ForceModel& model);

/// Returns the largest slope of the force that a scheme renders for a model, at least 0 [N/m or N*m/rad]. After a
/// reversal, the force of a hysteresis model changes from press to release over the play, which adds the slope h / r
/// (hysteresis by play radius). Compensation makes the model steeper.
[[nodiscard]] inline double steepest_slope(const Scheme& scheme, const ForceModel& model) {
    const std::optional<double> radius =
        scheme.play_radius > 0.0 ? std::optional{scheme.play_radius} : model.play_radius();
    const WaveletNetwork* network = model.network();
    const Interval slopes = network ? network->curve().slopes_everywhere() : model.slope_bounds(radius);
    const double steepest = std::max(slopes.upper, 0.0);
    const double stiffness = scheme.coupling.stiffness;
    return scheme.compensated ? stiffness * steepest / (stiffness - steepest) : steepest;
}

/// Checks a scheme for a device that applies forces like validate(scheme, model), and also throws if the scheme has no
/// coupling to the device or diverges at the period `period_s`.
inline void validate(const Scheme& scheme, const ForceModel& model, double period_s) {
    validate(scheme, model);
    detail::require(
        !is_uncoupled(scheme),
        "coupling_stiffness is 0: must be > 0 on a device that applies forces; only an admittance "
        "display renders an object without a coupling");
    with_kind(scheme.structure, [&](auto structure) {
        if constexpr (requires(StructureNumbers numbers) { structure.slope_limit(numbers); }) {
            const double steepest = steepest_slope(scheme, model);
            const double limit = structure.slope_limit(
                {.coupling = scheme.coupling, .inertia = scheme.inertia, .period_s = period_s});
            detail::require(steepest < limit, "structure is " + std::string(structure.traits.name) +
                                                  ", which diverges: the model's steepest slope is " +
                                                  readable(steepest) + ", must be below " + readable(limit) +
                                                  "; the implicit structure has no such limit");
        }
    });
}

}  // namespace palpate

#ifndef PALPATE_COMPILED
#include "palpate/rendering/detail/validate.hpp"
#endif
