// SPDX-License-Identifier: Apache-2.0
#include "palpate/model/hysteresis.hpp"

#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "palpate/model/wavelet.hpp"
#include "support.hpp"

namespace palpate {
namespace {

using test::cases;
using test::Random;
using test::uniform;

/// Returns a random mean force g with a hysteresis h >= 0. Wavelets (Mexican hats) also have negative values, so h
/// includes a constant that is larger than the negative parts of its wavelets.
HysteresisNetwork random_hysteresis(Random& random) {
    const std::size_t size = 1 + static_cast<std::size_t>(uniform(random, 0.0, 6.0));
    const NetworkParameters network = test::random_network(random, size);
    HysteresisParameters hysteresis;
    double deepest = 0.0;
    for (std::size_t i = 0; i < size; ++i) {
        hysteresis.weight.push_back(uniform(random, -0.2, 0.2));
        deepest += std::abs(hysteresis.weight.back());
    }
    hysteresis.linear = uniform(random, 0.0, 0.5);
    hysteresis.bias = deepest;
    const auto side = [&] {
        return uniform(random, 0.0, 1.0) < 0.5 ? Continuation::Linear : Continuation::Free;
    };
    return {network, hysteresis, test::unit_domain(side(), side()), std::exp(uniform(random, -6.0, -1.0))};
}

/// Returns the work done on the object over a straight move. The move is split where the play operator starts to slide
/// and at the edges of the domain, so that the midpoint rule is applied to smooth pieces.
double work(const HysteresisNetwork& object, HysteresisNetwork::State& state, double from, double to) {
    constexpr int pieces = 400;
    double sum = 0.0;
    for (int k = 0; k < pieces; ++k) {
        const double middle = from + (to - from) * (k + 0.5) / pieces;
        sum += object.at(middle, state).force * (to - from) / pieces;
        object.advance(from + (to - from) * (k + 1.0) / pieces, state);
    }
    return sum;
}

// A model with hysteresis h >= 0 gives no energy in any closed motion, also if h depends on the position or the motion
// contains smaller loops.
TEST(Hysteresis, NeverGivesMoreEnergyThanItStored) {
    Random random{11};
    for (int k = 0; k < cases(60); ++k) {
        const HysteresisNetwork object = random_hysteresis(random);
        double x = uniform(random, 0.0, 1.0);
        HysteresisNetwork::State state = object.start(x);
        for (int move = 0; move < 12; ++move) {
            const double target = uniform(random, -0.3, 1.3);
            const double before = object.at(x, state).energy;
            const double done = work(object, state, x, target);
            const double stored = object.at(target, state).energy - before;
            EXPECT_GE(done - stored, -2e-3 * (1.0 + std::abs(done))) << "case " << k << " move " << move;
            x = target;
        }
    }
}

TEST(Hysteresis, IsLosslessWhileItSticks) {
    Random random{12};
    for (int k = 0; k < cases(100); ++k) {
        const HysteresisNetwork object = random_hysteresis(random);
        const double x = uniform(random, 0.45, 0.55);
        HysteresisNetwork::State state = object.start(x);
        const double target = x + uniform(random, -0.9, 0.9) * std::min(object.play_radius(), 0.3);
        const double before = object.at(x, state).energy;
        const double done = work(object, state, x, target);
        EXPECT_NEAR(done, object.at(target, state).energy - before, 1e-4 * (1.0 + std::abs(done)))
            << "case " << k;
    }
}

TEST(Hysteresis, NegativeHysteresisGeneratesEnergy) {
    const HysteresisNetwork object{{1, {}, {}, {}, {2.0}, 0.0}, {{}, 0.0, -0.1}, test::unit_domain(), 0.01};
    HysteresisNetwork::State state = object.start(0.2);
    const double there = work(object, state, 0.2, 0.8);
    const double back = work(object, state, 0.8, 0.2);
    EXPECT_LT(there + back, -0.1);
}

TEST(Hysteresis, PressAndReleaseAreTheSlidingForces) {
    Random random{13};
    const HysteresisNetwork object = random_hysteresis(random);
    const double r = object.play_radius();
    HysteresisNetwork::State state = object.start(0.0);
    object.advance(0.5, state);
    EXPECT_DOUBLE_EQ(state.play, 0.5 - r);
    EXPECT_NEAR(object.at(0.5, state).force, object.sliding(0.5, 1.0).force, 1e-12);
    object.advance(0.9, state);
    object.advance(0.5, state);
    EXPECT_NEAR(object.at(0.5, state).force, object.sliding(0.5, -1.0).force, 1e-12);
}

TEST(Hysteresis, StartsWithoutHysteresisForce) {
    Random random{14};
    const HysteresisNetwork object = random_hysteresis(random);
    const auto state = object.start(0.4);
    EXPECT_DOUBLE_EQ(object.at(0.4, state).force, object.force().at(0.4).value);
}

TEST(Hysteresis, SlopeIsTheDerivativeWhileStickingAndSliding) {
    Random random{15};
    for (int k = 0; k < cases(100); ++k) {
        const HysteresisNetwork object = random_hysteresis(random);
        const HysteresisNetwork::State state{uniform(random, 0.3, 0.6)};
        for (const double offset : {-2.0, -0.5, 0.5, 2.0}) {
            const double x = state.play + offset * std::min(object.play_radius(), 0.1);
            if (x < 0.01 || x > 0.99 ||
                std::abs(std::abs(x - state.play) / object.play_radius() - 1.0) < 1e-3) {
                continue;
            }
            constexpr double h = 1e-7;
            const double slope = (object.at(x + h, state).force - object.at(x - h, state).force) / (2.0 * h);
            EXPECT_NEAR(object.at(x, state).slope, slope, 1e-4 * (1.0 + std::abs(slope)));
        }
    }
}

TEST(Hysteresis, FreeContinuationDecreasesHysteresisToZero) {
    // Mean force: g(0) = 0.1, and below the domain g falls with slope max|g| / travel = 2.1 and is zero at x = -1/21.
    // The hysteresis h decreases to zero there too.
    const HysteresisNetwork object{
        {1, {}, {}, {}, {2.0}, 0.1}, {{}, 0.0, 0.05}, test::unit_domain(Continuation::Free), 0.01};
    EXPECT_NEAR(object.hysteresis_force().at(-0.5 / 21.0).value, 0.025, 1e-12);
    EXPECT_NEAR(object.sliding(-0.5 / 21.0, -1.0).force, 0.025, 1e-12);
    EXPECT_NEAR(object.hysteresis_force().at(-1.0 / 21.0 + 1e-9).value, 0.0, 1e-8);
    EXPECT_EQ(object.hysteresis_force().at(-0.1).value, 0.0);
    EXPECT_EQ(object.hysteresis_force().at(1.5).value, 0.05);
}

// The slot of width 2 r moves with the position only when the position reaches one of its edges.
TEST(Hysteresis, PlayIsMovedByTheEdgesOfItsSlot) {
    EXPECT_EQ(play(1.25, 1.0, 0.5), 1.0);
    EXPECT_EQ(play(0.75, 1.0, 0.5), 1.0);
    EXPECT_EQ(play(1.5, 1.0, 0.5), 1.0);
    EXPECT_EQ(play(0.5, 1.0, 0.5), 1.0);
    EXPECT_EQ(play(2.0, 1.0, 0.5), 1.5);
    EXPECT_EQ(play(0.25, 1.0, 0.5), 0.75);
}

TEST(Hysteresis, UsualPlayRadiusIsAtLeastFourEncoderSteps) {
    EXPECT_DOUBLE_EQ(usual_play_radius(2.0), 0.02);
    EXPECT_DOUBLE_EQ(usual_play_radius(2.0, 0.004), 0.02);
    EXPECT_DOUBLE_EQ(usual_play_radius(2.0, 0.01), 0.04);
}

TEST(Hysteresis, SlidingForceIsMeanForceAndAShareOfTheHysteresis) {
    Random random{16};
    for (int k = 0; k < cases(50); ++k) {
        const HysteresisNetwork object = random_hysteresis(random);
        const double x = uniform(random, -0.3, 1.3);
        const double s = uniform(random, -1.0, 1.0);
        const EnvironmentSample sample = object.sliding(x, s);
        const double press = object.sliding(x, 1.0).force;
        const double release = object.sliding(x, -1.0).force;
        EXPECT_NEAR(sample.force, 0.5 * ((1.0 + s) * press + (1.0 - s) * release), 1e-13);
        EXPECT_NEAR(press - release, 2.0 * object.hysteresis_force().at(x).value, 1e-13);
        EXPECT_EQ(sample.energy, object.force().at(x).integral);
        EXPECT_EQ(sample.extrapolated, x < 0.0 || x > 1.0);
        EXPECT_EQ(object.at(x, {0.5}).extrapolated, x < 0.0 || x > 1.0);
        constexpr double h = 1e-7;
        const double slope = (object.sliding(x + h, s).force - object.sliding(x - h, s).force) / (2.0 * h);
        const double before = (object.sliding(x, s).force - object.sliding(x - h, s).force) / h;
        if (std::abs(slope - before) < 1e-3) {  // not at an end of the domain or of a continuation
            EXPECT_NEAR(sample.slope, slope, 1e-4 * (1.0 + std::abs(slope)));
        }
    }
}

// The energy is G(x) + (1/r) int_play^x (xi - play) h(xi) dxi, here with the midpoint rule.
TEST(Hysteresis, StoredEnergyIsThatOfTheSpringBetweenPlayAndPosition) {
    Random random{17};
    for (int k = 0; k < cases(50); ++k) {
        const HysteresisNetwork object = random_hysteresis(random);
        const double x = uniform(random, -0.3, 1.3);
        const double r = object.play_radius();
        const HysteresisNetwork::State state{x + uniform(random, -1.0, 1.0) * r};
        constexpr int steps = 4'000;
        double stored = 0.0;
        for (int j = 0; j < steps; ++j) {
            const double xi = state.play + (x - state.play) * (j + 0.5) / steps;
            stored +=
                (xi - state.play) * object.hysteresis_force().at(xi).value / r * (x - state.play) / steps;
        }
        EXPECT_NEAR(object.at(x, state).energy, object.force().at(x).integral + stored, 1e-6) << k;
    }
}

// Over [1, 3], g(1) = 0 and g falls at once to zero below the domain. h falls over 2 % of the domain, which is 0.04.
TEST(Hysteresis, FreeContinuationIsAtLeastTwoPercentOfTheDomainLong) {
    const HysteresisNetwork object{{1, {}, {}, {}, {2.0}, -2.0},
                                   {{}, 0.25, 0.25},
                                   {{1.0}, {3.0}, Continuation::Free, Continuation::Free, std::nullopt},
                                   0.01};
    const NetworkCurve& h = object.hysteresis_force();
    EXPECT_NEAR(h.at(1.0).value, 0.5, 1e-15);
    EXPECT_NEAR(h.at(0.98).value, 0.25, 1e-12);
    EXPECT_NEAR(h.at(0.97).value, 0.125, 1e-12);
    EXPECT_EQ(h.at(0.9599).value, 0.0);
    // g(3) = 4 = max|g| pulls the tool back and falls to zero over the length of the domain. h(3) = 1 falls with it.
    EXPECT_NEAR(h.at(3.5).value, 0.75, 0.01);
    EXPECT_NEAR(h.at(4.5).value, 0.25, 0.01);
    EXPECT_EQ(h.at(5.1).value, 0.0);
    EXPECT_EQ(object.domain().lower[0], 1.0);
    EXPECT_EQ(object.parameters().bias, -2.0);
}

TEST(Hysteresis, MeanForceAndHysteresisHaveTheSameWavelets) {
    const HysteresisNetwork object{
        {1, {4.0}, {0.4}, {0.5}, {2.0}, 0.1}, {{0.25}, 0.5, 0.75}, test::unit_domain(), 0.01};
    for (const double x : {0.0, 0.3, 0.9}) {
        const double hat = mexican_hat(4.0 * (x - 0.4)).value;
        EXPECT_NEAR(object.force().at(x).value, 0.5 * hat + 2.0 * x + 0.1, 1e-14);
        EXPECT_NEAR(object.hysteresis_force().at(x).value, 0.25 * hat + 0.5 * x + 0.75, 1e-14);
    }
}

TEST(Hysteresis, RefusesInvalidNumbersByName) {
    const auto refusal = [](const NetworkParameters& network, const HysteresisParameters& hysteresis,
                            double play_radius, const Domain& domain = test::unit_domain()) {
        return test::refusal(
            [&] { const HysteresisNetwork object{network, hysteresis, domain, play_radius}; });
    };
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const NetworkParameters good{1, {4.0}, {0.4}, {0.5}, {2.0}, 0.1};
    const HysteresisParameters h{{0.25}, 0.5, 0.75};
    EXPECT_EQ(refusal(good, h, std::numeric_limits<double>::denorm_min()), "");
    EXPECT_EQ(refusal(good, h, 0.5), "");
    EXPECT_EQ(refusal(good, h, 0.0), "play_radius is 0.000000, must be > 0");
    EXPECT_EQ(refusal(good, h, -0.1), "play_radius is -0.100000, must be > 0");
    EXPECT_EQ(refusal(good, h, infinity), "play_radius is inf, must be > 0");
    EXPECT_EQ(refusal(good, h, nan), "play_radius is nan, must be > 0");
    EXPECT_EQ(refusal(good, {{}, 0.5, 0.75}, 0.1), "weight_hysteresis has 0 values, must have 1");
    EXPECT_EQ(refusal(good, {{0.1, 0.2}, 0.5, 0.75}, 0.1), "weight_hysteresis has 2 values, must have 1");
    EXPECT_EQ(refusal(good, {{nan}, 0.5, 0.75}, 0.1), "weight_hysteresis[0] is not a finite number");
    EXPECT_EQ(refusal(good, {{0.25}, infinity, 0.75}, 0.1), "linear_hysteresis is not a finite number");
    EXPECT_EQ(refusal(good, {{0.25}, 0.5, nan}, 0.1), "bias_hysteresis is not a finite number");
    EXPECT_EQ(refusal({1, {-4.0}, {0.4}, {0.5}, {2.0}, 0.1}, h, 0.1),
              "alpha[0][0] is -4.000000, must be > 0");
    EXPECT_EQ(refusal({2, {}, {}, {}, {2.0, 1.0}, 0.1}, {{}, 0.5, 0.75}, 0.1,
                      {{0.0, 0.0}, {1.0, 1.0}, {}, {}, std::nullopt}),
              "the network has 2 inputs, must have 1");
}

}  // namespace
}  // namespace palpate
