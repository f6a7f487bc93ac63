// SPDX-License-Identifier: Apache-2.0
#include "palpate/model/velocity_network.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

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

// A straight line of position and velocity over [1, 3] x [-1, 2], whose continuation has a formula.
TEST(VelocityNetwork, ContinuesALineWithTheSlopeAtVelocityZero) {
    const Domain domain{{1.0, -1.0}, {3.0, 2.0}, {}, {}, std::nullopt};
    const VelocityNetwork line{{2, {}, {}, {}, {1.5, 0.5}, -1.0}, domain};
    EXPECT_EQ(line.lower(), 1.0);
    EXPECT_EQ(line.upper(), 3.0);
    EXPECT_EQ(line.travel(), 2.0);
    EXPECT_EQ(line.finest_width(), 2.0);
    for (const double v : {-3.0, -1.0, 0.5, 2.0, 4.0}) {
        const double damping = 0.5 * std::clamp(v, -1.0, 2.0);
        EXPECT_NEAR(line.force(2.0, v), 2.0 + damping, 1e-14);
        // At the lower edge the force 0.5 pushes out. The slope is the largest force 3.5 at rest divided by the length 2.
        EXPECT_NEAR(line.force(0.6, v), 0.5 + damping - 0.4 * 1.75, 1e-9);
        EXPECT_NEAR(line.force(3.4, v), 3.5 + damping + 0.4 * 1.5, 1e-9);
    }
    EXPECT_EQ(line.below().edge, 1.0);
    EXPECT_EQ(line.above().edge, 3.0);
    EXPECT_NEAR(line.below().at_edge.value, 0.5, 1e-15);
    EXPECT_NEAR(line.above().at_edge.value, 3.5, 1e-15);
    EXPECT_TRUE(line.extrapolated(0.9, 0.0));
    EXPECT_TRUE(line.extrapolated(2.0, 2.1));
    EXPECT_FALSE(line.extrapolated(3.0, -1.0));
    const VelocityNetwork falling{{2, {}, {}, {}, {-1.5, 0.5}, 4.0}, domain};
    EXPECT_NEAR(falling.force(0.6, 0.0), 2.5 - 0.4 * 1.25, 1e-9) << "pushes out";
    EXPECT_NEAR(falling.force(3.4, 0.0), -0.5 + 0.4 * 1.25, 1e-9) << "pushes out";
}

// If the velocity zero is not in the domain, the force at rest is that at the nearest velocity.
TEST(VelocityNetwork, ForceAtRestIsThatAtTheNearestVelocityOfTheDomain) {
    for (const double sign : {-1.0, 1.0}) {
        const Domain domain{
            {1.0, sign > 0.0 ? 0.5 : -2.0}, {3.0, sign > 0.0 ? 2.0 : -0.5}, {}, {}, std::nullopt};
        const VelocityNetwork force{{2, {1.0, 1.0}, {2.0, 0.0}, {0.7}, {3.0, 0.5}, 1.0}, domain};
        const double rest = 0.5 * sign;
        EXPECT_EQ(force.force(2.0, 0.0), force.network().value(std::array{2.0, rest}));
        EXPECT_EQ(force.below().at_edge.value, force.network().value(std::array{1.0, rest}));
        EXPECT_EQ(force.above().at_edge.value, force.network().value(std::array{3.0, rest}));
        double largest = -1e300;
        for (int j = 0; j <= 2'000; ++j) {
            largest = std::max(largest, force.network().value(std::array{1.0 + j / 1e3, rest}));
        }
        EXPECT_NEAR(force.resting_bounds(1e-6).value.upper, largest, 1e-4);
    }
}

