// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <linux/can.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <string>

#include "palpate/device/can_bus.hpp"
#include "palpate/device/mit_wire.hpp"

namespace palpate::test {

/// An MIT-mode drive and its bus in memory. It is written from the documentation of the makers and does not use the
/// functions of mit_wire.hpp that it tests. `step` advances its time by a tick.
class EmulatedMitDrive {
  public:
    explicit EmulatedMitDrive(mit::Preset drive = mit::presets.front(), int its_number = 1)
        : preset{drive}, number{its_number} {
        registers = {{10, 1},
                     {21, std::bit_cast<std::uint32_t>(static_cast<float>(preset.ranges.position))},
                     {22, std::bit_cast<std::uint32_t>(static_cast<float>(preset.ranges.velocity))},
                     {23, std::bit_cast<std::uint32_t>(static_cast<float>(preset.ranges.torque))},
                     {9, 0}};
    }

    // The bus
    Opened open(const std::string& /*name*/) { return {open_failure}; }
    void close() noexcept {}
    [[nodiscard]] bool is_off() const noexcept { return off; }
    [[nodiscard]] Sent send(const can_frame& frame) noexcept {
        if (off || down) {
            return Sent::Down;
        }
        if (full) {
            return Sent::Full;
        }
        if (!lose_commands) {
            obey(frame);
        }
        return Sent::Yes;
    }
    /// Returns the next waiting frame. A wait takes no time: a late answer arrives after a receive without a frame.
    [[nodiscard]] bool receive(can_frame& frame, Nanoseconds deadline) noexcept {
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
            kp = kd = feed_forward = 0.0;
        }
    }
    /// Returns the torque that the motor makes [N*m].
    [[nodiscard]] double torque() const noexcept {
        return enabled ? kp * (target - position) + feed_forward : 0.0;
    }

    static constexpr int watchdog_ticks = 20;

    mit::Preset preset;
    int number;
    std::map<int, std::uint32_t> registers;
    std::string open_failure;
    bool off = false, down = false, full = false, lose_commands = false;
    bool silent = false, late = false, twice = false, little_endian = false, ignores_enable = false;
    bool silent_registers = false, extended = false, remote = false, watchdog_refused = false;
    int answer_number = -1;  ///< number in the answers; -1: its own
    int length = 8;
    int fault = 0;  ///< state that the drive reports
    std::function<void(std::uint32_t&)> change_position;
    bool enabled = false;
    double center = 0.3, position = 0.3, target = 0.0, kp = 0.0, kd = 0.0, feed_forward = 0.0;
    int ticks = 0, silent_ticks = 0;
    std::deque<can_frame> waiting, delayed;

  private:
    void obey(const can_frame& frame) noexcept {
        const std::uint8_t* d = frame.data;
        if (frame.can_id == 0x7FF) {
            if (!silent_registers && d[0] == number) {
                access_register(d);
            }
            return;
        }
        if (frame.can_id != static_cast<canid_t>(number)) {
            return;
        }
        bool command = true;
        for (int k = 0; k < 7; ++k) {
            command = command && d[k] == 0xFF;
        }
        if (command && d[7] == 0xFC) {
            enabled = !ignores_enable;
            kp = kd = feed_forward = 0.0;
        } else if (command && d[7] == 0xFD) {
            enabled = false;
        } else {
            const auto field = [](int code, double low, double high, int bits) {
                return code * (high - low) / (std::pow(2.0, bits) - 1.0) + low;
            };
            const mit::Ranges& r = preset.ranges;
            target = field(d[0] * 256 + d[1], -r.position, r.position, 16);
            kp = field((d[3] % 16) * 256 + d[4], 0.0, r.stiffness, 12);
            kd = field(d[5] * 16 + d[6] / 16, 0.0, r.damping, 12);
            feed_forward = field((d[6] % 16) * 256 + d[7], -r.torque, r.torque, 12);
        }
        silent_ticks = 0;
        answer();
        if (twice) {
            answer();
        }
    }

    void access_register(const std::uint8_t* d) noexcept {
        can_frame reply{};
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

    void answer() noexcept {
        if (silent) {
            return;
        }
        const auto code = [](double value, double range, int bits) {
            return static_cast<std::uint32_t>(
                std::lround((value + range) * (std::pow(2.0, bits) - 1.0) / (2.0 * range)));
        };
        std::uint32_t p = code(position, preset.ranges.position, 16);
        if (change_position) {
            change_position(p);
        }
        if (little_endian) {
            p = (p % 256) * 256 + p / 256;
        }
        const std::uint32_t v = code(0.0, preset.ranges.velocity, 12);
        const std::uint32_t t = code(torque(), preset.ranges.torque, 12);
        const int own = answer_number < 0 ? number : answer_number;
        const bool damiao = preset.maker == mit::Maker::Damiao;
        can_frame reply{};
        reply.can_id = damiao ? 0x11 : 0x00;
        reply.can_id |= extended ? CAN_EFF_FLAG : 0U;
        reply.can_id |= remote ? CAN_RTR_FLAG : 0U;
        reply.len = static_cast<std::uint8_t>(length);
        reply.data[0] = static_cast<std::uint8_t>(
            damiao ? own + 16 * (fault != 0 ? fault : static_cast<int>(enabled)) : own);
        reply.data[1] = static_cast<std::uint8_t>(p / 256);
        reply.data[2] = static_cast<std::uint8_t>(p % 256);
        reply.data[3] = static_cast<std::uint8_t>(v / 16);
        reply.data[4] = static_cast<std::uint8_t>((v % 16) * 16 + t / 256);
        reply.data[5] = static_cast<std::uint8_t>(t % 256);
        reply.data[6] = 25;
        reply.data[7] = static_cast<std::uint8_t>(damiao ? 30 : fault);
        (late ? delayed : waiting).push_back(reply);
    }
};

}  // namespace palpate::test
