// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>

#include "palpate/device/device_profile.hpp"
#include "palpate/fields/readable.hpp"
#include "palpate/guard/limits.hpp"
#include "palpate/guard/reading_guard.hpp"
#include "palpate/rendering/scale.hpp"

namespace palpate {

/// Settings of the guards of a live rendering, with times in seconds instead of ticks.
struct GuardSettings {
    double force_limit = 5.0;      ///< largest force [N or N*m]
    double slew_s = 0.005;         ///< from zero force to the limit; 0 = no limit [s]
    double ramp_s = 0.2;           ///< from zero to the full force at the start [s]
    double largest_speed = 100.0;  ///< of the handle; faster is a jump [m/s or rad/s]
    double frozen_speed = 0.3;     ///< a faster handle cannot stop at once [m/s or rad/s]
    double frozen_s = 0.05;        ///< longest apparent rest; 0 = no check [s]
    bool energy_tank = true;       ///< true: an energy tank limits the energy
    double buzz_force =
        0.05;  ///< least force swing of a fast oscillation that is a limit cycle; 0 = no check [N or N*m]
    double device_damping = 0.0;   ///< known b [N*s/m or N*m*s/rad]
    double device_friction = 0.0;  ///< known f_c [N or N*m]
    double encoder_step = 0.0;     ///< [m or rad]
    /// true: a certificate holds for this run. The energy tank then uses the motion that readings prove, all of the
    /// device's damping and friction, and the energy that the object stores outside its domain.
    bool certified = false;
};

/// Returns the default guards for a device, at a model's scale.
[[nodiscard]] inline GuardSettings guards_for(const ModelScale& scale, const DeviceProfile& device) noexcept {
    GuardSettings guards;
    guards.force_limit = device.force_limit;
    guards.largest_speed *= scale.length;
    // A slower motion can stay within one encoder step.
    guards.frozen_speed =
        std::max(guards.frozen_speed * scale.length, 3.0 * device.encoder_step / device.period_s);
    guards.buzz_force *= scale.length * scale.stiffness();
    guards.device_damping = device.viscous_damping;
    guards.device_friction = device.coulomb_friction;
    guards.encoder_step = device.encoder_step;
    return guards;
}

inline constexpr double longest_guard_s =
    3600.0;  ///< largest ramp_s and frozen_s; whole samples must fit an integer [s]

/// Share of the device's damping and friction that the energy tank credits without a certificate.
inline constexpr double uncertified_credit = 0.9;

/// Frequency above which an oscillation cannot come from a hand [Hz].
inline constexpr double slowest_buzz_hz = 20.0;

/// Throws std::invalid_argument with the field, its value and the rule.
inline void validate(const GuardSettings& settings) {
    const auto require = [](bool holds, const char* field, double value, const char* right) {
        if (!holds) {
            throw std::invalid_argument(std::string(field) + " is " + readable(value) + ", must be " + right);
        }
    };
    const auto not_negative = [](double value) { return std::isfinite(value) && value >= 0.0; };
    require(std::isfinite(settings.force_limit) && settings.force_limit > 0.0, "force_limit",
            settings.force_limit, "> 0");
    require(not_negative(settings.slew_s), "slew_s", settings.slew_s, ">= 0");
    require(settings.ramp_s >= 0.0 && settings.ramp_s <= longest_guard_s, "ramp_s", settings.ramp_s,
            "0 to 3600");
    require(settings.largest_speed > 0.0, "largest_speed", settings.largest_speed, "> 0");
    require(not_negative(settings.frozen_speed), "frozen_speed", settings.frozen_speed, ">= 0");
    require(settings.frozen_s >= 0.0 && settings.frozen_s <= longest_guard_s, "frozen_s", settings.frozen_s,
            "0 to 3600");
    require(not_negative(settings.buzz_force), "buzz_force", settings.buzz_force, ">= 0");
    require(not_negative(settings.device_damping), "device_damping", settings.device_damping, ">= 0");
    require(not_negative(settings.device_friction), "device_friction", settings.device_friction, ">= 0");
    require(not_negative(settings.encoder_step), "encoder_step", settings.encoder_step, ">= 0");
}

/// Least number of equal samples that count as a frozen encoder.
inline constexpr std::uint64_t fewest_frozen_samples = 5;

[[nodiscard]] inline ForceLimit force_limit(const GuardSettings& settings) noexcept {
    return {settings.force_limit};
}

[[nodiscard]] inline SlewLimit slew_limit(const GuardSettings& settings, double period_s) noexcept {
    const double step = settings.slew_s > 0.0 ? settings.force_limit * period_s / settings.slew_s
                                              : std::numeric_limits<double>::infinity();
    return {step, 0.0};
}

[[nodiscard]] inline ForceRamp force_ramp(const GuardSettings& settings, double period_s) noexcept {
    return {static_cast<std::uint64_t>(std::llround(settings.ramp_s / period_s)), 0};
}

[[nodiscard]] inline ReadingGuard reading_guard(const GuardSettings& settings, double period_s) noexcept {
    const auto samples = static_cast<std::uint64_t>(std::llround(settings.frozen_s / period_s));
    return ReadingGuard{{settings.largest_speed * period_s, settings.frozen_speed * period_s,
                         settings.frozen_s > 0.0 ? std::max(samples, fewest_frozen_samples) : 0}};
}

}  // namespace palpate
