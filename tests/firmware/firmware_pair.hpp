// SPDX-License-Identifier: Apache-2.0
// Events of a device, applied to both implementations of the device side.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "c_firmware.hpp"
#include "motor_firmware.hpp"

namespace palpate::test {

using emulator::Answer;
using emulator::Bytes;
using emulator::CFirmware;
using emulator::Firmware;
using emulator::Identity;
using emulator::MotorFirmware;
using emulator::put;
using emulator::Sample;

inline constexpr std::int32_t stiffness_uNm = 10;  ///< of the model on the device, for each count
inline constexpr std::int32_t most_uNm = 5'000;

/// Returns a device whose clock and encoder overflow within a test.
[[nodiscard]] inline Identity small_device(bool has_model = true) {
    Identity identity;
    identity.max_torque_uNm = most_uNm;
    identity.model_uNm_per_count = has_model ? stiffness_uNm : 0;
    return identity;
}

[[nodiscard]] inline Bytes setup(std::uint8_t type, std::uint8_t request, std::uint16_t value,
                                 std::uint16_t length = 0) {
    Bytes bytes{type, request};
    put(bytes, value);
    put(bytes, std::uint16_t{0});
    put(bytes, length);
    return bytes;
}

[[nodiscard]] inline Bytes command(std::uint16_t sequence, std::int32_t torque_uNm,
                                   std::uint16_t life_ms = 10) {
    Bytes bytes{'T', 1};
    put(bytes, sequence);
    put(bytes, torque_uNm);
    put(bytes, std::uint16_t{0});
    put(bytes, life_ms);
    put(bytes, std::uint32_t{0});
    return bytes;
}

/// The device side in C99 and its second implementation, which receive the same events.
class FirmwarePair {
  public:
    explicit FirmwarePair(const Identity& identity) : first{identity}, second{identity} {}

    void tick(std::uint32_t passed_us, std::int32_t count) {
        clock_us += passed_us;
        const Sample sample{clock_us, count, count / 3, -count, 251};
        first.tick(sample);
        second.tick(sample);
    }
    void out(const Bytes& packet, std::uint32_t later_us = 0) {
        first.out(packet, clock_us + later_us);
        second.out(packet, clock_us + later_us);
    }
    /// Sends a control request and returns the answer of the first device; both must answer equally.
    Answer control(const Bytes& bytes) {
        Answer answer = first.control(bytes);
        const Answer other = second.control(bytes);
        EXPECT_EQ(answer.status, other.status);
        EXPECT_EQ(answer.data, other.data);
        return answer;
    }
    void disarm() {
        first.disarm();
        second.disarm();
    }
    void fault(std::uint16_t present) {
        first.fault(present);
        second.fault(present);
    }
    /// Compares torque, status and the next packet of both devices.
    void compare() {
        EXPECT_EQ(first.state().torque_uNm, second.state().torque_uNm);
        EXPECT_EQ(first.state().status, second.state().status);
        EXPECT_EQ(first.in(), second.in());
    }

    CFirmware first;
    MotorFirmware second;
    std::uint32_t clock_us = 0xFFFF'F000;
};

}  // namespace palpate::test
