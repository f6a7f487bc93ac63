// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <linux/can.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <deque>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "palpate/device/can_bus.hpp"
#include "palpate/device/mit_device.hpp"
#include "palpate/device/moteus_device.hpp"

namespace palpate::test {

/// A motor with its controller and its bus in memory, with faults. `Emulated` obeys frames and writes answers; it is
/// written from the documentation of the makers, without the functions that it tests. `step` advances the time by a tick.
template <class Emulated>
class EmulatedCanMotor {
  public:
    // The bus
    Opened open(const std::string& /*name*/) { return {open_failure}; }
    void close() noexcept {}
    [[nodiscard]] bool is_off() const noexcept { return off; }
    [[nodiscard]] Sent send(const canfd_frame& frame) noexcept {
        if (off || down) {
            return Sent::Down;
        }
        if (full) {
            return Sent::Full;
        }
        if (!lose_commands) {
            static_cast<Emulated*>(this)->obey(frame);
        }
        return Sent::Yes;
    }
    /// Returns the next waiting frame. A wait takes no time: a late answer arrives after a receive without a frame.
    [[nodiscard]] bool receive(canfd_frame& frame, Nanoseconds deadline) noexcept {
        if (off || waiting.empty()) {
            if (deadline > 0) {
                waiting.insert(waiting.end(), delayed.begin(), delayed.end());
                delayed.clear();
            }
            return false;
        }
        frame = waiting.front();
        waiting.pop_front();
        return true;
    }

    /// Advances the time by one tick. The watchdog ends the torque `watchdog_ticks` ticks after the last command.
    void step() noexcept {
        position = center + 0.02 * std::sin(0.05 * ++ticks);
        if (++silent_ticks > watchdog_ticks) {
            stiffness = feed_forward = 0.0;
        }
    }
    /// Returns the torque that the motor makes [N*m].
    [[nodiscard]] double torque() const noexcept {
        return enabled ? (stiffness > 0.0 ? stiffness * (target - position) : 0.0) + feed_forward : 0.0;
    }

    static constexpr int watchdog_ticks = 20;

    int number = 1;
    std::string open_failure;
    bool off = false, down = false, full = false, lose_commands = false;
    bool silent = false, late = false, twice = false, wrong_order = false, ignores_enable = false,
         remote = false;
    bool extended = false;
    int answer_number = -1;  ///< number in the answers; -1: its own
    int length = -1;         ///< size of the answers; -1: the right one
    int fault = 0;           ///< fault that the controller reports
    double jump = 0.0;       ///< error of the reported position [rad]
    bool shakes = false;     ///< true: the error has a different sign in each tick
    bool enabled = false;
    double center = 0.3, position = 0.3, target = 0.0, stiffness = 0.0, feed_forward = 0.0;
    int ticks = 0, silent_ticks = 0;
    std::deque<canfd_frame> waiting, delayed;

  protected:
    [[nodiscard]] double reported() const noexcept {
        return position + (shakes && ticks % 2 != 0 ? -jump : jump);
    }
    /// Queues an answer with the faults of the bus.
    void answer(canfd_frame frame) noexcept {
        silent_ticks = 0;
        if (silent) {
            return;
        }
        frame.can_id |= remote ? CAN_RTR_FLAG : 0U;
        frame.len = length < 0 ? frame.len : static_cast<std::uint8_t>(length);
        for (int k = 0; k < (twice ? 2 : 1); ++k) {
            (late ? delayed : waiting).push_back(frame);
        }
    }
};

class EmulatedMitDrive : public EmulatedCanMotor<EmulatedMitDrive> {
  public:
    using Motor = MitDevice<EmulatedMitDrive>;

