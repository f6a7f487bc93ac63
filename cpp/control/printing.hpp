// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "palpate/run/session.hpp"
#include "palpate/run/summary.hpp"

namespace palpate::control {

/// Prints warnings of a running session on standard error, and on a terminal one line that is overwritten.
class LiveView {
  public:
    LiveView(const LoopSettings& settings, RecordUnits units);
    void show(const SessionView& view);
    void end();

  private:
    void warn(const std::string& sentence);

    LoopSettings settings_;
    RecordUnits units_;
    bool terminal_;
    bool warned_of_privileges_ = false;
    bool warned_of_disk_ = false;
    bool is_slow_ = false;
    bool line_is_open_ = false;
    int calls_ = 0;
};

/// Prints the verdict and the summary on standard output, as lines or as one JSON object. Before them prints warnings
/// and, after a fault, the last ticks on standard error.
void print_summary(const Summary& summary, bool as_json);

}  // namespace palpate::control
