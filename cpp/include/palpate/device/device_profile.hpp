// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "palpate/fields/field_table.hpp"
#include "palpate/inline.hpp"

namespace palpate {

/// Longest delay between a sample and the force computed from it that a device may have [samples].
inline constexpr int longest_delay_samples = 16;

/// Returns the longest delay that a device with the period `period_s` may have [s], with a margin for rounding.
[[nodiscard]] constexpr double longest_delay_s(double period_s) noexcept {
    return longest_delay_samples * period_s * (1.0 + 1e-9);
}

/// Returns the number of whole periods in a delay. A remainder below 1e-9 of a period counts as rounding.
[[nodiscard]] inline int whole_periods(double delay_s, double period_s) noexcept {
    return static_cast<int>(std::floor(delay_s / period_s + 1e-9));
}

/// Timing of a model that runs on the motor controller of a device instead of on the host. A profile without these
/// numbers gets the defaults: a controller applies a force one period after the sample, with an interrupt of a hardware
/// timer.
struct OnDevice {
    double delay_periods = 1.0;
    double delay_s = 0.0;
    double jitter_s = 1e-6;
    std::optional<double> highest_rate_hz = std::nullopt;

    [[nodiscard]] bool operator==(const OnDevice&) const = default;
};

template <>
inline constexpr auto fields_of<OnDevice> = FieldTable{
    Field<&OnDevice::delay_periods>{
        "delay_periods",
        "Time from a sample to the force computed from it, in periods of the controller [-].",
        Rule::NotNegative},
    Field<&OnDevice::delay_s>{
        "delay_s",
        "Delay in addition to delay_periods, for example of the current control and of a filter [s].",
        Rule::NotNegative},
    Field<&OnDevice::jitter_s>{"jitter_s", "Largest time between two samples, minus the period [s].",
                               Rule::NotNegative},
    Field<&OnDevice::highest_rate_hz>{
        "highest_rate_hz", "Highest rate of the controller [Hz]; absent: not known.", Rule::Positive}};

/// Properties of an admittance display: a device that measures the force of the hand and moves to a commanded position,
/// such as a force-feedback pedal. A certificate holds for every hand within the stated stiffness, damping and mass.
struct AdmittanceDisplay {
    double hand_stiffness = 0.0;
    double hand_damping = 0.0;
    double hand_mass = 0.0;
    double handle_mass = 0.0;
    std::optional<double> servo_bandwidth_hz = std::nullopt;
    std::optional<double> servo_damping = std::nullopt;
    std::optional<double> rate_limit = std::nullopt;
    double position_step = 0.0;
    double feed_forward_s = 0.0;
    std::optional<double> drive_stiffness = std::nullopt;
    std::optional<double> drive_damping = std::nullopt;

    [[nodiscard]] bool operator==(const AdmittanceDisplay&) const = default;
};

template <>
inline constexpr auto fields_of<AdmittanceDisplay> = FieldTable{
    Field<&AdmittanceDisplay::hand_stiffness>{
        "hand_stiffness", "k_h, largest stiffness of the hand or foot [N/m or N*m/rad].", Rule::NotNegative},
    Field<&AdmittanceDisplay::hand_damping>{
        "hand_damping", "b_h, largest damping of the hand or foot [N*s/m or N*m*s/rad].", Rule::NotNegative},
    Field<&AdmittanceDisplay::hand_mass>{
        "hand_mass", "Largest mass of the hand or foot that moves with the handle [kg or kg*m^2].",
        Rule::NotNegative},
    Field<&AdmittanceDisplay::handle_mass>{
        "handle_mass", "Mass between the force sensor and the hand [kg or kg*m^2].", Rule::NotNegative},
    Field<&AdmittanceDisplay::servo_bandwidth_hz>{
        "servo_bandwidth_hz",
        "Natural frequency of the position servo [Hz]; of a servo of first order, its corner frequency. "
        "Absent: the servo moves at once.",
        Rule::Positive},
    Field<&AdmittanceDisplay::servo_damping>{
        "servo_damping", "Damping ratio of a position servo of second order [-]; absent: first order.",
        Rule::Positive},
    Field<&AdmittanceDisplay::rate_limit>{
        "rate_limit", "Largest speed of the position command [m/s or rad/s]; absent: none.", Rule::Positive},
    Field<&AdmittanceDisplay::position_step>{
        "position_step",
        "Smallest change of the position command, such as one step of a stepper motor [m or rad]; 0 = not "
        "quantised.",
        Rule::NotNegative},
    Field<&AdmittanceDisplay::feed_forward_s>{
        "feed_forward_s",
        "Time by which the command is ahead of the object's motion, to compensate the servo's lag [s].",
        Rule::NotNegative},
    Field<&AdmittanceDisplay::drive_stiffness>{
        "drive_stiffness",
        "Stiffness of the position control of a motor drive, which each command states [N*m/rad]; absent: "
        "the servo has its own.",
        Rule::Positive},
    Field<&AdmittanceDisplay::drive_damping>{
        "drive_damping",
        "Damping of the position control of a motor drive [N*m*s/rad]; a moteus uses its own "
        "servo.pid_position.kd. Absent: none.",
        Rule::Positive}};
/// Loop of a motor controller that holds a line, force + stiffness (x - position), between two commands (`Command`). The
/// controller reads its own encoder at a higher rate than the host. The default is a controller of 20 kHz with a period
/// of delay.
struct HeldLine {
    double period_s = 5e-5;
    double delay_s = 5e-5;
    double encoder_step = 0.0;
    double stiffness_step = 0.0;
    double position_step = 0.0;
    std::optional<double> largest_stiffness = std::nullopt;
    bool limits_force = true;
    std::optional<double> watchdog_s = std::nullopt;
    std::optional<double> largest_center = std::nullopt;

