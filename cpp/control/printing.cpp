// SPDX-License-Identifier: Apache-2.0
#include "printing.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <iostream>
#include <string>
#include <system_error>
#include <utility>
#include <variant>
#include <vector>

#include <nlohmann/json.hpp>

#include "palpate/fields/readable.hpp"
#include "palpate/io/tick_record.hpp"

namespace palpate::control {

namespace {

constexpr std::size_t shown_ticks = 8;
constexpr int calls_a_line = 5;  ///< show() writes the status line in every fifth call, ten times a second

nlohmann::json json_of(const NamedValues& fields);

nlohmann::json json_of(std::monostate /*nothing*/) {
    return nullptr;
}

nlohmann::json json_of(const std::vector<NamedValues>& list) {
    nlohmann::json array = nlohmann::json::array();
    for (const NamedValues& fields : list) {
        array.push_back(json_of(fields));
    }
    return array;
}

template <class T>
nlohmann::json json_of(const T& value) {  // the JSON text has null for a number that is not finite
    return value;
}

nlohmann::json json_of(const NamedValues& fields) {
    nlohmann::json object = nlohmann::json::object();
    for (const NamedValue& field : fields) {
        object[field.name] = std::visit([](const auto& value) { return json_of(value); }, field.value);
    }
    return object;
}

/// Joins as many of the first parts as fit on one line of the terminal. A longer line could not be overwritten
/// completely.
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

void print_last_ticks(const Summary& summary) {
    const std::vector<TickRecord>& last = summary.report.last_ticks;
    const std::size_t count = std::min(shown_ticks, last.size());
    std::string rows;
    for (std::size_t k = last.size() - count; k < last.size(); ++k) {
        append_row(rows, last[k]);
    }
    std::cerr << "the last " << count << " ticks:\n"
              << column_names(summary.units) << "\n"
              << rows << std::flush;
}

}  // namespace

LiveView::LiveView(const LoopSettings& settings, RecordUnits units, std::atomic<double> LoopProgress::* force)
    : settings_{settings}, units_{std::move(units)}, force_{force}, terminal_{isatty(STDERR_FILENO) == 1} {}

void LiveView::warn(const std::string& sentence) {
    end();
    std::cerr << "warning: " << sentence << "\n";
}

void LiveView::end() {
    if (line_is_open_) {
        std::cerr << "\r\033[K";
        line_is_open_ = false;
    }
}

void LiveView::show(const SessionView& view) {
    if (view.refused != nullptr && !std::exchange(warned_of_privileges_, true)) {
        for (const std::string& sentence : *view.refused) {
            warn(sentence);
        }
    }
    if (view.disk_error != 0 && !std::exchange(warned_of_disk_, true)) {
        warn("the recording stopped, the loop continues: " +
             std::generic_category().message(view.disk_error));
    }
    const double rate = view.progress.rate.rate_hz();
    const bool is_slow = rate > 0.0 && rate < held_rate_share * settings_.rate_hz;
    if (is_slow && !is_slow_) {
        warn("the loop runs at " + readable(rate) + " Hz, must run at " + readable(settings_.rate_hz) +
             " Hz");
    }
    is_slow_ = is_slow;
    if (terminal_ && ++calls_ % calls_a_line == 0) {
        const auto ticks = view.progress.ticks.load(std::memory_order_relaxed);
        const auto missed = view.progress.missed.load(std::memory_order_relaxed);
        const std::string line =
            fitting({readable(static_cast<double>(ticks + missed) / settings_.rate_hz) + " s",
                     readable(view.progress.position.load(std::memory_order_relaxed)) + " " + units_.position,
                     readable((view.progress.*force_).load(std::memory_order_relaxed)) + " " + units_.force,
                     readable(rate) + " Hz", "missed " + std::to_string(missed)});
        std::cerr << "\r\033[K" << line << std::flush;
        line_is_open_ = true;
    }
}

void print_summary(const Summary& summary, bool as_json) {
    for (const std::string& warning : summary.warnings) {
        std::cerr << "warning: " << warning << "\n";
    }
    if (!summary.orderly()) {
        std::cerr << "error: " << summary.ended() << "; " << summary.zero_force() << "\n";
        print_last_ticks(summary);
        if (!summary.last_ticks.empty()) {
            std::cerr << summary.last_ticks << "\n";
        }
    }
    if (as_json) {
        std::cout << json_of(fields(summary)).dump() << std::endl;
        return;
    }
    std::cout << "verdict: " << level_of(summary.findings) << "\n";
    for (const SessionFinding& finding : summary.findings) {
        std::cout << "  " << finding.sentence << "\n";
    }
    constexpr std::size_t column = 11;
    for (const auto& [title, text] : lines(summary)) {
        std::cout << title << std::string(title.size() < column ? column - title.size() : 1, ' ') << text
                  << "\n";
    }
    std::cout << std::flush;
}

}  // namespace palpate::control
