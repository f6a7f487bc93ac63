// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/simulation/force_error.hpp"

namespace palpate {
namespace {

constexpr double period = 1e-3;

/// Returns the force f = 10 x^2 at each position x of a motion.
std::vector<double> square_law(std::span<const double> motion, double /*step_s*/) {
    std::vector<double> force;
    for (const double x : motion) {
        force.push_back(10.0 * x * x);
    }
    return force;
}

/// A handle whose position is x(t), with held forces equal to the model force f at the time `ahead` after the start of
/// each tick.
struct Motions {
    std::vector<double> start, middle, end, applied;

    template <class Position>
    Motions(std::size_t ticks, double ahead, Position x) {
        for (std::size_t k = 0; k < ticks; ++k) {
            const double t = static_cast<double>(k) * period;
            start.push_back(x(t));
            middle.push_back(x(t + 0.5 * period));
            end.push_back(x(t + period));
            applied.push_back(10.0 * std::pow(x(t + ahead), 2));
        }
    }
    [[nodiscard]] HeldForces held() const noexcept { return {start, middle, end, applied, applied}; }
};

// A force held from the start of the tick at velocity v is too small by f' v T / 2 on average and by f' v T at the
// end, with slope f' and period T.
TEST(ForceError, HoldIsLateByHalfASampleInTheMeanAndByOneAtTheEnd) {
    constexpr double v = 0.5;
    const Motions motions{2000, 0.0, [&](double t) { return 1.0 + v * t; }};
    const ForceError error = force_error(motions.held(), period, square_law);
    // Expected values: RMS of 20 x v T / 2 over positions x from 1 to 2, and the work, the integral of 20 x v T / 2
    // over the same positions.
    const double mean = 20.0 * v * period / 2.0 * std::sqrt(7.0 / 3.0);
    EXPECT_NEAR(error.instant, 0.0, 1e-12);
    EXPECT_NEAR(error.mean, mean, 1e-3 * mean);
    EXPECT_NEAR(error.end, 2.0 * mean, 1e-3 * mean);
    EXPECT_NEAR(error.band, mean, 1e-2 * mean) << "slow against 50 Hz";
    const double work = -20.0 * v * period / 2.0 * 1.5;
    EXPECT_NEAR(error.work, work, -1e-3 * work) << "below 0: the rendering gives energy";
}

TEST(ForceError, ForceOfTheMiddleHasNoMeanErrorAndHalfTheErrorAtTheEnd) {
    const Motions late{2000, 0.0, [](double t) { return 1.0 + 0.5 * t; }};
    const Motions ahead{2000, 0.5 * period, [](double t) { return 1.0 + 0.5 * t; }};
    const ForceError before = force_error(late.held(), period, square_law);
    const ForceError error = force_error(ahead.held(), period, square_law);
    EXPECT_LT(error.mean, 1e-3 * before.mean);
    EXPECT_LT(std::abs(error.work), 1e-3 * std::abs(before.work));
    EXPECT_NEAR(error.end, 0.5 * before.end, 1e-3 * before.end);
}

TEST(ForceError, ForceAheadByOneSampleHasNoErrorAtTheEndAndTheFullMeanError) {
    const Motions late{2000, 0.0, [](double t) { return 1.0 + 0.5 * t; }};
    const Motions ahead{2000, period, [](double t) { return 1.0 + 0.5 * t; }};
    const ForceError before = force_error(late.held(), period, square_law);
    const ForceError error = force_error(ahead.held(), period, square_law);
    EXPECT_NEAR(error.end, 0.0, 1e-12);
    EXPECT_NEAR(error.mean, before.mean, 2e-3 * before.mean);
}

TEST(ForceError, FollowsACurvedMotionWithinTheTick) {
    // Handle at x = a t^2 within one tick, force held at 0: the mean of f is 10 a^2 T^4 / 5, the work -10 (a T^2)^3 /
    // 3.
    constexpr double a = 2e5;
    const Motions motions{1, 0.0, [&](double t) { return a * t * t; }};
    const ForceError error = force_error(motions.held(), period, square_law);
    // For this motion, which reverses, integration over four parts of the tick has an error of 5 %; integration from
    // both ends only would have an error of 50 %.
    EXPECT_NEAR(error.mean, 10.0 * a * a * std::pow(period, 4) / 5.0, 0.08 * 0.08);
    EXPECT_NEAR(error.work, -10.0 * std::pow(a * period * period, 3) / 3.0, 0.08 * 0.0267);
}

TEST(ForceError, BandKeepsSlowErrorsAndRemovesFastOnes) {
    const auto rms_of = [](double hertz) {
        std::vector<double> signal;
        for (int k = 0; k < 4000; ++k) {
            signal.push_back(std::sin(2.0 * std::numbers::pi * hertz * k * period));
        }
        double sum = 0.0;
        for (const double value : below_frequency(signal, period, 50.0)) {
            sum += value * value;
        }
        return std::sqrt(sum / 4000.0) / std::sqrt(0.5);
    };
    EXPECT_NEAR(rms_of(2.0), 1.0, 1e-3);
    EXPECT_NEAR(rms_of(30.0), 1.0, 0.01);
    EXPECT_NEAR(rms_of(50.0), 0.5, 0.02);
    EXPECT_LT(rms_of(70.0), 0.05);
    EXPECT_LT(rms_of(400.0), 0.02);
}

TEST(ForceError, BandOfAShortOrSlowlySampledSignalIsTheSignal) {
    const std::vector<double> constant(3, 2.0);
    for (const double value : below_frequency(constant, period, 50.0)) {
        EXPECT_NEAR(value, 2.0, 1e-12);
    }
    const std::vector<double> signal{1.0, -1.0, 3.0};
    EXPECT_EQ(below_frequency(signal, 0.02, 50.0), signal);
}

TEST(ForceError, ColumnsOfDifferentLengthsAreRefused) {
    const Motions motions{10, 0.0, [](double t) { return t; }};
    HeldForces held = motions.held();
    held.middle = held.middle.first(9);
    EXPECT_THROW((void)force_error(held, period, square_law), std::invalid_argument);
}

TEST(ForceError, TraceHoldsTheMiddleOfEachTickAndTheMeanOfADelayedForce) {
    Scheme scheme;
    scheme.structure = StructureKind::Direct;
    DeviceProfile device;
    device.encoder_step = 0.0;
    device.viscous_damping = 0.0;
    NetworkParameters line;
    line.bias = -0.1;
    Hand no_hand;
    no_hand.stiffness = no_hand.damping = 0.0;
    // At constant force the handle deviates in the middle of each tick from the straight line by a T^2 / 8, with
    // acceleration a and period T.
    const Domain domain{{-1.0}, {1.0}, {}, {}, std::nullopt};
    const Trace thrown = simulate({line, domain}, scheme, device, no_hand, 50);
    const double deviation = 0.1 / device.inertia * 1e-6 / 8.0;
    for (std::size_t k = 1; k < 50; ++k) {
        const double straight = 0.5 * (thrown.handle_start[k] + thrown.handle_end[k]);
        EXPECT_NEAR(straight - thrown.handle_middle[k], deviation, 1e-9 * deviation) << k;
    }
    line.linear = {20.0};
    device.delay_s = 0.25e-3;
    const Trace late = simulate({line, domain}, scheme, device, Hand{}, 500);
    for (std::size_t k = 1; k < 500; ++k) {
        EXPECT_NEAR(late.mean_applied[k], 0.25 * late.applied[k - 1] + 0.75 * late.applied[k], 1e-12);
    }
}

}  // namespace
}  // namespace palpate
