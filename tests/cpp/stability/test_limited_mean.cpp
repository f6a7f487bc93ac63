// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <random>
#include <utility>

#include <gtest/gtest.h>

#include "palpate/model/force_model.hpp"
#include "palpate/stability/force_bounds.hpp"

namespace palpate {
namespace {

constexpr double no_limit = std::numeric_limits<double>::infinity();
constexpr double turn = 2.0 * std::numbers::pi;

Domain wheel() {
    return {{0.0}, {turn}, Continuation::Linear, Continuation::Linear, turn};
}

/// Returns a wheel with one peak of 8 N*m and mean force 0.
NetworkParameters peak() {
    NetworkParameters network;
    network.alpha = {8.0, 0.6, 0.6};
    network.beta = {2.0, 4.5, 1.2};
    network.weight = {13.0, 1.0, 1.5};
    network.linear = {0.0};
    return network;
}

NetworkParameters balanced(NetworkParameters network, double force_limit) {
    network.bias += passive_shift(ForceModel{network, wheel()}, force_limit);
    return network;
}

/// Returns the energy that a hand takes out in one slow revolution of the wheel: the limited force summed over fine
/// steps.
double given_in_a_turn(const ForceModel& model, double force_limit, double side = 0.0) {
    constexpr int steps = 200'000;
    double given = 0.0;
    for (int k = 0; k < steps; ++k) {
        const double x = turn * (k + 0.5) / steps;
        const double force = model.network() != nullptr
                                 ? model.network()->curve().at(x).value
                                 : model.hysteresis()->force().at(x).value +
                                       side * model.hysteresis()->hysteresis_force().at(x).value;
        given += std::clamp(force, -force_limit, force_limit) * turn / steps;
    }
    return given;
}

TEST(LimitedMean, BalancedWheelWithAPeakAboveTheLimitIsActive) {
    const ForceModel model{balanced(peak(), no_limit), wheel()};
    EXPECT_GT(force_bounds(model).slope.upper, 0.0);
    EXPECT_EQ(force_bounds(model).mean_force, 0.0);
    const double given = std::abs(given_in_a_turn(model, 5.0));
    EXPECT_GT(given, 0.2);  // [J per turn]
    EXPECT_NEAR(force_bounds(model, 0.0, 5.0).mean_force, given / turn, 1e-8);
}

TEST(LimitedMean, ShiftOfTheLimitedForceMakesItPassive) {
    for (const double limit : {0.5, 2.0, 5.0, 7.9, 20.0}) {
        const ForceModel model{balanced(peak(), limit), wheel()};
        EXPECT_EQ(force_bounds(model, 0.0, limit).mean_force, 0.0) << limit;
        EXPECT_NEAR(given_in_a_turn(model, limit), 0.0, 1e-7) << limit;
        EXPECT_EQ(passive_shift(model, limit), 0.0) << limit;
    }
}

TEST(LimitedMean, EnclosesTheMeanOfRandomWheels) {
    std::mt19937 random{11};
    std::uniform_real_distribution<double> unit{0.0, 1.0};
    for (int scene = 0; scene < 10; ++scene) {
        NetworkParameters network;
        for (int k = 0; k < 6; ++k) {
            network.alpha.push_back(0.5 + 8.0 * unit(random));
            network.beta.push_back(turn * unit(random));
            network.weight.push_back(6.0 * (unit(random) - 0.5));
        }
        network.bias = unit(random) - 0.5;
        network.linear = {0.0};
        const ForceModel model{network, wheel()};
        const double limit = 0.2 + 2.0 * unit(random);
        const double mean = std::abs(given_in_a_turn(model, limit)) / turn;
        EXPECT_NEAR(force_bounds(model, 0.0, limit).mean_force, mean, 1e-8) << scene;
    }
}

/// A bound of the slope of the networks with the wavelets of `peak`; the narrow one has the slope 13 * 8 * max psi'.
constexpr double steepest_peak = 400.0;

/// Returns the curve of a periodic network over the positions from `lower` to `upper`.
NetworkCurve periodic_curve(const NetworkParameters& network, double lower, double upper) {
    return {network, {{lower}, {upper}, Continuation::Linear, Continuation::Linear, upper - lower}};
}

/// Returns a network without wavelets: the constant force `bias`.
NetworkParameters constant(double bias) {
    NetworkParameters network;
    network.bias = bias;
    return network;
}

TEST(LimitedMean, StrokesAreTheSumOfBothForcesAndTheShift) {
    NetworkParameters network = peak();
    network.bias = 0.4;
    NetworkParameters other = peak();
    other.weight = {0.2, 0.3, -0.1};
    other.bias = 0.7;
    const NetworkCurve g = periodic_curve(network, 0.0, turn);
    const NetworkCurve h = periodic_curve(other, 0.0, turn);
    const detail::PeriodicStrokes both{g, &h, 1.0};
    const detail::PeriodicStrokes single{g, nullptr, 1.0};
    for (const double x : {0.3, 2.0, 5.1}) {
        const auto [value, integral] = both.at(x, -1.0, 0.25);
        EXPECT_DOUBLE_EQ(value, g.inside(x).value - h.inside(x).value + 0.25);
        EXPECT_DOUBLE_EQ(integral, g.inside(x).integral - h.inside(x).integral + 0.25 * x);
        EXPECT_DOUBLE_EQ(both.at(x, 1.0, 0.0).first, g.inside(x).value + h.inside(x).value);
        EXPECT_DOUBLE_EQ(single.at(x, 1.0, 0.0).first, g.inside(x).value);
        EXPECT_DOUBLE_EQ(single.at(x, 1.0, 0.0).second, g.inside(x).integral);
    }
}

TEST(LimitedMean, RoundingIsAShareOfAllTermsOfTheForce) {
    NetworkParameters network = peak();
    network.bias = -0.5;
    network.linear = {0.25};
    NetworkParameters other = constant(3.0);
    // The straight line would make the force jump, so it is removed at construction; the parameters of the curve count.
    const NetworkCurve g = periodic_curve(network, -8.0, -6.0);
    const NetworkCurve h = periodic_curve(other, -8.0, -6.0);
    const NetworkParameters& used = g.parameters();
    const double size = std::abs(used.bias) + std::abs(used.linear[0]) * 8.0 + 13.0 + 1.0 + 1.5;
    EXPECT_GT(std::abs(used.linear[0]), 0.0);
    EXPECT_DOUBLE_EQ((detail::PeriodicStrokes{g, nullptr, 1.0}.rounding()), 1e-12 * size * 4.0);
    EXPECT_DOUBLE_EQ((detail::PeriodicStrokes{g, &h, 1.0}.rounding()), 1e-12 * (size + 3.0) * 4.0);
    const NetworkCurve centred = periodic_curve(constant(2.0), -1.0, 3.0);
    EXPECT_DOUBLE_EQ((detail::PeriodicStrokes{centred, nullptr, 1.0}.rounding()), 1e-12 * 2.0);
}

TEST(LimitedMean, OfAConstantForceIsItsClippedValue) {
    const NetworkCurve wide = periodic_curve(constant(2.0), -3.0, 5.0);
    for (const double shift : {-4.5, -2.0, 0.0, 0.25, 1.0}) {
        for (const double limit : {0.5, 1.0, 2.0, 2.25, 50.0, no_limit}) {
            const double expected = std::clamp(2.0 + shift, -limit, limit);
            for (const double steepest : {0.0, 1e-6}) {
                const Interval mean = detail::limited_mean({wide, nullptr, steepest}, 1.0, shift, limit);
                EXPECT_NEAR(mean.lower, expected, 1e-10) << shift << " " << limit;
                EXPECT_NEAR(mean.upper, expected, 1e-10) << shift << " " << limit;
                EXPECT_LE(mean.lower, mean.upper);
            }
        }
    }
}

/// Returns the mean of the clipped force with the trapezoidal rule.
double summed_mean(const detail::PeriodicStrokes& strokes, double side, double shift, double limit) {
    constexpr int steps = 40'000;
    const double lower = strokes.g.lower();
    const double period = strokes.g.upper() - lower;
    double sum = 0.0;
    for (int k = 0; k < steps; ++k) {
        const double x = lower + period * (k + 0.5) / steps;
        const double force = strokes.g.inside(x).value +
                             (strokes.h != nullptr ? side * strokes.h->inside(x).value : 0.0) + shift;
        sum += std::clamp(force, -limit, limit);
    }
    return sum / steps;
}

TEST(LimitedMean, EnclosesTheSummedMeanNarrowly) {
    NetworkParameters other = peak();
    other.weight = {0.4, 0.3, -0.2};
    other.bias = 0.5;
    const NetworkCurve g = periodic_curve(peak(), 0.0, turn);
    const NetworkCurve h = periodic_curve(other, 0.0, turn);
    const detail::PeriodicStrokes strokes{g, &h, steepest_peak};
    for (const double limit : {0.3, 2.0, 6.0}) {
        for (const double side : {-1.0, 1.0}) {
            for (const double shift : {-1.5, 0.7}) {
                const Interval mean = detail::limited_mean(strokes, side, shift, limit);
                const double summed = summed_mean(strokes, side, shift, limit);
                EXPECT_LE(mean.lower, summed + 1e-6) << limit << " " << side << " " << shift;
                EXPECT_GE(mean.upper, summed - 1e-6) << limit << " " << side << " " << shift;
                EXPECT_LE(mean.upper - mean.lower, 4e-15 * limit) << limit << " " << side << " " << shift;
            }
        }
    }
}

// A slope bound that is far too large leaves all cells open until there are more than 100 000: then 65 536 cells of
// the width w remain, each with an error of at most L w^2 / 4.
TEST(LimitedMean, WidthIsTheErrorOfTheOpenCells) {
    const NetworkCurve g = periodic_curve(peak(), 0.0, turn);
    const detail::PeriodicStrokes strokes{g, nullptr, 1e9};
    const Interval mean = detail::limited_mean(strokes, 1.0, 0.0, 3.0);
    const double w = turn / 65'536.0;
    const double error = 1e9 * w * w / 4.0 * 65'536.0 / turn;
    EXPECT_NEAR(mean.upper - mean.lower, 2.0 * error, 1e-9 * error);
    EXPECT_NEAR(0.5 * (mean.upper + mean.lower), summed_mean(strokes, 1.0, 0.0, 3.0), 1e-6);
}

TEST(LimitedMean, EnergyOfAPeriodIsTheMeanAboveTheHysteresis) {
    const NetworkCurve h = periodic_curve(constant(0.25), 0.0, 2.0);
    for (const auto& [force, expected] :
         {std::pair{0.0, 0.0}, {0.2, 0.0}, {-0.2, 0.0}, {1.0, 0.75}, {-1.0, 0.75}, {-4.0, 3.0}, {4.0, 3.0}}) {
        const NetworkCurve g = periodic_curve(constant(force), 0.0, 2.0);
        const detail::PeriodicStrokes strokes{g, &h, 1e-6};
        EXPECT_NEAR(detail::active_mean(strokes, 3.0), expected, 1e-12) << force;
        EXPECT_NEAR(detail::active_mean(strokes, 3.0, -force), 0.0, 1e-12) << force;
        // Without the hysteresis, the whole mean counts.
        EXPECT_NEAR(detail::active_mean({g, nullptr, 1e-6}, 3.0), std::min(std::abs(force), 3.0), 1e-12);
        // The shift moves the force to the edge of the region in which the hysteresis is larger.
        const double shift = std::copysign(std::max(0.0, std::abs(force) - 0.25), -force);
        EXPECT_NEAR(detail::passive_shift(strokes, 3.0), shift, 1e-12) << force;
    }
}

TEST(LimitedMean, BelowRoundingCountsAsZero) {
    NetworkParameters network = constant(0.0);
    network.alpha = {6.0, 6.0};
    network.beta = {0.7, 1.3};
    network.weight = {0.5, -0.5};
    for (const double share : {0.9, 1.1}) {
        for (const double sign : {-1.0, 1.0}) {
            const NetworkCurve g = periodic_curve(network, 0.0, 2.0);
            const detail::PeriodicStrokes strokes{g, nullptr, 4.0};
            const double mean = summed_mean(strokes, 1.0, 0.0, no_limit);
            const double shift = sign * share * strokes.rounding() - mean;
            EXPECT_EQ(detail::active_mean(strokes, no_limit, shift) > 0.0, share > 1.0)
                << share << " " << sign;
        }
    }
}

TEST(LimitedMean, OfAForceWithoutAPeriodOrABoundIsNotComputed) {
    const NetworkCurve line{constant(1.0), {{0.0}, {2.0}, {}, {}, std::nullopt}};
    EXPECT_EQ(detail::active_mean({line, nullptr, no_limit}, 3.0), 0.0);
    EXPECT_EQ(detail::passive_shift({line, nullptr, 1.0}, 3.0), 0.0);
    const NetworkCurve g = periodic_curve(constant(1.0), 0.0, 2.0);
    EXPECT_TRUE(std::isnan(detail::active_mean({g, nullptr, no_limit}, 3.0)));
    EXPECT_TRUE(std::isnan(detail::active_mean({g, nullptr, std::nan("")}, 3.0)));
}

// The force reaches the limit over most of the turn, so the shift is many times larger than the mean of the limited
// force.
TEST(LimitedMean, ShiftIsTheSmallestThatMakesTheForcePassive) {
    for (const auto& [bias, limit] : {std::pair{-6.0, 3.0}, {0.3, no_limit}, {6.0, no_limit}}) {
        NetworkParameters network = peak();
        network.bias = bias;
        const NetworkCurve g = periodic_curve(network, 0.0, turn);
        const detail::PeriodicStrokes strokes{g, nullptr, 160.0};
        const double shift = detail::passive_shift(strokes, limit);
        EXPECT_NE(shift, 0.0);
        EXPECT_EQ(detail::active_mean(strokes, limit, shift), 0.0) << bias << " " << limit;
        EXPECT_GT(detail::active_mean(strokes, limit, (1.0 - 1e-5) * shift), 0.0) << bias << " " << limit;
        EXPECT_NEAR(summed_mean(strokes, 1.0, shift, limit), 0.0, 1e-6) << bias << " " << limit;
    }
}

TEST(LimitedMean, HysteresisAboveTheMeanNeedsNoShift) {
    NetworkParameters force = balanced(peak(), 5.0);
    force.bias += 0.1;
    HysteresisParameters hysteresis;
    hysteresis.weight.assign(3, 0.0);
    hysteresis.linear = {0.0};
    hysteresis.bias = 0.3;
    const ForceModel dissipative{force, hysteresis, wheel(), 0.1};
    EXPECT_EQ(force_bounds(dissipative, 0.0, 5.0).mean_force, 0.0);
    EXPECT_EQ(passive_shift(dissipative, 5.0), 0.0);
    hysteresis.bias = 0.02;
    const ForceModel active{force, hysteresis, wheel(), 0.1};
    const double excess = force_bounds(active, 0.0, 5.0).mean_force;
    EXPECT_NEAR(excess, given_in_a_turn(active, 5.0, -1.0) / turn, 1e-8);
    EXPECT_GT(excess, 0.05);
    force.bias += passive_shift(active, 5.0);
    const ForceModel balanced_model{force, hysteresis, wheel(), 0.1};
    EXPECT_EQ(force_bounds(balanced_model, 0.0, 5.0).mean_force, 0.0);
    EXPECT_NEAR(given_in_a_turn(balanced_model, 5.0, -1.0), 0.0, 1e-7);
}

}  // namespace
}  // namespace palpate
