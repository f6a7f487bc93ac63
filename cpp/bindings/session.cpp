// SPDX-License-Identifier: Apache-2.0
#include "palpate/session.hpp"

#include <atomic>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <pybind11/stl.h>

#include "bindings.hpp"
#include "palpate/bench.hpp"
#include "palpate/device/simulated.hpp"
#include "palpate/session_text.hpp"

namespace palpate::bindings {

namespace py = pybind11;
using namespace py::literals;

namespace {

py::dict microseconds(const DurationHistogram& histogram) {
    return py::dict("p50_us"_a = 1e-3 * histogram.quantile(0.5), "p99_us"_a = 1e-3 * histogram.quantile(0.99),
                    "p999_us"_a = 1e-3 * histogram.quantile(0.999),
                    "max_us"_a = 1e-3 * static_cast<double>(histogram.largest()));
}

py::dict statuses(const LoopReport& loop) {
    py::dict counts;
    for (std::size_t k = 0; k < status_texts.size(); ++k) {
        if (loop.ticks_by_status[k] > 0) {
            counts[status_texts[k].word] = loop.ticks_by_status[k];
        }
    }
    return counts;
}

/// Ctrl-C reaches Python as an exception of its next line; while C++ waits it has to ask.
void ask_python(std::atomic<bool>& asked) {
    const py::gil_scoped_acquire locked;
    if (PyErr_CheckSignals() != 0) {
        PyErr_Clear();
        asked.store(true, std::memory_order_relaxed);
    }
}

py::dict render_in_python(const ForceModel& model, const Scheme& scheme, const std::string& position_unit,
                          const std::string& force_unit, double rate_hz, double duration_s,
                          std::string record, const std::string& model_name,
                          std::optional<std::uint16_t> telemetry_port, double telemetry_hz, int priority,
                          int cpu, double lowest_rate_share) {
    SessionSettings settings;
    settings.loop.rate_hz = rate_hz;
    settings.loop.duration_s = duration_s;
    settings.loop.lowest_rate_share = lowest_rate_share;
    settings.real_time = {priority, cpu};
    validate(settings.loop);
    const double period_s = 1.0 / rate_hz;
    const Bench bench = bench_for(model, position_unit == "rad", period_s);
    const GuardSettings guards = bench.guards();
    const RecordUnits units{position_unit, force_unit == "N*m" ? "Nm" : force_unit};
    const Metadata metadata = flight_metadata(std::string("palpate ") + PALPATE_VERSION,
                                              simulated_metadata(bench), model_name, scheme, guards, rate_hz);
    validate(scheme, model, period_s);
    SimulatedDevice device{bench.device, bench.hand, simulated_substeps(period_s)};
    Outlets outlets;
    if (telemetry_port) {
        const std::string reason = outlets.telemetry.open(*telemetry_port, telemetry_hz, units);
        detail::require(reason.empty(), reason);
    }
    if (!record.empty()) {
        const std::string reason = outlets.file.open(record, units, metadata);
        detail::require(reason.empty(), reason);
    }
    const Opened opened = device.open();
    detail::require(static_cast<bool>(opened), opened.reason);

    SessionReport report;
    std::atomic<bool> asked{false};
    {
        const py::gil_scoped_release unlocked;
        report = render_live(model, scheme, device, guards, settings, outlets, asked,
                             [&](const SessionView& /*view*/) { ask_python(asked); });
    }
    std::vector<std::string> notes = report.refused;
    const std::string asked_for = record;
    if (!record.empty()) {
        for (std::string& warning : finish_record(outlets.file, report, settings.loop, record)) {
            notes.push_back(std::move(warning));
        }
        if (!is_orderly(report.loop.ending)) {
            notes.push_back(write_last_ticks(asked_for, units, metadata, report, settings.loop));
        }
    }
    return py::dict("orderly"_a = is_orderly(report.loop.ending),
                    "ended"_a = ending_text(report.loop, settings.loop),
                    "status"_a = text(report.loop.status).word, "ticks"_a = report.loop.timing.ticks(),
                    "rate_hz"_a = report.loop.timing.rate_hz(), "wanted_rate_hz"_a = rate_hz,
                    "period"_a = microseconds(report.loop.timing.period),
                    "lateness"_a = microseconds(report.loop.timing.lateness),
                    "missed_deadlines"_a = report.loop.timing.missed,
                    "longest_gap_us"_a = 1e-3 * static_cast<double>(report.loop.timing.period.largest()),
                    "ticks_by_status"_a = statuses(report.loop), "lost_samples"_a = report.loop.lost_samples,
                    "repeated_samples"_a = report.loop.repeated_samples,
                    "record"_a = record.empty() ? py::object(py::none()) : py::cast(record),
                    "recorded"_a = outlets.file.written(),
                    "lost_records"_a = report.lost_records + outlets.file.refused(),
                    "telemetry_sent"_a = outlets.telemetry.sent(),
                    "telemetry_dropped"_a = outlets.telemetry.dropped(), "notes"_a = notes);
}

}  // namespace

void bind_session(py::module_& module) {
    const LoopSettings loop;
    const RealTimeOptions real_time;
    module.attr("usual_telemetry_hz") = Telemetry::usual_hz;
    py::class_<LoopSettings>(module, "LoopSettings", "When a rendering ticks, and when it ends: the defaults.")
        .def(py::init<>())
        .def_readonly("rate_hz", &LoopSettings::rate_hz)
        .def_readonly("duration_s", &LoopSettings::duration_s)
        .def_readonly("lowest_rate_share", &LoopSettings::lowest_rate_share);
    module.def(
        "render", &render_in_python, "model"_a, "scheme"_a, py::kw_only(), "position_unit"_a = "rad",
        "force_unit"_a = "N*m", "rate_hz"_a = loop.rate_hz, "duration_s"_a = loop.duration_s, "record"_a = "",
        "model_name"_a = "", "telemetry_port"_a = py::none(), "telemetry_hz"_a = Telemetry::usual_hz,
        "priority"_a = real_time.priority, "cpu"_a = real_time.cpu,
        "lowest_rate_share"_a = loop.lowest_rate_share,
        "The model rendered in real time on a simulated device: the loop of palpate-control.\n\n"
        "Blocks for `duration_s` (inf: until Ctrl-C) without holding the interpreter. `record` names the\n"
        "recording, which grows as record.part; a `telemetry_port` of this machine gets JSON lines over "
        "UDP.\n"
        "A rate below `lowest_rate_share` of `rate_hz` for half a second ends it, 0: never.\n"
        "Returns the summary by name; ValueError where it is refused before anything moves.");
}

}  // namespace palpate::bindings
