// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <span>

#include "palpate/device/device.hpp"

/// Registers of a moteus controller over CAN FD, from docs/protocol/registers.md and docs/protocol/can.md of
/// mjbots/moteus.
namespace palpate::moteus {

inline constexpr std::uint8_t mode_register = 0x00;      ///< mode of the controller
inline constexpr std::uint8_t position_register = 0x01;  ///< position, velocity and torque: rev, rev/s, N*m
inline constexpr std::uint8_t fault_register = 0x0F;     ///< number of a fault, or 0
/// First of six: position, velocity, feed-forward torque, kp scale, kd scale, largest torque
inline constexpr std::uint8_t command_register = 0x20;
inline constexpr std::uint8_t timeout_register = 0x27;   ///< time of the watchdog [s]
inline constexpr std::uint8_t integral_register = 0x2B;  ///< scale of the limit of the integral term

inline constexpr int stopped_mode = 0;           ///< mode without torque
inline constexpr int position_mode = 10;         ///< mode that holds a line
inline constexpr int first_harmless_fault = 96;  ///< from here on a fault number only names an active limit

inline constexpr double rad_a_revolution = 2.0 * std::numbers::pi;  ///< [rad/rev]

/// Data of a frame of CAN FD.
struct Frame {
    std::array<std::uint8_t, 64> data{};
    std::size_t size = 0;

    void add(std::uint8_t byte) noexcept { data[size++] = byte; }
    void add(float value) noexcept {
        const auto bits = std::bit_cast<std::uint32_t>(value);
        for (unsigned shift = 0; shift < 32; shift += 8) {
            add(static_cast<std::uint8_t>(bits >> shift & 0xFFU));
        }
    }
};

/// Values of a command in position mode. The torque at position p and velocity v is
/// kp_scale KP (position - p) + kd_scale KD (velocity - v) + torque, with KP and KD of the controller.
struct Fields {
    float position = std::numeric_limits<float>::quiet_NaN();  ///< [rev]; NaN: the present position
    float velocity = 0.0F;                                     ///< [rev/s]
    float torque = 0.0F;                                       ///< feed-forward torque [N*m]
    float kp_scale = 0.0F;
    float kd_scale = 0.0F;
    float largest_torque = 0.0F;  ///< [N*m]
    float timeout_s = 0.02F;  ///< the controller leaves the position mode without a command for this time [s]
};

namespace detail {

inline constexpr std::uint8_t write_int8 = 0x00, write_float = 0x0C, read_int8 = 0x10, read_float = 0x1C;
inline constexpr std::uint8_t nothing = 0x50;

/// Reads mode, position, velocity, torque and fault.
inline void add_query(Frame& frame) noexcept {
    for (const int byte : {read_int8 + 1, int{mode_register}, read_float + 3, int{position_register},
                           read_int8 + 1, int{fault_register}}) {
        frame.add(static_cast<std::uint8_t>(byte));
    }
}

}  // namespace detail

/// Returns the frame of a command with a query.
[[nodiscard]] inline Frame frame_of(const Fields& fields) noexcept {
    Frame frame;
    frame.add(static_cast<std::uint8_t>(detail::write_int8 + 1));
    frame.add(mode_register);
    frame.add(static_cast<std::uint8_t>(position_mode));
    frame.add(detail::write_float);
    frame.add(std::uint8_t{6});
    frame.add(command_register);
    for (const float value : {fields.position, fields.velocity, fields.torque, fields.kp_scale,
                              fields.kd_scale, fields.largest_torque}) {
        frame.add(value);
    }
    frame.add(static_cast<std::uint8_t>(detail::write_float + 1));
    frame.add(timeout_register);
    frame.add(fields.timeout_s);
    frame.add(static_cast<std::uint8_t>(detail::write_float + 1));
    frame.add(integral_register);
    frame.add(0.0F);  // no integral term: a held line has none
    detail::add_query(frame);
    return frame;
}

/// Returns the frame that stops the motor and queries its state, filled up to a size of CAN FD.
[[nodiscard]] inline Frame stop_frame() noexcept {
    Frame frame;
    frame.add(static_cast<std::uint8_t>(detail::write_int8 + 1));
    frame.add(mode_register);
    frame.add(static_cast<std::uint8_t>(stopped_mode));
    detail::add_query(frame);
    while (frame.size < 12) {
        frame.add(detail::nothing);
    }
    return frame;
}

/// Fields of a line, and whether it exceeds them.
struct Line {
    Fields fields;
    bool is_limited = false;
};

/// Converts the line force + stiffness (x - position) for a controller with servo.pid_position.kp = `kp` [N*m/rev]. A
/// force > 0 pushes to smaller positions, so the torque is its negative. The torque is that of the line at the rounded
/// position. A number that is not finite makes zero torque.
[[nodiscard]] inline Line line_of(const Command& command, double kp, double largest_torque) noexcept {
    Line line;
    line.fields.largest_torque = static_cast<float>(largest_torque);
    if (!(std::isfinite(command.force) && std::isfinite(command.position) &&
          std::isfinite(command.stiffness))) {
        line.is_limited = true;
        return line;
    }
    double force = command.force;
    if (command.stiffness > 0.0) {
        line.fields.kp_scale = static_cast<float>(command.stiffness * rad_a_revolution / kp);
        line.fields.position = static_cast<float>(command.position / rad_a_revolution);
        force += command.stiffness *
                 (static_cast<double>(line.fields.position) * rad_a_revolution - command.position);
    }
    line.fields.torque = static_cast<float>(-std::clamp(force, -largest_torque, largest_torque));
    line.is_limited = command.stiffness < 0.0 || std::abs(force) > largest_torque;
    return line;
}

/// Values of the answer to a query; NaN or -1 if the answer does not contain them.
struct Values {
    int mode = -1;
    int fault = -1;
    double position = std::numeric_limits<double>::quiet_NaN();  ///< [rev]
    double velocity = std::numeric_limits<double>::quiet_NaN();  ///< [rev/s]
    double torque = std::numeric_limits<double>::quiet_NaN();    ///< [N*m]

