// SPDX-License-Identifier: Apache-2.0
// What a test of UsbDevice does under the emulator: talk to it, and get a stream into a known state.
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

/// A word to the emulator; its answer.
inline std::string tell(const std::string& order) {
    const int talk = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    sockaddr_un own{};
    own.sun_family = AF_UNIX;
    ::bind(talk, reinterpret_cast<const sockaddr*>(&own),
           sizeof own.sun_family);  // a name of the kernel's choice
    sockaddr_un emulator{};
    emulator.sun_family = AF_UNIX;
    std::string{std::getenv("PALPATE_EMULATOR")}.copy(emulator.sun_path, sizeof emulator.sun_path - 1);
    ::sendto(talk, order.data(), order.size(), 0, reinterpret_cast<const sockaddr*>(&emulator),
             sizeof emulator);
    std::array<char, 512> answer{};
    const ssize_t length = ::recv(talk, answer.data(), answer.size(), 0);
    ::close(talk);
    return {answer.data(), static_cast<std::size_t>(length)};
}

/// One number of what the emulator says of its device.
inline double state(const std::string& field) {
    const std::string all = tell("state");
    const std::string key = "\"" + field + "\": ";
    const std::string value = all.substr(all.find(key) + key.size());
    return value.rfind("true", 0) == 0 ? 1.0 : value.rfind("false", 0) == 0 ? 0.0 : std::stod(value);
}

/// Patient: a busy machine is no fault of the device.
inline UsbDevice patient(const std::string& serial = "") {
    UsbOptions options;
    options.serial = serial;
    options.wait = std::chrono::seconds{20};
    return UsbDevice{options};
}

/// Exchanges until every command goes out, the last one is on the motor, the reading is the device's newest and only
/// two reads are on their way: from there on, one exchange is one frame.
inline Reading settled(UsbDevice& device, double force = 0.0) {
    Reading reading;
    for (int k = 0; k < 4; ++k) {
        reading = device.exchange({force});
    }
    const auto is_settled = [&] {
        const bool newest =
            static_cast<std::uint16_t>(reading.sequence) == static_cast<std::uint16_t>(state("told"));
        return reading.status != Status::Lost && device.in_flight() <= 2 && newest;
    };
    for (int k = 0; k < 1000 && reading.status != Status::Fault && !is_settled(); ++k) {
        std::this_thread::sleep_for(
            std::chrono::milliseconds{2});  // one is still on its way, and will be waiting
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
