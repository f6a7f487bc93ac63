// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "palpate/io/recording_file.hpp"
#include "palpate/io/telemetry.hpp"
#include "palpate/io/tick_record.hpp"

namespace palpate {

/// Where the ticks of a rendering go besides the device: a file, a network, both or nowhere.
struct Outlets {
    RecordingFile file;
    Telemetry telemetry;

    void take(std::span<const TickRecord> ticks) noexcept {
        if (file.is_open()) {
            file.take(ticks);
        }
        telemetry.take(ticks);
    }
};

}  // namespace palpate