    explicit EmulatedMitDrive(const mit::Preset& drive = mit::presets.front()) : preset{drive} {
        registers = {{10, 1},
                     {21, std::bit_cast<std::uint32_t>(static_cast<float>(preset.ranges.position))},
                     {22, std::bit_cast<std::uint32_t>(static_cast<float>(preset.ranges.velocity))},
                     {23, std::bit_cast<std::uint32_t>(static_cast<float>(preset.ranges.torque))},
                     {9, 0}};
    }
    /// Returns a motor on a copy of this drive.
    [[nodiscard]] Motor motor() const { return Motor{{.preset = preset}, *this}; }

    mit::Preset preset;
    std::map<int, std::uint32_t> registers;
    bool silent_registers = false, watchdog_refused = false;
    double damping = 0.0;  ///< kd of the last command
    int end_code = -1;     ///< code of the position that it reports; -1: the right one

    void obey(const canfd_frame& frame) noexcept {
        const std::uint8_t* d = frame.data;
        if (frame.can_id == 0x7FF) {
            if (!silent_registers && d[0] == number) {
                access_register(d);
            }
            return;
        }
        if (frame.can_id != static_cast<canid_t>(number) || frame.len != 8 || frame.flags != 0) {
            return;
        }
        bool command = true;
        for (int k = 0; k < 7; ++k) {
            command = command && d[k] == 0xFF;
        }
        if (command && d[7] == 0xFC) {
            enabled = !ignores_enable;
            stiffness = feed_forward = 0.0;
        } else if (command && d[7] == 0xFD) {
            enabled = false;
        } else {
            const auto field = [](int code, double low, double high, int bits) {
                return code * (high - low) / (std::pow(2.0, bits) - 1.0) + low;
            };
            const mit::Ranges& r = preset.ranges;
            target = field(d[0] * 256 + d[1], -r.position, r.position, 16);
            stiffness = field((d[3] % 16) * 256 + d[4], 0.0, r.stiffness, 12);
            damping = field(d[5] * 16 + d[6] / 16, 0.0, r.damping, 12);
            feed_forward = field((d[6] % 16) * 256 + d[7], -r.torque, r.torque, 12);
        }
        write_answer();
    }

  private:
    void access_register(const std::uint8_t* d) noexcept {
        canfd_frame reply{};
        reply.can_id = 0x11;
        reply.len = 8;
        std::uint32_t& value = registers[d[3]];
        if (d[2] == 0x55 && !watchdog_refused) {
            value = d[4] + 256U * d[5] + 65536U * d[6] + 16777216U * d[7];
        }
        for (int k = 0; k < 4; ++k) {
            reply.data[k] = d[k];
            reply.data[4 + k] = static_cast<std::uint8_t>(value >> (8 * k));
        }
        waiting.push_back(reply);
    }

    void write_answer() noexcept {
        const auto code = [](double value, double range, int bits) {
            return static_cast<std::uint32_t>(
                std::lround((value + range) * (std::pow(2.0, bits) - 1.0) / (2.0 * range)));
        };
        std::uint32_t p = end_code < 0 ? code(reported(), preset.ranges.position, 16)
                                       : static_cast<std::uint32_t>(end_code);
        p = wrong_order ? (p % 256) * 256 + p / 256 : p;
        const std::uint32_t v = code(0.0, preset.ranges.velocity, 12);
        const std::uint32_t t = code(torque(), preset.ranges.torque, 12);
        const int own = answer_number < 0 ? number : answer_number;
        const bool damiao = preset.maker == mit::Maker::Damiao;
        canfd_frame reply{};
        reply.can_id = (damiao ? 0x11U : 0x00U) | (extended ? CAN_EFF_FLAG : 0U);
        reply.len = 8;
        reply.data[0] = static_cast<std::uint8_t>(
            damiao ? own + 16 * (fault != 0 ? fault : static_cast<int>(enabled)) : own);
        reply.data[1] = static_cast<std::uint8_t>(p / 256);
        reply.data[2] = static_cast<std::uint8_t>(p % 256);
        reply.data[3] = static_cast<std::uint8_t>(v / 16);
        reply.data[4] = static_cast<std::uint8_t>((v % 16) * 16 + t / 256);
        reply.data[5] = static_cast<std::uint8_t>(t % 256);
        reply.data[6] = 25;
        reply.data[7] = static_cast<std::uint8_t>(damiao ? 30 : fault);
        answer(reply);
    }
};

class EmulatedMoteus : public EmulatedCanMotor<EmulatedMoteus> {
  public:
    using Motor = MoteusDevice<EmulatedMoteus>;

