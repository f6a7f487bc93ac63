// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <optional>
#include <string>

#include <pybind11/stl.h>

#include "arrays.hpp"
#include "bindings.hpp"
#include "fields.hpp"
#include "palpate/rendering/scheme.hpp"

namespace palpate::bindings {

namespace py = pybind11;
using namespace py::literals;

void bind_rendering(py::module_& module) {
    const Scheme scheme;
    const std::string structure{structure_names[static_cast<std::size_t>(scheme.structure)]};
    py::list names;
    for (const std::string_view name : structure_names) {
        names.append(std::string(name));
    }
    module.attr("structure_names") = py::tuple(names);
    module.attr("most_prediction_taps") = most_prediction_taps;
    py::class_<Scheme> type(module, "Scheme",
                            "How a model is rendered: the structure and its numbers, SI units.");
    type.def(py::init([](const std::string& name, double coupling_stiffness, double coupling_damping,
                         double mass, double damping, bool compensated, double play_radius, int predict) {
                 return Scheme{structure_named(name), {coupling_stiffness, coupling_damping},
                               {mass, damping},       compensated,
                               play_radius,           predict};
             }),
             py::kw_only(), "structure"_a = structure, "coupling_stiffness"_a = scheme.coupling.stiffness,
             "coupling_damping"_a = scheme.coupling.damping, "mass"_a = scheme.inertia.mass,
             "damping"_a = scheme.inertia.damping, "compensated"_a = scheme.compensated,
             "play_radius"_a = scheme.play_radius, "predict"_a = scheme.predict)
        .def_property_readonly("structure",
                               [](const Scheme& s) {
                                   return std::string(structure_names[static_cast<std::size_t>(s.structure)]);
                               })
        .def_property_readonly("coupling_stiffness", [](const Scheme& s) { return s.coupling.stiffness; })
        .def_property_readonly("coupling_damping", [](const Scheme& s) { return s.coupling.damping; })
        .def_property_readonly("mass", [](const Scheme& s) { return s.inertia.mass; })
        .def_property_readonly("damping", [](const Scheme& s) { return s.inertia.damping; })
        .def_readonly("compensated", &Scheme::compensated)
        .def_readonly("play_radius", &Scheme::play_radius)
        .def_readonly("predict", &Scheme::predict,
                      "m: samples used to predict the position half a sample ahead; 0 = none.")
        .def(
            "validate",
            [](const Scheme& s, const ForceModel& model, std::optional<double> period_s) {
                period_s ? validate(s, model, *period_s) : validate(s, model);
            },
            "model"_a, "period_s"_a = py::none(),
            "ValueError names the field, its value and what would be right for this model; with a period "
            "also\n"
            "what is sure to diverge at it.")
        .def(
            "steepest_slope",
            [](const Scheme& s, const ForceModel& model) { return steepest_slope(s, model); }, "model"_a,
            "Largest slope of the model that the structure meets, never below 0; h / r is part of it while "
            "a\n"
            "hysteresis model sticks.");
    define_by_fields(type, {"structure", "coupling_stiffness", "coupling_damping", "mass", "damping",
                            "compensated", "play_radius", "predict"});

    module.def(
        "explicit_slope_limit",
        [](const Scheme& s, double period_s, bool coupled) {
            require_period(period_s);
            return explicit_slope_limit(s.inertia, coupled ? s.coupling : VirtualCoupling{0.0, 0.0},
                                        period_s);
        },
        "scheme"_a, "period_s"_a, py::kw_only(), "coupled"_a = true,
        "Slope of the model below which the explicit structure is stable at a held device, or (not coupled)\n"
        "driven by a force: (4 m - 2 (B_o + B_c) T) / T^2 - K_c, with K_c = B_c = 0 when not coupled.");

    module.def(
        "solver_name",
        [](const ForceModel& model, const Scheme& s, double period_s) -> std::optional<std::string> {
            require_period(period_s);
            const auto name = solver_name(model, s, period_s);
            return name ? std::optional<std::string>{*name} : std::nullopt;
        },
        "model"_a, "scheme"_a, "period_s"_a,
        "How the load line is solved: 'table' where certified tables answer, at least in part, else "
        "'newton';\n"
        "None where a structure has no load line.");
}

}  // namespace palpate::bindings
