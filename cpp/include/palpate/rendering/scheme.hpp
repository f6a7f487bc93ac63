// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include "palpate/dynamics/coupling.hpp"
#include "palpate/fields/readable.hpp"
#include "palpate/model/compiled_network.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/model/limited_environment.hpp"
#include "palpate/rendering/compensated.hpp"
#include "palpate/rendering/direct.hpp"
#include "palpate/rendering/direct_velocity.hpp"
#include "palpate/rendering/energy_consistent.hpp"
#include "palpate/rendering/explicit.hpp"
#include "palpate/rendering/implicit.hpp"
#include "palpate/rendering/inertia.hpp"
#include "palpate/rendering/massless.hpp"
#include "palpate/rendering/predicted.hpp"
#include "palpate/solver/limited_resolvent.hpp"
#include "palpate/solver/piecewise_force.hpp"
#include "palpate/solver/resolvent.hpp"
#include "palpate/solver/sliding_resolvent.hpp"

namespace palpate {

enum class StructureKind : std::uint8_t { Direct, Massless, Implicit, Explicit, EnergyConsistent };

inline constexpr std::array<std::string_view, 5> structure_names{"direct", "massless", "implicit", "explicit",
                                                                 "energy-consistent"};

[[nodiscard]] constexpr std::string_view name_of(StructureKind structure) noexcept {
    return structure_names[static_cast<std::size_t>(structure)];
}

/// Whether an object has mass in this structure.
[[nodiscard]] constexpr bool has_mass(StructureKind structure) noexcept {
    return structure != StructureKind::Direct && structure != StructureKind::Massless;
}

[[nodiscard]] inline StructureKind structure_named(std::string_view name) {
    for (std::size_t k = 0; k < structure_names.size(); ++k) {
        if (structure_names[k] == name) {
            return static_cast<StructureKind>(k);
        }
    }
    throw std::invalid_argument("structure is '" + std::string(name) +
                                "', must be direct, massless, implicit, explicit or energy-consistent");
}

/// How a model is rendered: the structure and its numbers. Fields that a structure has no use for are
/// ignored.
struct Scheme {
    StructureKind structure = StructureKind::Massless;
    VirtualCoupling coupling;
    Inertia inertia;
    bool compensated = false;  ///< take the coupling's spring out of the model beforehand
    double play_radius = 0.0;  ///< r of a hysteresis model [m or rad]; 0 = the model's own
    int predict = 0;           ///< m: samples used to predict the position half a sample ahead; 0 = none
};

/// Throws std::invalid_argument: the field, its value, what would be right.
inline void validate(const Scheme& scheme, const ForceModel& model) {
    const auto require = [](bool holds, const char* field, double value, const char* right) {
        detail::require(holds, std::string(field) + " is " + readable(value) + ", must be " + right);
    };
    const auto positive = [](double value) { return std::isfinite(value) && value > 0.0; };
    const auto not_negative = [](double value) { return std::isfinite(value) && value >= 0.0; };
    require_renderable(model);
    detail::require(model.velocity() == nullptr || scheme.structure == StructureKind::Direct,
                    "structure is " + std::string(name_of(scheme.structure)) +
                        ", must be direct: of a force of position and velocity behind a coupling no bound is "
                        "known");
    if (scheme.structure != StructureKind::Direct) {
        require(positive(scheme.coupling.stiffness), "coupling_stiffness", scheme.coupling.stiffness, "> 0");
        require(not_negative(scheme.coupling.damping), "coupling_damping", scheme.coupling.damping, ">= 0");
    }
    if (has_mass(scheme.structure)) {
        require(positive(scheme.inertia.mass), "mass", scheme.inertia.mass, "> 0");
        require(not_negative(scheme.inertia.damping), "damping", scheme.inertia.damping, ">= 0");
    }
    require(scheme.predict >= 0 && scheme.predict <= most_prediction_taps, "predict", scheme.predict,
            "0 to 16");
    detail::require(scheme.predict == 0 || scheme.structure == StructureKind::Direct,
                    "predict is " + std::to_string(scheme.predict) + ", must be 0 for the structure " +
                        std::string(name_of(scheme.structure)));
    detail::require(
        scheme.predict == 0 || model.velocity() == nullptr,
        "predict is " + std::to_string(scheme.predict) + ", must be 0 for a force of position and velocity");
    require(not_negative(scheme.play_radius), "play_radius", scheme.play_radius, ">= 0");
    detail::require(!model.hysteresis() || model.play_radius() || scheme.play_radius > 0.0,
                    "play_radius is 0, but the model leaves it to the rendering: must be > 0");
    if (scheme.compensated) {
        detail::require(scheme.structure != StructureKind::Direct,
                        "compensated is set for the direct structure, which has no coupling to compensate");
        detail::require(
            !model.hysteresis(),
            "compensated is set for a hysteresis model, whose slope has no bound while it sticks");
        const double steepest = std::max(model.slope_bounds().upper, 0.0);
        detail::require(steepest <= 0.9 * scheme.coupling.stiffness,
                        "coupling_stiffness is " + readable(scheme.coupling.stiffness) +
                            ", must be at least " + readable(steepest / 0.9) +
                            " to compensate a model whose steepest slope is " + readable(steepest));
    }
}

/// Largest slope that the structure meets, never below 0. While a hysteresis model sticks, h / r is part of it;
/// a compensated model has had the coupling's spring taken out.
[[nodiscard]] inline double steepest_slope(const Scheme& scheme, const ForceModel& model) {
    const std::optional<double> radius =
        scheme.play_radius > 0.0 ? std::optional{scheme.play_radius} : model.play_radius();
    const double steepest = std::max(model.slope_bounds(radius).upper, 0.0);
    const double stiffness = scheme.coupling.stiffness;
    return scheme.compensated ? stiffness * steepest / (stiffness - steepest) : steepest;
}

/// The same, and refuses what is sure to diverge at this period.
inline void validate(const Scheme& scheme, const ForceModel& model, double period_s) {
    validate(scheme, model);
    if (scheme.structure == StructureKind::Explicit) {
        const double steepest = steepest_slope(scheme, model);
        const double limit = explicit_slope_limit(scheme.inertia, scheme.coupling, period_s);
        detail::require(
            steepest < limit,
            "structure is explicit, which diverges: the model's steepest slope is " + readable(steepest) +
                ", must be below " + readable(limit) +
                " = (4 m - 2 (B_o + B_c) T) / T^2 - K_c; the implicit structure has no such limit");
    }
}

/// Calls `visit` with the structure that the scheme asks for, built over the model's environment. The one place
/// that prepares a model for the loop: curves become certified polynomials and load lines certified tables, each
/// where that can be proved, in a few milliseconds.
///
/// `force_limit`: of the device [N or N*m], infinite for none. Massless objects and objects with mass have it inside
/// their solution, so that object and device get the same force. The direct and the explicit structure do not know
/// it: the guards clip their force, and a linear bound of the explicit structure holds below the limit only.
template <class Visitor>
auto with_structure(const ForceModel& given, const Scheme& scheme, double period_s, double force_limit,
                    Visitor visit) {
    validate(scheme, given);
    if (const VelocityNetwork* force = given.velocity()) {
        return visit(DirectVelocity{*force, period_s});
    }
    const ForceModel model = scheme.play_radius > 0.0 ? given.with_play_radius(scheme.play_radius) : given;
    const auto build = [&](auto environment, auto solver_of) {
        using E = decltype(environment);
        switch (scheme.structure) {
            case StructureKind::Direct:
                return scheme.predict > 0 ? visit(PredictedDirect{std::move(environment), scheme.predict})
                                          : visit(Direct{std::move(environment)});
            case StructureKind::Massless: {
                const double p = Massless<E>::load_line_slope(scheme.coupling, period_s);
                if (std::isfinite(force_limit)) {
                    return visit(Massless{LimitedEnvironment{std::move(environment), force_limit},
                                          scheme.coupling, period_s, LimitedResolvent{solver_of(p)}});
                }
                return visit(Massless{std::move(environment), scheme.coupling, period_s, solver_of(p)});
            }
            case StructureKind::Implicit: {
                const double p = Implicit<E>::load_line_slope(scheme.inertia, scheme.coupling, period_s);
                const double alone = Implicit<E>::load_line_slope(scheme.inertia, {0.0, 0.0}, period_s);
                return visit(Implicit{std::move(environment), scheme.inertia, scheme.coupling, period_s,
                                      solver_of(p), force_limit, solver_of(alone)});
            }
            case StructureKind::EnergyConsistent: {
                const double p =
                    EnergyConsistent<E>::load_line_slope(scheme.inertia, scheme.coupling, period_s);
                return visit(EnergyConsistent{std::move(environment), scheme.inertia, scheme.coupling,
                                              period_s, 1e-2 * model.finest_width(), true, force_limit,
                                              solver_of(p)});
            }
            case StructureKind::Explicit:
                break;
        }
        return visit(Explicit{std::move(environment), scheme.inertia, scheme.coupling, period_s});
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

/// How the load line of a rendering is solved: "table" where it is at least in part, else "newton"; nothing
/// where there is none to solve.
[[nodiscard]] inline std::optional<std::string_view> solver_name(const ForceModel& model,
                                                                 const Scheme& scheme, double period_s) {
    return with_structure(model, scheme, period_s, std::numeric_limits<double>::infinity(),
                          [&](const auto& structure) -> std::optional<std::string_view> {
                              if constexpr (requires { structure.solver(); }) {
                                  return structure.solver().tabulated() ? "table" : "newton";
                              } else if (scheme.structure == StructureKind::EnergyConsistent) {
                                  return "newton";
                              } else {
                                  return std::nullopt;
                              }
                          });
}

}  // namespace palpate
