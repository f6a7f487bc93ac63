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

/// Longest delay between a sample and its force [samples].
inline constexpr int longest_delay_samples = 16;

/// Returns the longest delay at a period [s], with a margin for rounding.
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

    /// Returns the longest time between two samples, for which a certificate must hold [s].
    [[nodiscard]] double longest_period_s() const noexcept { return period_s + jitter_s; }

    /// Returns n, the number of whole samples in the delay. A rest below 1e-9 of a period is rounding.
    [[nodiscard]] int whole_delay_samples() const noexcept {
        return static_cast<int>(std::floor(delay_s / period_s + 1e-9));
    }
    /// Returns tau, the rest of the delay, 0 <= tau < 1 [samples].
    [[nodiscard]] double delay_fraction() const noexcept {
        const double rest = delay_s / period_s - whole_delay_samples();
        return rest > 1e-9 ? rest : 0.0;
    }
    /// Returns the smallest number of whole samples that is not shorter than the delay.
    [[nodiscard]] int late_samples() const noexcept {
        return whole_delay_samples() + (delay_fraction() > 0.0 ? 1 : 0);
    }

    /// Returns true if the device can make this force. An excess below a force step is rounding.
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
    Field<&DeviceProfile::inertia>{"inertia", "Inertia of handle and motor [kg or kg*m^2].", Rule::Positive},
    Field<&DeviceProfile::viscous_damping>{
        "viscous_damping", "b, damping without control [N*s/m or N*m*s/rad]; at most the true value.",
        Rule::NotNegative},
    Field<&DeviceProfile::coulomb_friction>{
        "coulomb_friction", "f_c, friction without control [N or N*m]; at most the true value.",
        Rule::NotNegative},
    Field<&DeviceProfile::encoder_step>{
        "encoder_step", "Delta, step of the encoder [m or rad]; 0 = not quantised.", Rule::NotNegative},
    Field<&DeviceProfile::force_step>{
        "force_step", "Delta_F, step of the command [N or N*m]; 0 = not quantised.", Rule::NotNegative},
    Field<&DeviceProfile::delay_s>{
        "delay_s", "t_d, time from a sample to the force that is computed from it [s]; 0 to 16 periods.",
        Rule::NotNegative},
    Field<&DeviceProfile::force_limit>{"force_limit", "Largest force [N or N*m].", Rule::Positive},
    Field<&DeviceProfile::jitter_s>{"jitter_s", "Largest excess of the time between two samples over T [s].",
                                    Rule::NotNegative}};

/// Returns the profile without damping and friction, because values that were not measured must not be credited.
[[nodiscard]] inline DeviceProfile unmeasured(DeviceProfile profile) {
    profile.viscous_damping = profile.coulomb_friction = 0.0;
    return profile;
}

/// Throws std::invalid_argument with the field, its value and the rule.
inline void validate(const DeviceProfile& profile) {
    check_fields(profile, "device profile: ");
    if (!(profile.delay_s <= longest_delay_s(profile.period_s))) {
        throw std::invalid_argument("device profile: delay_s is " + readable(profile.delay_s) +
                                    ", must be 0 to 16 periods");
    }
}

}  // namespace palpate
