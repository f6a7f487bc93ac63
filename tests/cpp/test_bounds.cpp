// SPDX-License-Identifier: Apache-2.0
#include "palpate/model/bounds.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "palpate/model/network_curve.hpp"
#include "support.hpp"

namespace palpate {
namespace {

using test::cases;
using test::Random;
using test::uniform;

/// Random networks, every third with huge weights that cancel: pairs of nearly coincident wavelets.
NetworkParameters difficult_network(Random& random, int kind) {
    NetworkParameters network = test::random_network(random, static_cast<std::size_t>(2 * (1 + kind % 32)));
    if (kind % 3 == 0) {
        for (std::size_t i = 0; i + 1 < network.weight.size(); i += 2) {
            network.alpha[i + 1] = network.alpha[i] * (1.0 + 1e-6);
            network.beta[i + 1] = network.beta[i];
            network.weight[i] = uniform(random, -1e6, 1e6);
            network.weight[i + 1] = -network.weight[i];
        }
    }
    return network;
}

TEST(Bounds, HoldAtEveryPointOfRandomNetworks) {
    Random random{31};
    for (int k = 0; k < cases(100); ++k) {
        const NetworkParameters network = difficult_network(random, k);
        const NetworkCurve curve{network, test::unit_domain()};
        const double from = uniform(random, 0.0, 0.5);
        const double to = uniform(random, 0.5, 1.0);
        const Interval value = value_bounds(network, from, to);
        const Interval slope = slope_bounds(network, from, to);
        for (int j = 0; j < 1000; ++j) {
            const Curve here = curve.inside(uniform(random, from, to));
            ASSERT_GE(here.value, value.lower) << k;
            ASSERT_LE(here.value, value.upper) << k;
            ASSERT_GE(here.slope, slope.lower) << k;
            ASSERT_LE(here.slope, slope.upper) << k;
        }
    }
}

// spec section 7: "mean-value form ... for 1 % of L"
TEST(Bounds, AreWithinOnePercentOfWhatADenseSearchFinds) {
    Random random{32};
    for (int k = 0; k < cases(20); ++k) {
        const NetworkParameters network = test::random_network(random, static_cast<std::size_t>(1 + k % 64));
        const NetworkCurve curve{network, test::unit_domain()};
        Interval slope{1e300, -1e300};
        Interval value{1e300, -1e300};
        for (int j = 0; j <= 200'000; ++j) {
            const Curve here = curve.inside(j / 200'000.0);
            slope = {std::min(slope.lower, here.slope), std::max(slope.upper, here.slope)};
            value = {std::min(value.lower, here.value), std::max(value.upper, here.value)};
        }
        const Interval proved_slope = slope_bounds(network, 0.0, 1.0);
        const Interval proved_value = value_bounds(network, 0.0, 1.0);
        EXPECT_LE(proved_slope.upper - slope.upper, 0.0101 * slope.largest());
        EXPECT_LE(slope.lower - proved_slope.lower, 0.0101 * slope.largest());
        EXPECT_LE(proved_value.upper - value.upper, 0.0101 * value.largest());
        EXPECT_LE(value.lower - proved_value.lower, 0.0101 * value.largest());
    }
}

TEST(Bounds, OfALineAreTheLine) {
    const NetworkParameters line{1, {}, {}, {}, {3.0}, -1.0};
    EXPECT_NEAR(value_bounds(line, 0.0, 2.0).lower, -1.0, 1e-12);
    EXPECT_NEAR(value_bounds(line, 0.0, 2.0).upper, 5.0, 1e-12);
    EXPECT_NEAR(slope_bounds(line, 0.0, 2.0).lower, 3.0, 1e-12);
    EXPECT_NEAR(slope_bounds(line, 0.0, 2.0).upper, 3.0, 1e-12);
}

TEST(Bounds, SeeANarrowWaveletBetweenTheFirstCells) {
    const NetworkParameters spike{1, {1e5}, {0.0313}, {1.0}, {0.0}, 0.0};
    EXPECT_LE(value_bounds(spike, 0.0, 1.0).lower, -1.0);
    EXPECT_GE(slope_bounds(spike, 0.0, 1.0).upper, 1.38e5);
}

TEST(Bounds, ExtremaOfTheHatAreWhereItsNextDerivativeVanishes) {
    for (const double u : detail::hat_slope.extrema) {
        EXPECT_NEAR(mexican_hat_curvature(u), 0.0, 1e-14);
    }
    for (const double u : detail::hat_curvature.extrema) {
        EXPECT_NEAR(mexican_hat_jerk(u), 0.0, 1e-14);
    }
}

}  // namespace
}  // namespace palpate
