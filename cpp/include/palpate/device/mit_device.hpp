// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <linux/can.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>

#include "palpate/device/can_bus.hpp"
#include "palpate/device/can_motor.hpp"
#include "palpate/device/device.hpp"
#include "palpate/device/device_profile.hpp"
#include "palpate/device/mit_wire.hpp"
#include "palpate/fields/readable.hpp"
#include "palpate/realtime/periodic.hpp"

namespace palpate {

/// Address and settings of an MIT-mode drive.
struct MitSettings {
    std::string interface = "can0";  ///< CAN interface, or the path of a Unix socket
    std::uint8_t number = 1;         ///< CAN number of the drive, 1 to 127; of a Damiao drive 1 to 15
    mit::Preset preset = mit::presets.front();
    Nanoseconds wait = 2'000'000;  ///< longest wait of a tick for the answer of the drive [ns]
    /// Time without a frame after which a Damiao drive ends its torque [s]; other makers: set it with their tool
    double watchdog_s = 0.02;
    bool makes_force = true;  ///< false: the drive is never enabled and only reports its position
    double damping = 0.0;     ///< kd of commands with a stiffness [N*m*s/rad]
};

/// Frames of the MIT mode of Damiao, CubeMars and RobStride drives: torque = kp (p_0 - p) + kd (v_0 - v) + t_0 with
/// v_0 = 0. kd is 0 without the position control of an admittance display.
struct MitProtocol {
    using Settings = MitSettings;

    static constexpr int disabled_state = 0;
    static constexpr int enabled_state = 1;  ///< of a Damiao drive

    [[nodiscard]] static canfd_frame command_frame(const Settings& settings, const Command& command,
                                                   bool& is_limited) noexcept {
        const mit::Line line = mit::line_of(command, settings.preset.ranges, settings.damping);
        is_limited = line.is_limited;
        return frame_to(settings.number, line.frame);
    }
    [[nodiscard]] static canfd_frame enable_frame(const Settings& settings) noexcept {
        return frame_to(settings.number, mit::enable_frame);
    }
    [[nodiscard]] static canfd_frame disable_frame(const Settings& settings) noexcept {
        return frame_to(settings.number, mit::disable_frame);
    }

    [[nodiscard]] static Match read(const Settings& settings, const canfd_frame& frame,
                                    CanAnswer& answer) noexcept {
        if (!is_from(settings, frame)) {
            return Match::Other;
        }
        if (frame.len != mit::Frame{}.size()) {
            return Match::Malformed;
        }
        const mit::Answer read =
            mit::answer_of(bytes_of(frame), settings.preset.maker, settings.preset.ranges);
        answer = {read.position, read.velocity, read.torque, read.state, read.at_end};
        return Match::Answer;
    }

    [[nodiscard]] static bool has_fault(const Settings& settings, const CanAnswer& answer) noexcept {
        const bool enabled = is_damiao(settings) && settings.makes_force;
        return answer.state != (enabled ? enabled_state : disabled_state);
    }
    /// Returns true if an answer says whether the drive is disabled.
    [[nodiscard]] static bool confirms_disabled(const Settings& settings) noexcept {
        return is_damiao(settings);
    }

    /// Compares mode and ranges of a Damiao drive with the preset, and sets its watchdog.
    template <class Motor>
    [[nodiscard]] static std::string set_up(const Settings& settings, Motor& motor) {
        if (!is_damiao(settings)) {
            return "";
        }
        struct Entry {
            std::uint8_t address;
            const char* name;
            double value;
        };
        const mit::Ranges& ranges = settings.preset.ranges;
        if (register_answer(settings, motor, read_register, 10, 0) != 1U) {
            return "is not in the MIT mode: set its register 10 (CTRL_MODE) to 1";
        }
        for (const Entry& entry : {Entry{21, "PMAX", ranges.position},
                                   {22, "VMAX", ranges.velocity},
                                   {23, "TMAX", ranges.torque}}) {
            const auto bits = register_answer(settings, motor, read_register, entry.address, 0);
            const double found =
                bits ? std::bit_cast<float>(*bits) : std::numeric_limits<double>::quiet_NaN();
            if (!(std::abs(found - entry.value) <= 1e-3 * entry.value)) {
                return std::string("has ") + entry.name + " = " + readable(found) + ", but " +
                       std::string(settings.preset.name) + " has " + readable(entry.value) +
                       ": choose the kind of the drive";
            }
        }
        const auto watchdog = static_cast<std::uint32_t>(std::lround(settings.watchdog_s / 50e-6));
        if (register_answer(settings, motor, write_register, 9, watchdog) != watchdog) {
            return "does not accept its watchdog: its register 9 (TIMEOUT) must be writable";
        }
        return "";
    }

