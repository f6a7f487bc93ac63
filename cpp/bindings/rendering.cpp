// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include <pybind11/stl.h>

#include "arrays.hpp"
#include "bindings.hpp"
#include "fields.hpp"
#include "palpate/force_error.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/simulation.hpp"
#include "signals.hpp"

namespace palpate::bindings {

namespace py = pybind11;
using namespace py::literals;

namespace {

std::vector<std::int8_t> numbered(const std::vector<Status>& statuses) {
    std::vector<std::int8_t> numbers;
    numbers.reserve(statuses.size());
    for (const Status status : statuses) {
        numbers.push_back(static_cast<std::int8_t>(status));
    }
    return numbers;
}

py::dict simulate_in_python(const ForceModel& model, const Scheme& scheme, const DeviceProfile& device,
                            const Hand& hand, double duration_s, int substeps, double start_position,
                            const std::optional<py::function>& progress) {
    detail::require(std::isfinite(start_position), "start_position is not a finite number");
    const std::size_t ticks = simulated_ticks(duration_s, device.period_s);
    Trace trace;
    {
        const py::gil_scoped_release unlocked;
        trace = simulate(model, scheme, device, hand, ticks, substeps, start_position,
                         Interruptible{progress ? &*progress : nullptr});
    }
    return py::dict(
        "time_s"_a = moved(std::move(trace.time)), "position"_a = moved(std::move(trace.position)),
        "velocity"_a = moved(std::move(trace.velocity)),
        "handle_start"_a = moved(std::move(trace.handle_start)),
        "handle_middle"_a = moved(std::move(trace.handle_middle)),
        "handle_end"_a = moved(std::move(trace.handle_end)),
        "environment_position"_a = moved(std::move(trace.environment_position)),
        "force"_a = moved(std::move(trace.force)), "applied"_a = moved(std::move(trace.applied)),
        "mean_applied"_a = moved(std::move(trace.mean_applied)),
        "evaluations"_a = moved(std::move(trace.evaluations)), "status"_a = moved(numbered(trace.status)),
        "extrapolated"_a = moved(std::move(trace.extrapolated)));
}

py::dict rendered_arrays(const std::vector<Rendered>& rendered) {
    std::vector<double> force;
    std::vector<double> position;
    std::vector<int> evaluations;
    std::vector<Status> status;
    for (const Rendered& tick : rendered) {
        force.push_back(tick.force);
        position.push_back(tick.environment_position);
        evaluations.push_back(tick.evaluations);
        status.push_back(tick.status);
    }
    return py::dict("force"_a = moved(std::move(force)),
                    "environment_position"_a = moved(std::move(position)),
                    "evaluations"_a = moved(std::move(evaluations)), "status"_a = moved(numbered(status)));
}

void require_period(double period_s) {
    detail::require(std::isfinite(period_s) && period_s > 0.0,
                    "period_s is " + std::to_string(period_s) + ", must be > 0");
}

}  // namespace

void bind_rendering(py::module_& module) {
    const Scheme scheme;
    const std::string structure{structure_names[static_cast<std::size_t>(scheme.structure)]};
    py::list names;
    for (const std::string_view name : structure_names) {
        names.append(std::string(name));
    }
    module.attr("structure_names") = py::tuple(names);
    module.attr("most_prediction_taps") = most_prediction_taps;
    module.attr("most_simulated_ticks") = most_simulated_ticks;
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

    module.def("simulate", &simulate_in_python, "model"_a, "scheme"_a, "device"_a, "hand"_a, "duration_s"_a,
               "substeps"_a = 20, "start_position"_a = 0.0, "progress"_a = py::none(),
               "The model rendered on a simulated device held by a simulated hand, in virtual time.\n"
               "The handle starts at rest at start_position. Calls progress(ticks) about ten times a second. "
               "Ctrl-C\n"
               "ends it as in Python; ValueError for more than most_simulated_ticks.\n\n"
               "Arrays (n,) by name: time_s, position (measured), velocity, handle_start, handle_middle and\n"
               "handle_end (the true handle when sampled, and in the middle and at the end of the tick that "
               "holds the\n"
               "force), environment_position, force (commanded), applied (at the end of the tick), "
               "mean_applied (over\n"
               "the tick), evaluations, status, extrapolated.");
    module.def(
        "force_error",
        [](const ForceModel& model, double play_radius, const Array& start, const Array& middle,
           const Array& end, const Array& applied, const Array& mean_applied, double period_s) {
            require_vector(start, "start");
            require_vector(middle, "middle");
            require_vector(end, "end");
            require_vector(applied, "applied");
            require_vector(mean_applied, "mean_applied");
            require_period(period_s);
            ForceError error;
            {
                const py::gil_scoped_release unlocked;
                error = force_error(model, play_radius,
                                    {view(start), view(middle), view(end), view(applied), view(mean_applied)},
                                    period_s);
            }
            return py::dict("end"_a = error.end, "instant"_a = error.instant, "mean"_a = error.mean,
                            "band"_a = error.band, "work"_a = error.work);
        },
        "model"_a, "play_radius"_a, py::kw_only(), "start"_a, "middle"_a, "end"_a, "applied"_a,
        "mean_applied"_a, "period_s"_a,
        "RMS errors [N or N*m] of a simulated rendering against a model: at the end of the tick, at its\n"
        "sampling instant, of its mean over the tick, and of that below 50 Hz; and the work of the error "
        "[J].\n"
        "Arrays (n,) from simulate; play_radius 0 is the model's own.");
    module.def(
        "motion_driven",
        [](const ForceModel& model, const Scheme& s, const Array& position, double period_s) {
            require_vector(position, "position");
            require_period(period_s);
            std::vector<Rendered> rendered;
            {
                const py::gil_scoped_release unlocked;
                rendered = motion_driven(model, s, view(position), period_s, Interruptible{});
            }
            return rendered_arrays(rendered);
        },
        "model"_a, "scheme"_a, "position"_a, "period_s"_a,
        "The force that would have been rendered while a recorded motion (n,) moves the device.\n"
        "Arrays (n,) by name: force, environment_position, evaluations, status.");
    module.def(
        "force_driven",
        [](const ForceModel& model, const Scheme& s, const Array& force, double period_s,
           double start_position) {
            require_vector(force, "force");
            require_period(period_s);
            std::vector<Rendered> rendered;
            {
                const py::gil_scoped_release unlocked;
                rendered = force_driven(model, s, view(force), period_s, start_position, Interruptible{});
            }
            return rendered_arrays(rendered);
        },
        "model"_a, "scheme"_a, "force"_a, "period_s"_a, "start_position"_a = 0.0,
        "The motion that a recorded force (n,) gives the environment alone (paper figures 12 and 14).\n"
        "Arrays (n,) by name: force, environment_position, evaluations, status.");
}

}  // namespace palpate::bindings
