// SPDX-License-Identifier: Apache-2.0
#include "palpate/model/network.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>

#include <gtest/gtest.h>

#include "support.hpp"

namespace palpate {
namespace {

using test::cases;
using test::Random;
using test::random_network;
using test::uniform;
using test::unit_domain;

double force(const WaveletNetwork& network, double x) {
    return network.at(x, {}).force;
}

TEST(Network, SumsItsWavelets) {
    const NetworkParameters parameters{1, {10.0, 3.0}, {0.2, 0.7}, {0.5, -2.0}, {1.5}, 0.25};
    const WaveletNetwork network{parameters, unit_domain()};
    for (double x = 0.0; x <= 1.0; x += 0.05) {
        const double expected = 0.5 * mexican_hat(10.0 * (x - 0.2)).value -
                                2.0 * mexican_hat(3.0 * (x - 0.7)).value + 1.5 * x + 0.25;
        EXPECT_NEAR(force(network, x), expected, 1e-14);
    }
}

TEST(Network, SlopeAndEnergyAgreeWithTheForceInsideAndOutside) {
    Random random{1};
    for (int k = 0; k < cases(200); ++k) {
        const auto side = [&] {
            return uniform(random, 0.0, 1.0) < 0.5 ? Continuation::Linear : Continuation::Free;
        };
        const WaveletNetwork network{random_network(random, static_cast<std::size_t>(k % 9)),
                                     unit_domain(side(), side())};
        const double x = uniform(random, -0.5, 1.5);
        constexpr double h = 1e-6;
        const bool at_a_knot = std::abs(x) < 2 * h || std::abs(x - 1.0) < 2 * h ||
                               std::abs(network.at(x + h, {}).slope - network.at(x - h, {}).slope) > 0.5;
        if (at_a_knot) {
            continue;
        }
        const double slope = (force(network, x + h) - force(network, x - h)) / (2.0 * h);
        const double work = (network.at(x + h, {}).energy - network.at(x - h, {}).energy) / (2.0 * h);
        EXPECT_NEAR(network.at(x, {}).slope, slope, 1e-4 * (1.0 + std::abs(slope)))
            << "case " << k << " x " << x;
        EXPECT_NEAR(force(network, x), work, 1e-6 * (1.0 + std::abs(work))) << "case " << k << " x " << x;
    }
}

TEST(Network, IsContinuousAtItsEdgesAndFlagsExtrapolation) {
    Random random{2};
    for (int k = 0; k < cases(200); ++k) {
        const WaveletNetwork network{random_network(random, 5),
                                     unit_domain(Continuation::Free, Continuation::Linear)};
        for (const double edge : {0.0, 1.0}) {
            EXPECT_NEAR(force(network, edge - 1e-12), force(network, edge + 1e-12), 1e-8);
        }
        EXPECT_TRUE(network.at(-1e-9, {}).extrapolated);
        EXPECT_TRUE(network.at(1.0 + 1e-9, {}).extrapolated);
        EXPECT_FALSE(network.at(0.0, {}).extrapolated);
        EXPECT_FALSE(network.at(1.0, {}).extrapolated);
    }
}

TEST(Network, LinearContinuationNeverFallsAndKeepsTheEnergyBoundedBelow) {
    Random random{3};
    for (int k = 0; k < cases(200); ++k) {
        const WaveletNetwork network{random_network(random, 6), unit_domain()};
        const double cap = network.curve().extent().slope_cap;
        // Largest force in the domain, divided by the length 1 of the domain
        const double gentle = network.curve().extent().largest_force;
        for (const double x : {-0.3, 1.3}) {
            const double slope = network.at(x, {}).slope;
            EXPECT_GE(slope, 0.0);
            EXPECT_LE(slope, std::max(cap, gentle));
        }
        EXPECT_GE(network.at(1e4, {}).energy - network.at(1.0, {}).energy, -1e2 * gentle);
        EXPECT_GE(network.at(-1e4, {}).energy - network.at(0.0, {}).energy, -1e2 * gentle);
    }
}

TEST(Network, FreeContinuationEndsAtZeroForce) {
    const WaveletNetwork pushing{{1, {}, {}, {}, {2.0}, 0.1}, unit_domain(Continuation::Free)};
    // At the edge of the domain the force pushes the tool out, so the continuation falls with a slope of at least
    // max|f| / travel = 2.1, although the fitted slope is 2.
    EXPECT_NEAR(force(pushing, -0.02), 0.1 - 0.02 * 2.1, 1e-9);
    EXPECT_EQ(force(pushing, -0.05 - 1e-9), 0.0);
    EXPECT_EQ(force(pushing, -10.0), 0.0);
    const WaveletNetwork sticking{{1, {}, {}, {}, {2.0}, -0.1}, unit_domain(Continuation::Free)};
    EXPECT_LT(force(sticking, -0.01), 0.0);
    EXPECT_EQ(force(sticking, -1.0), 0.0);
    const WaveletNetwork touching{{1, {}, {}, {}, {2.0}, 0.0}, unit_domain(Continuation::Free)};
    EXPECT_EQ(force(touching, -1e-9), 0.0);
}

TEST(Network, PeriodicForceRepeatsWithoutAJumpAndItsEnergyContinues) {
    Random random{4};
    for (int k = 0; k < cases(100); ++k) {
        Domain domain = unit_domain();
        domain.period = 1.0;
        const WaveletNetwork knob{random_network(random, 5), domain};
        const double x = uniform(random, 0.0, 1.0);
        for (const double turns : {-3.0, 1.0, 2.0}) {
            EXPECT_NEAR(force(knob, x + turns), force(knob, x), 1e-9);
            EXPECT_FALSE(knob.at(x + turns, {}).extrapolated);
        }
        EXPECT_NEAR(force(knob, 1.0 - 1e-10), force(knob, 1.0 + 1e-10), 1e-6);
        for (const double edge : {-2.0, -1.0, 0.0, 1.0, 2.0, 3.0}) {
            const Curve before = knob.curve().at(edge - 1e-10);
            const Curve after = knob.curve().at(edge + 1e-10);
            EXPECT_NEAR(before.integral, after.integral, 1e-6) << edge;
            EXPECT_NEAR(before.double_integral, after.double_integral, 1e-6) << edge;
        }
        constexpr double h = 1e-5;
        for (const double at : {x - 2.0, x, x + 1.0}) {
            const double work = (knob.at(at + h, {}).energy - knob.at(at - h, {}).energy) / (2.0 * h);
            EXPECT_NEAR(work, force(knob, at), 1e-3) << at;
            const double first =
                (knob.curve().at(at + h).double_integral - knob.curve().at(at - h).double_integral) /
                (2.0 * h);
            EXPECT_NEAR(first, knob.curve().at(at).integral, 1e-5) << at;
        }
    }
}

TEST(Network, RemovingTheJumpKeepsTheMiddleOfThePeriod) {
    Random random{8};
    const NetworkParameters parameters = random_network(random, 5);
    Domain domain{{0.2}, {1.2}, {}, {}, 1.0};
    const WaveletNetwork knob{parameters, domain};
    domain.period.reset();
    EXPECT_NEAR(force(knob, 0.7), force(WaveletNetwork{parameters, domain}, 0.7), 1e-12);
}

TEST(Network, PeriodicNetworkWithoutAJumpIsUnchanged) {
    Random random{9};
    for (int k = 0; k < cases(100); ++k) {
        Domain domain{{-0.3}, {0.7}, {}, {}, 1.0};
        const WaveletNetwork once{random_network(random, 8), domain};
        const WaveletNetwork twice{once.parameters(), domain};
        EXPECT_EQ(twice.parameters().linear, once.parameters().linear);
        EXPECT_EQ(twice.parameters().bias, once.parameters().bias);
    }
}

TEST(Network, NanGivesNan) {
    const WaveletNetwork network{{1, {5.0}, {0.5}, {1.0}, {2.0}, 0.0}, unit_domain()};
    EXPECT_TRUE(std::isnan(force(network, std::numeric_limits<double>::quiet_NaN())));
}

std::string refusal(NetworkParameters parameters, Domain domain) {
    return test::refusal([&] { const WaveletNetwork network{std::move(parameters), std::move(domain)}; });
}

// Over [1, 3] the force 2 x - 1 pushes the tool out below and pulls it back above.
TEST(Network, ContinuesAtTheEndsOfItsDomain) {
    const NetworkParameters line{1, {}, {}, {}, {2.0}, -1.0};
    const WaveletNetwork linear{line, {{1.0}, {3.0}, {}, {}, std::nullopt}};
    // The largest force 5 divided by the length 2 exceeds the slope 2 of the line.
    EXPECT_NEAR(force(linear, 0.9), 1.0 - 0.1 * 2.5, 1e-9);
    EXPECT_NEAR(force(linear, 3.5), 6.0, 1e-9);
    const WaveletNetwork free{line, {{1.0}, {3.0}, Continuation::Free, Continuation::Free, std::nullopt}};
    EXPECT_NEAR(force(free, 0.9), 1.0 - 0.1 * 2.5, 1e-9);
    EXPECT_EQ(force(free, 0.5), 0.0);
    EXPECT_NEAR(force(free, 3.5), 5.0 - 0.5 * 2.5, 1e-9);
    EXPECT_EQ(force(free, 5.1), 0.0);
}

TEST(Network, HasOneInput) {
    EXPECT_EQ(refusal({2, {}, {}, {}, {2.0, 1.0}, 0.0}, {{0.0, 0.0}, {1.0, 1.0}, {}, {}, std::nullopt}),
              "the network has 2 inputs, must have 1");
}

TEST(Network, RefusesInvalidNumbersByName) {
    const NetworkParameters good{1, {5.0}, {0.5}, {1.0}, {2.0}, 0.0};
    EXPECT_EQ(refusal(good, unit_domain()), "");
    auto bad = good;
    bad.alpha = {-1.0};
    EXPECT_EQ(refusal(bad, unit_domain()), "alpha[0][0] is -1.000000, must be > 0");
    bad = good;
    bad.beta = {0.5, 0.6};
    EXPECT_EQ(refusal(bad, unit_domain()), "beta has 2 values, must have 1");
    bad = good;
    bad.weight = {std::numeric_limits<double>::quiet_NaN()};
    EXPECT_EQ(refusal(bad, unit_domain()), "weight[0] is not a finite number");
    EXPECT_EQ(refusal(good, {{1.0}, {1.0}, {}, {}, std::nullopt}),
              "lower[0] is 1.000000, must be below upper 1.000000");
    EXPECT_EQ(refusal(good, {{0.0}, {1.0}, {}, {}, 2.0}),
              "period is 2.000000, must equal upper - lower, 1.000000");
}

}  // namespace
}  // namespace palpate