    [[nodiscard]] bool operator==(const HeldLine&) const = default;
};

template <>
inline constexpr auto fields_of<HeldLine> = FieldTable{
    Field<&HeldLine::period_s>{"period_s", "Time between two samples of the controller [s].", Rule::Positive},
    Field<&HeldLine::delay_s>{
        "delay_s",
        "Time from a sample of the controller to its force, lag of the current control included [s].",
        Rule::NotNegative},
    Field<&HeldLine::encoder_step>{
        "encoder_step",
        "Smallest change of position that the controller reads [m or rad]; 0 = not quantised.",
        Rule::NotNegative},
    Field<&HeldLine::stiffness_step>{"stiffness_step",
                                     "Smallest change of the commanded stiffness [N/m or N*m/rad]; 0 = not "
                                     "quantised.",
                                     Rule::NotNegative},
    Field<&HeldLine::position_step>{
        "position_step", "Smallest change of the commanded position [m or rad]; 0 = not quantised.",
        Rule::NotNegative},
    Field<&HeldLine::largest_stiffness>{
        "largest_stiffness", "Largest stiffness that a command can have [N/m or N*m/rad]; absent: any.",
        Rule::Positive},
    Field<&HeldLine::limits_force>{
        "limits_force",
        "True if the controller limits the force of the line to the force limit of the profile."},
    Field<&HeldLine::watchdog_s>{
        "watchdog_s",
        "Time after the last command at which the controller makes zero force [s]; absent: never.",
        Rule::Positive},
    Field<&HeldLine::largest_center>{
        "largest_center",
        "Largest distance from 0 of the position at which a line has zero force, for a controller that takes "
        "a spring about a center, such as a wheel [m or rad]; absent: a command states force and position.",
        Rule::Positive}};

/// Properties of a haptic device; `fields_of` states the meaning of each number. The default is a direct-drive knob
/// with a 16-bit encoder.
struct DeviceProfile {
    std::string id = "simulated-knob";
    std::string position_unit = "rad";
    double period_s = 1e-3;
    double inertia = 2e-4;
    double viscous_damping = 0.06;
    double coulomb_friction = 0.0;
    double encoder_step = 2.0 * std::numbers::pi / 65536.0;
    double force_step = 0.0;
    double delay_s = 0.0;
    double force_limit = 5.0;
    double jitter_s = 0.0;
    std::optional<std::string> renderer = std::nullopt;
    std::optional<OnDevice> on_device = std::nullopt;
    std::optional<AdmittanceDisplay> admittance = std::nullopt;
    std::optional<HeldLine> held_line = std::nullopt;

    /// Returns the longest time between two samples, T plus jitter [s]. A certificate must hold for this time.
    [[nodiscard]] double longest_period_s() const noexcept { return period_s + jitter_s; }

    /// Returns n, the number of whole periods in the delay.
    [[nodiscard]] int whole_delay_samples() const noexcept { return whole_periods(delay_s, period_s); }
    /// Returns the part of the delay that remains after n whole periods T, divided by T: 0 <= result < 1.
    [[nodiscard]] double delay_fraction() const noexcept {
        const double rest = delay_s / period_s - whole_delay_samples();
        return rest > 1e-9 ? rest : 0.0;
    }
    /// Returns the delay divided by the period T of the control loop, rounded up to a whole number.
    [[nodiscard]] int late_samples() const noexcept {
        return whole_delay_samples() + (delay_fraction() > 0.0 ? 1 : 0);
    }

