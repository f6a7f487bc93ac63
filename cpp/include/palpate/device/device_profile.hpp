// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "palpate/readable.hpp"

namespace palpate {

/// What is known of a haptic device. The default is a direct-drive knob with a 16-bit encoder.
struct DeviceProfile {
    std::string id = "simulated-knob";
    double period_s = 1e-3;                                  ///< T, time between two samples [s]
    double inertia = 2e-4;                                   ///< of handle and motor [kg or kg*m^2]
    double viscous_damping = 0.06;                           ///< b, physical [N*s/m or N*m*s/rad]
    double coulomb_friction = 0.0;                           ///< f_c, physical [N or N*m]
    double encoder_step = 2.0 * std::numbers::pi / 65536.0;  ///< Delta [m or rad]; 0 = not quantised
    double force_step = 0.0;            ///< Delta_F, of the command [N or N*m]; 0 = not quantised
    int delay_samples = 0;              ///< n_d, whole samples between command and force
    double force_limit = 5.0;           ///< [N or N*m]
    double jitter_s = 0.0;              ///< how much longer than T the time between two samples can get [s]
    std::string position_unit = "rad";  ///< rad, and forces are in N*m; or m, and they are in N

    /// What a certificate has to hold for.
    [[nodiscard]] double longest_period_s() const noexcept { return period_s + jitter_s; }

    /// True if the device can make this force. Less than a force step is rounding.
    [[nodiscard]] bool makes(double force) const noexcept {
        return force <= force_limit * (1.0 + 1e-9) + force_step;
    }

    [[nodiscard]] bool operator==(const DeviceProfile&) const = default;
};

inline constexpr int longest_delay_samples = 16;

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
    require(profile.delay_samples >= 0 && profile.delay_samples <= longest_delay_samples, "delay_samples",
            profile.delay_samples, "0 to 16");
}

}  // namespace palpate
