// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <string>

#include "palpate/fields/field_table.hpp"
#include "palpate/fields/readable.hpp"
#include "palpate/rendering/scheme.hpp"

// Definition of validate, whose messages take long to compile.
namespace palpate {

PALPATE_INLINE void validate(const Scheme& scheme, const ForceModel& model) {
    const std::string structure{name_of(scheme.structure)};
    const StructureTraits& traits = traits_of(scheme.structure);
    require_renderable(model);
    detail::require(
        model.velocity() == nullptr || traits.velocity,
        "structure is " + structure +
            ", must be direct: only the direct structure can render a force of position and velocity");
    detail::require(model.memory() == nullptr || scheme.structure == StructureKind::Direct,
                    "structure is " + structure +
                        ", must be direct: only the direct structure can render a force with memory");
    if (traits.coupling && !is_uncoupled(scheme)) {
        check_fields(scheme.coupling, "coupling_");
    }
    if (traits.mass) {
        require_field(satisfies(scheme.inertia.mass, Rule::Positive), "mass", scheme.inertia.mass, "> 0");
        require_field(satisfies(scheme.inertia.damping, Rule::NotNegative), "object_damping",
                      scheme.inertia.damping, ">= 0");
    }
    const std::string predict = "predict is " + std::to_string(scheme.predict);
    detail::require(scheme.predict >= 0 && scheme.predict <= most_prediction_taps,
                    predict + ", must be 0 to 16");
    detail::require(scheme.predict == 0 || traits.predicts,
                    predict + ", must be 0 for the structure " + structure);
    detail::require(scheme.predict == 0 || model.velocity() == nullptr,
                    predict + ", must be 0 for a force of position and velocity");
    detail::require(scheme.predict == 0 || model.memory() == nullptr,
                    predict + ", must be 0 for a force with memory");
    detail::require(satisfies(scheme.play_radius, Rule::NotNegative),
                    "play_radius is " + readable(scheme.play_radius) + ", must be >= 0");
    detail::require(!model.hysteresis() || model.play_radius() || scheme.play_radius > 0.0,
                    "play_radius is 0, but the model does not define one: must be > 0");
    detail::require(traits.line || !scheme.line,
                    "line is given, must be absent for the structure " + structure);
    if (scheme.line) {
        validate(*scheme.line, model);
    }
    if (scheme.compensated) {
        detail::require(traits.coupling && !is_uncoupled(scheme),
                        "compensated is set for the " + structure + " structure, which has no coupling");
        detail::require(
            !model.hysteresis(),
            "compensated is set for a hysteresis model, whose slope has no bound while it sticks");
        const double steepest = std::max(model.network()->curve().slopes_everywhere().upper, 0.0);
        detail::require(steepest <= compensated_share * scheme.coupling.stiffness,
                        "coupling_stiffness is " + readable(scheme.coupling.stiffness) +
                            ", must be at least " + readable(steepest / compensated_share) +
                            " to compensate a model whose steepest slope is " + readable(steepest));
    }
}

}  // namespace palpate
