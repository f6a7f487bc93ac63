// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <string>
#include <utility>
#include <vector>

#include "palpate/run/session.hpp"
#include "palpate/run/summary.hpp"

namespace palpate::control {

/// Prints warnings of a run on standard error while the run continues. On a terminal it also shows time, position,
/// force and rate on one line that is overwritten ten times a second.
class LiveView {
  public:
    LiveView(const LoopSettings& settings, RecordUnits units, std::atomic<double> LoopProgress::* force);
    void show(const SessionView& view);
    void end();

  private:
    void warn(const std::string& sentence);

    LoopSettings settings_;
    RecordUnits units_;
    std::atomic<double> LoopProgress::* force_;  ///< the shown force
    bool terminal_;
    bool warned_of_privileges_ = false;
    bool warned_of_disk_ = false;
    bool is_slow_ = false;
    bool line_is_open_ = false;
    int calls_ = 0;
};

/// Prints warnings and, after a fault, the last ticks on standard error. Then prints the verdict and the summary of a
/// run on standard output, as lines or as one JSON object.
void print_summary(const Summary& summary, bool as_json);

}  // namespace palpate::control
