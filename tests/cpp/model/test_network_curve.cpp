// SPDX-License-Identifier: Apache-2.0
#include "palpate/model/network_curve.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "support.hpp"

namespace palpate {
namespace {

using test::cases;
using test::Random;
using test::uniform;

NetworkParameters smooth_network(Random& random, std::size_t size) {
    NetworkParameters network = test::random_network(random, size);
    for (double& alpha : network.alpha) {
        alpha = std::min(alpha, 15.0);
    }
    return network;
}

// Simpson's rule over pieces of the domain, in which the force is smooth. The positions are in several periods, or
// outside the domain.
TEST(NetworkCurve, AntiderivativesAreIntegralsOverAnyNumberOfPeriods) {
    Random random{91};
    for (const bool periodic : {false, true}) {
        for (int k = 0; k < cases(10); ++k) {
            Domain domain{{0.1}, {0.8}, {}, {}, std::nullopt};
            if (periodic) {
                domain.period = 0.8 - 0.1;
            }
            NetworkParameters network = smooth_network(random, 4);
            if (periodic && k % 2 == 0) {  // two harmonics of the period 0.7
                network.alpha.insert(network.alpha.end(),
                                     {2.0 * std::numbers::pi / 0.7, 6.0 * std::numbers::pi / 0.7});
                network.beta.insert(network.beta.end(), {0.3, 0.5});
                network.weight.insert(network.weight.end(), {0.5, -0.2});
                network.harmonics = 2;
            }
            const NetworkCurve curve{network, domain};
            constexpr int steps = 400;  // in one period
            const double h = 0.7 / steps;
            for (const int side : {-1, 1}) {
                Curve at = curve.at(0.1);
                double first = at.integral;
                double second = at.double_integral;
                for (int step = 0; step < 4 * steps; step += 2) {
                    const auto next = [&](int j) { return curve.at(0.1 + side * h * (step + j)); };
                    const Curve middle = next(1);
                    const Curve end = next(2);
                    first += side * h / 3.0 * (at.value + 4.0 * middle.value + end.value);
                    second += side * h / 3.0 * (at.integral + 4.0 * middle.integral + end.integral);
                    at = end;
                    ASSERT_NEAR(end.integral, first, 1e-6) << periodic << " " << side * step;
                    ASSERT_NEAR(end.double_integral, second, 1e-6) << periodic << " " << side * step;
                }
            }
            if (periodic) {
                EXPECT_NEAR(curve.at(0.1).integral, 0.0, 1e-15);
                EXPECT_NEAR(curve.at(0.1).double_integral, 0.0, 1e-15);
            }
        }
    }
}

TEST(NetworkCurve, ContinuesWithItsTangents) {
    Random random{92};
    for (int k = 0; k < cases(50); ++k) {
        const NetworkCurve curve{test::random_network(random, 5), {{-0.25}, {0.5}, {}, {}, std::nullopt}};
        for (const double edge : {-0.25, 0.5}) {
            const Curve here = curve.inside(edge);
            const Curve outside = curve.at(edge + (edge < 0.0 ? -0.5 : 0.5));
            EXPECT_EQ(outside.slope, here.slope);
            EXPECT_NEAR(outside.value, here.value + (edge < 0.0 ? -0.5 : 0.5) * here.slope, 1e-12);
        }
        EXPECT_FALSE(curve.periodic());
    }
}

// A difference of the forces at both ends of a period is rounding if it is at most 1e-12 times |b| + |c| max|x| + the
// sum of the absolute weights.
TEST(NetworkCurve, RemovesJumpsThatAreLargerThanRounding) {
    const auto is_changed = [](const NetworkParameters& network, double lower) {
        const Domain domain{{lower}, {lower + 1.0}, {}, {}, 1.0};
        const NetworkCurve curve{network, domain};
        return curve.parameters().linear != network.linear;
    };
    for (const double bias : {1.0, -1.0}) {
        EXPECT_TRUE(is_changed({1, {}, {}, {}, {1.1e-12}, bias}, 0.0));
        EXPECT_FALSE(is_changed({1, {}, {}, {}, {0.9e-12}, bias}, 0.0));
    }
    for (const double slope : {1.0, -1.0}) {
        EXPECT_TRUE(is_changed({1, {}, {}, {}, {slope}, 0.0}, 0.9e12));
        EXPECT_FALSE(is_changed({1, {}, {}, {}, {slope}, 0.0}, 1.1e12));
        EXPECT_TRUE(is_changed({1, {}, {}, {}, {slope}, 0.0}, -0.9e12));
        EXPECT_FALSE(is_changed({1, {}, {}, {}, {slope}, 0.0}, -1.1e12));
        // The size is exactly 1e12 times the jump.
        EXPECT_FALSE(is_changed({1, {}, {}, {}, {slope}, 0.0}, 1e12 - 1.0));
    }
    // Distant wavelets add nothing to the force in the domain.
    EXPECT_TRUE(is_changed({1, {1.0, 1.0}, {1e6, 1e6}, {2.0, -3.0}, {5.5e-12}, 0.0}, 0.0));
    EXPECT_FALSE(is_changed({1, {1.0, 1.0}, {1e6, 1e6}, {2.0, -3.0}, {4.5e-12}, 0.0}, 0.0));
}

TEST(NetworkCurve, WithoutAJumpKeepsTheForceInTheMiddleOfThePeriod) {
    const NetworkCurve curve{{1, {}, {}, {}, {3.0}, -2.0}, {{0.25}, {1.0}, {}, {}, 0.75}};
    EXPECT_DOUBLE_EQ(curve.parameters().linear[0], 0.0);
    EXPECT_DOUBLE_EQ(curve.parameters().bias, 3.0 * 0.625 - 2.0);
}

// The ends of the domain have the slope of the network, and the lines outside another slope.
TEST(NetworkCurve, EndsOfTheDomainBelongToTheNetwork) {
    NetworkCurve curve{{1, {3.0}, {0.4}, {1.0}, {2.0}, 0.5}, test::unit_domain()};
    EdgeLine below = curve.below();
    EdgeLine above = curve.above();
    below.at_edge.slope = above.at_edge.slope = 7.0;
    curve.continue_with(below, above);
    for (const double edge : {0.0, 1.0}) {
        EXPECT_EQ(curve.at(edge).slope, curve.inside(edge).slope);
        EXPECT_EQ(curve.at(std::nextafter(edge, edge < 0.5 ? -1.0 : 2.0)).slope, 7.0);
        EXPECT_FALSE(curve.extrapolated(edge));
        EXPECT_TRUE(curve.extrapolated(std::nextafter(edge, edge < 0.5 ? -1.0 : 2.0)));
    }
}

TEST(NetworkCurve, ExtentLeavesOutTheUncertainEnds) {
    Random random{93};
    for (int k = 0; k < cases(20); ++k) {
        const NetworkParameters network = test::random_network(random, 4);
        const NetworkCurve curve{network, {{0.25}, {0.75}, {}, {}, std::nullopt}};
        const CurveExtent extent = curve.extent();
        EXPECT_EQ(extent.travel, 0.5);
        EXPECT_EQ(extent.largest_force, value_bounds(network, 0.25, 0.75).largest());
        const double steepest = slope_bounds(network, 0.25 + 0.02 * 0.5, 0.75 - 0.02 * 0.5).upper;
        EXPECT_NEAR(extent.slope_cap, std::max(0.0, steepest), 1e-9 * std::abs(steepest));
        EXPECT_EQ(curve.value_bounds().lower, value_bounds(network, 0.25, 0.75).lower);
        EXPECT_EQ(curve.value_bounds().upper, value_bounds(network, 0.25, 0.75).upper);
        EXPECT_EQ(curve.slope_bounds().lower, slope_bounds(network, 0.25, 0.75).lower);
        EXPECT_EQ(curve.slope_bounds().upper, slope_bounds(network, 0.25, 0.75).upper);
    }
    const NetworkCurve falling{{1, {}, {}, {}, {-3.0}, 0.0}, test::unit_domain()};
    EXPECT_EQ(falling.extent().slope_cap, 0.0);
    // Two narrow wavelets of slope 1e4 in the ends of the domain
    const NetworkCurve ends{{1, {1e4, 1e4}, {0.01, 0.99}, {1.0, 1.0}, {2.0}, 0.0}, test::unit_domain()};
    EXPECT_NEAR(ends.extent().slope_cap, 2.0, 0.03);
}

TEST(NetworkCurve, BatchesReplaceEveryPositionOutsideTheDomain) {
    Random random{94};
    for (const bool periodic : {false, true}) {
        Domain domain = test::unit_domain();
        if (periodic) {
            domain.period = 1.0;
        }
        NetworkParameters network = test::random_network(random, 3);
        if (periodic) {
            network = test::with_harmonics(random, network, 2);
        }
        const NetworkCurve curve{network, domain};
        for (const double place : {-2.5, 1.25, -0.0001, 0.5, 1e10}) {
            const std::array<double, 1> x{place};
            std::array<double, 1> result{};
            const Curve expected = curve.at(place);
            curve.at(HatQuantity::Force, x, result);
            EXPECT_NEAR(result[0], expected.value, 1e-12 * std::abs(expected.value) + 1e-13);
            curve.at(HatQuantity::Slope, x, result);
            EXPECT_NEAR(result[0], expected.slope, 1e-11 * std::abs(expected.slope) + 1e-12);
            curve.at(HatQuantity::Integral, x, result);
            EXPECT_NEAR(result[0], expected.integral, 1e-12 * std::abs(expected.integral) + 1e-13);
        }
    }
}

TEST(NetworkCurve, EveryFinitePositionOfAPeriodicForceIsInsideItsDomain) {
    const double infinity = std::numeric_limits<double>::infinity();
    const NetworkCurve curve{{1, {}, {}, {}, {0.0}, 2.0}, {{0.0}, {1.0}, {}, {}, 1.0}};
    EXPECT_TRUE(curve.periodic());
    for (const double x : {-1e300, -0.5, 0.5, 1e300}) {
        EXPECT_FALSE(curve.extrapolated(x));
        EXPECT_EQ(curve.at(x).value, 2.0);
    }
    for (const double x : {-infinity, infinity, std::nan("")}) {
        EXPECT_TRUE(curve.extrapolated(x));
        const Curve none = curve.at(x);
        EXPECT_TRUE(std::isnan(none.value) && std::isnan(none.slope) && std::isnan(none.integral) &&
                    std::isnan(none.double_integral));
    }
}

}  // namespace
}  // namespace palpate