    [[nodiscard]] bool complete() const noexcept {
        return mode >= 0 && fault >= 0 && std::isfinite(position) && std::isfinite(velocity) &&
               std::isfinite(torque);
    }
};

/// Reads an answer. Values that it does not contain stay unset; bytes behind an unknown subframe are not read.
[[nodiscard]] inline Values values_of(std::span<const std::uint8_t> data) noexcept {
    constexpr std::uint8_t reply_int8 = 0x20, reply_float = 0x2C;
    const auto signed_byte = [](std::uint32_t bits) {
        return static_cast<int>(bits) - (bits < 128 ? 0 : 256);
    };
    Values values;
    for (std::size_t at = 0; at + 2 <= data.size();) {
        const std::uint8_t type = data[at] & 0xFCU;
        const std::size_t count = data[at] & 3U;
        const std::size_t size = type == reply_int8 ? 1 : type == reply_float ? 4 : 0;
        std::uint8_t address = data[at + 1];
        at += 2;
        if (size == 0 || count == 0 || at + count * size > data.size()) {
            break;
        }
        for (std::size_t k = 0; k < count; ++k, at += size, ++address) {
            std::uint32_t bits = 0;
            for (std::size_t byte = 0; byte < size; ++byte) {
                bits |= static_cast<std::uint32_t>(data[at + byte]) << 8U * byte;
            }
            if (size == 1 && address == mode_register) {
                values.mode = signed_byte(bits);
            } else if (size == 1 && address == fault_register) {
                values.fault = signed_byte(bits);
            } else if (size == 4 && address >= position_register && address < position_register + 3) {
                const std::array to{&values.position, &values.velocity, &values.torque};
                *to[static_cast<std::size_t>(address - position_register)] = std::bit_cast<float>(bits);
            }
        }
    }
    return values;
}

}  // namespace palpate::moteus
