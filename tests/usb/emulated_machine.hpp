// SPDX-License-Identifier: Apache-2.0
// Functions for tests of UsbDevice with the emulator.
#pragma once

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "palpate/device/usb.hpp"

namespace palpate::test {

/// Sends an order ("fault KIND COUNT", "state", ...) to the emulator and returns the emulator's answer.
inline std::string send_order(const std::string& order) {
    const int connection = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    sockaddr_un own{};
    own.sun_family = AF_UNIX;
    ::bind(connection, reinterpret_cast<const sockaddr*>(&own),
           sizeof own.sun_family);  // empty address: the kernel chooses a name for the socket
    sockaddr_un emulator{};
    emulator.sun_family = AF_UNIX;
    std::string{std::getenv("PALPATE_EMULATOR")}.copy(emulator.sun_path, sizeof emulator.sun_path - 1);
    ::sendto(connection, order.data(), order.size(), 0, reinterpret_cast<const sockaddr*>(&emulator),
             sizeof emulator);
    std::array<char, 512> answer{};
    const ssize_t length = ::recv(connection, answer.data(), answer.size(), 0);
    ::close(connection);
    return {answer.data(), static_cast<std::size_t>(length)};
}

/// Returns the number in one field of the state of the emulated device, as the emulator reports it.
inline double state(const std::string& field) {
    const std::string all = send_order("state");
    const std::string key = "\"" + field + "\": ";
    const std::string value = all.substr(all.find(key) + key.size());
    return value.rfind("true", 0) == 0 ? 1.0 : value.rfind("false", 0) == 0 ? 0.0 : std::stod(value);
}

/// Exchanges commands until the last one has reached the motor, and returns the last reading. Each exchange takes one
/// frame.
inline Reading settled(UsbDevice& device, double force = 0.0) {
    Reading reading;
    for (int k = 0; k < 4; ++k) {
        reading = device.exchange({force});
    }
    return reading;
}

inline std::size_t open_files() {
    std::size_t count = 0;
    for ([[maybe_unused]] const auto& file : std::filesystem::directory_iterator("/proc/self/fd")) {
        ++count;
    }
    return count;
}

}  // namespace palpate::test
