// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <cstdint>
#include <limits>
#include <string>

#include "palpate/status.hpp"

namespace palpate {

/// What is sent to a device: the force of the virtual object against the handle. A force > 0 pushes the
/// handle towards smaller positions, out of the object.
struct Command {
    double force = 0.0;  ///< [N or N*m]
};

/// What a device answers.
struct Reading {
    double position = 0.0;                                       ///< measured [m or rad]
    double velocity = 0.0;                                       ///< measured or differenced
    double applied = 0.0;                                        ///< the force acting now, in Command's sign
    double measured = std::numeric_limits<double>::quiet_NaN();  ///< force transducer; NaN without one
    double device_time = 0.0;                                    ///< the device's own clock [s]
    std::uint64_t sequence = 0;                                  ///< counts the device's samples
    Status status = Status::Ok;
};

/// How opening a device ended: `reason` is empty when it is open, else one sentence with the likely cure.
struct Opened {
    std::string reason;
    [[nodiscard]] explicit operator bool() const noexcept { return reason.empty(); }
};

/// A haptic device of one degree of freedom. `exchange` sends the command and returns the next sample: it
/// fits a device that paces the host (it waits) and one that the host paces (it answers at once).
template <class D>
concept Device = requires(D& device, const Command& command) {
    { device.open() } -> std::same_as<Opened>;
    { device.exchange(command) } noexcept -> std::same_as<Reading>;
    { device.close() } noexcept;
};

/// Whether a device paces the host: its exchange waits for the next sample of the device's own clock. Such a device
/// says so by a member of this name; the others answer at once, and the host's clock paces both.
template <Device D>
inline constexpr bool paces_host = [] {
    if constexpr (requires { D::paces_host; }) {
        return D::paces_host;
    } else {
        return false;
    }
}();

}  // namespace palpate
