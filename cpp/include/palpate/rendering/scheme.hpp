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
#include "palpate/model/force_model.hpp"
#include "palpate/readable.hpp"
#include "palpate/rendering/compensated.hpp"
#include "palpate/rendering/direct.hpp"
#include "palpate/rendering/energy_consistent.hpp"
#include "palpate/rendering/explicit.hpp"
#include "palpate/rendering/implicit.hpp"
#include "palpate/rendering/inertia.hpp"
#include "palpate/rendering/massless.hpp"

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
};

/// Throws std::invalid_argument: the field, its value, what would be right.
inline void validate(const Scheme& scheme, const ForceModel& model) {
    const auto require = [](bool holds, const char* field, double value, const char* right) {
        detail::require(holds, std::string(field) + " is " + readable(value) + ", must be " + right);
    };
    const auto positive = [](double value) { return std::isfinite(value) && value > 0.0; };
    const auto not_negative = [](double value) { return std::isfinite(value) && value >= 0.0; };
    require_one_input(model.parameters());
    if (scheme.structure != StructureKind::Direct) {
        require(positive(scheme.coupling.stiffness), "coupling_stiffness", scheme.coupling.stiffness, "> 0");
        require(not_negative(scheme.coupling.damping), "coupling_damping", scheme.coupling.damping, ">= 0");
    }
    if (has_mass(scheme.structure)) {
        require(positive(scheme.inertia.mass), "mass", scheme.inertia.mass, "> 0");
        require(not_negative(scheme.inertia.damping), "damping", scheme.inertia.damping, ">= 0");
    }
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
        detail::require(steepest < limit,
                        "structure is explicit, which diverges: the model's steepest slope is " +
                            readable(steepest) + ", must be below " + readable(limit) +
                            " = (4 m - 2 (B_o + B_c) T) / T^2 - K_c; the implicit structure has no such limit");
    }
}

/// The numerical search of a structure's load line: where p + f' can vanish it must not step over a whole
/// wavelet, or it could miss the branch that a slow motion follows.
[[nodiscard]] inline LoadLineSolver solver_for(const ForceModel& model, double load_line_slope) {
    LoadLineSolver solver;
    if (load_line_slope + model.slope_bounds().lower <= 0.0) {
        solver.longest_step = 0.25 * model.finest_width();
    }
    return solver;
}

/// Calls `visit` with the structure that the scheme asks for, built over the model's environment.
template <class Visitor>
auto with_structure(const ForceModel& given, const Scheme& scheme, double period_s, Visitor visit) {
    validate(scheme, given);
    const ForceModel model = scheme.play_radius > 0.0 ? given.with_play_radius(scheme.play_radius) : given;
    const double coupling = scheme.coupling.stiffness + scheme.coupling.damping / period_s;
    const double inertia = (scheme.inertia.mass / period_s + scheme.inertia.damping) / period_s;
    const auto build = [&](const auto& environment, const LoadLineSolver& massless,
                           const LoadLineSolver& implicit) {
        switch (scheme.structure) {
            case StructureKind::Direct:
                return visit(Direct{environment});
            case StructureKind::Massless:
                return visit(Massless{environment, scheme.coupling, period_s, massless});
            case StructureKind::Implicit:
                return visit(Implicit{environment, scheme.inertia, scheme.coupling, period_s, implicit});
            case StructureKind::EnergyConsistent:
                return visit(EnergyConsistent{environment, scheme.inertia, scheme.coupling, period_s,
                                              1e-2 * model.finest_width()});
            case StructureKind::Explicit:
                break;
        }
        return visit(Explicit{environment, scheme.inertia, scheme.coupling, period_s});
    };
    const auto render = [&](const auto& environment) {
        if (scheme.compensated) {
            // Its slope is above -K_c everywhere: the load line is unique.
            return build(Compensated{environment, scheme.coupling.stiffness}, {}, {});
        }
        return build(environment, solver_for(model, coupling), solver_for(model, coupling + inertia));
    };
    return model.hysteresis() ? render(*model.hysteresis()) : render(*model.network());
}

}  // namespace palpate
