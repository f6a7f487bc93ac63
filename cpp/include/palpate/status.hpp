// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace palpate {

/// Result of one step of the control loop or of a solver. Solvers, devices, guards and records use this one list;
/// Python, CSV files and the documentation use the same words.
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
    Stale,
    Saturated,
};

/// The word of a status, such as "Ok", and its meaning as a sentence.
struct StatusText {
    const char* word;
    const char* meaning;
};

/// Word and meaning of every status, in the order of the enumeration.
inline constexpr std::array<StatusText, 15> status_texts{{
    {"Ok", "the step was computed to its tolerance, without an error or limit"},
    {"MaxIterations",
     "the solver of the load line used all its evaluations; the position is its best approximation"},
    {"NotUnique",
     "the model's force falls too steeply; the equation of the virtual object may have a second solution"},
    {"NonFinite", "the position or the force of the model was not a finite number; the force sent is zero"},
    {"Timeout", "the device did not answer in time"},
    {"Lost", "a sample of the device or a command to it was lost or repeated"},
    {"Fault", "the device reported a fault or was disconnected; the force sent is zero"},
    {"Limited",
     "the force was clipped to the force limit of host or device, or its change to the slew limit"},
    {"Jump", "the position moved farther in one sample than the device can; the force sent is zero"},
    {"Frozen",
     "the position stopped within one sample during fast motion and stayed constant; the force sent is zero"},
    {"Ramp", "the force is scaled up from zero after the start"},
    {"EnergyLimited",
     "a larger force could take the energy that the energy account still has; the force was limited"},
    {"LimitCycleScaled", "a limit cycle was detected; all forces are scaled down until the end of the run"},
    {"Stale",
     "the device applied a force computed from an older sample than the certificate allows; the force sent "
     "is "
     "zero"},
    {"Saturated",
     "the force sensor of an admittance display was at the end of its range; the position is held"},
}};

/// Returns word and meaning of a status.
[[nodiscard]] constexpr const StatusText& text(Status status) noexcept {
    return status_texts[static_cast<std::size_t>(status)];
}

/// Returns true if a tick with this status sends the computed force. With another status zero force is sent, and an admittance display
/// holds its position.
[[nodiscard]] constexpr bool sends_force(Status status) noexcept {
    return status == Status::Ok || status == Status::MaxIterations || status == Status::NotUnique ||
           status == Status::Limited || status == Status::Ramp || status == Status::EnergyLimited ||
           status == Status::LimitCycleScaled;
}

/// Returns true if the run must end after this status, because the device or its readings are no longer reliable.
[[nodiscard]] constexpr bool is_final(Status status) noexcept {
    return status == Status::Fault || status == Status::Jump || status == Status::Frozen ||
           status == Status::Stale || status == Status::Saturated;
}

}  // namespace palpate
