// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "palpate/device/device_profile.hpp"
#include "palpate/fields/field_table.hpp"
#include "palpate/fields/readable.hpp"

// Definitions of the functions that check a device profile.
namespace palpate {

PALPATE_INLINE void validate(const DeviceProfile& profile) {
    check_fields(profile, "device profile: ");
    if (!(profile.delay_s <= longest_delay_s(profile.period_s))) {
        throw std::invalid_argument("device profile: delay_s is " + readable(profile.delay_s) +
                                    ", must be 0 to 16 periods");
    }
    if (profile.admittance && profile.admittance->servo_damping && !profile.admittance->servo_bandwidth_hz) {
        throw std::invalid_argument(
            "device profile: admittance.servo_damping is given without admittance.servo_bandwidth_hz: give "
            "both, or neither for a servo without lag");
    }
    if (profile.held_line && !(profile.held_line->period_s <= profile.period_s)) {
        throw std::invalid_argument("device profile: held_line.period_s is " +
                                    readable(profile.held_line->period_s) + ", must be at most period_s, " +
                                    readable(profile.period_s));
    }
    if (profile.held_line && !(profile.held_line->delay_s <= longest_delay_s(profile.held_line->period_s))) {
        throw std::invalid_argument("device profile: held_line.delay_s is " +
                                    readable(profile.held_line->delay_s) +
                                    ", must be 0 to 16 periods of held_line");
    }
}

PALPATE_INLINE DeviceProfile on_device(DeviceProfile profile, double rate_hz) {
    const OnDevice timing = profile.on_device.value_or(OnDevice{});
    require_field(satisfies(rate_hz, Rule::Positive), "on_device", rate_hz, "a rate in Hz, > 0");
    const double highest = timing.highest_rate_hz.value_or(rate_hz);
    require_field(
        rate_hz <= highest, "on_device", rate_hz,
        "at most " + readable(highest) + " Hz, the highest rate of the controller of " + profile.id);
    profile.period_s = 1.0 / rate_hz;
    profile.delay_s = timing.delay_periods * profile.period_s + timing.delay_s;
    profile.jitter_s = timing.jitter_s;
    profile.renderer = "device";
    profile.held_line.reset();
    if (const double most = longest_delay_samples - timing.delay_periods; timing.delay_s * rate_hz > most) {
        require_field(false, "on_device", rate_hz,
                      "at most " + readable(std::floor(std::max(most, 0.0) / timing.delay_s)) +
                          " Hz, so that the delay of the controller is at most 16 periods");
    }
    validate(profile);
    return profile;
}

}  // namespace palpate
