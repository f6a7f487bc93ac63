// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "little_endian.hpp"

namespace emulator {

/// Properties of an emulated device, and its behaviour in all cases for which the USB protocol allows several
/// behaviours.
struct Identity {
    // GET_INFO
    std::uint8_t magic = 'I';  ///< First byte of the answer to GET_INFO; 'I' for devices of this project.
    std::uint16_t firmware = 0x0100;
    std::uint32_t counts_per_rev = 65536;
    std::int32_t max_torque_uNm = 5'000'000;
    std::uint16_t rate_hz = 1000;
    std::uint16_t watchdog_ms = 20;
    std::uint32_t capabilities = 3;  ///< Bit 0: the device measures force, bit 1: it measures velocity.
    std::uint64_t uid = 0x5041'4C50'0001ULL;
    std::uint32_t loop_hz = 10'000;  ///< rate of the control loop in the device
    // Model on the device: a spring
    std::int32_t model_uNm_per_count = 0;  ///< stiffness; 0: no model
    std::uint64_t model_fingerprint = 0x0123'4567'89AB'CDEFULL;
    std::uint64_t model_certificate = 0xFEDC'BA98'7654'3210ULL;
    std::uint16_t ramp_ms = 20;  ///< the force of the model grows for this time after its start
    std::size_t info_size = 32;  ///< Bytes of the answer to GET_INFO; another value means another protocol.
    /// False: GET_INFO reports the watchdog time at power-up, also after a change.
    bool reports_current_watchdog = true;

    // Descriptors
    std::u16string manufacturer = u"palpate";
    std::u16string product = u"emulated knob";
    std::u16string serial = u"EMU-1";
    std::array<std::uint8_t, 3> string_indices{1, 2, 3};
    std::uint16_t language = 0x0409;  ///< English (United States)
    std::uint16_t usb_version = 0x0200;
    std::uint16_t release = 0x0100;
    std::uint8_t control_packet = 64;  ///< bytes
    std::uint8_t configuration = 1;    ///< bConfigurationValue
    std::uint8_t power = 250;          ///< largest current from the USB bus [2 mA]
    bool out_endpoint_first = false;
    bool has_second_interface = false;
    /// Descriptor that the device sends between the interface descriptor and the endpoint descriptors
    Bytes class_descriptor;

    // Sequence number and clock begin close to their largest values, so that they overflow to zero in every run.
    std::uint16_t first_sequence = 65'500;
    std::uint32_t first_us = 4'294'867'296U;
    std::int32_t first_count = 0;
    /// Number of the last OUT packet that IN packets report before the first OUT packet.
    std::uint16_t first_out_sequence = 0;
    /// Age of the last OUT packet that IN packets report before the first one [us].
    std::uint16_t first_out_age_us = 0xFFFF;

    // Behaviour that the protocol leaves to the firmware
    bool reversed = false;  ///< The torque has the wrong sign.
    /// True: the torque of an OUT packet acts before the device reads the encoder count of the same frame.
    bool applies_out_first = false;
    /// True: in each frame the device completes the IN transfer before the OUT transfer.
    bool ends_in_transfer_first = false;
    /// Number of IN packets that the device stores until the host reads them. With 0 a new packet replaces the packet
    /// that the host has not read.
    std::size_t held_packets = 0;
    /// False: the device accepts OUT packets only while it is enabled.
    bool accepts_while_disabled = true;
    /// False: after an emergency stop the request ENABLE is accepted without effect.
    bool refuses_by_stall = true;
    bool stop_disables = true;       ///< An emergency stop also clears the enabled bit of the status.
    std::uint16_t spare_status = 0;  ///< Bits of the status that the protocol does not define.
    std::uint16_t temperature_dC = 253;
    std::int32_t torque_step_uNm = 1;  ///< Smallest change of the motor torque that the device can make.
    std::uint32_t latch_jitter_us = 0;

    /// Returns the torque of the model on the device, limited to 32 bits.
    [[nodiscard]] std::int32_t model_torque_uNm(std::int32_t count) const {
        const std::int64_t torque = -std::int64_t{model_uNm_per_count} * count;
        return static_cast<std::int32_t>(std::clamp<std::int64_t>(torque, INT32_MIN, INT32_MAX));
    }

    [[nodiscard]] Bytes device_descriptor() const {
        Bytes bytes{18, 1};
        put(bytes, usb_version);
        bytes.insert(bytes.end(), {0xFF, 0, 0, control_packet, 0x09, 0x12, 0x01, 0x00});
        put(bytes, release);
        bytes.insert(bytes.end(), {string_indices[0], string_indices[1], string_indices[2], 1});
        return bytes;
    }
    [[nodiscard]] Bytes configuration_descriptor() const {
        const Bytes in{7, 5, 0x81, 3, 64, 0, 1};   // IN endpoint: interrupt transfer in every frame
        const Bytes out{7, 5, 0x01, 3, 64, 0, 1};  // OUT endpoint: interrupt transfer in every frame
        Bytes rest{9, 4, 0, 0, 2, 0xFF, 0x01, 0x01, 0};
        for (const Bytes& part :
             {class_descriptor, out_endpoint_first ? out : in, out_endpoint_first ? in : out}) {
            rest.insert(rest.end(), part.begin(), part.end());
        }
        if (has_second_interface) {
            // A second USB interface of the device, for updates of its firmware.
            const Bytes second{9, 4, 1, 0, 0, 0xFE, 0x01, 0x01, 0};
            rest.insert(rest.end(), second.begin(), second.end());
        }
        Bytes bytes{9, 2};
        put(bytes, static_cast<std::uint16_t>(9 + rest.size()));
        bytes.insert(bytes.end(), {static_cast<std::uint8_t>(has_second_interface ? 2 : 1), configuration, 0,
                                   0x80, power});
        bytes.insert(bytes.end(), rest.begin(), rest.end());
        return bytes;
    }
    [[nodiscard]] Bytes string_descriptor(unsigned index) const {
        Bytes bytes{0, 3};
        if (index == 0) {
            put(bytes, language);
        }
        const std::array<const std::u16string*, 3> texts{&manufacturer, &product, &serial};
        for (std::size_t k = 0; k < texts.size(); ++k) {
            if (index == string_indices.at(k)) {
                for (const char16_t unit : *texts.at(k)) {
                    put(bytes, static_cast<std::uint16_t>(unit));
                }
                bytes[0] = 1;
            }
        }
        if (index != 0 && bytes[0] == 0) {
            return {};
        }
        bytes[0] = static_cast<std::uint8_t>(bytes.size());
        return bytes;
    }
};

}  // namespace emulator
