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

/// One tick as it is recorded and sent: numbers in SI units.
struct TickRecord {
    double time = 0.0;      ///< of the wake-up, since the first one [s]
    double position = 0.0;  ///< measured [m or rad]
    double force = 0.0;     ///< after the guards, positive out of the object [N or N*m]
    double applied = 0.0;   ///< of the device at the sample, same sign
    double measured =
        std::numeric_limits<double>::quiet_NaN();  ///< of the transducer, same sign; NaN without one
    double environment_position = 0.0;             ///< position y of the object [m or rad]
    double velocity = 0.0;                         ///< of the device [m/s or rad/s]
    double device_time = 0.0;                      ///< the device's clock [s]
    double lateness = 0.0;                         ///< of the wake-up [s]
    std::uint64_t sequence = 0;                    ///< of the device's sample
    std::int32_t evaluations = 0;                  ///< of the environment
    Status status = Status::Ok;
    bool extrapolated = false;  ///< the object was evaluated outside its data
};

/// Returns the force of a real object against the handle. Without a transducer it is the force that the motor holds
/// against the object, which is valid for slow motion and includes the friction of the device.
[[nodiscard]] inline double object_force(const TickRecord& tick) noexcept {
    return std::isnan(tick.measured) ? -tick.applied : tick.measured;
}

/// Units of a model at the end of the column names; empty without a unit.
struct RecordUnits {
    std::string position = "rad";
    std::string force = "Nm";
};

/// Returns the units of a recording from those of a model, which has torques in N*m.
[[nodiscard]] inline RecordUnits record_units(const std::string& position, const std::string& force) {
    return {position, force == "N*m" ? "Nm" : force};
}

/// Returns the end of a column name, such as "_Nm"; empty without a unit.
[[nodiscard]] inline std::string suffix_of(const std::string& unit) {
    return unit.empty() ? "" : "_" + unit;
}

namespace detail {

/// Appends the shortest text from which the same number is read.
inline void append_number(std::string& text, double value) {
    std::array<char, 32> digits{};
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
    text.append(digits.data(), end);
}

/// Appends a time to the nanosecond, which is its resolution.
inline void append_nanoseconds(std::string& text, double seconds) {
    std::array<char, 32> digits{};
    const auto end =
        std::to_chars(digits.data(), digits.data() + digits.size(), seconds, std::chars_format::fixed, 9).ptr;
    text.append(digits.data(), end);
}

}  // namespace detail

/// Returns the column names: a stem, and the unit after the last underscore. Position and force come first with plain
/// stems, so that a reader chooses them without a hint. The table of units does not contain velocities; `radps` keeps a
/// velocity from being read as another quantity.
[[nodiscard]] inline std::string column_names(const RecordUnits& units) {
    const std::string position = suffix_of(units.position);
    const std::string force = suffix_of(units.force);
    return "time_s,position" + position + ",force" + force + ",applied" + force + ",environment_position" +
           position + ",velocity" + position + (position.empty() ? "" : "ps") +
           ",sequence,device_clock_s,lateness_s,evaluations,extrapolated,status";
}

/// Appends the columns as one line of numbers.
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

/// Appends the columns as one JSON object; a number that is not finite becomes null.
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
