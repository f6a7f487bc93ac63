// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "limits/hands.hpp"
#include "palpate/rendering/direct.hpp"
#include "palpate/simulation/closed_loop.hpp"
#include "simulation/scenes.hpp"
#include "support.hpp"

namespace palpate {
namespace {

using test::ClickAndWall;
using test::Spring;

using test::to_the_end;

DeviceProfile random_device(test::Random& random) {
    DeviceProfile device;
    device.inertia = std::exp(test::uniform(random, -10.0, -5.0));
    device.viscous_damping = test::uniform(random, 0.0, 0.2);
    device.coulomb_friction = random() % 2 == 0 ? 0.0 : test::uniform(random, 0.0, 0.1);
    device.encoder_step = random() % 2 == 0 ? 0.0 : 1e-4;
    device.delay_s = static_cast<double>(random() % 3) * device.period_s;
    return device;
}

/// Returns the error of the energy account, divided by the total energy that was exchanged.
double open_balance(const DeviceProfile& device, double start_velocity, const ClosedLoopEnd& end) {
    const double kinetic =
        0.5 * device.inertia * (end.handle.velocity * end.handle.velocity - start_velocity * start_velocity);
    const double off = end.energy.hand - end.energy.motor - end.energy.dissipated - kinetic;
    return std::abs(off) / (end.energy.throughput + std::abs(kinetic));
}

// Energy account: the work of the hand equals the energy of the motor, the losses, and the increase
// of the handle's kinetic energy.
TEST(EnergyBalance, BalancesToRoundingForEveryHand) {
    test::Random random{11};
    double worst = 0.0;
    for (int k = 0; k < test::cases(200); ++k) {
        const DeviceProfile device = random_device(random);
        const ClosedLoopSettings start{
            20, test::uniform(random, 0.0, 0.5), test::uniform(random, -1.0, 1.0), {}};
        const auto close = [&](auto hand) {
            const ClosedLoopEnd end =
                closed_loop(Direct{ClickAndWall{}}, device, hand, 300, start, to_the_end);
            worst = std::max(worst, open_balance(device, start.start_velocity, end));
        };
        close(PassiveHand{});
        close(PassiveHand{0.0, 0.0, std::exp(test::uniform(random, -8.0, 3.0)), 0.0});
        close(PassiveHand{test::uniform(random, 0.0, 1e3), test::uniform(random, 0.0, 1.0), 1e-3, 0.2});
        close(ShakingHand{test::uniform(random, 1.0, 300.0), 0.15, 0.05, test::uniform(random, 0.0, 1.0)});
        close(GreedyHand{10.0, 0.15, 0.02, test::uniform(random, 0.1, 3.0)});
        close(Hand{});
    }
    EXPECT_LT(worst, 1e-12);
}

TEST(ClosedLoop, LimitsTheForceByDefaultToTheLimitOfTheDevice) {
    for (const double limit : {2.0, 8.5}) {
        DeviceProfile device;
        device.force_limit = limit;
        double largest = 0.0;
        (void)closed_loop(Direct{Spring{40.0}}, device, PassiveHand{}, 3, {20, 0.5, 0.0, {}},
                          [&](const Tick& tick, const Motion& /*handle*/, const EnergyBalance& /*account*/) {
                              largest = std::max(largest, tick.command.force);
                              return true;
                          });
        EXPECT_EQ(largest, limit);
    }
}

TEST(EnergyBalance, BalancesForAMassMuchLargerThanTheDevice) {
    DeviceProfile device;
    device.viscous_damping = 0.02;
    const ClosedLoopEnd end = closed_loop(Direct{Spring{40.0}}, device, PassiveHand{0.0, 0.0, 100.0, 0.0},
                                          20'000, {20, 0.0, 0.05, {}}, to_the_end);
    EXPECT_LT(open_balance(device, 0.05, end), 1e-13);
}

TEST(Midpoint, FrictionHoldsAgainstSmallForcesAndDissipatesTheRemainingSpeed) {
    DeviceProfile device;
    device.viscous_damping = 0.0;
    device.coulomb_friction = 0.05;
    const auto pushed = [&](double force, double speed) {
        SimulatedHandle<PassiveHand, Midpoint> handle{device, {}, 20, 0.0, speed};
        EXPECT_TRUE(handle.open());
        for (int k = 0; k < 100; ++k) {
            (void)handle.exchange({-force});
        }
        return handle;
    };
    EXPECT_EQ(pushed(0.049, 0.0).handle().position, 0.0);
    EXPECT_GT(pushed(0.051, 0.0).handle().position, 0.0);
    const auto stopped = pushed(0.0, 0.5);
    EXPECT_EQ(stopped.handle().velocity, 0.0);
    EXPECT_NEAR(stopped.plant().account().dissipated, 0.5 * device.inertia * 0.25, 1e-17);
    EXPECT_NEAR(stopped.handle().position, 0.5 * device.inertia * 0.25 / 0.05, 1e-6);
}

TEST(Midpoint, KeepsTheEnergyOfAnUndampedHand) {
    DeviceProfile device;
    device.viscous_damping = 0.0;
    SimulatedHandle<PassiveHand, Midpoint> handle{device, {500.0, 0.0, 0.01, 0.0}, 3, 0.1};
    ASSERT_TRUE(handle.open());
    const double inertia = device.inertia + 0.01;
    for (int k = 0; k < 10'000; ++k) {
        (void)handle.exchange({});
        const Motion& now = handle.handle();
        EXPECT_NEAR(250.0 * now.position * now.position + 0.5 * inertia * now.velocity * now.velocity, 2.5,
                    1e-10);
    }
}

}  // namespace
}  // namespace palpate
