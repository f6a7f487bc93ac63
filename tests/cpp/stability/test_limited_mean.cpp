// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

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
