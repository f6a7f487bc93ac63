// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <span>
#include <string_view>
#include <type_traits>

/// Check and input of all fuzz targets.
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

/// A target, which is called with each input.
using Target = int (*)(const std::uint8_t* data, std::size_t size);

/// Returns the targets of this program by their names; replay.cpp calls them.
inline std::map<std::string_view, Target>& targets() {
    static std::map<std::string_view, Target> all;
    return all;
}

}  // namespace palpate::fuzz

/// Begins the function of a target with the input `data` of `size` bytes. A program of libFuzzer has one target, and the
/// program that reads the seeds has all.
#ifdef PALPATE_REPLAY
#define FUZZ_TARGET(name)                                                                              \
    static int name##_target(const std::uint8_t* data, std::size_t size);                              \
    static const bool name##_is_known = palpate::fuzz::targets().emplace(#name, name##_target).second; \
    static int name##_target(const std::uint8_t* data, std::size_t size)
#else
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
#define FUZZ_TARGET(name) extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
#endif
