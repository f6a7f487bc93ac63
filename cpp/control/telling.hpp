// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "palpate/run/record_sinks.hpp"
#include "palpate/run/session.hpp"
#include "palpate/run/session_verdict.hpp"

namespace palpate::control {

/// What a person is told while it runs, on standard error: what was refused, what falls short, and, on a
/// terminal only, one line that is alive.
class LiveView {
  public:
    LiveView(const LoopSettings& settings, RecordUnits units);
    void show(const SessionView& view);
    void end();

  private:
    void say(const std::string& sentence);

    LoopSettings settings_;
    RecordUnits units_;
    bool terminal_;
    bool told_privileges_ = false;
    bool told_disk_ = false;
    bool short_of_rate_ = false;
    bool line_is_open_ = false;
    int calls_ = 0;
};

/// What a device adds to the summary: lines of a title and a text, and the same as JSON, under a
/// name of its own.
struct Story {
    std::vector<std::pair<std::string, std::string>> lines;
    nlohmann::json json;
};

[[nodiscard]] nlohmann::json microseconds(const DurationHistogram& histogram);

/// Prints the verdict and the summary on standard output, as lines or as one JSON object.
void tell_summary(const SessionReport& report, const SessionSettings& settings, const RecordSinks& sinks,
                  const std::string& record, const std::vector<SessionFinding>& findings, const Story& device,
                  bool as_json);

/// The last ticks before a fault, on standard error.
void tell_last_ticks(const SessionReport& report, const RecordUnits& units);

}  // namespace palpate::control
