// SPDX-License-Identifier: Apache-2.0
#include "palpate/simulation/simulated_device.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "support.hpp"

namespace palpate {
namespace {

constexpr Hand no_hand{0.0, 0.0, 0.0, 0.0, 1.0};

DeviceProfile frictionless() {
    DeviceProfile profile;
    profile.viscous_damping = 0.0;
    profile.encoder_step = 0.0;
    return profile;
}

TEST(SimulatedDevice, AcceleratesAgainstTheForceOfTheObject) {
    SimulatedDevice device{frictionless(), no_hand};
    ASSERT_TRUE(device.open());
    for (int k = 0; k < 100; ++k) {
        (void)device.exchange({0.01});
    }
    const double acceleration = -0.01 / device.profile().inertia;
    EXPECT_NEAR(device.handle_velocity(), acceleration * 0.1, 1e-9);
    EXPECT_NEAR(device.handle_position(), 0.5 * acceleration * 0.01, 3e-4 * std::abs(acceleration) * 0.01);
}

TEST(SimulatedDevice, ViscousDampingHasItsTimeConstant) {
    DeviceProfile profile = frictionless();
    profile.viscous_damping = 0.02;
    SimulatedDevice device{profile, no_hand, 200};
    ASSERT_TRUE(device.open());
    for (int k = 0; k < 10; ++k) {
        (void)device.exchange({-0.01});
    }
    EXPECT_NEAR(device.handle_velocity(), 0.01 / 0.02 * (1.0 - std::exp(-1.0)), 1e-3);
}

TEST(SimulatedDevice, CoulombFrictionHoldsAgainstSmallForcesAndNeverReversesTheHandle) {
    DeviceProfile profile = frictionless();
    profile.coulomb_friction = 0.05;
    SimulatedDevice device{profile, no_hand};
    ASSERT_TRUE(device.open());
    for (int k = 0; k < 50; ++k) {
        (void)device.exchange({-0.049});
    }
    EXPECT_EQ(device.handle_position(), 0.0);
    for (int k = 0; k < 50; ++k) {
        (void)device.exchange({-0.2});
    }
    EXPECT_GT(device.handle_velocity(), 0.0);
    for (int k = 0; k < 5000; ++k) {
        (void)device.exchange({0.0});
        ASSERT_GE(device.handle_velocity(), 0.0);
    }
    EXPECT_EQ(device.handle_velocity(), 0.0);
}

TEST(SimulatedDevice, EncoderReportsWholeSteps) {
    DeviceProfile profile;
    profile.encoder_step = 0.01;
    SimulatedDevice device{profile};
    ASSERT_TRUE(device.open());
    for (int k = 0; k < 2000; ++k) {
        const Reading reading = device.exchange({});
        EXPECT_NEAR(reading.position, 0.01 * std::round(reading.position / 0.01), 1e-15);
        EXPECT_LE(std::abs(reading.position - device.handle_position()), 0.005 + 1e-12);
    }
}

TEST(SimulatedDevice, DelaysLimitsAndRoundsTheForce) {
    for (const int delay : {0, 1, 2, longest_delay_samples}) {
        DeviceProfile profile;
        profile.delay_s = delay * profile.period_s;
        profile.force_step = 0.25;
        SimulatedDevice device{profile, no_hand};
        ASSERT_TRUE(device.open());
        EXPECT_EQ(device.exchange({7.0}).applied, delay == 0 ? 5.0 : 0.0);
        for (int k = 1; k <= 2 * longest_delay_samples; ++k) {
            EXPECT_EQ(device.exchange({0.3}).applied, k < delay ? 0.0 : (k == delay ? 5.0 : 0.25))
                << delay << " " << k;
        }
    }
}

// Expected motion by Newton's law: no force for the first quarter of the second tick, the first command for the
// remaining time.
TEST(SimulatedDevice, AppliesACommandAFractionOfASampleLate) {
    DeviceProfile profile;
    profile.delay_s = 1.25 * profile.period_s;
    profile.viscous_damping = 0.0;
    profile.encoder_step = 0.0;
    SimulatedDevice device{profile, no_hand, 1000};
    ASSERT_TRUE(device.open());
    EXPECT_EQ(device.exchange({1.0}).applied, 0.0);
    EXPECT_EQ(device.exchange({2.0}).applied, 1.0);
    const double T = profile.period_s;
    EXPECT_NEAR(device.handle_velocity(), -0.75 * T / profile.inertia, 1e-9);
    EXPECT_EQ(device.exchange({3.0}).applied, 2.0);
    EXPECT_NEAR(device.handle_velocity(), -(0.75 + 0.25 + 2.0 * 0.75) * T / profile.inertia, 1e-9);
}

TEST(SimulatedDevice, ReplacesAForceThatIsNotFiniteByZero) {
    SimulatedDevice device{DeviceProfile{}, no_hand};
    ASSERT_TRUE(device.open());
    EXPECT_EQ(device.exchange({std::numeric_limits<double>::quiet_NaN()}).applied, 0.0);
    EXPECT_EQ(device.exchange({std::numeric_limits<double>::infinity()}).applied, 0.0);
}

TEST(SimulatedDevice, CountsItsSamplesAndRestartsOnOpening) {
    SimulatedDevice device{DeviceProfile{}};
    ASSERT_TRUE(device.open());
    for (std::uint64_t k = 1; k <= 5; ++k) {
        const Reading reading = device.exchange({-1.0});
        EXPECT_EQ(reading.sequence, k);
        EXPECT_NEAR(reading.device_time, 1e-3 * static_cast<double>(k), 1e-12);
        EXPECT_TRUE(std::isnan(reading.measured));
    }
    ASSERT_TRUE(device.open());
    EXPECT_EQ(device.handle_position(), 0.0);
    EXPECT_EQ(device.exchange({}).sequence, 1U);
}

TEST(SimulatedDevice, StartsAtRestAtTheGivenPosition) {
    SimulatedDevice device{DeviceProfile{}, no_hand, 20, 0.3};
    ASSERT_TRUE(device.open());
    EXPECT_EQ(device.handle_position(), 0.3);
    EXPECT_EQ(device.exchange({}).velocity, 0.0);
}

TEST(HeldLineDevice, AppliesTheLineBetweenTwoCommands) {
    DeviceProfile profile;
    profile.held_line = HeldLine{.period_s = 5e-5, .delay_s = 0.0, .encoder_step = 0.0};
    SimulatedHandle<Hand, SemiImplicitEuler> device{profile, {}, 20, 0.5};
    (void)device.open();
    (void)device.exchange({0.0, 0.5, 20.0});
    EXPECT_NE(device.handle_position(), 0.5) << "the hand moves the handle";
    EXPECT_NEAR(device.applied_force(), 20.0 * (device.handle_position() - 0.5),
                20.0 * std::abs(device.handle_velocity()) * 6e-5);
    EXPECT_NE(device.applied_force(), 0.0);
}

TEST(HeldLineDevice, OfSpringsRoundsTheCenterInsideItsRange) {
    DeviceProfile profile;
    profile.held_line =
        HeldLine{.period_s = 5e-5, .delay_s = 0.0, .position_step = 0.1, .largest_center = 0.3};
    SimulatedHandle<Hand, SemiImplicitEuler> device{profile, {}, 20, 0.5};
    (void)device.open();
    (void)device.exchange({1.48, 0.5, 4.0});  // zero force at 0.13, rounded to 0.1
    EXPECT_NEAR(device.applied_force(), 4.0 * (device.handle_position() - 0.1), 0.02);
    (void)device.exchange({-2.0, 0.5, 8.0});  // zero force at 0.75, outside of the range
    EXPECT_NEAR(device.applied_force(), 8.0 * (device.handle_position() - 0.3), 0.05);
    (void)device.exchange({0.4, 0.5, 0.0});
    EXPECT_EQ(device.applied_force(), 0.4);
}

TEST(HeldLineDevice, WithoutALoopHoldsTheForce) {
    SimulatedHandle<Hand, SemiImplicitEuler> device{DeviceProfile{}, {}, 20, 0.5};
    (void)device.open();
    (void)device.exchange({1.0, 0.5, 20.0});
    EXPECT_EQ(device.applied_force(), 1.0);
}

TEST(HeldLineDevice, LimitsTheForceOfTheLineAndRoundsIt) {
    DeviceProfile profile;
    profile.force_limit = 0.4;
    profile.held_line =
        HeldLine{.period_s = 5e-5, .delay_s = 0.0, .encoder_step = 0.0, .stiffness_step = 8.0};
    SimulatedHandle<Hand, SemiImplicitEuler> device{profile, {}, 20, 0.5};
    (void)device.open();
    (void)device.exchange({5.0, 0.5, 20.0});
    EXPECT_EQ(device.applied_force(), 0.4);
    const double from = device.handle_position();
    (void)device.exchange({0.1, from, 3.9});
    EXPECT_EQ(device.applied_force(), 0.1) << "a stiffness below half a step is 0";
    (void)device.exchange({std::numeric_limits<double>::quiet_NaN(), 0.0, 1.0});
    EXPECT_EQ(device.applied_force(), 0.0);
}

}  // namespace
}  // namespace palpate