    /// Returns true if `force` is at most the device's force limit. A force that is larger by at most one force
    /// step also counts, because the device rounds forces to force steps.
    [[nodiscard]] bool makes(double force) const noexcept {
        return force <= force_limit * (1.0 + 1e-9) + force_step;
    }

    [[nodiscard]] bool operator==(const DeviceProfile&) const = default;
};

namespace detail {
inline constexpr std::array<std::string_view, 2> position_units{"rad", "m"};
inline constexpr std::array<std::string_view, 1> renderers{"device"};
}  // namespace detail

template <>
inline constexpr auto fields_of<DeviceProfile> = FieldTable{
    Field<&DeviceProfile::id>{"id",
                              "Name; a certificate holds for the device with this name and these numbers."},
    Field<&DeviceProfile::position_unit>{"position_unit",
                                         "\"rad\", with forces in N*m, or \"m\", with forces in N.",
                                         Rule::Any, true, detail::position_units},
    Field<&DeviceProfile::period_s>{"period_s", "T, time between two samples [s].", Rule::Positive},
    Field<&DeviceProfile::inertia>{"inertia", "Inertia of handle and motor together [kg or kg*m^2].",
                                   Rule::Positive},
    Field<&DeviceProfile::viscous_damping>{"viscous_damping",
                                           "b, viscous damping of the handle without control [N*s/m or "
                                           "N*m*s/rad]; not more than the true value.",
                                           Rule::NotNegative},
    Field<&DeviceProfile::coulomb_friction>{
        "coulomb_friction",
        "f_c, Coulomb friction of the handle without control [N or N*m]; not more than the true value.",
        Rule::NotNegative},
    Field<&DeviceProfile::encoder_step>{
        "encoder_step",
        "Delta, smallest change of position that the encoder reports [m or rad]; 0 = not quantised.",
        Rule::NotNegative},
    Field<&DeviceProfile::force_step>{
        "force_step", "Delta_F, smallest change of the commanded force [N or N*m]; 0 = not quantised.",
        Rule::NotNegative},
    Field<&DeviceProfile::delay_s>{
        "delay_s", "t_d, time from a sample to the force that is computed from it [s]; 0 to 16 periods.",
        Rule::NotNegative},
    Field<&DeviceProfile::force_limit>{"force_limit", "Largest force of the device [N or N*m].",
                                       Rule::Positive},
    Field<&DeviceProfile::jitter_s>{"jitter_s", "Largest time between two samples, minus the period T [s].",
                                    Rule::NotNegative},
    Field<&DeviceProfile::renderer>{"renderer",
                                    "\"device\" if the model runs on the motor controller, with the period, "
                                    "delay and jitter above; absent if "
                                    "it runs on the host.",
                                    Rule::Any, true, detail::renderers},
    Field<&DeviceProfile::on_device>{
        "on_device",
        "Timing of a model that runs on the motor controller; absent: the defaults of OnDevice."},
    Field<&DeviceProfile::admittance>{
        "admittance",
        "Hand, handle and position servo of an admittance display, which measures the force and moves to a "
        "position; absent: the device measures its position and applies a force."},
    Field<&DeviceProfile::held_line>{
        "held_line",
        "Loop of a controller that holds a line between two commands; absent: it holds a force."}};

/// Returns the profile with zero damping and friction. A certificate must not rely on values that were not measured.
[[nodiscard]] inline DeviceProfile unmeasured(DeviceProfile profile) {
    profile.viscous_damping = profile.coulomb_friction = 0.0;
    return profile;
}

/// Returns the part of the profile on which a certificate relies. The timing of another renderer is left out, and the
/// loop that holds a line unless the rendering uses it.
[[nodiscard]] inline DeviceProfile certified_part(DeviceProfile profile, bool holds_line) {
    profile.on_device.reset();
    if (!holds_line) {
        profile.held_line.reset();
    }
    return profile;
}

/// Checks a device profile. Throws std::invalid_argument with the wrong field, its value and the rule.
PALPATE_INLINE void validate(const DeviceProfile& profile);

/// Returns the profile of a device whose motor controller runs the model `rate_hz` times a second: period, delay and
/// jitter are those of the controller. Throws std::invalid_argument if the controller does not reach this rate, or if
/// its delay is longer than a certificate allows.
[[nodiscard]] PALPATE_INLINE DeviceProfile on_device(DeviceProfile profile, double rate_hz);

}  // namespace palpate

#ifndef PALPATE_COMPILED
#include "palpate/device/detail/validate.hpp"
#endif
