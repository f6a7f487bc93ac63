// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <cstdint>
#include <limits>
#include <string>

#include "palpate/status.hpp"

namespace palpate {

/// Command to a device: the force of the virtual object against the handle. A force > 0 pushes the handle towards
/// smaller positions, out of the object. A device whose controller holds a line applies
/// force + stiffness (x - position) at the handle's position x until the next command; other devices hold the force. A
/// position servo moves to `position`; with stiffness 0 it holds its last command.
struct Command {
    double force = 0.0;      ///< force on the handle, at `position` [N or N*m]
    double position = 0.0;   ///< x0, position at which the line has the force [m or rad]
    double stiffness = 0.0;  ///< kappa, slope of the line; 0: the force is held [N/m or N*m/rad]
};

/// One sample of a device: position and velocity of the handle, forces, time, and the number of the sample.
struct Reading {
    double position = 0.0;  ///< measured position of the handle [m or rad]
    /// Velocity of the handle: measured, or a difference quotient of positions [m/s or rad/s]
    double velocity = 0.0;
    double applied = 0.0;  ///< force that the motor applies; > 0 pushes to smaller positions [N or N*m]
    /// Force that a transducer measures; NaN without a transducer
    double measured = std::numeric_limits<double>::quiet_NaN();
    /// Time of the sample by the device's clock [s]
    double device_time = 0.0;
    std::uint64_t sequence = 0;  ///< number of this sample, counted by the device
    Status status = Status::Ok;
    /// Largest time, since the sample before, by which the applied force was late: the time from a sample until the
    /// device applied the force computed from it or from a newer sample. Without such a force it counts up to this
    /// sample, so that a command that never acts becomes late. NaN if the device does not measure it [s]
    double delay = std::numeric_limits<double>::quiet_NaN();
};

/// Result of opening a device: `reason` is empty if the device is open, otherwise one sentence with the likely
/// cure.
struct Opened {
    std::string reason;
    [[nodiscard]] explicit operator bool() const noexcept { return reason.empty(); }
};

/// Known state of the force after a device was closed.
enum class ZeroForce : std::uint8_t {
    Commanded,  ///< zero force was commanded; this device does not report whether the command arrived
    NotSent,    ///< zero force could not be sent
    Sent,       ///< zero force was sent; the device did not confirm it
    Confirmed,  ///< the device confirmed zero force
    Held,       ///< a position servo held the last command until it was closed
};

/// A haptic device of one degree of freedom. `exchange` sends a force command and returns the next sample. It waits for
/// the next sample if the device's clock sets the rate of the loop. `close` may return a `ZeroForce`.
template <class D>
concept Device = requires(D& device, const Command& command) {
    { device.open() } -> std::same_as<Opened>;
    { device.exchange(command) } noexcept -> std::same_as<Reading>;
    { device.close() } noexcept;
};

/// Closes a device and returns what is known about its force.
template <Device D>
[[nodiscard]] ZeroForce closed(D& device) noexcept {
    if constexpr (std::same_as<decltype(device.close()), ZeroForce>) {
        return device.close();
    } else {
        device.close();
        return ZeroForce::Commanded;
    }
}

/// True if the device's clock sets the rate of the control loop: `exchange` waits for the device's next sample. Such a
/// device class has a member `paces_host`. With other devices the host's clock sets the rate.
template <Device D>
inline constexpr bool paces_host = [] {
    if constexpr (requires { D::paces_host; }) {
        return D::paces_host;
    } else {
        return false;
    }
}();

/// Returns true if the clock of this device sets the rate of the control loop; a device that knows this only while it
/// runs has a member `sets_pace`.
template <Device D>
[[nodiscard]] constexpr bool sets_pace(const D& device) noexcept {
    if constexpr (requires { device.sets_pace(); }) {
        return device.sets_pace();
    } else {
        return paces_host<D>;
    }
}

}  // namespace palpate
