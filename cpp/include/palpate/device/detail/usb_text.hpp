// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <libusb-1.0/libusb.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "palpate/device/wire.hpp"
#include "palpate/fields/escaped.hpp"

namespace palpate::detail {

/// Returns a text with the cause of a libusb error and the cure; only the name and meaning of an error without such a
/// text.
[[nodiscard]] inline std::string usb_reason(int code) {
    static_assert(LIBUSB_ERROR_IO == -1 && LIBUSB_ERROR_ACCESS == -3 && LIBUSB_ERROR_NO_MEM == -11);
    const std::string_view cause = wire::usb_cause(code);
    return cause.empty() ? std::string(libusb_error_name(code)) + ", " + libusb_strerror(code)
                         : std::string(cause);
}

/// Returns the integer in the two bytes from index `at`, low byte first.
[[nodiscard]] inline std::uint16_t two_bytes(std::span<const std::uint8_t> bytes, std::size_t at) {
    return static_cast<std::uint16_t>(bytes[at] + 256U * bytes[at + 1]);
}

/// Appends one Unicode character to a text in UTF-8.
inline void append_utf8(std::string& text, std::uint32_t character) {
    const auto byte = [&](std::uint32_t bits) { text.push_back(static_cast<char>(bits)); };
    const auto rest = [&](unsigned shift) { byte(0x80U | (character >> shift & 0x3FU)); };
    if (character < 0x80) {
        byte(character);
    } else if (character < 0x800) {
        byte(0xC0U | character >> 6U);
        rest(0);
    } else if (character < 0x10000) {
        byte(0xE0U | character >> 12U);
        rest(6);
        rest(0);
    } else {
        byte(0xF0U | character >> 18U);
        rest(12);
        rest(6);
        rest(0);
    }
}

/// Converts the UTF-16 text (little endian) of a USB string descriptor to UTF-8, on one line, without blanks at both
/// ends, and escaped. Returns an empty text if the bytes are not valid UTF-16.
[[nodiscard]] inline std::string text_of_utf16(std::span<const std::uint8_t> bytes) {
    std::string text;
    std::uint32_t high = 0;  // first half of a character that UTF-16 stores in two units; 0: none
    for (std::size_t k = 0; k + 1 < bytes.size(); k += 2) {
        const std::uint32_t unit = two_bytes(bytes, k);
        const bool is_low = unit >= 0xDC00 && unit < 0xE000;
        if (is_low != (high != 0)) {
            return "";
        }
        if (unit >= 0xD800 && unit < 0xDC00) {
            high = unit;
            continue;
        }
        const bool is_control = unit < 0x20 || unit == 0x7F;
        append_utf8(text, is_control ? ' '
                          : is_low   ? 0x10000 + ((high - 0xD800) << 10U) + (unit - 0xDC00)
                                     : unit);
        high = 0;
    }
    const std::size_t first = text.find_first_not_of(' ');
    return high != 0 || first == std::string::npos
               ? ""
               : escaped(std::string_view{text}.substr(first, text.find_last_not_of(' ') + 1 - first));
}

/// Reads the string descriptor `index` of a USB device, in the device's first language. Returns an empty text if the
/// device has no such string.
[[nodiscard]] inline std::string string_of(libusb_device_handle* handle, std::uint8_t index) {
    std::array<std::uint8_t, 255> bytes{};
    const auto read = [&](std::uint8_t string_index, std::uint16_t language) {
        const int length = libusb_get_string_descriptor(handle, string_index, language, bytes.data(),
                                                        static_cast<int>(bytes.size()));
        const bool is_string = length >= 2 && bytes[0] >= 2 && bytes[1] == LIBUSB_DT_STRING;
        return std::span<const std::uint8_t>{bytes}.first(is_string ? std::min<std::size_t>(bytes[0], length)
                                                                    : 0);
    };
    if (index == 0) {
        return "";
    }
    const auto languages = read(0, 0);
    if (languages.size() < 4) {
        return "";
    }
    const auto text = read(index, two_bytes(languages, 2));
    return text.size() < 2 ? "" : text_of_utf16(text.subspan(2));
}

}  // namespace palpate::detail
