// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "palpate/fields/readable.hpp"
#include "palpate/run/loop.hpp"
#include "palpate/run/record_sinks.hpp"
#include "palpate/run/session.hpp"
#include "palpate/run/session_text.hpp"
#include "palpate/status.hpp"

namespace palpate {

/// Defect of a session: value, likely cause and cure in one sentence.
struct SessionFinding {
    std::string_view level;  ///< "usable", or "no" for an unusable result
    std::string sentence;
};

/// Expected properties of a session.
struct SessionExpectation {
    bool recorded = false;      ///< true if a recording was requested
    double encoder_step = 0.0;  ///< of the device [m or rad]; 0 without quantisation
    Range domain{};             ///< positions of the rendered model; NaN for a real object
    std::string position_unit{};
    std::vector<std::string> warnings{};  ///< from `finish_record`
};

namespace detail {

inline constexpr double tolerated_loss = 0.001;     ///< share of deadlines, samples and rows that may be lost
inline constexpr double tolerated_change = 0.01;    ///< share of ticks with another force than the model's
inline constexpr double fewest_encoder_steps = 50;  ///< least number that a recording covers
inline constexpr double smallest_domain_share = 0.1;  ///< least share that a rendering covers

/// Returns a text such as "12 of 1000 (1.2 %)".
[[nodiscard]] inline std::string share_text(std::uint64_t part, std::uint64_t whole) {
    return std::to_string(part) + " of " + std::to_string(whole) + " (" +
           readable(100.0 * static_cast<double>(part) /
                    static_cast<double>(std::max<std::uint64_t>(whole, 1))) +
           " %)";
}

/// Returns true if a part exceeds a share of the whole.
[[nodiscard]] inline bool exceeds(std::uint64_t part, std::uint64_t whole, double share) noexcept {
    return static_cast<double>(part) > share * static_cast<double>(whole);
}

/// Adds findings about lost time, samples and rows.
inline void judge_losses(const SessionReport& report, const LoopSettings& settings,
                         std::vector<SessionFinding>& findings) {
    const LoopTiming& timing = report.loop.timing;
    const std::uint64_t ticks = timing.ticks();
    if (const std::uint64_t deadlines = ticks + timing.missed;
        exceeds(timing.missed, deadlines, tolerated_loss)) {
        findings.push_back(
            {"usable", share_text(timing.missed, deadlines) +
                           " deadlines were missed: close other programs, or allow real-time priority"});
    } else if (ticks > 1 && timing.rate_hz() < held_rate_share * settings.rate_hz) {
        findings.push_back({"usable", "the rate was " + readable(timing.rate_hz()) + " Hz of " +
                                          readable(settings.rate_hz) +
                                          " Hz: close other programs, or choose a lower rate"});
    }
    if (const std::uint64_t bad = report.loop.lost_samples + report.loop.repeated_samples;
        exceeds(bad, ticks, tolerated_loss)) {
        findings.push_back(
            {"usable", share_text(bad, ticks) +
                           " samples of the device were lost or repeated: check its cable, and close "
                           "other programs"});
    }
    if (report.lost_records > 0) {
        findings.push_back(
            {"usable", share_text(report.lost_records, ticks) +
                           " rows are missing in the recording, because the disk was too slow: record "
                           "to a faster disk"});
    }
}

/// Adds findings about ticks whose force differed from the model's force.
inline void judge_forces(const LoopReport& loop, const RecordSinks& sinks, const SessionExpectation& expected,
                         std::vector<SessionFinding>& findings) {
    const std::uint64_t ticks = loop.timing.ticks();
    const auto count = [&](Status status) { return loop.ticks_by_status[static_cast<std::size_t>(status)]; };
    const auto changed = [&](std::uint64_t part, const std::string& sentence) {
        if (exceeds(part, ticks, tolerated_change)) {
            findings.push_back({"usable", share_text(part, ticks) + " ticks " + sentence});
        }
    };
    changed(count(Status::Limited),
            "clipped the force to its limit: raise the limit, or use a stronger device");
    changed(count(Status::EnergyLimited) + count(Status::LimitCycleScaled),
            "reduced the force, because the rendering gave energy: choose its structure with palpate plan");
    changed(count(Status::MaxIterations) + count(Status::NotUnique),
            "did not solve the load line: choose the structure with palpate plan");
    changed(sinks.extrapolated, "lay outside the model's data, from " + readable(expected.domain.lower) +
                                    " to " + readable(expected.domain.upper) + " " + expected.position_unit +
                                    ": stay within, or identify the model over a larger range");
    if (ticks > 0 && count(Status::Ramp) == ticks) {
        findings.push_back({"usable", "all " + std::to_string(ticks) +
                                          " ticks lay within the ramp at the start: run for a longer time"});
    }
    if (ticks > 0 && sinks.forces.lower == 0.0 && sinks.forces.upper == 0.0) {
        findings.push_back({"no", "every force was zero: the handle did not touch the object between " +
                                      readable(sinks.positions.lower) + " and " +
                                      readable(sinks.positions.upper) + " " + expected.position_unit +
                                      "; move it against the object"});
    }
}

/// Adds findings about the motion of the handle.
inline void judge_motion(const RecordSinks& sinks, const SessionExpectation& expected,
                         std::vector<SessionFinding>& findings) {
    const double covered = sinks.positions.upper - sinks.positions.lower;
    const double domain = expected.domain.upper - expected.domain.lower;
    const std::string range = "the handle covered " + readable(covered) + " " + expected.position_unit;
    if (!(covered > 2.0 * expected.encoder_step)) {
        findings.push_back(
            {expected.recorded ? "no" : "usable",
             range + ", so the force over position is unknown: move it over the whole object"});
    } else if (covered < smallest_domain_share * domain) {
        findings.push_back({"usable", range + ", " + readable(100.0 * covered / domain) +
                                          " % of the model's domain: move it over the whole object"});
    } else if (std::isnan(domain) && covered < fewest_encoder_steps * expected.encoder_step) {
        findings.push_back({"usable", range + ", " + readable(covered / expected.encoder_step) +
                                          " steps of the encoder: move it over the whole object"});
    }
}

}  // namespace detail

/// Judges a session. The most serious finding comes first; an empty list means "good".
[[nodiscard]] inline std::vector<SessionFinding> judge_session(const SessionReport& report,
                                                               const LoopSettings& settings,
                                                               const RecordSinks& sinks,
                                                               const SessionExpectation& expected) {
    std::vector<SessionFinding> findings;
    if (!is_orderly(report.loop.exit_reason)) {
        findings.push_back({"no", exit_text(report.loop, settings)});
    }
    const auto usable_rows = report.loop.ticks_by_status[static_cast<std::size_t>(Status::Ok)];
    if (expected.recorded && sinks.file.written() == 0) {
        findings.push_back({"no", "nothing was recorded"});
    } else if (expected.recorded && usable_rows == 0) {
        findings.push_back({"no", "the recording has no usable row, because none of its " +
                                      std::to_string(sinks.file.written()) +
                                      " forces is that of the object alone: record for a longer time"});
    }
    for (const std::string& warning : expected.warnings) {
        findings.push_back({"usable", warning});
    }
    if (is_orderly(report.loop.exit_reason)) {  // an interrupted run does not show the usual motion
        detail::judge_forces(report.loop, sinks, expected, findings);
        detail::judge_motion(sinks, expected, findings);
    }
    detail::judge_losses(report, settings, findings);
    std::stable_partition(findings.begin(), findings.end(),
                          [](const SessionFinding& finding) { return finding.level == "no"; });
    return findings;
}

/// Returns "good", "usable" or "no".
[[nodiscard]] inline std::string level_of(const std::vector<SessionFinding>& findings) {
    return findings.empty() ? "good" : std::string(findings.front().level);
}

/// Returns "good", "usable: ..." or "no: ...".
[[nodiscard]] inline std::string verdict_text(const std::vector<SessionFinding>& findings) {
    std::string text = level_of(findings);
    for (const SessionFinding& finding : findings) {
        text += (&finding == &findings.front() ? ": " : "; ") + finding.sentence;
    }
    return text;
}

}  // namespace palpate
