// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <exception>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/stl.h>

#include "bindings.hpp"
#include "palpate/run/session.hpp"
#include "palpate/run/session_text.hpp"
#include "palpate/run/session_verdict.hpp"

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

/// Calls Python with ticks, position, force and lost samples; an exception from there ends the session and is thrown
/// again afterwards.
class Watcher {
  public:
    Watcher(const std::optional<py::function>& progress, std::atomic<double> LoopProgress::* force,
            std::atomic<bool>& asked)
        : progress_{progress}, force_{force}, asked_{asked} {}

    void operator()(const SessionView& view) {
        ask_python(asked_);
        if (!progress_ || error_ || views_++ % views_a_call != 0) {
            return;
        }
        const py::gil_scoped_acquire locked;
        try {
            (*progress_)(view.progress.ticks.load(std::memory_order_relaxed),
                         view.progress.position.load(std::memory_order_relaxed),
                         (view.progress.*force_).load(std::memory_order_relaxed),
                         view.progress.lost.load(std::memory_order_relaxed));
        } catch (const py::error_already_set&) {
            error_ = std::current_exception();
            asked_.store(true, std::memory_order_relaxed);
        }
    }

    void rethrow() const {
        if (error_) {
            std::rethrow_exception(error_);
        }
    }

  private:
    static constexpr int views_a_call = 5;  ///< ten a second, so that a person sees a number change
    const std::optional<py::function>& progress_;
    std::atomic<double> LoopProgress::* force_;
    std::atomic<bool>& asked_;
    std::exception_ptr error_;
    int views_ = 0;
};

/// Renames the recording, if there is one; `record` becomes its name. Returns notes for a person: privileges that were
/// refused, and every other difference from what was asked for. What the verdict needs is added to `expected`.
inline std::vector<std::string> close_record(RecordSinks& sinks, const SessionReport& report,
                                             const LoopSettings& settings, const RecordUnits& units,
                                             const Metadata& metadata, std::string& record, bool force,
                                             SessionExpectation& expected) {
    std::vector<std::string> notes = report.refused;
    if (record.empty()) {
        return notes;
    }
    if (const std::string& aside = sinks.file.file().set_aside_as(); !aside.empty()) {
        notes.push_back("a recording that was cut off earlier is kept as " + aside);
    }
    const std::string asked_for = record;
    expected.recorded = true;
    expected.warnings = finish_record(sinks.file, report, settings, record);
    notes.insert(notes.end(), expected.warnings.begin(), expected.warnings.end());
    if (!is_orderly(report.loop.ending)) {
        notes.push_back(write_last_ticks(asked_for, force, units, metadata, report, settings));
    }
    return notes;
}

inline py::list findings_of(const std::vector<SessionFinding>& findings) {
    py::list records;
    for (const SessionFinding& finding : findings) {
        records.append(py::dict("level"_a = finding.level, "sentence"_a = finding.sentence));
    }
    return records;
}

/// What a session did, by name. `record` is the name that its recording has, empty without one.
inline py::dict summary_of(const SessionReport& report, const LoopSettings& settings,
                           const RecordSinks& sinks, const std::string& record,
                           const std::vector<std::string>& notes, const SessionExpectation& expected) {
    const std::vector<SessionFinding> findings = judge_session(report, settings, sinks, expected);
    return py::dict(
        "verdict"_a = verdict_text(findings), "findings"_a = findings_of(findings),
        "orderly"_a = is_orderly(report.loop.ending), "ended"_a = ending_text(report.loop, settings),
        "status"_a = text(report.loop.status).word, "ticks"_a = report.loop.timing.ticks(),
        "rate_hz"_a = report.loop.timing.rate_hz(), "wanted_rate_hz"_a = settings.rate_hz,
        "period"_a = microseconds(report.loop.timing.period),
        "lateness"_a = microseconds(report.loop.timing.lateness),
        "missed_deadlines"_a = report.loop.timing.missed,
        "longest_gap_us"_a = 1e-3 * static_cast<double>(report.loop.timing.period.largest()),
        "ticks_by_status"_a = statuses(report.loop), "lost_samples"_a = report.loop.lost_samples,
        "repeated_samples"_a = report.loop.repeated_samples,
        "record"_a = record.empty() ? py::object(py::none()) : py::cast(record),
        "recorded"_a = sinks.file.written(), "lost_records"_a = report.lost_records + sinks.file.refused(),
        "telemetry_sent"_a = sinks.telemetry.sent(), "telemetry_dropped"_a = sinks.telemetry.dropped(),
        "notes"_a = notes);
}

}  // namespace palpate::bindings
