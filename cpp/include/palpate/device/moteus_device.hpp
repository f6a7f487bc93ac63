// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <linux/can.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "palpate/device/can_bus.hpp"
#include "palpate/device/can_motor.hpp"
#include "palpate/device/device.hpp"
#include "palpate/device/device_profile.hpp"
#include "palpate/device/moteus_wire.hpp"
#include "palpate/realtime/periodic.hpp"

namespace palpate {

/// Address and settings of a moteus controller.
struct MoteusSettings {
    std::string interface = "can0";  ///< CAN interface with CAN FD, or the path of a Unix socket
    std::uint8_t number = 1;         ///< CAN number of the controller, 1 to 126
    double kp = 4.0;                 ///< servo.pid_position.kp of the controller [N*m/rev]
    double torque_limit = 1.0;       ///< largest torque, which the controller limits [N*m]
    Nanoseconds wait = 2'000'000;    ///< longest wait of a tick for the answer of the controller [ns]
    /// Time without a command after which the controller leaves the position mode [s]. With servo.timeout_mode = 0 its
    /// torque is then zero; by default it brakes.
    double watchdog_s = 0.02;
    bool makes_force = true;  ///< false: the controller stays stopped and only reports its position
    double damping = 0.0;     ///< above 0: commands with a stiffness use the KD of the controller
};

/// Registers of a moteus controller over CAN FD: torque = kp_scale KP (p_0 - p) + t_0. The scale of KD is 0, and 1
/// in the position control of an admittance display.
struct MoteusProtocol {
    using Settings = MoteusSettings;

    static constexpr int disabled_state = moteus::stopped_mode;

    [[nodiscard]] static canfd_frame command_frame(const Settings& settings, const Command& command,
                                                   bool& is_limited) noexcept {
        moteus::Line line = moteus::line_of(command, settings.kp, settings.torque_limit);
        is_limited = line.is_limited;
        line.fields.timeout_s = static_cast<float>(settings.watchdog_s);
        line.fields.kd_scale = settings.damping > 0.0 && line.fields.kp_scale > 0.0F ? 1.0F : 0.0F;
        return frame_to(settings.number, moteus::frame_of(line.fields));
    }
    [[nodiscard]] static canfd_frame enable_frame(const Settings& settings) noexcept {
        bool is_limited = false;
        return command_frame(settings, {}, is_limited);
    }
    [[nodiscard]] static canfd_frame disable_frame(const Settings& settings) noexcept {
        return frame_to(settings.number, moteus::stop_frame());
    }

    [[nodiscard]] static Match read(const Settings& settings, const canfd_frame& frame,
                                    CanAnswer& answer) noexcept {
        constexpr canid_t host = 0;
        if ((frame.can_id & CAN_RTR_FLAG) != 0 ||
            (frame.can_id & CAN_EFF_MASK) != (canid_t{settings.number} << 8U | host)) {
            return Match::Other;
        }
        const moteus::Values values = moteus::values_of(
            std::span{static_cast<const std::uint8_t*>(frame.data), std::min<std::size_t>(frame.len, 64)});
        if (!values.complete()) {
            return Match::Malformed;
        }
        const bool has_fault = values.fault != 0 && values.fault < moteus::first_harmless_fault;
        answer = {values.position * moteus::rad_a_revolution, values.velocity * moteus::rad_a_revolution,
                  values.torque, has_fault ? -values.fault : values.mode, false};
        return Match::Answer;
    }

    [[nodiscard]] static bool has_fault(const Settings& settings, const CanAnswer& answer) noexcept {
        return answer.state != (settings.makes_force ? moteus::position_mode : moteus::stopped_mode);
    }
    [[nodiscard]] static bool confirms_disabled(const Settings& /*settings*/) noexcept { return true; }

    template <class Motor>
    [[nodiscard]] static std::string set_up(const Settings& /*settings*/, Motor& /*motor*/) {
        return "";
    }

    /// Returns the profile of the controller. Its encoder is assumed to have 16384 counts a turn; damping and friction
    /// are 0, because the controller does not report them.
    [[nodiscard]] static DeviceProfile profile(const Settings& settings, double rate_hz) {
        DeviceProfile profile = unmeasured({});
        profile.id = "moteus-r4";
        profile.period_s = profile.delay_s = 1.0 / rate_hz;
        profile.encoder_step = moteus::rad_a_revolution / 16384.0;
        profile.force_step = 0.0;
        profile.force_limit = settings.torque_limit;
        return profile;
    }

  private:
    [[nodiscard]] static canfd_frame frame_to(std::uint8_t number, const moteus::Frame& content) noexcept {
        constexpr canid_t wants_answer = 0x8000;
        canfd_frame frame{};
        frame.can_id = wants_answer | number | CAN_EFF_FLAG;
        frame.flags = fd_frame_flag | CANFD_BRS;
        frame.len = static_cast<std::uint8_t>(content.size);
        std::copy_n(content.data.begin(), content.size, static_cast<std::uint8_t*>(frame.data));
        return frame;
    }
};

/// A moteus controller as a device.
template <class Bus = CanBus>
using MoteusDevice = CanMotor<MoteusProtocol, Bus>;

static_assert(Device<MoteusDevice<>>);

}  // namespace palpate
