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
    EnergyLimited,
    LimitCycleScaled,
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
    {"NotUnique", "the force falls more steeply than the load line rises; another solution may exist"},
    {"NonFinite", "an input or the environment was not a finite number; the force sent is zero"},
    {"Timeout", "the device did not answer in time"},
    {"Lost", "a sample of the device was lost or repeated"},
    {"Fault", "the device reported a fault or was disconnected; the force sent is zero"},
    {"Limited", "the force was clipped to the limit of the host or of the device"},
    {"Jump", "the position moved farther in one sample than the device can; the force sent is zero"},
    {"Frozen", "the position stopped within one sample during fast motion; the force sent is zero"},
    {"Ramp", "the force is scaled up from zero after the start"},
    {"EnergyLimited", "the rendering had given all energy that it may give; the force was scaled down"},
    {"LimitCycleScaled", "a limit cycle was detected; all forces are scaled down until the end of the run"},
}};

/// Returns word and meaning of a status.
[[nodiscard]] constexpr const StatusText& text(Status status) noexcept {
    return status_texts[static_cast<std::size_t>(status)];
}

/// Returns true if a tick of this status sends a force. The others send zero.
[[nodiscard]] constexpr bool sends_force(Status status) noexcept {
    return status == Status::Ok || status == Status::MaxIterations || status == Status::NotUnique ||
           status == Status::Limited || status == Status::Ramp || status == Status::EnergyLimited ||
           status == Status::LimitCycleScaled;
}

/// Returns true if no tick can follow: the device or its readings are not reliable any more.
[[nodiscard]] constexpr bool is_final(Status status) noexcept {
    return status == Status::Fault || status == Status::Jump || status == Status::Frozen;
}

}  // namespace palpate
