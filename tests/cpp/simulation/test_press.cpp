// SPDX-License-Identifier: Apache-2.0
#include "palpate/simulation/press.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "palpate/device/device_profile.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/stability/account_certificate.hpp"
#include "palpate/stability/certificate_check.hpp"

namespace palpate {
namespace {

/// A key of 4 mm with the slope `stiffness` at rest and a click in the middle.
ForceModel key(double stiffness) {
    return {NetworkParameters{1, {2000.0}, {2e-3}, {-0.4}, {stiffness}, 0.0},
            {{0.0}, {4e-3}, Continuation::Free, Continuation::Linear, std::nullopt}};
}

/// A voice coil without delay and friction steps.
DeviceProfile coil(double damping) {
    DeviceProfile device;
    device.id = "coil";
    device.position_unit = "m";
    device.inertia = 0.012;
    device.viscous_damping = damping;
    device.coulomb_friction = 0.05;
    device.encoder_step = 1e-6;
    device.force_limit = 8.0;
    return device;
}

Scheme direct() {
    Scheme scheme;
    scheme.structure = StructureKind::Direct;
    return scheme;
}

TEST(Finger, PressesWaitsAndReturnsAtItsSpeed) {
    const Finger finger{1.0, 0.5, 0.75, 0.125, 0.0};
    EXPECT_DOUBLE_EQ(finger.duration(), 2.0 * (2.0 + Finger::wait_s));
    EXPECT_EQ(finger.base(1.0).position, 0.625);
    EXPECT_EQ(finger.base(1.0).velocity, 0.125);
    EXPECT_EQ(finger.base(2.05).position, 0.75);
    EXPECT_EQ(finger.base(2.05).velocity, 0.0);
    EXPECT_NEAR(finger.base(3.1).position, 0.625, 1e-15);
    EXPECT_EQ(finger.base(3.1).velocity, -0.125);
    EXPECT_NEAR(finger.base(4.15).position, 0.5, 1e-15);
    EXPECT_EQ(finger.base(4.15).velocity, 0.0);
    const Finger resting{1.0, 0.0, 0.5, 0.0, 0.25};
    EXPECT_DOUBLE_EQ(resting.base(0.025).position, 0.75);
    EXPECT_NEAR(resting.base(0.025).velocity, 0.0, 1e-12);
    EXPECT_DOUBLE_EQ(resting.base(0.0).velocity, 0.25 * 2.0 * std::acos(-1.0) * Finger::tremor_hz);
}

TEST(AccountUse, OrdinaryPressesOfAProvedRenderingAreNotLimited) {
    const ForceModel model = key(600.0);
    const DeviceProfile device = coil(1.0);
    ASSERT_TRUE(certify(model, direct(), device).certified());
    const AccountUse use = account_use(model, direct(), device);
    EXPECT_EQ(use.shares.size(), 6U);
    EXPECT_EQ(use.share, 0.0);
    EXPECT_EQ(use.force_error, 0.0);
    EXPECT_NEAR(use.energy, 0.5 * 600.0 * 16e-6, 2e-3);
}

TEST(AccountUse, ATooWeakDeviceIsLimitedOften) {
    const AccountUse use = account_use(key(12e3), direct(), coil(0.05));
    EXPECT_GT(use.share, 0.05);
    EXPECT_GT(use.force_error, 0.01);
}

TEST(AccountUse, LeavesOutSpeedsThatEndTheRun) {
    const ForceModel small{NetworkParameters{1, {}, {}, {}, {600.0}, 0.0},
                           {{0.0}, {1e-3}, Continuation::Free, Continuation::Linear, std::nullopt}};
    const AccountUse use = account_use(small, direct(), coil(1.0));
    EXPECT_DOUBLE_EQ(use.largest_speed, 100.0 * 1e-3 / 0.5);
    EXPECT_EQ(use.shares.size(), 5U) << "0.3 m/s is above 0.2 m/s";
}

TEST(RestingOscillation, IsFoundOnAWallBeyondItsBoundOnly) {
    for (const double share : {0.5, 20.0}) {
        DeviceProfile device = coil(0.3);
        device.coulomb_friction = 0.0;
        const double stiffness = share * 2.0 * device.viscous_damping / device.period_s;
        const ForceModel wall{NetworkParameters{1, {}, {}, {}, {stiffness}, 0.0},
                              {{0.0}, {4e-3}, Continuation::Free, Continuation::Linear, std::nullopt}};
        const RestingOscillation found = resting_oscillation(wall, direct(), device);
        if (share < 1.0) {
            EXPECT_EQ(found.amplitude, 0.0);
        } else {
            EXPECT_GT(found.amplitude, 1e-5);
            EXPECT_GT(found.frequency_hz, lowest_limit_cycle_hz);
        }
    }
}

}  // namespace
}  // namespace palpate
