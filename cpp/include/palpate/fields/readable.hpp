// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <string>

namespace palpate {

/// Returns a number as text with four significant digits. Numbers from 1000 to 10^7 are written as integers, without an
/// exponent.
[[nodiscard]] inline std::string readable(double value) {
    std::array<char, 32> digits{};
    char* const first = digits.data();
    char* const last = first + digits.size();
    const double size = std::abs(value);
    const bool whole = size >= 1e3 && size < 1e7;
    return {first, whole ? std::to_chars(first, last, value, std::chars_format::fixed, 0).ptr
                         : std::to_chars(first, last, value, std::chars_format::general, 4).ptr};
}
[[nodiscard]] inline std::string readable(std::optional<double> value) {
    return value ? readable(*value) : "not given";
}

}  // namespace palpate
