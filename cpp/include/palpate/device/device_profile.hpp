// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "palpate/fields/readable.hpp"

namespace palpate {

/// Longest delay between a sample and its force, in samples.
inline constexpr int longest_delay_samples = 16;

/// The same at a period [s], with room for rounding.
[[nodiscard]] constexpr double longest_delay_s(double period_s) noexcept {
    return longest_delay_samples * period_s * (1.0 + 1e-9);
}

/// What is known of a haptic device. The default is a direct-drive knob with a 16-bit encoder.
struct DeviceProfile {
    std::string id = "simulated-knob";
    double period_s = 1e-3;                                  ///< T, time between two samples [s]
    double inertia = 2e-4;                                   ///< of handle and motor [kg or kg*m^2]
    double viscous_damping = 0.06;                           ///< b, physical [N*s/m or N*m*s/rad]
    double coulomb_friction = 0.0;                           ///< f_c, physical [N or N*m]
    double encoder_step = 2.0 * std::numbers::pi / 65536.0;  ///< Delta [m or rad]; 0 = not quantised
    double force_step = 0.0;            ///< Delta_F, of the command [N or N*m]; 0 = not quantised
    double delay_s = 0.0;               ///< t_d, time from a sample to the force that is computed from it [s]
    double force_limit = 5.0;           ///< [N or N*m]
    double jitter_s = 0.0;              ///< how much longer than T the time between two samples can get [s]
    std::string position_unit = "rad";  ///< rad, and forces are in N*m; or m, and they are in N

    /// What a certificate has to hold for.
    [[nodiscard]] double longest_period_s() const noexcept { return period_s + jitter_s; }

    /// n: number of whole samples in the delay. Rounding of a period's 1e-9 counts as none.
    [[nodiscard]] int whole_delay_samples() const noexcept {
        return static_cast<int>(std::floor(delay_s / period_s + 1e-9));
    }
    /// tau: rest of the delay, 0 <= tau < 1 [samples].
    [[nodiscard]] double delay_fraction() const noexcept {
        const double rest = delay_s / period_s - whole_delay_samples();
        return rest > 1e-9 ? rest : 0.0;
    }
    /// Smallest number of whole samples that is not shorter than the delay.
    [[nodiscard]] int late_samples() const noexcept {
        return whole_delay_samples() + (delay_fraction() > 0.0 ? 1 : 0);
    }

    /// True if the device can make this force. Less than a force step is rounding.
    [[nodiscard]] bool makes(double force) const noexcept {
        return force <= force_limit * (1.0 + 1e-9) + force_step;
    }

    [[nodiscard]] bool operator==(const DeviceProfile&) const = default;
};

/// Throws std::invalid_argument naming the field, its value and what would be right.
inline void validate(const DeviceProfile& profile) {
    const auto require = [](bool holds, const char* field, double value, const char* right) {
        if (!holds) {
            throw std::invalid_argument("device profile: " + std::string(field) + " is " + readable(value) +
                                        ", must be " + right);
        }
    };
    const auto positive = [](double value) { return std::isfinite(value) && value > 0.0; };
    const auto not_negative = [](double value) { return std::isfinite(value) && value >= 0.0; };
    require(positive(profile.period_s), "period_s", profile.period_s, "> 0");
    require(positive(profile.inertia), "inertia", profile.inertia, "> 0");
    require(not_negative(profile.viscous_damping), "viscous_damping", profile.viscous_damping, ">= 0");
    require(not_negative(profile.coulomb_friction), "coulomb_friction", profile.coulomb_friction, ">= 0");
    require(not_negative(profile.encoder_step), "encoder_step", profile.encoder_step, ">= 0");
    require(not_negative(profile.force_step), "force_step", profile.force_step, ">= 0");
    require(positive(profile.force_limit), "force_limit", profile.force_limit, "> 0");
    require(not_negative(profile.jitter_s), "jitter_s", profile.jitter_s, ">= 0");
    if (profile.position_unit != "rad" && profile.position_unit != "m") {
        throw std::invalid_argument("device profile: position_unit is '" + profile.position_unit +
                                    "', must be 'rad' or 'm'");
    }
    require(profile.delay_s >= 0.0 && profile.delay_s <= longest_delay_s(profile.period_s), "delay_s",
            profile.delay_s, "0 to 16 periods");
}

}  // namespace palpate
