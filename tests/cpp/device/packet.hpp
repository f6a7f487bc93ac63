// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "palpate/device/wire.hpp"

namespace palpate::test {

using Bytes = std::vector<std::uint8_t>;

/// An IN packet of the USB protocol, written byte by byte as the protocol page of the documentation defines the
/// packet.
struct Packet {
    std::uint16_t sequence = 0;
    std::uint32_t clock_us = 0;
    std::int32_t count = 0;
    std::int32_t velocity_cps = 0;
    std::int32_t torque_uNm = 0;
    std::uint16_t status = wire::enabled;
    std::uint16_t out_sequence = 0;
    std::uint16_t out_age_us = 0;
    std::int32_t sensor_uNm = 0;

    [[nodiscard]] Bytes bytes() const {
        Bytes all{'H', 1};
        const auto put = [&](auto value) {
            for (std::size_t k = 0; k < sizeof value; ++k) {
                all.push_back(static_cast<std::uint8_t>(static_cast<std::uint64_t>(value) >> (8 * k)));
            }
        };
        put(sequence), put(clock_us), put(count), put(velocity_cps), put(torque_uNm), put(status);
        put(out_sequence), put(out_age_us), put(std::uint16_t{253}), put(sensor_uNm);
        return all;
    }
};

inline wire::Info knob(std::uint32_t capabilities = 3) {
    return {0x0100, 65536, 5'000'000, 1000, 20, capabilities, 7};
}

}  // namespace palpate::test
