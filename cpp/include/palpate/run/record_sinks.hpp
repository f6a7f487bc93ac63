// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "palpate/io/recording_file.hpp"
#include "palpate/io/telemetry.hpp"
#include "palpate/io/tick_record.hpp"

namespace palpate {

/// Smallest and largest of all added values; NaN before the first value.
struct Range {
    double lower = std::numeric_limits<double>::quiet_NaN();
    double upper = std::numeric_limits<double>::quiet_NaN();

    /// Updates the smallest and the largest value with a new value; a NaN changes nothing.
    void add(double value) noexcept {
        lower = std::fmin(lower, value);
        upper = std::fmax(upper, value);
    }
};

/// Force that a recording contains.
enum class RecordedForce : std::uint8_t {
    Sent,    ///< the command after all guards
    Object,  ///< the force of a real object
    Applied  ///< the force of the motor, which the device computes itself
};

/// Passes the records of ticks to a file, to telemetry and to memory, and stores the range of positions and forces.
struct RecordSinks {
    RecordingFile file;
    Telemetry telemetry;
    std::vector<TickRecord> kept;
    bool keeps = false;  ///< true if every tick is kept in memory
    RecordedForce force = RecordedForce::Sent;

    /// Writes records to the recording, sends them as telemetry and keeps them if requested. The oldest comes first.
    void take(std::span<const TickRecord> ticks) noexcept {
        if (force != RecordedForce::Sent) {
            recorded_.assign(ticks.begin(), ticks.end());
            for (TickRecord& tick : recorded_) {
                tick.force = force == RecordedForce::Object ? object_force(tick) : tick.applied;
            }
            ticks = recorded_;
        }
        for (const TickRecord& tick : ticks) {
            positions.add(tick.position);
            forces.add(tick.force);
            extrapolated += tick.extrapolated ? 1 : 0;
        }
        if (file.is_open()) {
            file.take(ticks);
        }
        telemetry.take(ticks);
        if (keeps) {
            kept.insert(kept.end(), ticks.begin(), ticks.end());
        }
    }

    Range positions;  ///< smallest and largest position of the handle [m or rad]
    /// Smallest and largest sent force, or force of a real object [N or N*m]
    Range forces;
    std::uint64_t extrapolated = 0;  ///< number of ticks with a model evaluation outside its domain

  private:
    std::vector<TickRecord> recorded_;
};

}  // namespace palpate
