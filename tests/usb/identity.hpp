// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "little_endian.hpp"

namespace emulator {

/// What a device is, as its firmware says it.
struct Identity {
    std::string manufacturer = "palpate";
    std::string product = "emulated knob";
    std::string serial = "EMU-1";
    std::uint8_t magic = 'I';  ///< of GET_INFO; another one makes it somebody else's device
    std::uint16_t firmware = 0x0100;
    std::uint32_t counts_per_rev = 65536;
    std::int32_t max_torque_uNm = 5'000'000;
    std::uint16_t rate_hz = 1000;
    std::uint16_t watchdog_ms = 20;
    std::uint32_t capabilities = 3;  ///< bit 0 force transducer, bit 1 measured velocity
    std::uint64_t uid = 0x5041'4C50'0001ULL;
    // Counters begin close to their ends, so that every run sees them wrap.
    std::uint16_t first_sequence = 65'500;
    std::uint32_t first_us = 4'294'867'296U;
    bool flipped = false;          ///< a firmware whose torque points the wrong way
    bool takes_out_first = false;  ///< OUT packets act before the encoder of their frame is latched

    [[nodiscard]] static Bytes device_descriptor() {
        return {18, 1, 0x00, 0x02, 0xFF, 0, 0, 64, 0x09, 0x12, 0x01, 0x00, 0x00, 0x01, 1, 2, 3, 1};
    }
    [[nodiscard]] static Bytes configuration_descriptor() {
        return {9, 2, 32,   0, 1,  1,    0,    0x80, 250,  // bus powered, 500 mA
                9, 4, 0,    0, 2,  0xFF, 0x01, 0x01, 0,    // the interface
                7, 5, 0x81, 3, 64, 0,    1,                // interrupt IN, every frame
                7, 5, 0x01, 3, 64, 0,    1};               // interrupt OUT, every frame
    }
    [[nodiscard]] Bytes string_descriptor(unsigned index) const {
        if (index == 0) {
            return {4, 3, 0x09, 0x04};  // English (United States)
        }
        const std::array<std::string, 3> texts{manufacturer, product, serial};
        if (index > texts.size()) {
            return {};
        }
        const std::string& text = texts.at(index - 1);
        Bytes bytes{static_cast<std::uint8_t>(2 + 2 * text.size()), 3};
        for (const char letter : text) {
            put(bytes, static_cast<std::uint16_t>(static_cast<unsigned char>(letter)));
        }
        return bytes;
    }
};

}  // namespace emulator
