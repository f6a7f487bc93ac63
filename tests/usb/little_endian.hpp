// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <vector>

namespace emulator {

using Bytes = std::vector<std::uint8_t>;

/// Appends an integer, least significant byte first.
template <class Integer>
void put(Bytes& bytes, Integer value) {
    static_assert(std::is_integral_v<Integer>);
    auto bits = static_cast<std::make_unsigned_t<Integer>>(value);
    for (std::size_t k = 0; k < sizeof(Integer); ++k) {
        bytes.push_back(static_cast<std::uint8_t>(bits & 0xFFU));
        bits = static_cast<std::make_unsigned_t<Integer>>(static_cast<std::uint64_t>(bits) >> 8U);
    }
}

/// Replaces an integer, least significant byte first.
template <class Integer>
void replace(Bytes& bytes, std::size_t offset, Integer value) {
    Bytes written;
    put(written, value);
    std::copy(written.begin(), written.end(), bytes.begin() + static_cast<std::ptrdiff_t>(offset));
}

/// Reads an integer, least significant byte first.
template <class Integer>
[[nodiscard]] Integer get(const Bytes& bytes, std::size_t offset) {
    std::uint64_t bits = 0;
    for (std::size_t k = 0; k < sizeof(Integer); ++k) {
        bits |= static_cast<std::uint64_t>(bytes.at(offset + k)) << (8U * k);
    }
    return static_cast<Integer>(static_cast<std::make_unsigned_t<Integer>>(bits));
}

}  // namespace emulator
