// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include <pybind11/stl.h>

#include "arrays.hpp"
#include "bindings.hpp"
#include "fields.hpp"
#include "palpate/rendering/admittance.hpp"
#include "palpate/rendering/make_structure.hpp"
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
    module.def(
        "display_lag_s", &display_lag_s, "device"_a,
        "Returns the time by which the handle of an admittance display follows the virtual object in slow\n"
        "motion [s]: delay and lag of the servo, less the feed-forward. A hand feels the slope of the\n"
        "object times this time as damping, in addition to the damping of the object.");
    module.def(
        "virtual_friction", &virtual_friction, "device"_a,
        "Returns the Coulomb friction of the virtual object that makes the steps of command and force\n"
        "sensor of an admittance display harmless [N or N*m].");
    py::class_<HeldSlope> line(module, "HeldSlope",
                               "Rule for the slope of a line that a tangent holds, in SI units.");
    bind_fields(line);
    line.def(py::init([](const py::dict& fields) {
                 return py::type::of<HeldSlope>()(**fields).cast<HeldSlope>();
             }),
             "fields"_a);
    py::implicitly_convertible<py::dict, HeldSlope>();
    module.attr("most_slope_cells") = most_slope_cells;
    module.attr("cells_in_motion") = cells_in_motion;
    py::class_<Scheme> type(module, "Scheme",
                            "Structure that renders a model, with the numbers of the structure in SI units.");
    bind_fields(type);
    type.def_property_readonly(
            "has_coupling", [](const Scheme& s) { return has_coupling(s.structure) && !is_uncoupled(s); },
            "True if the structure has a virtual coupling between device and object.")
        .def_property_readonly(
            "has_mass", [](const Scheme& s) { return has_mass(s.structure); },
            "True if the virtual object of the structure has mass and damping.")
        .def(
            "validate",
            [](const Scheme& s, const ForceModel& model, std::optional<double> period_s) {
                period_s ? validate(s, model, *period_s) : validate(s, model);
            },
            "model"_a, "period_s"_a = py::none(),
            "Checks that the scheme can render a model. Raises ValueError with the wrong field, its\n"
            "value and its bound. With period_s also raises ValueError if the scheme diverges at this\n"
            "period.")
        .def(
            "steepest_slope",
            [](const Scheme& s, const ForceModel& model) { return steepest_slope(s, model); }, "model"_a,
            "Returns the largest slope of the rendered force, at least 0 [N/m or N*m/rad]. For a\n"
            "hysteresis model it includes h / r (hysteresis by play radius), the slope that is added\n"
            "after a reversal.");

    module.def(
        "explicit_slope_limit",
        [](const Scheme& s, double period_s, bool coupled) {
            require_period(period_s);
            return explicit_slope_limit(s.inertia, coupled ? s.coupling : VirtualCoupling{0.0, 0.0},
                                        period_s);
        },
        "scheme"_a, "period_s"_a, py::kw_only(), "coupled"_a = true,
        "Returns the slope limit of a model: below it the explicit structure is stable while the device\n"
        "is held still, or, with coupled=False, while a force drives the object without coupling.");

    module.def(
        "default_play_radius", &default_play_radius, "model"_a, "encoder_step"_a,
        "Returns the default play radius for a hysteresis model that does not define one; otherwise 0.");
    module.attr("fewest_encoder_steps_in_play") = fewest_encoder_steps_in_play;

    module.def(
        "solver_name",
        [](const ForceModel& model, const Scheme& s, double period_s) -> std::optional<std::string> {
            require_period(period_s);
            const auto name = solver_name(model, s, period_s);
            return name ? std::optional<std::string>{*name} : std::nullopt;
        },
        "model"_a, "scheme"_a, "period_s"_a,
        "Returns the method that solves the load line of a scheme: 'table' if a table of solutions is\n"
        "used for at least a part of the positions, otherwise 'newton'; None for a structure without a\n"
        "load line.");
}

}  // namespace palpate::bindings
