// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>
#include <string_view>
#include <tuple>

#include "palpate/fields/field_table.hpp"

namespace palpate {

/// Longest delay between a sample and the force computed from it that a device may have [samples].
inline constexpr int longest_delay_samples = 16;

/// Returns the longest delay that a device with the period `period_s` may have [s], with a margin for rounding.
[[nodiscard]] constexpr double longest_delay_s(double period_s) noexcept {
    return longest_delay_samples * period_s * (1.0 + 1e-9);
}

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

    /// Returns the longest time between two samples, T plus jitter [s]. A certificate must hold for this time.
    [[nodiscard]] double longest_period_s() const noexcept { return period_s + jitter_s; }

    /// Returns n, the number of whole periods in the delay. A remainder below 1e-9 of a period counts as rounding.
    [[nodiscard]] int whole_delay_samples() const noexcept {
        return static_cast<int>(std::floor(delay_s / period_s + 1e-9));
    }
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
}

template <>
inline constexpr auto fields_of<DeviceProfile> = std::tuple{
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
                                    Rule::NotNegative}};

/// Returns the profile with zero damping and friction. A certificate must not rely on values that were not measured.
[[nodiscard]] inline DeviceProfile unmeasured(DeviceProfile profile) {
    profile.viscous_damping = profile.coulomb_friction = 0.0;
    return profile;
}

/// Checks a device profile. Throws std::invalid_argument with the wrong field, its value and the rule.
inline void validate(const DeviceProfile& profile) {
    check_fields(profile, "device profile: ");
    if (!(profile.delay_s <= longest_delay_s(profile.period_s))) {
        throw std::invalid_argument("device profile: delay_s is " + readable(profile.delay_s) +
                                    ", must be 0 to 16 periods");
    }
}

}  // namespace palpate