    /// Returns the profile that follows from the fields of the drive. Damping and friction are 0, because the drive does
    /// not report them.
    [[nodiscard]] static DeviceProfile profile(const Settings& settings, double rate_hz) {
        const mit::Ranges& ranges = settings.preset.ranges;
        DeviceProfile profile = unmeasured({});
        profile.id = std::string(settings.preset.name);
        profile.period_s = profile.delay_s = 1.0 / rate_hz;
        profile.encoder_step = mit::step_of(-ranges.position, ranges.position, mit::position_bits);
        profile.force_step = mit::step_of(-ranges.torque, ranges.torque, mit::field_bits);
        profile.force_limit = ranges.torque;
        return profile;
    }

  private:
    static constexpr canid_t register_number = 0x7FF;
    static constexpr std::uint8_t read_register = 0x33;
    static constexpr std::uint8_t write_register = 0x55;

    [[nodiscard]] static bool is_damiao(const Settings& settings) noexcept {
        return settings.preset.maker == mit::Maker::Damiao;
    }

    [[nodiscard]] static canfd_frame frame_to(canid_t number, const mit::Frame& bytes) noexcept {
        canfd_frame frame{};
        frame.can_id = number;
        frame.len = static_cast<std::uint8_t>(bytes.size());
        std::copy(bytes.begin(), bytes.end(), static_cast<std::uint8_t*>(frame.data));
        return frame;
    }
    [[nodiscard]] static mit::Frame bytes_of(const canfd_frame& frame) noexcept {
        mit::Frame bytes{};
        std::copy_n(static_cast<const std::uint8_t*>(frame.data), bytes.size(), bytes.begin());
        return bytes;
    }

    /// Returns true for a frame of this drive. The frames of other programs to the drive have its number as CAN number.
    [[nodiscard]] static bool is_from(const Settings& settings, const canfd_frame& frame) noexcept {
        const std::uint8_t mask = is_damiao(settings) ? 0xF : 0xFF;
        return (frame.can_id & ~canid_t{CAN_SFF_MASK}) == 0 && frame.can_id != settings.number &&
               frame.can_id != register_number && frame.len > 0 &&
               (frame.data[0] & mask) == (settings.number & mask);
    }

    /// Returns the answer to a register frame; nothing without an answer.
    template <class Motor>
    [[nodiscard]] static std::optional<std::uint32_t> register_answer(const Settings& settings, Motor& motor,
                                                                      std::uint8_t command,
                                                                      std::uint8_t address,
                                                                      std::uint32_t value) {
        const auto byte = [value](unsigned index) { return static_cast<std::uint8_t>(value >> 8U * index); };
        (void)motor.bus().send(frame_to(
            register_number, {settings.number, 0, command, address, byte(0), byte(1), byte(2), byte(3)}));
        canfd_frame frame{};
        if (!motor.find(frame, Motor::step_wait, [&](const canfd_frame& found) {
                return is_from(settings, found) && found.len == 8 && found.data[1] == 0 &&
                       found.data[2] == command && found.data[3] == address;
            })) {
            return {};
        }
        std::uint32_t found = 0;
        for (unsigned index = 0; index < 4; ++index) {
            found |= static_cast<std::uint32_t>(frame.data[4 + index]) << 8U * index;
        }
        return found;
    }
};

/// An MIT-mode drive as a device. Damiao drives confirm zero force and report their ranges; other makers do not.
template <class Bus = CanBus>
using MitDevice = CanMotor<MitProtocol, Bus>;

static_assert(Device<MitDevice<>>);

}  // namespace palpate
