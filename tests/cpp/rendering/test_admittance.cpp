// SPDX-License-Identifier: Apache-2.0
#include "palpate/rendering/admittance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "admittance/displays.hpp"
#include "palpate/rendering/energy_consistent.hpp"
#include "palpate/rendering/explicit.hpp"
#include "palpate/rendering/implicit.hpp"
#include "palpate/rendering/massless.hpp"
#include "palpate/solver/newton.hpp"
#include "palpate/solver/resolvent.hpp"
#include "solvers/scene.hpp"
#include "support.hpp"

namespace palpate::admittance_tests {
namespace {

constexpr double period = 1e-3;
constexpr VirtualCoupling none{0.0, 0.0};
constexpr Inertia inertia{0.5, 20.0};

DeviceProfile display(AdmittanceDisplay admittance = {}) {
    DeviceProfile device;
    device.position_unit = "m";
    device.period_s = period;
    device.admittance = admittance;
    return device;
}

/// Returns one object of each structure with mass.
std::vector<AnyStructure> objects(double stiffness) {
    const bench::LinearSpring spring{stiffness};
    return {Implicit{spring, inertia, none, period}, Explicit{spring, inertia, none, period},
            EnergyConsistent{spring, inertia, none, period}};
}

TEST(Admittance, ConstantForceMovesTheObjectToItsEquilibrium) {
    for (const AnyStructure& object : objects(1000.0)) {
        Admittance source{object, display()};
        double position = 0.0;
        for (int k = 0; k < 2000; ++k) {
            position = source.step(5.0).position;
        }
        EXPECT_NEAR(position, 5e-3, 1e-9);
    }
}

TEST(Admittance, ForceThatIsNotANumberHoldsTheCommand) {
    for (const AnyStructure& object : objects(1000.0)) {
        Admittance source{object, display()};
        const double before = source.step(5.0).position;
        for (const double force :
             {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
            const PositionCommand command = source.step(force);
            EXPECT_EQ(command.position, before);
            EXPECT_EQ(command.object.status, Status::NonFinite);
            EXPECT_EQ(command.object.force, 0.0);
        }
        EXPECT_GT(source.step(5.0).position, before);
    }
}

TEST(Admittance, StructureWithoutMassHoldsTheCommand) {
    Admittance source{Massless{bench::LinearSpring{100.0}, {100.0, 0.0}, period}, display()};
    source.reset(0.25);
    EXPECT_EQ(source.step(5.0).position, 0.25);
}

TEST(Admittance, RateLimitBoundsEveryStepAndIsForgottenWhenTheForceTurns) {
    for (const AnyStructure& object : objects(0.0)) {
        Admittance source{object, display({.rate_limit = 0.1})};
        double before = 0.0;
        for (int k = 0; k < 500; ++k) {
            const double now = source.step(50.0).position;
            EXPECT_LE(now - before, 0.1 * period * (1.0 + 1e-9));
            before = now;
        }
        EXPECT_NEAR(before, 0.1 * 0.5, 5e-3);
        // The speed of the object is the limited one, not one that grew behind the limit: it stops in about m / B_o
        for (int k = 0; k < 200; ++k) {
            before = source.step(-5.0).position;
        }
        EXPECT_LT(source.step(-5.0).position, before);
    }
}

TEST(Admittance, FrictionHoldsTheObjectAgainstSmallForcesAndReducesLargeOnes) {
    DeviceProfile device = display();
    device.force_step = 2.0;  // friction 1 N
    EXPECT_EQ(virtual_friction(device), 1.0);
    for (const AnyStructure& object : objects(1000.0)) {
        Admittance source{object, device};
        for (int k = 0; k < 100; ++k) {
            EXPECT_EQ(source.step(k % 2 == 0 ? 0.999 : -0.999).position, 0.0);
        }
        double position = 0.0;
        for (int k = 0; k < 2000; ++k) {
            position = source.step(5.0).position;
        }
        // At rest where the force of the spring differs from the push by at most the friction
        EXPECT_NEAR(position, 5e-3, 1e-3);
        EXPECT_EQ(source.step(5.0).position, position);
        const double held = 1e3 * position;
        for (const double change : {0.9, -0.9}) {
            for (int k = 0; k < 500; ++k) {  // without friction the object would move by 0.9 mm
                EXPECT_NEAR(source.step(held + change).position, position, 1e-6);
            }
        }
    }
}

TEST(Admittance, CommandIsAMultipleOfThePositionStepAndAheadByTheFeedForward) {
    Admittance source{Implicit{bench::LinearSpring{0.0}, inertia, none, period},
                      display({.position_step = 1e-4, .feed_forward_s = 0.01})};
    for (int k = 0; k < 1000; ++k) {
        const PositionCommand command = source.step(4.0);
        EXPECT_NEAR(std::remainder(command.position, 1e-4), 0.0, 1e-12);
        if (k > 500) {  // speed F / B_o
            EXPECT_NEAR(command.position - command.object.environment_position, 0.01 * 4.0 / 20.0, 0.6e-4);
        }
    }
}

// The branch of a table is kept from step to step, and found again after a step that a limit ended elsewhere.
TEST(Admittance, TableAndSearchMoveTheObjectEquallyAcrossFallsOfTheForce) {
    const WaveletNetwork network = bench::two_clicks(16);
    const Inertia light{4e-6, 0.001};  // a load line may have several solutions
    const double p = light.load_line_slope(period);
    LoadLineSolver search;
    search.longest_step = 0.001;
    search.max_evaluations = 5000;
    test::Random random{3};
    for (const double rate : {0.3, 3.0, 30.0, 1e9}) {
        Admittance table{Implicit{network, light, none, period, Resolvent{network.curve(), p}},
                         display({.rate_limit = rate})};
        double before = 0.0;
        double now = 0.0;
        for (int k = 0; k < 3000; ++k) {
            const double force = 2.0 - 2.5 * std::cos(0.004 * k) + test::uniform(random, -1.0, 1.0);
            const double inertial = light.mass / (period * period);
            const LoadLine line{p, force - inertial * before + (inertial + p) * now};
            const double end = search.solve(network, {}, line, now).position;
            before = std::exchange(now, std::clamp(end, now - rate * period, now + rate * period));
            EXPECT_NEAR(table.step(force).position, now, 1e-8) << k;
        }
    }
}

TEST(Admittance, FrictionCoversTheHandOfTheProfile) {
    DeviceProfile device = display({.hand_stiffness = 1e4,
                                    .hand_damping = 10.0,
                                    .hand_mass = 0.1,
                                    .handle_mass = 0.2,
                                    .servo_bandwidth_hz = 10.0,
                                    .position_step = 1e-5});
    const double w = 20.0 * 3.14159265358979323846;
    EXPECT_NEAR(virtual_friction(device), 0.5e-5 * (1e4 + 10.0 * 2.0 * w + 0.3 * 2.0 * w * w), 1e-9);
}

}  // namespace
}  // namespace palpate::admittance_tests
