// SPDX-License-Identifier: Apache-2.0
#include "telling.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iostream>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "palpate/run/session_text.hpp"

namespace palpate::control {

namespace {

constexpr std::size_t shown_ticks = 8;
constexpr int calls_a_line = 5;  ///< the live line changes ten times a second

nlohmann::json statuses(const LoopReport& loop) {
    nlohmann::json counts = nlohmann::json::object();
    for (std::size_t k = 0; k < status_texts.size(); ++k) {
        if (loop.ticks_by_status[k] > 0) {
            counts[status_texts[k].word] = loop.ticks_by_status[k];
        }
    }
    return counts;
}

/// As many of the parts as fit on one line of the terminal: a longer one would leave its first half behind.
std::string fitting(const std::vector<std::string>& parts) {
    constexpr std::size_t usual_columns = 80;
    winsize size{};
    const bool known = ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
    const std::size_t columns = known ? size.ws_col : usual_columns;
    std::string line;
    for (const std::string& part : parts) {
        const std::string more = (line.empty() ? "" : "  ") + part;
        if (line.size() + more.size() >= columns) {
            break;
        }
        line += more;
    }
    return line;
}

}  // namespace

nlohmann::json microseconds(const DurationHistogram& histogram) {
    return {{"p50_us", 1e-3 * histogram.quantile(0.5)},
            {"p99_us", 1e-3 * histogram.quantile(0.99)},
            {"p999_us", 1e-3 * histogram.quantile(0.999)},
            {"max_us", 1e-3 * static_cast<double>(histogram.largest())}};
}

LiveView::LiveView(const LoopSettings& settings, RecordUnits units)
    : settings_{settings}, units_{std::move(units)}, terminal_{isatty(STDERR_FILENO) == 1} {}

void LiveView::say(const std::string& sentence) {
    end();
    std::cerr << sentence << "\n";
}

void LiveView::end() {
    if (line_is_open_) {
        std::cerr << "\r\033[K";
        line_is_open_ = false;
    }
}

void LiveView::show(const SessionView& view) {
    if (view.refused != nullptr && !std::exchange(told_privileges_, true)) {
        for (const std::string& sentence : *view.refused) {
            say("warning: " + sentence);
        }
    }
    if (view.disk_error != 0 && !std::exchange(told_disk_, true)) {
        say(std::string("warning: the recording stopped, the loop goes on: ") +
            std::generic_category().message(view.disk_error));
    }
    const double rate = view.progress.rate.rate_hz();
    const bool is_short = rate > 0.0 && rate < held_rate_share * settings_.rate_hz;
    if (is_short && !std::exchange(short_of_rate_, is_short)) {
        say("warning: the loop runs at " + readable(rate) + " Hz, asked for " + readable(settings_.rate_hz) +
            " Hz");
    }
    short_of_rate_ = is_short;
    if (terminal_ && ++calls_ % calls_a_line == 0) {
        const auto ticks = view.progress.ticks.load(std::memory_order_relaxed);
        const auto missed = view.progress.missed.load(std::memory_order_relaxed);
        const std::string line =
            fitting({readable(static_cast<double>(ticks + missed) / settings_.rate_hz) + " s",
                     readable(view.progress.position.load(std::memory_order_relaxed)) + " " + units_.position,
                     readable(view.progress.force.load(std::memory_order_relaxed)) + " " + units_.force,
                     readable(rate) + " Hz", "missed " + std::to_string(missed)});
        std::cerr << "\r\033[K" << line << std::flush;
        line_is_open_ = true;
    }
}

void tell_summary(const SessionReport& report, const SessionSettings& settings, const RecordSinks& sinks,
                  const std::string& record, const std::vector<SessionFinding>& findings, const Story& device,
                  bool as_json) {
    const LoopReport& loop = report.loop;
    const RecordingFile& file = sinks.file;
    const std::string ending = ending_text(loop, settings.loop);
    if (as_json) {
        nlohmann::json summary{
            {"verdict", verdict_text(findings)},
            {"ended", ending},
            {"status", text(loop.status).word},
            {"ticks", loop.timing.ticks()},
            {"rate_hz", loop.timing.rate_hz()},
            {"wanted_rate_hz", settings.loop.rate_hz},
            {"period", microseconds(loop.timing.period)},
            {"lateness", microseconds(loop.timing.lateness)},
            {"missed_deadlines", loop.timing.missed},
            {"longest_gap_us", 1e-3 * static_cast<double>(loop.timing.period.largest())},
            {"ticks_by_status", statuses(loop)},
            {"lost_samples", loop.lost_samples},
            {"repeated_samples", loop.repeated_samples},
            {"record", record.empty() ? nlohmann::json() : nlohmann::json(record)},
            {"recorded", file.written()},
            {"lost_records", report.lost_records + file.refused()},
            {"telemetry_sent", sinks.telemetry.sent()},
            {"telemetry_dropped", sinks.telemetry.dropped()},
            {"energy",
             {{"given_in_ramp_J", loop.given_in_ramp},
              {"given_J", loop.given},
              {"most_stored_J",
               std::isfinite(loop.most_stored) ? nlohmann::json(loop.most_stored) : nlohmann::json()}}},
            {"without", report.refused}};
        if (!device.json.is_null()) {
            summary.update(device.json);
        }
        std::cout << summary.dump() << std::endl;
        return;
    }
    std::string counted;
    const nlohmann::json counts = statuses(loop);
    for (const auto& [word, count] : counts.items()) {
        counted += (counted.empty() ? "" : ", ") + std::to_string(count.get<std::uint64_t>()) + " " + word;
    }
    std::cout << "verdict: " << level_of(findings) << "\n";
    for (const SessionFinding& finding : findings) {
        std::cout << "  " << finding.sentence << "\n";
    }
    std::cout << "ended      " << ending << "\n"
              << "rate       " << readable(loop.timing.rate_hz()) << " Hz of "
              << readable(settings.loop.rate_hz) << " Hz"
              << (loop.timing.rate_hz() < held_rate_share * settings.loop.rate_hz ? ", lower than asked, "
                                                                                  : ", ")
              << loop.timing.missed << " deadlines missed\n"
              << "period     " << percentiles(loop.timing.period) << " (the longest gap)\n"
              << "late by    " << percentiles(loop.timing.lateness) << "\n"
              << "ticks      " << counted << "\n"
              << "samples    " << loop.lost_samples << " lost, " << loop.repeated_samples << " repeated\n"
              << "energy     " << energy_text(loop) << "\n";
    for (const auto& [title, text] : device.lines) {
        std::cout << title << std::string(title.size() < 11 ? 11 - title.size() : 1, ' ') << text << "\n";
    }
    if (!record.empty()) {
        std::cout << "recorded   " << record << ": " << file.written() << " rows, "
                  << report.lost_records + file.refused() << " lost\n";
    }
    if (sinks.telemetry.sent() + sinks.telemetry.dropped() > 0) {
        std::cout << "telemetry  " << sinks.telemetry.sent() << " lines sent, " << sinks.telemetry.dropped()
                  << " dropped\n";
    }
    std::cout << std::flush;
}

void tell_last_ticks(const SessionReport& report, const RecordUnits& units) {
    const std::size_t count = std::min(shown_ticks, report.last_ticks.size());
    std::string rows;
    for (std::size_t k = report.last_ticks.size() - count; k < report.last_ticks.size(); ++k) {
        append_row(rows, report.last_ticks[k]);
    }
    std::cerr << "the last " << count << " ticks:\n" << column_names(units) << "\n" << rows << std::flush;
}

}  // namespace palpate::control
