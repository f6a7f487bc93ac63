// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "palpate/fields/readable.hpp"
#include "palpate/fields/value.hpp"
#include "palpate/io/recording_file.hpp"
#include "palpate/io/tick_record.hpp"
#include "palpate/run/live_device.hpp"
#include "palpate/run/loop.hpp"
#include "palpate/run/record_sinks.hpp"
#include "palpate/run/session.hpp"
#include "palpate/run/session_text.hpp"
#include "palpate/run/session_verdict.hpp"
#include "palpate/status.hpp"

namespace palpate {

/// Result of a run: all values that palpate-control and Python report.
struct Summary {
    SessionReport report;
    LoopSettings loop;
    RecordUnits units;
    std::string record;  ///< name of the recording; empty without one
    std::uint64_t recorded = 0;
    std::uint64_t lost_records = 0;
    std::uint64_t telemetry_sent = 0;
    std::uint64_t telemetry_dropped = 0;
    Range positions;
    Range forces;
    std::vector<TickRecord> kept;       ///< records of all ticks; empty if the caller did not require them
    std::vector<std::string> notes;     ///< messages to the user from the preparation of the run
    std::vector<std::string> warnings;  ///< warnings about the recording
    /// Message about the file NAME.fault.csv with the last ticks before a fault; empty without a fault or a recording
    std::string last_ticks;
    std::vector<SessionFinding> findings;
    std::string device;
    DeviceReport device_report;

    /// Returns true if the run ended as intended (`LoopReport::orderly`).
    [[nodiscard]] bool orderly() const noexcept { return report.loop.orderly(); }
    /// Returns the exit reason of the run as a sentence.
    [[nodiscard]] std::string ended() const { return exit_text(report.loop, loop); }
    /// Returns what is known about the force of the device after the run.
    [[nodiscard]] std::string zero_force() const { return closing_text(report.loop.zero_force); }
    /// Returns all messages of the run: refused real-time requests, notes and warnings.
    [[nodiscard]] std::vector<std::string> all_notes() const {
        std::vector<std::string> all = report.refused;
        for (const std::vector<std::string>& more : {notes, warnings}) {
            all.insert(all.end(), more.begin(), more.end());
        }
        if (!last_ticks.empty()) {
            all.push_back(last_ticks);
        }
        return all;
    }
};

/// Returns the percentiles of durations by name [us].
[[nodiscard]] inline NamedValues fields(const DurationHistogram& histogram) {
    return {{"p50_us", 1e-3 * histogram.quantile(0.5)},
            {"p99_us", 1e-3 * histogram.quantile(0.99)},
            {"p999_us", 1e-3 * histogram.quantile(0.999)},
            {"max_us", 1e-3 * static_cast<double>(histogram.largest())}};
}

/// Returns the number of ticks with each status that occurred in a run.
[[nodiscard]] inline NamedValues ticks_by_status(const LoopReport& loop) {
    NamedValues counts;
    for (std::size_t k = 0; k < status_texts.size(); ++k) {
        if (loop.ticks_by_status[k] > 0) {
            counts.push_back({std::string(status_texts[k].word), loop.ticks_by_status[k]});
        }
    }
    return counts;
}

/// Returns the values of a summary by name, for JSON and Python.
[[nodiscard]] inline NamedValues fields(const Summary& summary) {
    const LoopReport& loop = summary.report.loop;
    std::vector<NamedValues> findings;
    findings.reserve(summary.findings.size());
    for (const SessionFinding& finding : summary.findings) {
        findings.push_back({{"level", std::string(finding.level)}, {"sentence", finding.sentence}});
    }
    NamedValues all{
        {"verdict", verdict_text(summary.findings)},
        {"findings", findings},
        {"orderly", summary.orderly()},
        {"ended", summary.ended()},
        {"zero_force", summary.zero_force()},
        {"status", std::string(text(loop.status).word)},
        {"device", summary.device},
        {"ticks", loop.ticks()},
        {"rate_hz", loop.timing.rate_hz()},
        {"wanted_rate_hz", summary.loop.rate_hz},
        {"period", fields(loop.timing.period)},
        {"lateness", fields(loop.timing.lateness)},
        {"missed_deadlines", loop.timing.missed},
        {"longest_gap_us", 1e-3 * static_cast<double>(loop.timing.period.largest())},
        {"ticks_by_status", ticks_by_status(loop)},
        {"limit_cycles", loop.limit_cycles},
        {"lost_samples", loop.lost_samples},
        {"repeated_samples", loop.repeated_samples},
        {"largest_delay_s", loop.largest_delay},
        {"longest_delay_s", loop.longest_delay},
        {"record", summary.record.empty() ? Value{} : Value{summary.record}},
        {"recorded", summary.recorded},
        {"lost_records", summary.lost_records},
        {"telemetry_sent", summary.telemetry_sent},
        {"telemetry_dropped", summary.telemetry_dropped},
        {"position_range", std::vector<double>{summary.positions.lower, summary.positions.upper}},
        {"force_range", std::vector<double>{summary.forces.lower, summary.forces.upper}},
        {"energy", NamedValues{{"given_in_ramp_J", loop.given_in_ramp},
                               {"given_J", loop.given},
                               {"most_stored_J", loop.most_stored},
                               {"sentence", energy_text(loop)}}},
        {"without", summary.report.refused},
        {"notes", summary.all_notes()},
    };
    if (!summary.device_report.name.empty()) {
        all.push_back({summary.device_report.name, summary.device_report.fields});
    }
    return all;
}

/// Returns a summary as lines of text, for the terminal.
[[nodiscard]] inline Lines lines(const Summary& summary) {
    const LoopReport& loop = summary.report.loop;
    const bool slow = loop.timing.rate_hz() < held_rate_share * summary.loop.rate_hz;
    std::string counts;
    for (const NamedValue& status : ticks_by_status(loop)) {
        counts += (counts.empty() ? "" : ", ") + std::to_string(std::get<std::uint64_t>(status.value)) + " " +
                  status.name;
    }
    Lines all{
        {"ended", summary.ended() + "; " + summary.zero_force()},
        {"rate", readable(loop.timing.rate_hz()) + " Hz of " + readable(summary.loop.rate_hz) + " Hz" +
                     (slow ? ", lower than required, " : ", ") + std::to_string(loop.timing.missed) +
                     " deadlines of the loop missed"},
        {"period", percentiles(loop.timing.period) + " (the longest gap)"},
        {"late by", percentiles(loop.timing.lateness)},
        {"ticks", counts},
        {"samples",
         std::to_string(loop.lost_samples) + " lost, " + std::to_string(loop.repeated_samples) + " repeated"},
        {"delay", delay_text(loop)},
        {"energy", energy_text(loop)},
    };
    all.insert(all.end(), summary.device_report.lines.begin(), summary.device_report.lines.end());
    if (!summary.record.empty()) {
        all.emplace_back("recorded", summary.record + ": " + std::to_string(summary.recorded) + " rows, " +
                                         std::to_string(summary.lost_records) + " lost");
    }
    if (summary.telemetry_sent + summary.telemetry_dropped > 0) {
        all.emplace_back("telemetry", std::to_string(summary.telemetry_sent) + " lines sent, " +
                                          std::to_string(summary.telemetry_dropped) + " dropped");
    }
    return all;
}

}  // namespace palpate
