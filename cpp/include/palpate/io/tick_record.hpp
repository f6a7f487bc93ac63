// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "palpate/status.hpp"

namespace palpate {

/// Metadata at the start of a recording, as pairs of a key and its text.
using Metadata = std::vector<std::pair<std::string, std::string>>;

/// Record of one tick for recordings and telemetry, in SI units.
struct TickRecord {
    double time = 0.0;      ///< time of the tick's wake-up, counted from the first wake-up [s]
    double position = 0.0;  ///< measured position of the handle [m or rad]
    double force = 0.0;     ///< sent force after all guards, positive out of the object [N or N*m]
    double applied = 0.0;   ///< force that the device applied at the sample, same sign [N or N*m]
    /// Force of the transducer, same sign [N or N*m]; NaN without a transducer.
    double measured = std::numeric_limits<double>::quiet_NaN();
    double environment_position = 0.0;  ///< position y of the virtual object [m or rad]
    double velocity = 0.0;              ///< velocity of the handle [m/s or rad/s]
    double device_time = 0.0;           ///< time of the sample by the device's clock [s]
    double lateness = 0.0;              ///< actual minus planned time of the control loop's wake-up [s]
    /// Time from a sample until the device applied its force [s], `Reading::delay`; NaN if it is not measured.
    double delay = std::numeric_limits<double>::quiet_NaN();
    std::uint64_t sequence = 0;    ///< number of the sample, counted by the device
    std::int32_t evaluations = 0;  ///< number of evaluations of the model's force in this tick
    Status status = Status::Ok;
    bool extrapolated = false;  ///< true if the model was evaluated outside its domain
};

/// Returns the force of a real object against the handle. If the device has no transducer, returns the opposite of the
/// motor's force, which equals the object's force in slow motion and includes the friction of the device.
[[nodiscard]] inline double object_force(const TickRecord& tick) noexcept {
    return std::isnan(tick.measured) ? -tick.applied : tick.measured;
}

/// Units of position and force at the end of a recording's column names, such as force_Nm; empty without a unit.
struct RecordUnits {
    std::string position = "rad";
    std::string force = "Nm";
};

/// Converts the units of a model to those of a recording: the unit "N*m" of a model is "Nm" in a column name.
[[nodiscard]] inline RecordUnits record_units(const std::string& position, const std::string& force) {
    return {position, force == "N*m" ? "Nm" : force};
}

/// Returns a unit as the end of a column name, such as "_Nm"; "" for an empty unit.
[[nodiscard]] inline std::string suffix_of(const std::string& unit) {
    return unit.empty() ? "" : "_" + unit;
}

namespace detail {

/// Appends a number as the shortest text from which exactly the same number is read again.
inline void append_number(std::string& text, double value) {
    std::array<char, 32> digits{};
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
    text.append(digits.data(), end);
}

/// Appends a time [s] with nine decimals, because the clock's unit is the nanosecond.
inline void append_nanoseconds(std::string& text, double seconds) {
    std::array<char, 32> digits{};
    const auto end =
        std::to_chars(digits.data(), digits.data() + digits.size(), seconds, std::chars_format::fixed, 9).ptr;
    text.append(digits.data(), end);
}

}  // namespace detail

/// Returns the column names of a recording: name of the quantity, then underscore and unit, if it has one. A reader of
/// recordings chooses `position` and `force` by these names, without options. The unit `radps` of the velocity is not
/// in the reader's table of units, so that a reader does not take the velocity for another quantity.
[[nodiscard]] inline std::string column_names(const RecordUnits& units) {
    const std::string position = suffix_of(units.position);
    const std::string force = suffix_of(units.force);
    return "time_s,position" + position + ",force" + force + ",applied" + force + ",environment_position" +
           position + ",velocity" + position + (position.empty() ? "" : "ps") +
           ",sequence,device_clock_s,lateness_s,delay_s,evaluations,extrapolated,status";
}

/// Appends the record of a tick as one row of a CSV file.
inline void append_row(std::string& text, const TickRecord& tick) {
    detail::append_nanoseconds(text, tick.time);
    for (const double value :
         {tick.position, tick.force, tick.applied, tick.environment_position, tick.velocity}) {
        text += ',';
        detail::append_number(text, value);
    }
    text += ',' + std::to_string(tick.sequence) + ',';
    detail::append_number(text, tick.device_time);
    text += ',';
    detail::append_nanoseconds(text, tick.lateness);
    text += ',';
    if (!std::isnan(tick.delay)) {
        detail::append_nanoseconds(text, tick.delay);
    }
    text += ',' + std::to_string(tick.evaluations) + (tick.extrapolated ? ",1," : ",0,");
    text += palpate::text(tick.status).word;
    text += '\n';
}

/// Appends the record of a tick as one line of JSON for telemetry; a number that is not finite becomes null.
inline void append_json(std::string& text, const TickRecord& tick, const RecordUnits& units) {
    const auto field = [&](const std::string& name, double value) {
        text += '"' + name + "\":";
        if (std::isfinite(value)) {
            detail::append_number(text, value);
        } else {
            text += "null";
        }
        text += ',';
    };
    text += '{';
    field("time_s", tick.time);
    field("position" + suffix_of(units.position), tick.position);
    field("force" + suffix_of(units.force), tick.force);
    field("applied" + suffix_of(units.force), tick.applied);
    field("environment_position" + suffix_of(units.position), tick.environment_position);
    field("lateness_s", tick.lateness);
    text += std::string("\"status\":\"") + palpate::text(tick.status).word + "\"}\n";
}

}  // namespace palpate
