// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <charconv>
#include <cmath>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "palpate/fields/readable.hpp"

namespace palpate {

/// A kind of device that a program can open. All help texts, messages and completions take it from `transports`.
struct Transport {
    std::string_view name;  ///< first word of the name of a device
    std::string_view form;  ///< name of a device, with the optional parts in brackets
    std::string_view help;  ///< meaning of the parts of the form; empty: none needed
    bool measures;          ///< true if `record` and `check-device` can use it
    double wait_s;  ///< longest wait of a tick for a sample if the options do not set it [s]; 0: no wait
};

/// Every kind of device. `open_device` and `device_to_measure` have one function for each, in the same order.
inline constexpr std::array transports{
    Transport{"simulated", "simulated", "", true, 0.0},
    Transport{"usb", "usb[:SERIAL]",
#ifdef PALPATE_HAS_USB
              "",
#else
              "this program was built without libusb and has no usb",
#endif
              true, 5e-3},
    Transport{"mit", "mit:BUS:NUMBER:KIND",
              "an MIT-mode drive of this KIND, such as damiao-4310, with a CAN NUMBER on a BUS such as can0",
              true, 2e-3},
    Transport{"moteus", "moteus:BUS:NUMBER:KP", "a moteus whose servo.pid_position.kp is KP in N*m/rev", true,
              2e-3},
    Transport{
        "wheel", "wheel:NODE:DEGREES:TORQUE[:STIFFNESS]",
        "a force-feedback wheel (USB class PID) on a NODE such as /dev/hidraw0: DEGREES from end to end, "
        "TORQUE in N*m of its full force, STIFFNESS in N*m/rad of its full spring",
        true, 1e-3},
    Transport{"inverse3", "inverse3[:AXIS[@PORT]]",
              "AXIS is x, y, z (default), -x, -y or -z, PORT that of its service", false, 20e-3},
};

/// Returns the parts of the name of a device, which colons separate.
[[nodiscard]] inline std::vector<std::string> device_parts(const std::string& device) {
    std::vector<std::string> parts{""};
    for (const char letter : device) {
        if (letter == ':') {
            parts.emplace_back();
        } else {
            parts.back() += letter;
        }
    }
    return parts;
}

/// Returns the number in a part of the name of a device. Throws std::invalid_argument unless it is > 0.
[[nodiscard]] inline double positive_part(const std::string& device, const std::string& part,
                                          const std::string& name, const std::string& unit) {
    double number = 0.0;
    const char* end = part.data() + part.size();
    const auto found = std::from_chars(part.data(), end, number);
    if (found.ec != std::errc{} || found.ptr != end || !(number > 0.0 && std::isfinite(number))) {
        throw std::invalid_argument("device is '" + device + "', " + name + " must be a number > 0 in " +
                                    unit);
    }
    return number;
}

/// Returns the forms of all devices as text: "simulated, usb[:SERIAL] or ...". `measuring`: only those that measure.
[[nodiscard]] inline std::string transport_forms(bool measuring) {
    std::string text;
    std::string_view last;
    for (const Transport& transport : transports) {
        if (measuring && !transport.measures) {
            continue;
        }
        if (!last.empty()) {
            text += (text.empty() ? "" : ", ") + std::string(last);
        }
        last = transport.form;
    }
    return text + " or " + std::string(last);
}

/// Returns the help of an option that chooses a device.
[[nodiscard]] inline std::string transport_help(bool measuring) {
    std::string text = transport_forms(measuring);
    for (const Transport& transport : transports) {
        if (!transport.help.empty() && (transport.measures || !measuring)) {
            text += "; " + std::string(transport.help);
        }
    }
    return text;
}

/// Returns the waits of all devices in ms as text: "usb 5, mit 2, inverse3 20".
[[nodiscard]] inline std::string transport_waits() {
    std::string text;
    for (const Transport& transport : transports) {
        if (transport.wait_s > 0.0) {
            text += (text.empty() ? "" : ", ") + std::string(transport.name) + " " +
                    readable(1e3 * transport.wait_s);
        }
    }
    return text;
}

}  // namespace palpate