    static constexpr double kp = 4.0;  ///< servo.pid_position.kp [N*m/rev]

    /// Returns a motor on a copy of this controller.
    [[nodiscard]] Motor motor() const { return Motor{{.kp = kp, .torque_limit = 5.0}, *this}; }

    double timeout_s = 0.0;
    std::uint8_t mode = 0;
    std::map<int, double> values;  ///< registers that the last frame wrote

    void obey(const canfd_frame& frame) noexcept {
        if (frame.can_id != (0x8000U | static_cast<canid_t>(number) | CAN_EFF_FLAG) || frame.flags != 5) {
            return;
        }
        values.clear();
        std::vector<Query> queries;
        int at = 0;
        const auto next = [&]() -> std::uint8_t {
            return at < frame.len ? frame.data[at++] : std::uint8_t{0x50};
        };
        while (at < frame.len) {
            const int head = next();
            if (head == 0x50) {
                continue;
            }
            const int resolution = head >> 2 & 3;  // 0: int8, 3: float
            const int count = (head & 3) != 0 ? head & 3 : next();
            const int first = next();
            if ((head & 0xF0) == 0x10) {
                queries.push_back({first, count, resolution});
                continue;
            }
            for (int k = 0; k < count; ++k) {
                if (resolution == 0) {
                    values[first + k] = static_cast<std::int8_t>(next());
                } else {
                    const std::uint8_t bytes[4] = {next(), next(), next(), next()};
                    float value = 0.0F;
                    std::memcpy(&value, bytes, 4);
                    values[first + k] = value;
                }
            }
        }
        apply();
        std::vector<std::uint8_t> content;
        for (const Query& query : queries) {
            reply_to(query, content);
        }
        canfd_frame reply{};
        reply.can_id = static_cast<canid_t>((answer_number < 0 ? number : answer_number) * 256);
        reply.flags = 5;
        reply.len = static_cast<std::uint8_t>(content.size());
        std::memcpy(reply.data, content.data(), content.size());
        answer(reply);
    }

  private:
    struct Query {
        int first, count, resolution;
    };

    void apply() noexcept {
        if (values.count(0) != 0) {
            mode = static_cast<std::uint8_t>(values[0]);
        }
        if (mode == 10 && ignores_enable) {
            mode = 0;
        }
        enabled = mode == 10;
        stiffness = feed_forward = 0.0;
        if (enabled) {
            stiffness = values[0x23] * kp / (2.0 * M_PI);
            target = std::isnan(values[0x20]) ? position : values[0x20] * 2.0 * M_PI;
            feed_forward = values[0x22];
            timeout_s = values[0x27];
        }
    }

    void reply_to(const Query& query, std::vector<std::uint8_t>& content) const {
        content.push_back(static_cast<std::uint8_t>(0x20 | query.resolution << 2 | query.count));
        content.push_back(static_cast<std::uint8_t>(query.first));
        for (int address = query.first; address < query.first + query.count; ++address) {
            const double value = address == 0    ? (fault != 0 ? 1 : mode)
                                 : address == 1  ? reported() / (2.0 * M_PI)
                                 : address == 3  ? torque()
                                 : address == 15 ? fault
                                                 : 0.0;
            if (query.resolution == 0) {
                content.push_back(static_cast<std::uint8_t>(static_cast<std::int8_t>(value)));
                continue;
            }
            const auto single = static_cast<float>(value);
            std::uint8_t bytes[4];
            std::memcpy(bytes, &single, 4);
            for (int k = 0; k < 4; ++k) {
                content.push_back(bytes[wrong_order ? 3 - k : k]);
            }
        }
    }
};

}  // namespace palpate::test
