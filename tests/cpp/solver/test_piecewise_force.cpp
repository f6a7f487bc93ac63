// SPDX-License-Identifier: Apache-2.0
#include "palpate/solver/piecewise_force.hpp"
#include "special_values.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/model/derivatives.hpp"
#include "palpate/model/network.hpp"
#include "support.hpp"

namespace palpate {
namespace {

using test::cases;
using test::Random;
using test::uniform;

using test::infinity;

/// Returns the force at x: the network inside the domain, and outside it the straight lines added up from the edge.
double added_up(const PiecewiseForce& force, double x) {
    const double edge = std::clamp(x, force.lower, force.upper);
    const double outward = x < edge ? -1.0 : 1.0;
    double value = jet(force.network, edge)[0];
    double rest = std::abs(x - edge);
    if (rest > 0.0) {
        for (const OuterLine& line : outward < 0.0 ? force.below : force.above) {
            const double part = std::min(rest, line.length);
            value += outward * part * line.slope;
            rest -= part;
        }
        EXPECT_EQ(rest, 0.0) << "the last line is infinite";
    }
    return value;
}

/// Returns positions inside the domain, within the continuation, and far outside.
double position(Random& random, int k) {
    return k % 3 == 0   ? uniform(random, -0.2, 1.2)
           : k % 3 == 1 ? uniform(random, -0.03, 0.0)
                        : (k % 2 == 0 ? 1.0 + uniform(random, 0.0, 0.03) : uniform(random, -30.0, 30.0));
}

void expect_lines(const std::vector<OuterLine>& lines) {
    ASSERT_FALSE(lines.empty());
    for (const OuterLine& line : lines) {
        EXPECT_GT(line.length, 0.0);
        EXPECT_EQ(line.length == infinity, &line == &lines.back());
    }
}

TEST(PiecewiseForce, HasTheForceOfTheNetworkEverywhere) {
    Random random{301};
    for (int k = 0; k < cases(40); ++k) {
        const auto below = k % 2 == 0 ? Continuation::Linear : Continuation::Free;
        const auto above = k % 3 == 0 ? Continuation::Linear : Continuation::Free;
        const WaveletNetwork network{test::random_network(random, static_cast<std::size_t>(k % 6)),
                                     test::unit_domain(below, above)};
        const PiecewiseForce force = piecewise(network.curve());
        EXPECT_FALSE(force.periodic);
        EXPECT_EQ(force.lower, 0.0);
        EXPECT_EQ(force.upper, 1.0);
        expect_lines(force.below);
        expect_lines(force.above);
        const double factor = uniform(random, -3.0, 3.0);
        const PiecewiseForce multiple = scaled(force, factor);
        for (int j = 0; j < 100; ++j) {
            const double x = position(random, j);
            const double expected = network.curve().at(x).value;
            const double tolerance = 1e-10 * (1.0 + std::abs(x)) * (1.0 + std::abs(expected));
            ASSERT_NEAR(added_up(force, x), expected, tolerance) << k << " " << x;
            ASSERT_NEAR(added_up(multiple, x), factor * expected, 3.0 * tolerance) << k << " " << x;
        }
    }
}

TEST(PiecewiseForce, HasTheForceOfBothSlidingDirectionsAndTheHysteresisEverywhere) {
    Random random{302};
    for (int k = 0; k < cases(40); ++k) {
        const auto below = k % 2 == 0 ? Continuation::Linear : Continuation::Free;
        const auto above = k % 3 == 0 ? Continuation::Linear : Continuation::Free;
        const auto wavelets = static_cast<std::size_t>(1 + k % 6);
        HysteresisParameters hysteresis{std::vector<double>(wavelets), uniform(random, -1.0, 1.0),
                                        uniform(random, 0.3, 1.0)};
        for (double& weight : hysteresis.weight) {
            weight = uniform(random, -0.5, 0.5);
        }
        const HysteresisNetwork pair{test::random_network(random, wavelets), hysteresis,
                                     test::unit_domain(below, above), 0.01};
        const PiecewiseForce press = piecewise(pair, 1.0);
        const PiecewiseForce release = piecewise(pair, -1.0);
        const PiecewiseForce mean = piecewise(pair, 0.0);
        const PiecewiseForce h = piecewise_hysteresis(pair);
        for (const PiecewiseForce& each : {press, release, mean, h}) {
            expect_lines(each.below);
            expect_lines(each.above);
            ASSERT_EQ(each.below.size(), h.below.size());
            ASSERT_EQ(each.above.size(), h.above.size());
            for (std::size_t j = 0; j < h.below.size(); ++j) {
                EXPECT_EQ(each.below[j].length, h.below[j].length);
            }
        }
        for (int j = 0; j < 100; ++j) {
            const double x = position(random, j);
            const double upper = pair.sliding(x, 1.0).force;
            const double lower = pair.sliding(x, -1.0).force;
            const double tolerance = 1e-9 * (1.0 + std::abs(x)) * (1.0 + std::abs(upper) + std::abs(lower));
            ASSERT_NEAR(added_up(press, x), upper, tolerance) << k << " " << x;
            ASSERT_NEAR(added_up(release, x), lower, tolerance) << k << " " << x;
            ASSERT_NEAR(added_up(mean, x), 0.5 * (upper + lower), tolerance) << k << " " << x;
            ASSERT_NEAR(added_up(h, x), 0.5 * (upper - lower), tolerance) << k << " " << x;
        }
    }
}

TEST(PiecewiseForce, HasNoLinesIfItIsPeriodic) {
    Random random{303};
    const Domain knob{{0.1}, {1.1}, Continuation::Linear, Continuation::Linear, 1.0};
    const NetworkParameters network = test::random_network(random, 4);
    const HysteresisNetwork pair{network, {{0.1, 0.2, -0.1, 0.1}, 0.3, 0.5}, knob, 0.01};
    const WaveletNetwork plain{network, knob};
    for (const PiecewiseForce& force : {piecewise(plain.curve()), piecewise(pair, 1.0), piecewise(pair, -1.0),
                                        piecewise_hysteresis(pair)}) {
        EXPECT_TRUE(force.periodic);
        EXPECT_TRUE(force.below.empty());
        EXPECT_TRUE(force.above.empty());
        EXPECT_EQ(force.lower, 0.1);
        EXPECT_EQ(force.upper, 1.1);
    }
    for (int j = 0; j <= 50; ++j) {
        const double x = 0.1 + j / 50.0;
        EXPECT_NEAR(added_up(piecewise(plain.curve()), x), plain.curve().inside(x).value, 1e-12);
        EXPECT_NEAR(added_up(piecewise(pair, 1.0), x),
                    pair.force().inside(x).value + pair.hysteresis_force().inside(x).value, 1e-12);
    }
}

// The slope changes at distances 0.1, 0.3 and 10 from the edge 2. A distance that is given twice, of 0, or that is
// infinite adds no line.
TEST(OuterLines, HaveTheSlopesBetweenTheReachesInTheOrderOfDistance) {
    for (const double outward : {-1.0, 1.0}) {
        const auto slope = [&](double x) {
            const double distance = outward * (x - 2.0);
            return distance < 0.0    ? -1.0
                   : distance < 0.1  ? 1.0
                   : distance < 0.3  ? 2.0
                   : distance < 10.0 ? 3.0
                                     : 4.0;
        };
        const auto lines = detail::outer_lines(2.0, outward, {10.0, 0.1, infinity, 0.3, 0.1, 0.0}, slope);
        ASSERT_EQ(lines.size(), 4U);
        const std::vector<double> lengths{0.1, 0.2, 9.7, infinity};
        for (std::size_t k = 0; k < 4; ++k) {
            EXPECT_DOUBLE_EQ(lines[k].length, lengths[k]);
            EXPECT_EQ(lines[k].slope, 1.0 + static_cast<double>(k));
        }
        const auto only = detail::outer_lines(2.0, outward, {infinity}, slope);
        ASSERT_EQ(only.size(), 1U);
        EXPECT_EQ(only[0].length, infinity);
    }
}

}  // namespace
}  // namespace palpate
