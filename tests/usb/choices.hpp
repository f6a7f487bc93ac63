// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <random>

#include "identity.hpp"

namespace emulator {

/// Returns an emulated device of the USB protocol; the seed chooses every property that the protocol leaves to the
/// firmware.
[[nodiscard]] inline Identity identity_of_seed(std::uint32_t seed) {
    std::mt19937 random{seed};
    const auto below = [&](std::uint64_t end) {
        return std::uniform_int_distribution<std::uint64_t>{0, end - 1}(random);
    };
    const auto yes = [&] { return below(2) == 1; };
    const auto one_of = [&](auto... values) {
        const std::array all{values...};
        return all[below(all.size())];
    };
    Identity device;
    device.firmware = static_cast<std::uint16_t>(below(0x10000));
    device.counts_per_rev = one_of(4000U, 36'001U, 65'536U, 1U << 24U);
    device.max_torque_uNm = one_of(2'000'000, 5'000'000, 40'000'001);
    device.watchdog_ms = one_of(std::uint16_t{15}, std::uint16_t{20}, std::uint16_t{1000});
    device.capabilities = static_cast<std::uint32_t>(below(4));
    device.uid = random();
    device.reports_current_watchdog = yes();

    device.manufacturer = one_of(std::u16string{}, std::u16string{u"M\u00fcller & S\u00f6hne"});
    device.product =
        one_of(std::u16string{}, std::u16string{u"knob, \u043d\u043e\u0432\u044b\u0439\n\u2116 7"},
               std::u16string(126, u'k'));
    device.serial = one_of(std::u16string{u"0"}, std::u16string{u"A:B C/\u00e9 \U0001D11E"},
                           std::u16string{u"PADDED"} + std::u16string(4, u'\0'));
    std::uint8_t index = 0;
    for (std::uint8_t& place : device.string_indices) {
        place = index = static_cast<std::uint8_t>(index + 1 + below(40));
    }
    std::shuffle(device.string_indices.begin(), device.string_indices.end(), random);
    device.language = one_of(std::uint16_t{0x0409}, std::uint16_t{0x0407}, std::uint16_t{0x0411});
    device.usb_version = one_of(std::uint16_t{0x0110}, std::uint16_t{0x0200});
    device.release = static_cast<std::uint16_t>(below(0x10000));
    device.control_packet = one_of(std::uint8_t{8}, std::uint8_t{16}, std::uint8_t{64});
    device.configuration = static_cast<std::uint8_t>(1 + below(255));
    device.power = static_cast<std::uint8_t>(below(251));
    device.out_endpoint_first = yes();
    device.has_second_interface = yes();
    device.class_descriptor = yes() ? Bytes{} : Bytes{5, 0x24, 1, 2, 3};

    device.first_sequence = static_cast<std::uint16_t>(below(0x10000));
    device.first_us = static_cast<std::uint32_t>(random());
    // The first encoder count may be close to the largest or smallest 32-bit integer, as after many revolutions of the
    // handle.
    device.first_count = one_of(0, -7, INT32_MAX - 100, INT32_MIN + 1, static_cast<std::int32_t>(random()));
    device.first_out_sequence = static_cast<std::uint16_t>(below(0x10000));
    device.first_out_age_us = one_of(std::uint16_t{0}, std::uint16_t{0xFFFF});

    device.applies_out_first = yes();
    device.ends_in_transfer_first = yes();
    device.held_packets = below(3);
    device.accepts_while_disabled = yes();
    device.refuses_by_stall = yes();
    device.stop_disables = yes();
    device.spare_status = static_cast<std::uint16_t>(below(0x200) << 7U);
    device.temperature_dC = static_cast<std::uint16_t>(below(0x10000));
    device.torque_step_uNm = one_of(1, 40, 1000);
    device.latch_jitter_us = one_of(0U, 40U);
    return device;
}

}  // namespace emulator
