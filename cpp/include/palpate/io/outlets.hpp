// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "palpate/io/recording_file.hpp"
#include "palpate/io/telemetry.hpp"
#include "palpate/io/tick_record.hpp"

namespace palpate {

/// Where ticks go besides the device: a file, a network, memory, all of them or nowhere.
struct Outlets {
    RecordingFile file;
    Telemetry telemetry;
    std::vector<TickRecord> kept;
    bool keeps = false;  ///< whether every tick is kept in memory
    bool real_object =
        false;  ///< whether the force to be told is that of a real object, not of a virtual one

    void take(std::span<const TickRecord> ticks) noexcept {
        if (real_object) {
            told_.assign(ticks.begin(), ticks.end());
            for (TickRecord& tick : told_) {
                tick.force = object_force(tick);
            }
            ticks = told_;
        }
        if (file.is_open()) {
            file.take(ticks);
        }
        telemetry.take(ticks);
        if (keeps) {
            kept.insert(kept.end(), ticks.begin(), ticks.end());
        }
    }

  private:
    std::vector<TickRecord> told_;
};

}  // namespace palpate
