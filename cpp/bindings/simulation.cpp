// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/stl.h>

#include "arrays.hpp"
#include "bindings.hpp"
#include "fields.hpp"
#include "palpate/simulation/closed_loop.hpp"
#include "palpate/simulation/force_error.hpp"
#include "palpate/simulation/hand.hpp"
#include "palpate/simulation/press.hpp"
#include "palpate/simulation/simulated_display.hpp"
#include "palpate/simulation/test_rig.hpp"
#include "palpate/stability/account_certificate.hpp"
#include "settings.hpp"
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

/// Simulates the rendering of a model and returns the columns of the simulated ticks as numpy arrays by name.
py::dict simulate_in_python(const ForceModel& model, const Scheme& scheme, const DeviceProfile& device,
                            const Hand& hand, double duration_s, int substeps, double start_position,
                            bool energy_account, const std::optional<py::function>& progress) {
    detail::require(std::isfinite(start_position), "start_position is not a finite number");
    const std::size_t ticks = simulated_ticks(duration_s, device.period_s);
    Trace trace;
    {
        const py::gil_scoped_release unlocked;
        Guards guards{.limit = {device.force_limit}};
        if (energy_account) {
            guards.account = account_of(model, scheme, device);
        }
        trace = simulate(model, scheme, device, hand, guards, ticks, substeps, start_position,
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

/// Calls `render(samples, each)` with the positions or forces of a recording (n,). Returns the columns of the rendered
/// ticks as numpy arrays by name.
template <class Render>
py::dict rendered_along(const Array& samples, const char* name, double period_s, Render render) {
    require_vector(samples, name);
    require_period(period_s);
    const std::vector<Rendered> rendered = [&] {
        const py::gil_scoped_release unlocked;
        return render(view(samples), Interruptible{});
    }();
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

}  // namespace

void bind_simulation(py::module_& module) {
    module.attr("tolerated_change") = tolerated_change;
    module.attr("smallest_domain_share") = smallest_domain_share;
    py::class_<Hand> hand(module, "Hand",
                          "Simulated hand: a spring to a target that moves between lower and upper, and\n"
                          "a damper between handle and ground.");
    bind_fields(hand);

    py::class_<TestRig> rig(module, "TestRig", "Simulated device and hand, scaled to a model.");
    bind_fields<TestRig, 2>(rig);
    rig.def(
        "scheme",
        [](const TestRig& self, const ForceModel& model, const py::kwargs& fields) {
            SchemeChoices chosen;
            set_fields(chosen, fields);
            return self.scheme(model, chosen);
        },
        "model"_a,
        "Returns a scheme with the given fields of Scheme, in the model's units. Other fields, and fields\n"
        "with the value None, have the default, multiplied by the scale of the model.");
    module.def(
        "rig_for", &rig_for, "model"_a, "is_angle"_a, "period_s"_a = DeviceProfile{}.period_s,
        "Returns the test rig for a model of position, or of position and velocity. With is_angle\n"
        "(positions in rad) the device is the default knob. For any other unit, its lengths and forces\n"
        "are scaled to the travel and the largest force of the model. The hand moves the handle through\n"
        "the domain of the model.");

    module.def(
        "simulate", &simulate_in_python, "model"_a, "scheme"_a, "device"_a, "hand"_a, "duration_s"_a,
        "substeps"_a = usual_substeps, "start_position"_a = 0.0, "energy_account"_a = false,
        "progress"_a = py::none(),
        "Renders a model on a simulated device with a simulated hand, in simulated time.\n\n"
        "The handle starts at rest at start_position. With energy_account the energy account limits the\n"
        "force, as in a rendering that it holds. Calls progress(ticks) about ten times a second.\n"
        "Ctrl-C raises KeyboardInterrupt. Raises ValueError for more than 3 600 000 ticks.\n\n"
        "Returns arrays (n,) by name:\n\n"
        "- time_s, position (measured), velocity, environment_position.\n"
        "- handle_start, handle_middle, handle_end: true positions of the handle when it is sampled, and in\n"
        "  the middle and at the end of the tick that holds the force.\n"
        "- force (commanded), applied (at the end of the tick), mean_applied (over the tick).\n"
        "- evaluations, status, extrapolated.");
    py::class_<AccountUse> use(
        module, "AccountUse",
        "Effect of the energy account on simulated presses and rests, and the numbers of its limit.");
    bind_fields<AccountUse, 2>(use, false);
    module.def(
        "account_use",
        [](const ForceModel& model, const Scheme& scheme, const DeviceProfile& device) {
            const py::gil_scoped_release unlocked;
            return account_use(model, scheme, device);
        },
        "model"_a, "scheme"_a, "device"_a,
        "Presses and holds a model in simulation while the energy account limits its force. The finger\n"
        "presses at 10, 30, 100 and 300 mm/s, or turns a knob of 40 mm diameter at the same speed; speeds\n"
        "above the largest speed are left out. It rests with a tremor of 10 Hz where the force is largest\n"
        "and where its slope is steepest.");
    py::class_<RestingOscillation> resting(module, "RestingOscillation",
                                           "Oscillation of a handle on which a finger rests, in simulation.");
    bind_fields<RestingOscillation, 3>(resting, false);
    module.def(
        "resting_oscillation",
        [](const ForceModel& model, const Scheme& scheme, const DeviceProfile& device) {
            const py::gil_scoped_release unlocked;
            return resting_oscillation(model, scheme, device);
        },
        "model"_a, "scheme"_a, "device"_a,
        "Returns the largest limit cycle of a handle on which a finger of 10 g rests, at the largest force\n"
        "and at the steepest slope of a model, with no guard but the force limit.");
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
        "Returns errors of the force of a simulated rendering, compared with a model, by name. RMS\n"
        "errors [N or N*m]: `end`, at the end of each tick; `instant`, at the time of the sample;\n"
        "`mean`, mean error over a tick; `band`, mean error below 50 Hz. `work` is the work of the error\n"
        "[J]. The arrays (n,) are those of simulate(); play_radius 0 means the play radius of the model.");
    module.def(
        "display_motion",
        [](const DeviceProfile& device, const Array& command, double start) {
            require_vector(command, "command");
            SimulatedDisplay display{device, start};
            std::vector<double> position;
            position.reserve(view(command).size());
            for (const double each : view(command)) {
                display.move(each);
                position.push_back(display.handle().position);
            }
            return moved(std::move(position));
        },
        "device"_a, "command"_a, "start"_a = 0.0,
        "Returns the positions (n,) of the handle of an admittance display, each at the end of the period\n"
        "after a position command (n,). The handle starts at rest at start.");
    module.def(
        "motion_driven",
        [](const ForceModel& model, const Scheme& s, const Array& position, double period_s) {
            return rendered_along(position, "position", period_s, [&](auto motion, auto each) {
                return motion_driven(model, s, motion, period_s, each);
            });
        },
        "model"_a, "scheme"_a, "position"_a, "period_s"_a,
        "Returns the force that a scheme renders while the device follows a recorded motion (n,).\n"
        "Arrays (n,) by name: force, environment_position, evaluations, status.");
    module.def(
        "force_driven",
        [](const ForceModel& model, const Scheme& s, const Array& force, double period_s,
           double start_position) {
            return rendered_along(force, "force", period_s, [&](auto forces, auto each) {
                return force_driven(model, s, forces, period_s, start_position, each);
            });
        },
        "model"_a, "scheme"_a, "force"_a, "period_s"_a, "start_position"_a = 0.0,
        "Returns the motion of the virtual object, without device and coupling, when a recorded force\n"
        "(n,) drives the object (paper figures 12 and 14). Arrays (n,) by name: force,\n"
        "environment_position, evaluations, status.");
}

}  // namespace palpate::bindings
