// SPDX-License-Identifier: Apache-2.0
#include "palpate/run/session.hpp"

#include <atomic>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <pybind11/stl.h>

#include "bindings.hpp"
#include "palpate/run/session_text.hpp"
#include "palpate/simulation/simulated_device.hpp"
#include "palpate/simulation/test_rig.hpp"
#include "summary.hpp"

namespace palpate::bindings {

namespace py = pybind11;
using namespace py::literals;

namespace {

/// What energy a rendering gave; None where no bound is known.
py::dict energy_of(const LoopReport& loop) {
    const py::object stored =
        std::isfinite(loop.most_stored) ? py::object(py::float_(loop.most_stored)) : py::none();
    return py::dict("given_in_ramp_J"_a = loop.given_in_ramp, "given_J"_a = loop.given,
                    "most_stored_J"_a = stored, "sentence"_a = energy_text(loop));
}

py::dict render_in_python(const ForceModel& model, const Scheme& scheme, const std::string& position_unit,
                          const std::string& force_unit, double rate_hz, double duration_s,
                          std::string record, bool force, const std::string& model_name,
                          std::optional<std::uint16_t> telemetry_port, double telemetry_hz, int priority,
                          int cpu, double lowest_rate_share, const std::optional<py::function>& progress) {
    SessionSettings settings;
    settings.loop.rate_hz = rate_hz;
    settings.loop.duration_s = duration_s;
    settings.loop.lowest_rate_share = lowest_rate_share;
    settings.real_time = {priority, cpu};
    validate(settings.loop);
    const double period_s = 1.0 / rate_hz;
    const TestRig rig = rig_for(model, position_unit == "rad", period_s);
    const GuardSettings guards = guards_for(rig.scale, rig.device);
    const RecordUnits units{position_unit, force_unit == "N*m" ? "Nm" : force_unit};
    const Metadata metadata = flight_metadata(std::string("palpate ") + PALPATE_VERSION,
                                              simulated_metadata(rig), model_name, scheme, guards, rate_hz);
    validate(scheme, model, period_s);
    SimulatedDevice device{rig.device, rig.hand, simulated_substeps(period_s)};
    RecordSinks sinks;
    if (telemetry_port) {
        const std::string reason = sinks.telemetry.open(*telemetry_port, telemetry_hz, units);
        detail::require(reason.empty(), reason);
    }
    if (!record.empty()) {
        const std::string reason = sinks.file.open(record, units, metadata, force);
        detail::require(reason.empty(), reason);
    }
    const Opened opened = device.open();
    detail::require(static_cast<bool>(opened), opened.reason);

    SessionReport report;
    std::atomic<bool> asked{false};
    Watcher watcher{progress, &LoopProgress::force, asked};
    {
        const py::gil_scoped_release unlocked;
        report = render_live(model, scheme, device, guards, settings, sinks, asked,
                             [&](const SessionView& view) { watcher(view); });
    }
    const Domain& domain = model.domain();
    SessionExpectation expected{
        false, guards.encoder_step, {domain.lower[0], domain.upper[0]}, units.position};
    const std::vector<std::string> notes =
        close_record(sinks, report, settings.loop, units, metadata, record, force, expected);
    watcher.rethrow();
    py::dict summary = summary_of(report, settings.loop, sinks, record, notes, expected);
    summary["energy"] = energy_of(report.loop);
    return summary;
}

}  // namespace

void bind_run(py::module_& module) {
    const LoopSettings loop;
    const RealTimeOptions real_time;
    module.attr("usual_telemetry_hz") = Telemetry::usual_hz;
    py::class_<LoopSettings>(module, "LoopSettings",
                             "When a rendering ticks, and when it ends: the defaults.")
        .def(py::init<>())
        .def_readonly("rate_hz", &LoopSettings::rate_hz)
        .def_readonly("duration_s", &LoopSettings::duration_s)
        .def_readonly("lowest_rate_share", &LoopSettings::lowest_rate_share);
    module.def(
        "render", &render_in_python, "model"_a, "scheme"_a, py::kw_only(), "position_unit"_a = "rad",
        "force_unit"_a = "N*m", "rate_hz"_a = loop.rate_hz, "duration_s"_a = loop.duration_s, "record"_a = "",
        "force"_a = false, "model_name"_a = "", "telemetry_port"_a = py::none(),
        "telemetry_hz"_a = Telemetry::usual_hz, "priority"_a = real_time.priority, "cpu"_a = real_time.cpu,
        "lowest_rate_share"_a = loop.lowest_rate_share, "progress"_a = py::none(),
        "The model rendered in real time on a simulated device: the loop of palpate-control.\n\n"
        "Blocks for `duration_s` (inf: until Ctrl-C) without holding the interpreter. `record` names the\n"
        "recording, which grows as record.part; an existing one is refused, or replaced with `force`. A\n"
        "`telemetry_port` of this machine gets JSON lines over UDP.\n"
        "`progress(ticks, position, force, lost)` is called ten times a second.\n"
        "A rate below `lowest_rate_share` of `rate_hz` for half a second ends it, 0: never.\n"
        "Returns the summary by name; ValueError where it is refused before anything moves.");
}

}  // namespace palpate::bindings