// The slope of the line is the slope at the edge, between 0 and the largest slope inside, and at least max|f| / travel
// if the force pushes out. All of these are computed here by dense samples.
TEST(VelocityNetwork, SlopesOfTheLinesAgreeWithDenseSamples) {
    test::Random random{43};
    int limited = 0;
    for (int k = 0; k < test::cases(60); ++k) {
        const Domain domain{{-0.2, -0.5}, {1.1, 0.8}, {}, {}, std::nullopt};
        const VelocityNetwork force{random_force(random), domain};
        double largest_force = 0.0;
        double cap = 0.0;
        double steepest = 0.0;
        for (int j = 0; j <= 2'000; ++j) {
            const double share = j / 2e3;
            std::array<double, 2> gradient{};
            const double value = force.network().at(std::array{-0.2 + 1.3 * share, 0.0}, gradient);
            largest_force = std::max(largest_force, std::abs(value));
            steepest = std::max(steepest, std::abs(gradient[0]));
            if (share >= 0.02 && share <= 0.98) {
                cap = std::max(cap, gradient[0]);
            }
        }
        const RadialBounds bounds = force.resting_bounds(0.01);
        EXPECT_GE(bounds.value.largest(), largest_force - 1e-9);
        EXPECT_LE(bounds.value.largest(), 1.0101 * largest_force);
        EXPECT_LE(bounds.gradient[0].largest(), 1.0101 * steepest);
        for (const bool above : {false, true}) {
            const double edge = above ? 1.1 : -0.2;
            const double fitted = [&] {
                std::array<double, 2> gradient{};
                (void)force.network().at(std::array{edge, 0.0}, gradient);
                return gradient[0];
            }();
            const double value = force.network().value(std::array{edge, 0.0});
            const bool pushes = above ? value < 0.0 : value > 0.0;
            const double least = pushes ? largest_force / 1.3 : 0.0;
            const double expected = std::max(std::clamp(fitted, 0.0, cap), least);
            limited += fitted > cap ? 1 : 0;
            const double outward = above ? 1.0 : -1.0;
            for (const double v : {-0.4, 0.0, 0.7}) {
                const double rise =
                    (force.force(edge + 2.0 * outward, v) - force.force(edge, v)) / 2.0 * outward;
                EXPECT_NEAR(rise, expected, 0.0101 * (expected == least ? least : steepest))
                    << k << " above " << above;
            }
        }
    }
    EXPECT_GT(limited, 0);
}

// A steep rise in the last 2 % of the domain does not count, and one at 3 % does. The force falls elsewhere.
TEST(VelocityNetwork, EachEndOfTheDomainIsUncertainForTwoPercent) {
    for (const double travel : {1.0, 2.0}) {
        const Domain domain{{1.0, -1.0}, {1.0 + travel, 1.0}, {}, {}, std::nullopt};
        const auto slope = [&](bool above, double share) {
            // A hat is steepest at a distance of 0.7 widths above its centre.
            const double width = 0.002 * travel;
            const double edge = above ? 1.0 + travel : 1.0;
            const double other = edge + (above ? -share : share) * travel;
            const VelocityNetwork force{{2,
                                         {1.0 / width, 0.01, 1.0 / width, 0.01},
                                         {edge - 0.7 * width, 0.0, other - 0.7 * width, 0.0},
                                         {0.01 * travel, 0.01 * travel},
                                         {-1.0, 0.0},
                                         above ? 100.0 : -100.0},
                                        domain};
            return (above ? force.above() : force.below()).at_edge.slope;
        };
        for (const bool above : {false, true}) {
            EXPECT_EQ(slope(above, 0.005), 0.0) << above << travel;
            EXPECT_GT(slope(above, 0.035), 1.0) << above << travel;
        }
    }
}

TEST(VelocityNetwork, HasTwoInputs) {
    const auto message = [](std::size_t d) {
        NetworkParameters network{d, {}, {}, {}, std::vector<double>(d, 1.0), 0.0};
        return test::refusal([&] {
            const VelocityNetwork force{
                network, {std::vector<double>(d, 0.0), std::vector<double>(d, 1.0), {}, {}, {}}};
        });
    };
    EXPECT_EQ(message(1), "the network has 1 inputs, must have 2: position and velocity");
    EXPECT_EQ(message(2), "");
    EXPECT_EQ(message(3), "the network has 3 inputs, must have 2: position and velocity");
}

TEST(VelocityNetwork, EnergyRangeContainsTheEnergyOfALimitedForce) {
    test::Random random{41};
    for (int k = 0; k < test::cases(6); ++k) {
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
