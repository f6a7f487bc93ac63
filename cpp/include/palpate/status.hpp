// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace palpate {

/// Why a step ended as it did. One list for solvers, devices, guards and records; the same words in
/// Python, in CSV files and in the documentation.
enum class Status : std::uint8_t {
    Ok,
    MaxIterations,
    NotUnique,
    NonFinite,
    Timeout,
    Lost,
    Fault,
    Limited,
};

struct StatusText {
    const char* word;
    const char* meaning;
};

/// Word and meaning of every status, in the order of the enumeration.
inline constexpr std::array<StatusText, 8> status_texts{{
    {"Ok", "the step is exact to its tolerance"},
    {"MaxIterations", "the solver used all its evaluations; the position is its best one"},
    {"NotUnique", "the load line meets the environment where it falls faster than the line rises"},
    {"NonFinite", "an input or the environment was not a finite number; the force sent is zero"},
    {"Timeout", "the device did not answer in time"},
    {"Lost", "a sample of the device was lost or came twice"},
    {"Fault", "the device reported a fault or is gone; the force sent is zero"},
    {"Limited", "the force was clipped to the limit"},
}};

[[nodiscard]] constexpr const StatusText& text(Status status) noexcept {
    return status_texts[static_cast<std::size_t>(status)];
}

}  // namespace palpate
