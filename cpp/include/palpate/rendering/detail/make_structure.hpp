// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>

#include "palpate/model/compiled_network.hpp"
#include "palpate/rendering/compensated.hpp"
#include "palpate/rendering/make_structure.hpp"
#include "palpate/rendering/structures.hpp"
#include "palpate/solver/piecewise_force.hpp"
#include "palpate/solver/resolvent.hpp"
#include "palpate/solver/sliding_resolvent.hpp"

// Definition of make_structure, the only function that contains all structures. It takes seconds to compile.
namespace palpate {

PALPATE_INLINE AnyStructure make_structure(const ForceModel& given, const Scheme& scheme, double period_s,
                                           double force_limit) {
    validate(scheme, given);
    if (const VelocityNetwork* force = given.velocity()) {
        return DirectVelocity{*force, period_s};
    }
    if (const MemoryNetwork* memory = given.memory()) {
        // Also a constant ratio gets a table, which is faster than the exact continuation
        const CompileOptions always{.fewest_wavelets = 0};
        return Direct{MemoryForce{CompiledCurve{given.network()->curve(), always},
                                  CompiledCurve{memory->ratio(), always}, *memory, period_s, force_limit}};
    }
    const ForceModel model = scheme.play_radius > 0.0 ? given.with_play_radius(scheme.play_radius) : given;
    const StructureNumbers numbers{scheme.coupling, scheme.inertia,       scheme.predict, period_s,
                                   force_limit,     model.finest_width(), scheme.line,    &model};
    const auto build = [&](auto environment, const auto& solver_of) {
        return with_kind(scheme.structure, [&](auto structure) {
            return structure.build(std::move(environment), numbers, solver_of);
        });
    };
    if (const HysteresisNetwork* both = model.hysteresis()) {
        return build(CompiledHysteresis{*both}, [&](double p) { return SlidingResolvent{*both, p}; });
    }
    const CompiledNetwork network{*model.network()};
    const NetworkCurve& curve = network.curve().curve();
    if (scheme.compensated) {
        const double stiffness = scheme.coupling.stiffness;
        return build(Compensated{network, stiffness},
                     [&](double p) { return CompensatedResolvent{piecewise(curve), stiffness, p}; });
    }
    return build(network, [&](double p) { return Resolvent{curve, p}; });
}

}  // namespace palpate
