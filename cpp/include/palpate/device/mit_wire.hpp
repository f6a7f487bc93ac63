// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "palpate/device/device.hpp"

namespace palpate::mit {

/// Bytes of a CAN frame of an MIT-mode drive.
using Frame = std::array<std::uint8_t, 8>;

/// Largest values of the fields. Position, velocity and torque reach from -value to +value, the gains from 0 to value.
struct Ranges {
    double position = 12.5;    ///< [rad]
    double velocity = 30.0;    ///< [rad/s]
    double torque = 10.0;      ///< [N*m]
    double stiffness = 500.0;  ///< kp [N*m/rad]
    double damping = 5.0;      ///< kd [N*m*s/rad]
};

/// Maker of a drive: the bytes before and after position, velocity and torque of its answer differ.
enum class Maker : std::uint8_t {
    Damiao,     ///< byte 0: low half number, high half state; registers through the number 0x7FF
    CubeMars,   ///< byte 0: number; byte 7: error
    RobStride,  ///< byte 0: number; bytes 6 and 7: temperature
};

/// Ranges of the fields of one drive, and its maker.
struct Preset {
    std::string_view name;
    Maker maker;
    Ranges ranges;
};

/// Drives by name. Sources: Damiao, the table of PyPI damiao-motor 1.0.6; CubeMars, from memory, not
/// checked against the manual of the AK series; RobStride, the table of PyPI robstride-dynamics 0.0.1. No number was tried on hardware.
/// No MIT frame of CubeMars (manual of the AK series 1.0.8) or RobStride sets a watchdog; RobStride's parameter 0x7028
/// canTimeout belongs to its private protocol.
inline constexpr std::array presets{
    Preset{"damiao-4310", Maker::Damiao, {12.5, 30.0, 10.0, 500.0, 5.0}},
    Preset{"damiao-4340", Maker::Damiao, {12.5, 10.0, 28.0, 500.0, 5.0}},
    Preset{"damiao-6006", Maker::Damiao, {12.5, 45.0, 20.0, 500.0, 5.0}},
    Preset{"damiao-8009", Maker::Damiao, {12.5, 45.0, 54.0, 500.0, 5.0}},
    Preset{"damiao-h3510", Maker::Damiao, {12.5, 280.0, 1.0, 500.0, 5.0}},
    Preset{"damiao-g6215", Maker::Damiao, {12.5, 45.0, 10.0, 500.0, 5.0}},
    Preset{"cubemars-ak60-6", Maker::CubeMars, {12.5, 45.0, 15.0, 500.0, 5.0}},
    Preset{"cubemars-ak70-10", Maker::CubeMars, {12.5, 50.0, 25.0, 500.0, 5.0}},
    Preset{"cubemars-ak80-6", Maker::CubeMars, {12.5, 76.0, 12.0, 500.0, 5.0}},
    Preset{"cubemars-ak80-9", Maker::CubeMars, {12.5, 50.0, 18.0, 500.0, 5.0}},
    Preset{"robstride-00", Maker::RobStride, {12.566370614359172, 50.0, 17.0, 500.0, 5.0}},
    Preset{"robstride-02", Maker::RobStride, {12.566370614359172, 44.0, 17.0, 500.0, 5.0}},
    Preset{"robstride-03", Maker::RobStride, {12.566370614359172, 50.0, 60.0, 5000.0, 100.0}},
};

inline constexpr int position_bits = 16;  ///< bits of the position
inline constexpr int field_bits = 12;     ///< bits of velocity, torque and both gains

/// Enables the torque of a drive.
inline constexpr Frame enable_frame{0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFC};
/// Ends the torque of a drive; the drive answers with its state.
inline constexpr Frame disable_frame{0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFD};

/// Returns the largest whole number of a field of `bits` bits.
[[nodiscard]] constexpr double largest_code(int bits) noexcept {
    return static_cast<double>((1U << static_cast<unsigned>(bits)) - 1U);
}

/// Returns the width of one step of a field of `bits` bits from `low` to `high`.
[[nodiscard]] constexpr double step_of(double low, double high, int bits) noexcept {
    return (high - low) / largest_code(bits);
}

/// Returns the whole number of a field, rounded down as the makers do: (x - low) (2^bits - 1) / (high - low).
[[nodiscard]] inline std::uint32_t code_of(double value, double low, double high, int bits) noexcept {
    const double within = std::isnan(value) ? low : std::clamp(value, low, high);
    return static_cast<std::uint32_t>((within - low) * largest_code(bits) / (high - low));
}

/// Returns the value of a field.
[[nodiscard]] constexpr double value_of(std::uint32_t code, double low, double high, int bits) noexcept {
    return code * (high - low) / largest_code(bits) + low;
}

/// Torque of a drive at position p and velocity v: kp (position - p) + kd (velocity - v) + torque.
struct Fields {
    double position = 0.0;   ///< [rad]
    double velocity = 0.0;   ///< [rad/s]
    double stiffness = 0.0;  ///< kp [N*m/rad]
    double damping = 0.0;    ///< kd [N*m*s/rad]
    double torque = 0.0;     ///< feed-forward torque [N*m]
};

/// Returns the frame of a command, from the first bit: position 16, velocity 12, kp 12, kd 12, torque 12 bits.
[[nodiscard]] inline Frame frame_of(const Fields& fields, const Ranges& ranges) noexcept {
    const std::uint32_t p = code_of(fields.position, -ranges.position, ranges.position, position_bits);
    const std::uint32_t v = code_of(fields.velocity, -ranges.velocity, ranges.velocity, field_bits);
    const std::uint32_t kp = code_of(fields.stiffness, 0.0, ranges.stiffness, field_bits);
    const std::uint32_t kd = code_of(fields.damping, 0.0, ranges.damping, field_bits);
    const std::uint32_t t = code_of(fields.torque, -ranges.torque, ranges.torque, field_bits);
    const auto byte = [](std::uint32_t bits) { return static_cast<std::uint8_t>(bits & 0xFFU); };
    return {byte(p >> 8U),
            byte(p),
            byte(v >> 4U),
            byte((v & 0xFU) << 4U | kp >> 8U),
            byte(kp),
            byte(kd >> 4U),
            byte((kd & 0xFU) << 4U | t >> 8U),
            byte(t)};
}

/// Frame of a line that was rounded to the fields of a drive.
struct Line {
    Frame frame{};
    bool is_limited =
        false;  ///< true if position, stiffness or torque exceed their fields, or stiffness is negative
};

/// Rounds the line force + stiffness (x - position) to the fields. A force > 0 pushes to smaller positions, so the
/// torque is its negative: kp = stiffness, position = position, torque = -force.
///
/// Stiffness and position are rounded first, to the nearest step; the torque is then that of the line at the rounded
/// position. The force at `position` is therefore exact to half a step of the torque. A number that is not finite
/// makes zero torque. A line has the damping `damping` about rest [N*m*s/rad].
[[nodiscard]] inline Line line_of(const Command& command, const Ranges& ranges,
                                  double damping = 0.0) noexcept {
    if (!(std::isfinite(command.force) && std::isfinite(command.position) &&
          std::isfinite(command.stiffness))) {
        return {frame_of({}, ranges), true};
    }
    // The frame rounds down, so that half a step is added for the nearest value
    const double half_position = 0.5 * step_of(-ranges.position, ranges.position, position_bits);
    const double half_stiffness = 0.5 * step_of(0.0, ranges.stiffness, field_bits);
    const double half_torque = 0.5 * step_of(-ranges.torque, ranges.torque, field_bits);
    const double stiffness =
        value_of(code_of(command.stiffness + half_stiffness, 0.0, ranges.stiffness, field_bits), 0.0,
                 ranges.stiffness, field_bits);
    const double position =
        value_of(code_of(command.position + half_position, -ranges.position, ranges.position, position_bits),
                 -ranges.position, ranges.position, position_bits);
    const double force = command.force + stiffness * (position - command.position);
    const double damped =
        damping > 0.0 && stiffness > 0.0 ? damping + 0.5 * step_of(0.0, ranges.damping, field_bits) : 0.0;
    return {frame_of({position + half_position, 0.0, stiffness + half_stiffness, damped, half_torque - force},
                     ranges),
            command.stiffness < 0.0 || command.stiffness > ranges.stiffness ||
                std::abs(force) > ranges.torque ||
                (stiffness > 0.0 && std::abs(command.position) > ranges.position)};
}

/// Answer of a drive to a frame.
struct Answer {
    /// Damiao: 0 disabled, 1 enabled, else a fault; CubeMars: 0, or the number of a fault; RobStride: 0
    std::uint8_t state = 0;
    bool at_end = false;    ///< true if the position is at an end of its field and therefore not known
    double position = 0.0;  ///< [rad]
    double velocity = 0.0;  ///< [rad/s]
    double torque = 0.0;    ///< [N*m]
};

/// Reads the answer of a drive.
[[nodiscard]] inline Answer answer_of(const Frame& bytes, Maker maker, const Ranges& ranges) noexcept {
    const auto byte = [&bytes](std::size_t index) -> std::uint32_t { return bytes[index]; };
    const std::uint32_t p = byte(1) << 8U | byte(2);
    const std::uint32_t v = byte(3) << 4U | byte(4) >> 4U;
    const std::uint32_t t = (byte(4) & 0xFU) << 8U | byte(5);
    Answer answer;
    answer.state = static_cast<std::uint8_t>(maker == Maker::Damiao     ? byte(0) >> 4U
                                             : maker == Maker::CubeMars ? byte(7)
                                                                        : 0U);
    answer.at_end = p == 0 || p == 0xFFFF;
    answer.position = value_of(p, -ranges.position, ranges.position, position_bits);
    answer.velocity = value_of(v, -ranges.velocity, ranges.velocity, field_bits);
    answer.torque = value_of(t, -ranges.torque, ranges.torque, field_bits);
    return answer;
}

}  // namespace palpate::mit
