// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <span>
#include <string_view>
#include <type_traits>

/// Check and input of all fuzz targets. Each target defines LLVMFuzzerTestOneInput, which libFuzzer calls with every input.
namespace palpate::fuzz {

/// Ends the program if `holds` is false; libFuzzer then stores the input.
inline void require(bool holds, const char* promise) {
    if (!holds) {
        (void)std::fprintf(stderr, "broken promise: %s\n", promise);
        std::abort();
    }
}

/// Takes numbers and bytes from the front of an input; 0 and no bytes after its end.
class Input {
  public:
    Input(const std::uint8_t* data, std::size_t size) : bytes_{data, size} {}

    [[nodiscard]] bool empty() const { return bytes_.empty(); }

    template <class Number>
    [[nodiscard]] Number take() {
        static_assert(std::is_arithmetic_v<Number>);
        Number number{};
        const auto given = take_bytes(sizeof number);
        std::copy(given.begin(), given.end(), reinterpret_cast<std::uint8_t*>(&number));
        return number;
    }
    /// Returns at most `size` bytes.
    [[nodiscard]] std::span<const std::uint8_t> take_bytes(std::size_t size) {
        const auto taken = bytes_.first(std::min(size, bytes_.size()));
        bytes_ = bytes_.subspan(taken.size());
        return taken;
    }
    [[nodiscard]] std::string_view take_text() {
        const auto taken = take_bytes(bytes_.size());
        return {reinterpret_cast<const char*>(taken.data()), taken.size()};
    }

  private:
    std::span<const std::uint8_t> bytes_;
};

}  // namespace palpate::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
