// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <charconv>
#include <string>

namespace palpate {

/// A number as a person reads it: four significant digits.
[[nodiscard]] inline std::string readable(double value) {
    std::array<char, 32> digits{};
    const auto end =
        std::to_chars(digits.data(), digits.data() + digits.size(), value, std::chars_format::general, 4).ptr;
    return {digits.data(), end};
}

}  // namespace palpate
