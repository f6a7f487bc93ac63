// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace palpate {

/// Result of a step. Solvers, devices, guards and records use one list; Python, CSV files and the documentation use the
/// same words.
enum class Status : std::uint8_t {
    Ok,
    MaxIterations,
    NotUnique,
    NonFinite,
    Timeout,
    Lost,
    Fault,
    Limited,
    Jump,
    Frozen,
    Ramp,
    Drained,
    Softened,
};

/// Word and meaning of a status.
struct StatusText {
    const char* word;
    const char* meaning;
};

/// Word and meaning of every status, in the order of the enumeration.
inline constexpr std::array<StatusText, 13> status_texts{{
    {"Ok", "the step is exact to its tolerance"},
    {"MaxIterations", "the solver used all its evaluations; the position is its best one"},
    {"NotUnique", "the load line meets the environment where it falls faster than the line rises"},
    {"NonFinite", "an input or the environment was not a finite number; the force sent is zero"},
    {"Timeout", "the device did not answer in time"},
    {"Lost", "a sample of the device was lost or came twice"},
    {"Fault", "the device reported a fault or is gone; the force sent is zero"},
    {"Limited", "the force was clipped to the limit of the host or of the device"},
    {"Jump", "the position moved farther in one sample than the device can; the force sent is zero"},
    {"Frozen", "the position stood still at once out of full motion; the force sent is zero"},
    {"Ramp", "the force is still on its way up from zero after the start"},
    {"Drained", "the rendering had given all the energy it may; a force that gives more was scaled down"},
    {"Softened", "the handle buzzed; all forces are scaled down from then on"},
}};

/// Returns word and meaning of a status.
[[nodiscard]] constexpr const StatusText& text(Status status) noexcept {
    return status_texts[static_cast<std::size_t>(status)];
}

/// Returns true if a tick of this status sends a force. The others send zero.
[[nodiscard]] constexpr bool sends_force(Status status) noexcept {
    return status == Status::Ok || status == Status::MaxIterations || status == Status::NotUnique ||
           status == Status::Limited || status == Status::Ramp || status == Status::Drained ||
           status == Status::Softened;
}

/// Returns true if no tick can follow: the device or its readings are not reliable any more.
[[nodiscard]] constexpr bool is_final(Status status) noexcept {
    return status == Status::Fault || status == Status::Jump || status == Status::Frozen;
}

}  // namespace palpate
