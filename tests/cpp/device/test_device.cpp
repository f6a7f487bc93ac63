// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>

#include <gtest/gtest.h>

#include "palpate/rendering/direct.hpp"
#include "palpate/rendering/implicit.hpp"
#include "palpate/run/controller.hpp"
#include "palpate/simulation/simulated_device.hpp"
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

TEST(SimulatedDevice, CoulombFrictionHoldsAgainstLessAndNeverTurnsTheHandleRound) {
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

// Newton's law by hand: no force for a quarter of the second tick, the first command for the rest.
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

TEST(SimulatedDevice, TakesAForceThatIsNoNumberAsZero) {
    SimulatedDevice device{DeviceProfile{}, no_hand};
    ASSERT_TRUE(device.open());
    EXPECT_EQ(device.exchange({std::numeric_limits<double>::quiet_NaN()}).applied, 0.0);
    EXPECT_EQ(device.exchange({std::numeric_limits<double>::infinity()}).applied, 0.0);
}

TEST(SimulatedDevice, CountsItsSamplesAndOpensAfresh) {
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

TEST(SimulatedDevice, StartsAtRestWhereItIsTold) {
    SimulatedDevice device{DeviceProfile{}, no_hand, 20, 0.3};
    ASSERT_TRUE(device.open());
    EXPECT_EQ(device.handle_position(), 0.3);
    EXPECT_EQ(device.exchange({}).velocity, 0.0);
}

TEST(DeviceProfile, RefusesImpossibleValuesByName) {
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

/// A device with prescribed readings, for tests of the controller with invalid ones.
class ScriptedDevice {
  public:
    Opened open() { return {}; }
    Reading exchange(const Command& command) noexcept {
        sent = command.force;
        Reading reading = next;
        reading.sequence = ++sequence;
        return reading;
    }
    void close() noexcept {}

    Reading next;
    double sent = 0.0;
    std::uint64_t sequence = 0;
};

TEST(Controller, SendsZeroForceOnAnyReadingThatIsNotSound) {
    ScriptedDevice device;
    device.next.position = 0.2;
    Controller<ScriptedDevice, Direct<test::Spring>> controller{device, Direct{test::Spring{10.0}},
                                                                ForceLimit{5.0}};
    ASSERT_EQ(controller.start(), Status::Ok);
    for (const Status bad : {Status::Timeout, Status::Lost, Status::Fault}) {
        device.next.status = Status::Ok;
        (void)controller.tick();
        EXPECT_EQ(controller.tick().command.force, 2.0);
        EXPECT_EQ(device.sent, 2.0);
        device.next.status = bad;
        (void)controller.tick();
        EXPECT_EQ(controller.tick().status, bad);
        EXPECT_EQ(device.sent, 0.0);
    }
    device.next = {};
    device.next.position = std::numeric_limits<double>::quiet_NaN();
    (void)controller.tick();
    EXPECT_EQ(controller.tick().status, Status::NonFinite);
    EXPECT_EQ(device.sent, 0.0);
}

TEST(Controller, PutsTheObjectAtRestUnderTheHandleBeforeTheFirstForce) {
    const VirtualCoupling coupling;
    Implicit expected{test::Spring{10.0}, Inertia{}, coupling, 1e-3};
    expected.reset(0.2);
    ScriptedDevice device;
    device.next.position = 0.2;
    Controller<ScriptedDevice, Implicit<test::Spring>> controller{
        device, Implicit{test::Spring{10.0}, Inertia{}, coupling, 1e-3}, ForceLimit{5.0}};
    (void)controller.start();
    EXPECT_EQ(controller.tick().command.force, expected.step(0.2).force);
}

TEST(Controller, RaisesTheForceFromZeroAndSaysSo) {
    ScriptedDevice device;
    device.next.position = 0.2;
    Controller<ScriptedDevice, Direct<test::Spring>> controller{device, Direct{test::Spring{10.0}},
                                                                Guards{.limit = {5.0}, .ramp = {4, 0}}};
    (void)controller.start();
    for (const double expected : {0.0, 0.5, 1.0, 1.5}) {
        EXPECT_EQ(controller.tick().status, Status::Ramp);
        EXPECT_EQ(device.sent, expected);
    }
    EXPECT_EQ(controller.tick().status, Status::Ok);
    EXPECT_EQ(device.sent, 2.0);
}

TEST(Controller, ClipsToTheForceLimitAndSaysSo) {
    ScriptedDevice device;
    device.next.position = -3.0;
    Controller<ScriptedDevice, Direct<test::Spring>> controller{device, Direct{test::Spring{10.0}},
                                                                ForceLimit{5.0}};
    (void)controller.start();
    const Tick tick = controller.tick();
    EXPECT_EQ(device.sent, -5.0);
    EXPECT_EQ(tick.rendered.force, -30.0);
    EXPECT_EQ(tick.status, Status::Limited);
}

}  // namespace
}  // namespace palpate
