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
}

}  // namespace
}  // namespace palpate
