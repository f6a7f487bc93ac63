// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/stl.h>

#include "bindings.hpp"
#include "palpate/session.hpp"
#include "palpate/session_text.hpp"

namespace palpate::bindings {

namespace py = pybind11;
using namespace py::literals;

inline py::dict microseconds(const DurationHistogram& histogram) {
    return py::dict("p50_us"_a = 1e-3 * histogram.quantile(0.5), "p99_us"_a = 1e-3 * histogram.quantile(0.99),
                    "p999_us"_a = 1e-3 * histogram.quantile(0.999),
                    "max_us"_a = 1e-3 * static_cast<double>(histogram.largest()));
}

inline py::dict statuses(const LoopReport& loop) {
    py::dict counts;
    for (std::size_t k = 0; k < status_texts.size(); ++k) {
        if (loop.ticks_by_status[k] > 0) {
            counts[status_texts[k].word] = loop.ticks_by_status[k];
        }
    }
    return counts;
}

/// Ctrl-C reaches Python as an exception of its next line; while C++ waits it has to ask.
inline void ask_python(std::atomic<bool>& asked) {
    const py::gil_scoped_acquire locked;
    if (PyErr_CheckSignals() != 0) {
        PyErr_Clear();
        asked.store(true, std::memory_order_relaxed);
    }
}

/// Gives the recording, if there is one, its name, which `record` becomes. Returns what is to be told: privileges
/// that were refused, and everything that is not as it was asked for.
inline std::vector<std::string> close_record(Outlets& outlets, const SessionReport& report,
                                             const LoopSettings& settings, const RecordUnits& units,
                                             const Metadata& metadata, std::string& record) {
    std::vector<std::string> notes = report.refused;
    if (record.empty()) {
        return notes;
    }
    const std::string asked_for = record;
    for (std::string& warning : finish_record(outlets.file, report, settings, record)) {
        notes.push_back(std::move(warning));
    }
    if (!is_orderly(report.loop.ending)) {
        notes.push_back(write_last_ticks(asked_for, units, metadata, report, settings));
    }
    return notes;
}

/// What a session did, by name. `record` is the name that its recording has, empty without one.
inline py::dict summary_of(const SessionReport& report, const LoopSettings& settings, const Outlets& outlets,
                           const std::string& record, const std::vector<std::string>& notes) {
    return py::dict("orderly"_a = is_orderly(report.loop.ending),
                    "ended"_a = ending_text(report.loop, settings),
                    "status"_a = text(report.loop.status).word, "ticks"_a = report.loop.timing.ticks(),
                    "rate_hz"_a = report.loop.timing.rate_hz(), "wanted_rate_hz"_a = settings.rate_hz,
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

}  // namespace palpate::bindings
