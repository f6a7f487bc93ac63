// SPDX-License-Identifier: Apache-2.0
#include "palpate/model/hysteresis.hpp"

#include <cmath>
#include <stdexcept>

#include <gtest/gtest.h>

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

TEST(Hysteresis, RefusesAPlayRadiusOfZero) {
    EXPECT_THROW(HysteresisNetwork({1, {}, {}, {}, {2.0}, 0.0}, {{}, 0.0, 0.1}, test::unit_domain(), 0.0),
                 std::invalid_argument);
}

}  // namespace
}  // namespace palpate
