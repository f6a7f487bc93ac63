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

/// A defect of a run: a sentence with the measured value, the likely cause and the cure.
struct SessionFinding {
    std::string_view level;  ///< verdict on a run with this defect: "usable" or "no"
    std::string sentence;
};

/// Properties of a run that are needed to judge it.
struct SessionExpectation {
    bool recorded = false;      ///< true if a recording was requested
    double encoder_step = 0.0;  ///< encoder step of the device [m or rad]; 0: the encoder has no steps
    Range domain{};             ///< domain of the rendered model [m or rad]; NaN for a real object
    std::string position_unit{};
    std::vector<std::string> warnings{};  ///< warnings about the model or the recording
};

namespace detail {

/// A run is not good if missed ticks divided by planned ticks exceed this limit, or if lost and repeated samples
/// divided by ticks exceed this limit [-]
inline constexpr double tolerated_loss = 0.001;
/// A recording of a real object is not good if the handle's travel is less than this number of encoder steps
inline constexpr double fewest_encoder_steps = 50;

/// Returns two counts and their ratio as a text such as "12 of 1000 (1.2 %)".
[[nodiscard]] inline std::string share_text(std::uint64_t part, std::uint64_t whole) {
    return std::to_string(part) + " of " + std::to_string(whole) + " (" +
           readable(100.0 * static_cast<double>(part) /
                    static_cast<double>(std::max<std::uint64_t>(whole, 1))) +
           " %)";
}

/// Returns true if `part` is larger than the given share of `whole`.
[[nodiscard]] inline bool exceeds(std::uint64_t part, std::uint64_t whole, double share) noexcept {
    return static_cast<double>(part) > share * static_cast<double>(whole);
}

/// Adds findings about missed deadlines, a low rate, lost samples and lost rows.
inline void judge_losses(const SessionReport& report, const LoopSettings& settings,
                         std::vector<SessionFinding>& findings) {
    const LoopTiming& timing = report.loop.timing;
    const std::uint64_t ticks = report.loop.ticks();
    if (const std::uint64_t deadlines = timing.wakes() + timing.missed;
        exceeds(timing.missed, deadlines, tolerated_loss)) {
        findings.push_back(
            {"usable",
             share_text(timing.missed, deadlines) +
                 " deadlines of the loop were missed: close other programs, or allow real-time priority"});
    } else if (ticks > 1 && timing.rate_hz() < held_rate_share * settings.rate_hz) {
        findings.push_back({"usable", "the rate of the loop was " + readable(timing.rate_hz()) + " Hz of " +
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

/// Adds findings about ticks with a changed or unsolved force or outside the domain, and about a run without a force.
inline void judge_forces(const LoopReport& loop, const RecordSinks& sinks, const SessionExpectation& expected,
                         std::vector<SessionFinding>& findings) {
    const std::uint64_t ticks = loop.ticks();
    const auto count = [&](Status status) { return loop.ticks_by_status[static_cast<std::size_t>(status)]; };
    const auto changed = [&](std::uint64_t part, const std::string& sentence) {
        if (exceeds(part, ticks, tolerated_change)) {
            findings.push_back({"usable", share_text(part, ticks) + " ticks " + sentence});
        }
    };
    changed(count(Status::Limited),
            "clipped the force to the force limit: raise the force limit, or use a stronger device");
    changed(count(Status::EnergyLimited) + count(Status::LimitCycleScaled),
            "reduced the force, because the rendering gave energy: choose the structure with palpate plan");
    changed(count(Status::MaxIterations) + count(Status::NotUnique),
            "did not solve the load line: choose the structure with palpate plan");
    changed(sinks.extrapolated,
            "had a position outside the model's domain, " + readable(expected.domain.lower) + " to " +
                readable(expected.domain.upper) + " " + expected.position_unit +
                ": move the handle only within the domain, or identify the model over a larger domain");
    if (ticks > 0 && count(Status::Ramp) == ticks) {
        findings.push_back(
            {"usable",
             "all " + std::to_string(ticks) +
                 " ticks were part of the start ramp, which scales the force down: run for a longer time"});
    }
    if (ticks > 0 && sinks.forces.lower == 0.0 && sinks.forces.upper == 0.0) {
        findings.push_back({"no", "every force was zero: the handle did not touch the object between " +
                                      readable(sinks.positions.lower) + " and " +
                                      readable(sinks.positions.upper) + " " + expected.position_unit +
                                      "; move the handle against the object"});
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
             range + ", so the force over position is unknown: move the handle over the whole object"});
    } else if (covered < smallest_domain_share * domain) {
        findings.push_back({"usable", range + ", " + readable(100.0 * covered / domain) +
                                          " % of the model's domain: move the handle over the whole object"});
    } else if (std::isnan(domain) && covered < fewest_encoder_steps * expected.encoder_step) {
        findings.push_back({"usable", range + ", " + readable(covered / expected.encoder_step) +
                                          " encoder steps: move the handle over the whole object"});
    }
}

}  // namespace detail

/// Returns the defects of a run, the most serious defect first. An empty list means the verdict "good".
[[nodiscard]] inline std::vector<SessionFinding> judge_session(const SessionReport& report,
                                                               const LoopSettings& settings,
                                                               const RecordSinks& sinks,
                                                               const SessionExpectation& expected) {
    std::vector<SessionFinding> findings;
    if (!report.loop.orderly()) {
        findings.push_back(
            {"no", exit_text(report.loop, settings) + "; " + closing_text(report.loop.zero_force)});
    }
    const auto usable_rows = report.loop.ticks_by_status[static_cast<std::size_t>(Status::Ok)];
    if (expected.recorded && sinks.file.written() == 0) {
        findings.push_back({"no", "nothing was recorded"});
    } else if (expected.recorded && usable_rows == 0) {
        findings.push_back(
            {"no", "the recording has no usable row: in all " + std::to_string(sinks.file.written()) +
                       " rows the force was scaled, limited or missing; record for a longer time"});
    }
    for (const std::string& warning : expected.warnings) {
        findings.push_back({"usable", warning});
    }
    if (is_orderly(report.loop.exit_reason)) {  // forces and motion are not judged after a fault
        detail::judge_forces(report.loop, sinks, expected, findings);
        detail::judge_motion(sinks, expected, findings);
    }
    detail::judge_losses(report, settings, findings);
    std::stable_partition(findings.begin(), findings.end(),
                          [](const SessionFinding& finding) { return finding.level == "no"; });
    return findings;
}

/// Returns the verdict on a run without its reasons: "good", "usable" or "no".
[[nodiscard]] inline std::string level_of(const std::vector<SessionFinding>& findings) {
    return findings.empty() ? "good" : std::string(findings.front().level);
}

/// Returns the verdict on a run with its reasons: "good", "usable: ..." or "no: ...".
[[nodiscard]] inline std::string verdict_text(const std::vector<SessionFinding>& findings) {
    std::string text = level_of(findings);
    for (const SessionFinding& finding : findings) {
        text += (&finding == &findings.front() ? ": " : "; ") + finding.sentence;
    }
    return text;
}

}  // namespace palpate
