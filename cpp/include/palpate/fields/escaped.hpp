// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

namespace palpate {

namespace detail {

/// Characters that control a terminal, change the direction of text or are invisible: the categories Cc, Cf, Co, Zl and
/// Zp of Unicode 15.
inline constexpr std::array<std::pair<std::uint32_t, std::uint32_t>, 26> invisible_characters{
    {{0x0000, 0x001F},    {0x007F, 0x009F},   {0x00AD, 0x00AD},   {0x0600, 0x0605},   {0x061C, 0x061C},
     {0x06DD, 0x06DD},    {0x070F, 0x070F},   {0x0890, 0x0891},   {0x08E2, 0x08E2},   {0x180E, 0x180E},
     {0x200B, 0x200F},    {0x2028, 0x202E},   {0x2060, 0x2064},   {0x2066, 0x206F},   {0xE000, 0xF8FF},
     {0xFEFF, 0xFEFF},    {0xFFF9, 0xFFFB},   {0x110BD, 0x110BD}, {0x110CD, 0x110CD}, {0x13430, 0x1343F},
     {0x1BCA0, 0x1BCA3},  {0x1D173, 0x1D17A}, {0xE0001, 0xE0001}, {0xE0020, 0xE007F}, {0xF0000, 0xFFFFD},
     {0x100000, 0x10FFFD}}};

/// Returns the first character of a text that is not empty, and its number of bytes; 0 bytes if it is not UTF-8.
[[nodiscard]] constexpr std::pair<std::uint32_t, std::size_t> first_character(
    std::string_view text) noexcept {
    const auto byte = [&](std::size_t at) {
        return static_cast<std::uint32_t>(static_cast<unsigned char>(text[at]));
    };
    const std::uint32_t lead = byte(0);
    const std::size_t size = lead < 0x80   ? 1
                             : lead < 0xC0 ? 0
                             : lead < 0xE0 ? 2
                             : lead < 0xF0 ? 3
                             : lead < 0xF8 ? 4
                                           : 0;
    if (size < 2 || size > text.size()) {
        return {lead, size < 2 ? size : 0};
    }
    std::uint32_t character = lead & (0x7FU >> size);
    for (std::size_t k = 1; k < size; ++k) {
        if ((byte(k) & 0xC0U) != 0x80) {
            return {lead, 0};
        }
        character = character << 6U | (byte(k) & 0x3FU);
    }
    constexpr std::array<std::uint32_t, 3> least{0x80, 0x800, 0x10000};
    const bool is_surrogate = character >= 0xD800 && character < 0xE000;
    const bool is_valid = character >= least[size - 2] && character <= 0x10FFFF && !is_surrogate;
    return {is_valid ? character : lead, is_valid ? size : 0};
}

}  // namespace detail

/// Returns a text from a device or a service in UTF-8 without control and invisible characters: these and invalid bytes
/// are escaped, such as "\x1b" or "\u202e". The result cannot control a terminal or break a line of a file.
[[nodiscard]] inline std::string escaped(std::string_view text) {
    std::string shown;
    while (!text.empty()) {
        const auto [character, size] = detail::first_character(text);
        const std::uint32_t code = character;
        const bool is_visible =
            size > 0 &&
            std::none_of(detail::invisible_characters.begin(), detail::invisible_characters.end(),
                         [&](const auto& range) { return range.first <= code && code <= range.second; });
        if (is_visible) {
            shown += text.substr(0, size);
        } else {
            const int digits = code < 0x100 ? 2 : code < 0x10000 ? 4 : 8;
            shown += digits == 2 ? "\\x" : digits == 4 ? "\\u" : "\\U";
            for (int k = digits - 1; k >= 0; --k) {
                shown += "0123456789abcdef"[code >> 4U * static_cast<unsigned>(k) & 0xFU];
            }
        }
        text.remove_prefix(std::max<std::size_t>(size, 1));
    }
    return shown;
}

}  // namespace palpate
