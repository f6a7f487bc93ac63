// SPDX-License-Identifier: Apache-2.0
#include "palpate/device/device_profile.hpp"

#include <cmath>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

namespace palpate {
namespace {

TEST(DeviceProfile, RefusesInvalidValuesByName) {
    const auto refusal = [](auto change) -> std::string {
        DeviceProfile profile;
        change(profile);
        try {
            validate(profile);
        } catch (const std::invalid_argument& error) {
            return error.what();
        }
        return "accepted";
    };
    EXPECT_EQ(refusal([](DeviceProfile&) {}), "accepted");
    EXPECT_EQ(refusal([](DeviceProfile& p) { p.inertia = 0.0; }),
              "device profile: inertia is 0, must be > 0");
    EXPECT_EQ(refusal([](DeviceProfile& p) { p.delay_s = 17.0 * p.period_s; }),
              "device profile: delay_s is 0.017, must be 0 to 16 periods");
    EXPECT_NE(refusal([](DeviceProfile& p) { p.period_s = std::nan(""); }), "accepted");
    EXPECT_NE(refusal([](DeviceProfile& p) { p.viscous_damping = -1.0; }), "accepted");
    EXPECT_EQ(refusal([](DeviceProfile& p) { p.on_device = OnDevice{.delay_s = -1.0}; }),
              "device profile: on_device.delay_s is -1, must be >= 0");
    EXPECT_EQ(refusal([](DeviceProfile& p) { p.held_line = HeldLine{.largest_center = 0.0}; }),
              "device profile: held_line.largest_center is 0, must be > 0");
    EXPECT_EQ(refusal([](DeviceProfile& p) { p.renderer = "phone"; }),
              "device profile: renderer is 'phone', must be device");
}

TEST(OnDevice, ReplacesPeriodDelayAndJitterByThoseOfTheController) {
    DeviceProfile profile{.delay_s = 2e-3, .jitter_s = 3e-4};
    const DeviceProfile usual = on_device(profile, 40'000.0);
    EXPECT_DOUBLE_EQ(usual.period_s, 2.5e-5);
    EXPECT_EQ(usual.late_samples(), 1);  // the default: the force appears one period after the sample
    EXPECT_DOUBLE_EQ(usual.jitter_s, OnDevice{}.jitter_s);
    EXPECT_EQ(usual.renderer, "device");
    profile.on_device = OnDevice{.delay_periods = 0.5, .delay_s = 5e-5, .jitter_s = 2e-6};
    const DeviceProfile given = on_device(profile, 10'000.0);
    EXPECT_DOUBLE_EQ(given.delay_s, 1e-4);
    EXPECT_DOUBLE_EQ(given.jitter_s, 2e-6);
    EXPECT_EQ(given.viscous_damping, profile.viscous_damping);
}

TEST(OnDevice, RefusesARateThatTheControllerOrTheProofsDoNotAllow) {
    const auto refusal = [](const OnDevice& timing, double rate_hz) -> std::string {
        DeviceProfile profile;
        profile.on_device = timing;
        try {
            (void)on_device(profile, rate_hz);
        } catch (const std::invalid_argument& error) {
            return error.what();
        }
        return "accepted";
    };
    EXPECT_EQ(refusal({.highest_rate_hz = 8000.0}, 8000.0), "accepted");
    EXPECT_EQ(
        refusal({.highest_rate_hz = 8000.0}, 8001.0),
        "on_device is 8001, must be at most 8000 Hz, the highest rate of the controller of simulated-knob");
    EXPECT_EQ(refusal({}, std::nan("")), "on_device is nan, must be a rate in Hz, > 0");
    EXPECT_EQ(refusal({.delay_s = 1e-3}, 15'000.0), "accepted");
    EXPECT_EQ(refusal({.delay_s = 1e-3}, 20'000.0),
              "on_device is 20000, must be at most 15000 Hz, so that the delay of the controller is at most "
              "16 periods");
}

}  // namespace
}  // namespace palpate
