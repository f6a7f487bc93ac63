// SPDX-License-Identifier: Apache-2.0
#include "palpate/run/measure.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/rendering/measuring.hpp"
#include "palpate/simulation/simulated_device.hpp"

namespace palpate {
namespace {

constexpr double period = 1e-3;

/// Returns the force of a detent, f = 2 x + 0.6 exp(-((x - 0.15)/0.03)^2), whose slope falls to -15.
double detent(double x) {
    const double u = (x - 0.15) / 0.03;
    return 2.0 * x + 0.6 * std::exp(-u * u);
}

struct Sweep {
    std::vector<Reading> readings;
    std::vector<double> commands;
};

Sweep sweep_of(SimulatedRig& device, const ProbeSettings& settings, int ticks) {
    (void)device.open();
    Controller controller{device, Probe{settings, period}, ForceLimit{settings.force_limit}};
    (void)controller.start();
    Sweep sweep;
    for (int k = 0; k < ticks; ++k) {
        const Tick tick = controller.tick();
        sweep.readings.push_back(tick.reading);
        sweep.commands.push_back(tick.command.force);
    }
    return sweep;
}

SimulatedRig rig_without_hand(const std::function<double(double)>& object, bool transducer = true) {
    SimulatedRig device{DeviceProfile{}, Hand{0.0, 0.0, 0.0, 0.0, 0.5}};
    device.mount({object, transducer});
    return device;
}

TEST(Probe, CoversItsRangeSlowlyThroughAFallingForce) {
    SimulatedRig device = rig_without_hand(detent);
    ProbeSettings settings;
    settings.upper = 0.4;
    const Sweep sweep = sweep_of(device, settings, 5000);
    double lowest = 1.0;
    double highest = -1.0;
    double fastest = 0.0;
    for (const Reading& reading : sweep.readings) {
        lowest = std::min(lowest, reading.position);
        highest = std::max(highest, reading.position);
        fastest = std::max(fastest, std::abs(reading.velocity));
    }
    EXPECT_LT(lowest, 0.01);
    EXPECT_GT(highest, 0.38);
    EXPECT_LT(fastest, 5.0 * settings.speed);
}

TEST(Probe, ReversesIfTheObjectHoldsItsLimit) {
    SimulatedRig device = rig_without_hand([](double x) { return 20.0 * x; });
    ProbeSettings settings;
    settings.upper = 3.0;
    settings.force_limit = 0.8;
    const Sweep sweep = sweep_of(device, settings, 6000);
    double highest = 0.0;
    for (const Reading& reading : sweep.readings) {
        highest = std::max(highest, reading.position);
    }
    EXPECT_NEAR(highest, 0.04, 0.004);  // 0.8 / 20
    EXPECT_LT(sweep.readings.back().position, 0.04);
    for (const double command : sweep.commands) {
        EXPECT_LE(std::abs(command), settings.force_limit);
    }
}

TEST(Probe, ReturnsIfItStartsOutsideItsRange) {
    SimulatedRig device{DeviceProfile{}, Hand{0.0, 0.0, 0.0, 0.0, 0.5}, 20, 0.9};
    ProbeSettings settings;
    settings.upper = 0.3;
    EXPECT_LT(sweep_of(device, settings, 4000).readings.back().position, 0.32);
}

TEST(Probe, PositionThatIsNotFiniteGivesZeroForce) {
    Probe probe{{}, period};
    probe.reset(0.1);
    const Rendered rendered = probe.step(std::nan(""));
    EXPECT_EQ(rendered.status, Status::NonFinite);
    EXPECT_EQ(rendered.force, 0.0);
}

TEST(Probe, RefusesARangeWithoutWidth) {
    EXPECT_THROW((Probe{{.lower = 0.2, .upper = 0.2}, period}), std::invalid_argument);
    EXPECT_THROW((Probe{{.speed = 0.0}, period}), std::invalid_argument);
}

TEST(ObjectForce, ComesFromTheTransducerOtherwiseFromTheMotor) {
    for (const bool transducer : {true, false}) {
        SimulatedRig device = rig_without_hand([](double x) { return 3.0 * x; }, transducer);
        ProbeSettings settings;
        settings.upper = 0.3;
        settings.force_limit = 5.0;
        const Sweep sweep = sweep_of(device, settings, 4000);
        double worst = 0.0;
        for (std::size_t k = 500; k < sweep.readings.size(); ++k) {
            const Reading& reading = sweep.readings[k];
            TickRecord tick;
            tick.measured = reading.measured;
            tick.applied = reading.applied;
            worst = std::max(worst, std::abs(object_force(tick) - 3.0 * reading.position));
        }
        // With a force sensor the tolerance covers the encoder step; without one it covers the friction of the device,
        // which depends on the direction of the motion.
        EXPECT_LT(worst, transducer ? 2e-4 : 0.05);
    }
}

TEST(Pulses, AlternateAndEndAtTheFarthestPosition) {
    Pulses pulses{{.force = 0.5, .push_s = 0.03, .rest_s = 0.17, .farthest = 0.2}, period};
    pulses.reset(1.0);
    double sum = 0.0;
    int pushed = 0;
    for (int k = 0; k < 400; ++k) {
        const double force = pulses.step(1.0).force;
        sum += force;
        pushed += force != 0.0 ? 1 : 0;
    }
    EXPECT_EQ(pushed, 60);
    EXPECT_NEAR(sum, 0.0, 1e-12);
    for (int k = 0; k < 400; ++k) {
        EXPECT_EQ(pulses.step(1.3).force, 0.0);
    }
    EXPECT_EQ(pulses.step(std::nan("")).status, Status::NonFinite);
    EXPECT_THROW((Pulses{{.force = 0.0}, period}), std::invalid_argument);
}

TEST(Pulses, AreSmallerInEverySecondGroupOfThree) {
    Pulses pulses{{.force = 0.5, .smaller = 0.6, .push_s = 0.03, .rest_s = 0.17}, period};
    pulses.reset(0.0);
    std::vector<double> sizes;
    for (int k = 0; k < 8 * 200; ++k) {
        const double force = pulses.step(0.0).force;
        if (k % 200 == 199) {
            sizes.push_back(force);
        }
    }
    EXPECT_EQ(sizes, (std::vector<double>{0.5, -0.5, 0.5, -0.3, 0.3, -0.3, 0.5, -0.5}));
}

TEST(FreeMotion, SendsZeroForce) {
    FreeMotion free;
    free.reset(1.0);
    EXPECT_EQ(free.step(0.3).force, 0.0);
    EXPECT_EQ(free.step(std::nan("")).status, Status::NonFinite);
}

TEST(Watching, SendsZeroForceAndMarksPositionsOutsideTheDomain) {
    Domain domain;
    domain.lower = {0.0};
    domain.upper = {0.5};
    Watching watching{domain};
    watching.reset(1.0);
    EXPECT_EQ(watching.step(0.3).force, 0.0);
    EXPECT_FALSE(watching.step(0.5).extrapolated);
    EXPECT_TRUE(watching.step(0.501).extrapolated);
    EXPECT_TRUE(watching.step(-0.001).extrapolated);
    EXPECT_EQ(watching.step(std::nan("")).status, Status::NonFinite);
    domain.period = 0.5;
    EXPECT_FALSE(Watching{domain}.step(7.0).extrapolated);
}

TEST(SimulatedRig, MovesAgainstItsMountedObject) {
    SimulatedRig device{DeviceProfile{}, Hand{15.0, 0.05, 0.3, 0.3, 0.5}};
    device.mount({[](double x) { return 5.0 * x; }, true});
    (void)device.open();
    Reading reading;
    for (int k = 0; k < 4000; ++k) {
        reading = device.exchange({});
    }
    EXPECT_NEAR(reading.position, 15.0 * 0.3 / 20.0, 1e-3);
    EXPECT_NEAR(reading.measured, 5.0 * reading.position, 1e-3);
}

}  // namespace
}  // namespace palpate
