// SPDX-License-Identifier: Apache-2.0
// Functions for tests of UsbDevice with the emulator: they send orders to the emulator, and exchange packets with a
// device until its state is known.
#pragma once

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <thread>

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

/// Returns a device with a long timeout, because the computer that runs the test may be slow.
inline UsbDevice patient(const std::string& serial = "") {
    UsbOptions options;
    options.serial = serial;
    options.wait = std::chrono::seconds{20};
    return UsbDevice{options};
}

/// Exchanges packets until every command is sent, the last command has reached the motor, the reading is the newest
/// one, and only two reads are queued. Then each further exchange takes exactly one frame.
inline Reading settled(UsbDevice& device, double force = 0.0) {
    Reading reading;
    for (int k = 0; k < 4; ++k) {
        reading = device.exchange({force});
    }
    const auto is_settled = [&] {
        const bool newest =
            static_cast<std::uint16_t>(reading.sequence) == static_cast<std::uint16_t>(state("last_read"));
        return reading.status != Status::Lost && device.in_flight() <= 2 && newest;
    };
    for (int k = 0; k < 1000 && reading.status != Status::Fault && !is_settled(); ++k) {
        // During this pause a packet that the device has sent arrives at the host; the next exchange reads this packet.
        std::this_thread::sleep_for(std::chrono::milliseconds{2});
        if (!is_settled()) {
            reading = device.exchange({force});
        }
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
