// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "palpate/device/device_profile.hpp"
#include "palpate/fields/field_table.hpp"
#include "palpate/guard/limits.hpp"
#include "palpate/guard/reading_guard.hpp"
#include "palpate/rendering/scale.hpp"

namespace palpate {

/// Settings of the guards for a rendering on a device, with times in seconds.
struct GuardSettings {
    double force_limit = 5.0;  ///< largest absolute force that is sent to the device [N or N*m]
    /// Slew limit: shortest time in which the force may rise from 0 to the force limit; 0: no slew limit [s]
    double slew_s = 0.005;
    double ramp_s = 0.2;           ///< duration of the start ramp from zero force to the full force [s]
    double largest_speed = 100.0;  ///< handle speed above which a reading is a fault (jump) [m/s or rad/s]
    /// Speed from which a handle cannot stop within one period T [m/s or rad/s]
    double frozen_speed = 0.3;
    /// If the position is constant for this time directly after fast motion, the encoder is frozen; 0: no check [s]
    double frozen_s = 0.05;
    bool energy_account = true;  ///< true: an energy account limits the energy that a hand can take out
    /// An oscillation is a limit cycle only if the force changes by at least this much in each swing between two
    /// reversals; 0: limit cycles are not detected [N or N*m]
    double limit_cycle_force = 0.05;
    double device_damping = 0.0;   ///< device damping b [N*s/m or N*m*s/rad]
    double device_friction = 0.0;  ///< Coulomb friction f_c of the device [N or N*m]
    double encoder_step = 0.0;     ///< encoder step of the device [m or rad]
    double force_step = 0.0;       ///< force step of the device [N or N*m]
    double delay_s = 0.0;          ///< delay from a reading to its force [s]
    double jitter_s = 0.0;         ///< longest time between two readings, minus the period [s]
    /// true: a certificate holds for this run. The energy account then uses the motion that encoder readings prove,
    /// counts all damping and friction of the device, and includes the energy that the virtual object stores outside
    /// the domain.
    bool certified = false;
    /// Largest delay of the applied force, `Reading::delay`; a longer delay ends the run [s]
    double longest_delay_s = std::numeric_limits<double>::infinity();
};

/// Sets the numbers of the device that the guards use.
inline void use_device(GuardSettings& guards, const DeviceProfile& device) noexcept {
    guards.force_limit = device.force_limit;
    guards.device_damping = device.viscous_damping;
    guards.device_friction = device.coulomb_friction;
    guards.encoder_step = device.encoder_step;
    guards.force_step = device.force_step;
    guards.delay_s = device.delay_s;
    guards.jitter_s = device.jitter_s;
}

/// Returns the default guard settings for a device. Speeds and the force of a limit cycle are scaled by the length and
/// the stiffness of the model.
[[nodiscard]] inline GuardSettings guards_for(const ModelScale& scale, const DeviceProfile& device) noexcept {
    GuardSettings guards;
    guards.largest_speed *= scale.length;
    // Below a speed of one encoder step per sample, a moving handle can give equal readings; the factor 3 is a reserve.
    guards.frozen_speed =
        std::max(guards.frozen_speed * scale.length, 3.0 * device.encoder_step / device.period_s);
    guards.limit_cycle_force *= scale.length * scale.stiffness();
    use_device(guards, device);
    return guards;
}

/// Largest allowed `ramp_s` and `frozen_s`, so that each number of samples fits an integer [s].
inline constexpr double longest_guard_s = 3600.0;

/// Without a certificate, the energy account counts this part (90 %) of the losses by device damping and Coulomb
/// friction. With all of it a steady limit cycle, which gives exactly the energy that the device dissipates, would not
/// decay.
inline constexpr double uncertified_credit = 0.9;

/// Lowest frequency of a limit cycle [Hz]: slower oscillations of the handle can come from a hand.
inline constexpr double lowest_limit_cycle_hz = 20.0;

/// Throws std::invalid_argument if a guard setting is not allowed, with the name of the setting, its value and the
/// rule.
inline void validate(const GuardSettings& settings) {
    const auto require_rule = [](const char* field, double value, Rule rule) {
        require_field(satisfies(value, rule), field, value, text(rule));
    };
    const auto require_within_an_hour = [](const char* field, double value) {
        require_field(value >= 0.0 && value <= longest_guard_s, field, value,
                      "0 to " + readable(longest_guard_s));
    };
    require_rule("force_limit", settings.force_limit, Rule::Positive);
    require_rule("slew_s", settings.slew_s, Rule::NotNegative);
    require_within_an_hour("ramp_s", settings.ramp_s);
    require_field(settings.largest_speed > 0.0, "largest_speed", settings.largest_speed, "> 0");
    require_rule("frozen_speed", settings.frozen_speed, Rule::NotNegative);
    require_within_an_hour("frozen_s", settings.frozen_s);
    require_rule("limit_cycle_force", settings.limit_cycle_force, Rule::NotNegative);
    require_rule("device_damping", settings.device_damping, Rule::NotNegative);
    require_rule("device_friction", settings.device_friction, Rule::NotNegative);
    require_rule("encoder_step", settings.encoder_step, Rule::NotNegative);
    require_rule("force_step", settings.force_step, Rule::NotNegative);
    require_rule("delay_s", settings.delay_s, Rule::NotNegative);
    require_rule("jitter_s", settings.jitter_s, Rule::NotNegative);
    require_field(settings.longest_delay_s >= 0.0, "longest_delay_s", settings.longest_delay_s, ">= 0");
}

/// Smallest number of consecutive ticks with equal position after which an encoder can count as frozen.
inline constexpr std::uint64_t fewest_frozen_samples = 5;

/// Returns the force limit of these settings.
[[nodiscard]] inline ForceLimit force_limit(const GuardSettings& settings) noexcept {
    return {settings.force_limit};
}

/// Returns the slew limit: the force limit over `slew_s`, or no limit if `slew_s` is 0.
[[nodiscard]] inline SlewLimit slew_limit(const GuardSettings& settings, double period_s) noexcept {
    const double step = settings.slew_s > 0.0 ? settings.force_limit * period_s / settings.slew_s
                                              : std::numeric_limits<double>::infinity();
    return {step, 0.0};
}

/// Returns the start ramp of these settings.
[[nodiscard]] inline ForceRamp force_ramp(const GuardSettings& settings, double period_s) noexcept {
    return {static_cast<std::uint64_t>(std::llround(settings.ramp_s / period_s)), 0};
}

/// Returns the guard of the readings, with the limits of these settings in one period. A change of position above
/// `largest_step` is also a fault.
[[nodiscard]] inline ReadingGuard reading_guard(
    const GuardSettings& settings, double period_s,
    double largest_step = std::numeric_limits<double>::infinity()) noexcept {
    const auto samples = static_cast<std::uint64_t>(std::llround(settings.frozen_s / period_s));
    return ReadingGuard{
        {std::min(settings.largest_speed * period_s, largest_step), settings.frozen_speed * period_s,
         settings.frozen_s > 0.0 ? std::max(samples, fewest_frozen_samples) : 0, settings.longest_delay_s}};
}

}  // namespace palpate
