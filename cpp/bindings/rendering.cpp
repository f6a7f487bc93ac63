// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include <pybind11/stl.h>

#include "arrays.hpp"
#include "bindings.hpp"
#include "fields.hpp"
#include "palpate/rendering/scale.hpp"
#include "palpate/rendering/scheme.hpp"

namespace palpate::bindings {

namespace py = pybind11;
using namespace py::literals;

void bind_rendering(py::module_& module) {
    module.attr("structure_names") =
        py::tuple(py::cast(std::vector<std::string>(structure_names.begin(), structure_names.end())));
    module.attr("most_prediction_taps") = most_prediction_taps;
    module.attr("compensated_share") = compensated_share;
    py::class_<Scheme> type(module, "Scheme",
                            "Structure that renders a model, with its numbers in SI units.");
    bind_fields(type);
    type.def_property_readonly(
            "has_coupling", [](const Scheme& s) { return has_coupling(s.structure); },
            "True if the object is behind a virtual coupling.")
        .def_property_readonly(
            "has_mass", [](const Scheme& s) { return has_mass(s.structure); },
            "True if the object has mass and damping.")
        .def(
            "validate",
            [](const Scheme& s, const ForceModel& model, std::optional<double> period_s) {
                period_s ? validate(s, model, *period_s) : validate(s, model);
            },
            "model"_a, "period_s"_a = py::none(),
            "Raises ValueError with the field, its value and the bound for this model. With a period it "
            "also\n"
            "refuses a scheme that diverges at this period.")
        .def(
            "steepest_slope",
            [](const Scheme& s, const ForceModel& model) { return steepest_slope(s, model); }, "model"_a,
            "Returns the largest slope of the model in the structure, at least 0. It includes h / r, the "
            "slope\n"
            "that a hysteresis model adds while it sticks.");

    module.def(
        "explicit_slope_limit",
        [](const Scheme& s, double period_s, bool coupled) {
            require_period(period_s);
            return explicit_slope_limit(s.inertia, coupled ? s.coupling : VirtualCoupling{0.0, 0.0},
                                        period_s);
        },
        "scheme"_a, "period_s"_a, py::kw_only(), "coupled"_a = true,
        "Returns the slope of the model below which the explicit structure is stable at a held device, or,\n"
        "with coupled=False, driven by a force.");

    module.def("default_play_radius", &default_play_radius, "model"_a, "encoder_step"_a,
               "Returns the default play radius of a model that does not define one; otherwise 0.");
    module.attr("fewest_encoder_steps_in_play") = fewest_encoder_steps_in_play;

    module.def(
        "solver_name",
        [](const ForceModel& model, const Scheme& s, double period_s) -> std::optional<std::string> {
            require_period(period_s);
            const auto name = solver_name(model, s, period_s);
            return name ? std::optional<std::string>{*name} : std::nullopt;
        },
        "model"_a, "scheme"_a, "period_s"_a,
        "Returns the method that solves the load line: 'table' if certified tables are used at least in "
        "part,\n"
        "otherwise 'newton'; None for a structure without a load line.");
}

}  // namespace palpate::bindings
