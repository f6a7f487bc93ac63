// SPDX-License-Identifier: Apache-2.0
#include "palpate/model/velocity_network.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <stdexcept>

#include <gtest/gtest.h>

#include "palpate/model/energy.hpp"
#include "palpate/model/force_model.hpp"
#include "support.hpp"

namespace palpate {
namespace {

const Domain box{{0.0, -1.0}, {1.0, 1.0}, {}, {}, std::nullopt};

NetworkParameters random_force(test::Random& random) {
    NetworkParameters network = test::random_network(random, 5, 2);
    for (double& alpha : network.alpha) {
        alpha = std::min(alpha, 20.0);
    }
    return network;
}

// The slope of a fitted force is least certain at the ends of the domain, for every kind of model.
TEST(VelocityNetwork, ContinuesWithTheLargestSlopeOfTheDomainWithoutItsEnds) {
    // The force rises steeply only in the last 2 % of the domain.
    const VelocityNetwork force{{2, {300.0, 0.1}, {1.0025, 0.0}, {-0.5}, {4.0, 0.0}, 0.0}, box};
    const double slope = force.force(2.0, 0.0) - force.force(1.0, 0.0);
    double inside = 0.0;
    double at_end = 0.0;
    for (int k = 0; k <= 10'000; ++k) {
        const double x = 1e-4 * k;
        std::array<double, 2> gradient{};
        (void)force.network().at(std::array{x, 0.0}, gradient);
        double& largest = x <= 0.98 ? inside : at_end;
        largest = std::max(largest, gradient[0]);
    }
    ASSERT_GT(at_end, 2.0 * inside);
    EXPECT_LE(slope, 1.02 * inside);
}

TEST(VelocityNetwork, EnergyRangeContainsTheEnergyOfALimitedForce) {
    test::Random random{41};
    for (int k = 0; k < test::cases(20); ++k) {
        const VelocityNetwork force{random_force(random), box};
        const double limit = k % 2 == 0 ? 1e9 : test::uniform(random, 0.2, 2.0);
        const EnergyRange range = energy_range(force, limit);
        constexpr int steps = 400'000;
        double energy = 0.0;
        double least = 0.0;
        double largest = 0.0;
        for (int j = 0; j < steps; ++j) {
            energy += std::clamp(force.force((j + 0.5) / steps, 0.0), -limit, limit) / steps;
            least = std::min(least, energy);
            largest = std::max(largest, energy);
        }
        constexpr double rounding = 1e-9;
        EXPECT_GE(range.span(), largest - least - rounding) << k;
        EXPECT_GT(range.missed, 0.0);
        EXPECT_LE(range.missed, 0.05 * (largest - least)) << "the bound is close to the energy";
    }
}

TEST(ForceModel, RefusesSlopeBoundsOfSeveralInputs) {
    test::Random random{42};
    const ForceModel model{random_force(random), box};
    EXPECT_THROW((void)model.slope_bounds(), std::invalid_argument);
    EXPECT_NO_THROW((void)ForceModel::of_velocity(random_force(random), box).slope_bounds());
}

}  // namespace
}  // namespace palpate
