// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>

#include "palpate/status.hpp"

namespace palpate {

/// One tick as it is recorded and told: plain numbers, SI.
struct TickRecord {
    double time = 0.0;      ///< of the wake-up, since the first [s]
    double position = 0.0;  ///< measured [m or rad]
    double force = 0.0;     ///< sent after the guards, positive out of the object [N or N*m]
    double applied = 0.0;   ///< by the device when the position was sampled, same sign
    double measured =
        std::numeric_limits<double>::quiet_NaN();  ///< by the transducer, same sign; NaN without
    double environment_position = 0.0;             ///< y, where the object was evaluated [m or rad]
    double velocity = 0.0;                         ///< of the device [m/s or rad/s]
    double device_time = 0.0;                      ///< the device's clock [s]
    double lateness = 0.0;                         ///< of the wake-up [s]
    std::uint64_t sequence = 0;                    ///< of the device's sample
    std::int32_t evaluations = 0;                  ///< of the environment
    Status status = Status::Ok;
    bool extrapolated = false;  ///< the object was evaluated outside its data
};

/// The force of a real object against the handle: what the transducer says, or, without one, what the motor has
/// to hold against it. The latter holds for slow motion; the friction of the device is in it.
[[nodiscard]] inline double object_force(const TickRecord& tick) noexcept {
    return std::isnan(tick.measured) ? -tick.applied : tick.measured;
}

/// The units that a model gives to the columns, as they stand at the end of a column name; empty: unstated.
struct RecordUnits {
    std::string position = "rad";
    std::string force = "Nm";
};

/// Returns the units of a recording from those of a model, which has torques in N*m.
[[nodiscard]] inline RecordUnits record_units(const std::string& position, const std::string& force) {
    return {position, force == "N*m" ? "Nm" : force};
}

/// "_Nm": what a column's name ends in; empty for an unstated unit.
[[nodiscard]] inline std::string suffix_of(const std::string& unit) {
    return unit.empty() ? "" : "_" + unit;
}

namespace detail {

/// The shortest text that reads back as the same number.
inline void append_number(std::string& text, double value) {
    std::array<char, 32> digits{};
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
    text.append(digits.data(), end);
}

/// The wake-up's time and lateness to the nanosecond: there is no more in them.
inline void append_nanoseconds(std::string& text, double seconds) {
    std::array<char, 32> digits{};
    const auto end =
        std::to_chars(digits.data(), digits.data() + digits.size(), seconds, std::chars_format::fixed, 9).ptr;
    text.append(digits.data(), end);
}

}  // namespace detail

/// Column names: a stem, and the unit after the last underscore. Position and force come first and their stems
/// stand alone, so that a reader chooses them without a hint. A velocity has no unit of the table of units:
/// `radps` keeps it from being read as anything else.
[[nodiscard]] inline std::string column_names(const RecordUnits& units) {
    const std::string position = suffix_of(units.position);
    const std::string force = suffix_of(units.force);
    return "time_s,position" + position + ",force" + force + ",applied" + force + ",environment_position" +
           position + ",velocity" + position + (position.empty() ? "" : "ps") +
           ",sequence,device_clock_s,lateness_s,evaluations,extrapolated,status";
}

/// The same columns as one line of numbers.
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
    text += ',' + std::to_string(tick.evaluations) + (tick.extrapolated ? ",1," : ",0,");
    text += palpate::text(tick.status).word;
    text += '\n';
}

/// The same again as one JSON object; a number that is none becomes null.
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
