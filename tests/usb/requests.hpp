// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cerrno>
#include <cstdint>

#include "identity.hpp"
#include "little_endian.hpp"

namespace emulator {

/// Answer of the emulated device to a control transfer.
struct Answer {
    int status = 0;  ///< 0 if the request succeeded, or -EPIPE if the device refuses the request (stall)
    Bytes data;
};

[[nodiscard]] inline Answer stalled() {
    return {-EPIPE, {}};
}

/// First eight bytes of a control transfer, which state the request.
struct Setup {
    std::uint8_t type;
    std::uint8_t request;
    std::uint16_t value;
    std::uint16_t index;
    std::uint16_t length;

    explicit Setup(const Bytes& bytes)
        : type{bytes.at(0)},
          request{bytes.at(1)},
          value{get<std::uint16_t>(bytes, 2)},
          index{get<std::uint16_t>(bytes, 4)},
          length{get<std::uint16_t>(bytes, 6)} {}
};

/// Halted endpoints, which refuse every transfer until the host clears the halt.
struct Halts {
    bool in = false;
    bool out = false;

    void clear(std::uint8_t endpoint) { (endpoint == 0x81 ? in : out) = false; }
};

/// Answers the standard requests (chapter 9 of the USB specification), except the requests that set the torque to
/// zero.
[[nodiscard]] inline Answer standard_answer(const Setup& setup, const Identity& identity, Halts& halts) {
    switch (setup.request) {
        case 0: {  // GET_STATUS
            const bool halted = (setup.index == 0x81 && halts.in) || (setup.index == 1 && halts.out);
            return {0, {static_cast<std::uint8_t>(halted), 0}};
        }
        case 1:  // CLEAR_FEATURE
            if (setup.value == 0) {
                halts.clear(static_cast<std::uint8_t>(setup.index));
            }
            return {};
        case 6: {  // GET_DESCRIPTOR
            const unsigned kind = setup.value >> 8U;
            const Bytes descriptor = kind == 1   ? identity.device_descriptor()
                                     : kind == 2 ? identity.configuration_descriptor()
                                     : kind == 3 ? identity.string_descriptor(setup.value & 0xFFU)
                                                 : Bytes{};
            return descriptor.empty() ? stalled() : Answer{0, descriptor};
        }
        case 8:  // GET_CONFIGURATION
            return {0, {identity.configuration}};
        case 10:  // GET_INTERFACE
            return {0, {0}};
        default:
            return stalled();
    }
}

}  // namespace emulator
