// SPDX-License-Identifier: Apache-2.0
// Compares the bounds of a force with dense samples of the force: no sample lies outside, and the bounds are not
// wider than the accuracy that the header states.
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/stability/force_bounds.hpp"
#include "special_values.hpp"
#include "support.hpp"

namespace palpate {
namespace {

using test::infinity;
using test::nan;

TEST(ForceBounds, RisingAndFallingAreTheSlopesOfEachSign) {
    ForceBounds bounds;
    bounds.slope = {-3.0, 2.0};
    EXPECT_EQ(bounds.rising(), 2.0);
    EXPECT_EQ(bounds.falling(), 3.0);
    bounds.slope = {1.0, 2.0};
    EXPECT_EQ(bounds.falling(), 0.0);
    bounds.slope = {-3.0, -1.0};
    EXPECT_EQ(bounds.rising(), 0.0);
    bounds.slope = {0.0, 0.0};
    EXPECT_FALSE(std::signbit(bounds.falling()));
    bounds.slope = {nan, nan};
    EXPECT_TRUE(std::isnan(bounds.rising()));
    EXPECT_TRUE(std::isnan(bounds.falling()));
}

TEST(ForceBounds, PlayRadiusIsTheHysteresisByItsSlope) {
    ForceBounds bounds;
    EXPECT_EQ(bounds.play_radius(), infinity);
    bounds.hysteresis_force = {0.1, 0.5};
    bounds.hysteresis_per_play = 20.0;
    EXPECT_DOUBLE_EQ(bounds.play_radius(), 0.025);
    bounds.hysteresis_per_play = 0.5;
    EXPECT_DOUBLE_EQ(bounds.play_radius(), 1.0);
}

TEST(ForceBounds, AreFiniteOnlyIfEachBoundIs) {
    EXPECT_TRUE(finite(ForceBounds{}));
    for (const double wrong : {infinity, -infinity, nan}) {
        for (double ForceBounds::* field :
             {&ForceBounds::steepest, &ForceBounds::sliding, &ForceBounds::hysteresis_per_play,
              &ForceBounds::mean_force, &ForceBounds::drag}) {
            ForceBounds bounds;
            bounds.*field = wrong;
            EXPECT_FALSE(finite(bounds));
        }
        for (Interval ForceBounds::* field : {&ForceBounds::slope, &ForceBounds::hysteresis_force}) {
            ForceBounds bounds;
            (bounds.*field).lower = wrong;
            EXPECT_FALSE(finite(bounds));
            bounds = {};
            (bounds.*field).upper = wrong;
            EXPECT_FALSE(finite(bounds));
        }
    }
}

// Solves the load line K_c (x - y) = f(y) of a straight force f = k y and differentiates the force by x.
TEST(ForceBounds, CompensationInvertsTheCouplingInSeries) {
    for (const double k : {-40.0, 0.0, 30.0, 99.0}) {
        ForceBounds bounds;
        bounds.slope = {std::min(k, 0.0), std::max(k, 0.0)};
        bounds.drag = 0.5;
        const ForceBounds harder = compensated(bounds, 100.0);
        const double back_lower = slope_behind_coupling(harder.slope.lower, 100.0);
        const double back_upper = slope_behind_coupling(harder.slope.upper, 100.0);
        EXPECT_NEAR(back_lower, bounds.slope.lower, 1e-12);
        EXPECT_NEAR(back_upper, bounds.slope.upper, 1e-12);
        EXPECT_EQ(harder.steepest, std::max(-harder.slope.lower, harder.slope.upper));
        EXPECT_EQ(harder.sliding, harder.steepest);
        EXPECT_EQ(harder.drag, 0.5);
        // A force change of K_c per unit moves the object by 1 - dy/dx.
        const double moved = 100.0 / (100.0 + k);
        EXPECT_NEAR(slope_behind_coupling(k, 100.0), k * moved, 1e-12);
    }
    ForceBounds steep;
    steep.slope = {-1.0, 100.0};
    EXPECT_EQ(compensated(steep, 100.0).slope.upper, infinity);
    steep.slope.upper = std::nextafter(100.0, 0.0);
    EXPECT_LT(compensated(steep, 100.0).slope.upper, infinity);
    EXPECT_GT(compensated(steep, 100.0).slope.upper, 1e17);
}

TEST(ForceBounds, SlopesOfALineThatEndsIncludeZero) {
    EdgeLine line;
    line.at_edge.slope = 3.0;
    EXPECT_EQ(detail::line_slopes(line).lower, 3.0);
    EXPECT_EQ(detail::line_slopes(line).upper, 3.0);
    line.reach = 1.0;
    EXPECT_EQ(detail::line_slopes(line).lower, 0.0);
    EXPECT_EQ(detail::line_slopes(line).upper, 3.0);
    line.at_edge.slope = -3.0;
    EXPECT_EQ(detail::line_slopes(line).lower, -3.0);
    EXPECT_EQ(detail::line_slopes(line).upper, 0.0);
}

/// Returns a pair of networks with the same wavelets, with every parameter of the hysteresis different from 0.
std::pair<NetworkParameters, HysteresisParameters> random_pair(test::Random& random, std::size_t size) {
    const NetworkParameters force = test::random_network(random, size);
    const NetworkParameters other = test::random_network(random, size);
    const HysteresisParameters hysteresis{other.weight, test::uniform(random, 0.5, 2.0),
                                          test::uniform(random, 0.2, 0.6)};
    return {force, hysteresis};
}

TEST(ForceBounds, BoundsOfACombinedSlopeAreTight) {
    test::Random random{2};
    for (int draw = 0; draw < 20; ++draw) {
        const auto [force, hysteresis] = random_pair(random, static_cast<std::size_t>(1 + draw % 5));
        NetworkParameters h = force;
        h.weight = hysteresis.weight;
        h.linear = {hysteresis.linear};
        h.bias = hysteresis.bias;
        const detail::SlopeReading reading{test::uniform(random, -1.0, 1.0), test::uniform(random, -1.0, 1.0),
                                           test::uniform(random, -30.0, 30.0)};
        const Interval bounds = detail::reading_bounds(force, h, reading, 0.1, 0.9);
        const NetworkCurve g_curve{force, test::unit_domain()};
        const NetworkCurve h_curve{h, test::unit_domain()};
        Interval sampled{infinity, -infinity};
        for (int k = 0; k <= 8000; ++k) {
            const Curve g = g_curve.inside(0.1 + 0.8 * k / 8000);
            const Curve both = h_curve.inside(0.1 + 0.8 * k / 8000);
            const double slope = reading.of_force_slope * g.slope + reading.of_hysteresis_slope * both.slope +
                                 reading.of_hysteresis * both.value;
            sampled = sampled.with({slope, slope});
        }
        EXPECT_LE(bounds.lower, sampled.lower) << draw;
        EXPECT_GE(bounds.upper, sampled.upper) << draw;
        EXPECT_GE(bounds.lower, sampled.lower - 4e-4 * sampled.largest()) << draw;
        EXPECT_LE(bounds.upper, sampled.upper + 4e-4 * sampled.largest()) << draw;
    }
}

/// Returns the interval of the slopes of a function at `count` positions, by differences.
template <class Function>
Interval sampled_slopes(double from, double to, int count, Function force) {
    Interval slopes{infinity, -infinity};
    constexpr double step = 1e-6;
    for (int k = 0; k < count; ++k) {
        const double x = from + step + (to - from - 2.0 * step) * k / (count - 1);
        const double slope = (force(x + step) - force(x - step)) / (2.0 * step);
        slopes = slopes.with({slope, slope});
    }
    return slopes;
}

TEST(ForceBounds, OfAStaticForceAreTheSlopesOfItsDifferences) {
    test::Random random{4};
    for (int draw = 0; draw < 16; ++draw) {
        NetworkParameters network = test::random_network(random, 1 + static_cast<std::size_t>(draw % 4));
        network.bias += draw % 2 == 0 ? 3.0 : -3.0;
        const Domain domain = test::unit_domain(draw % 4 < 2 ? Continuation::Free : Continuation::Linear,
                                                draw % 3 == 0 ? Continuation::Free : Continuation::Linear);
        const ForceModel model{network, domain};
        const ForceBounds bounds = force_bounds(model);
        const auto force = [&](double x) { return model.network()->at(x, {}).force; };
        const Interval sampled = sampled_slopes(0.0, 1.0, 20'000, force)
                                     .with(sampled_slopes(-4.0, 0.0, 400, force))
                                     .with(sampled_slopes(1.0, 5.0, 400, force));
        const double margin = 1e-3 * sampled.largest();
        EXPECT_LE(bounds.slope.lower, sampled.lower + 1e-6 * margin) << draw;
        EXPECT_GE(bounds.slope.upper, sampled.upper - 1e-6 * margin) << draw;
        EXPECT_GE(bounds.slope.lower, sampled.lower - margin) << draw;
        EXPECT_LE(bounds.slope.upper, sampled.upper + margin) << draw;
        EXPECT_EQ(bounds.steepest, bounds.slope.largest());
        EXPECT_EQ(bounds.sliding, bounds.steepest);
        EXPECT_FALSE(bounds.hysteresis);
        EXPECT_FALSE(bounds.memory.has_value());
        EXPECT_EQ(bounds.mean_force, 0.0);
        EXPECT_EQ(bounds.hysteresis_per_play, 0.0);
    }
}

TEST(ForceBounds, AreComputedToATenThousandthOfTheSteepestSlope) {
    // The slope of one wavelet over its whole width; the extremes of psi' are found by a fine search.
    NetworkParameters network;
    network.alpha = {9.0};
    network.beta = {0.5};
    network.weight = {1.0};
    const NetworkCurve curve{network, test::unit_domain()};
    Interval sampled{infinity, -infinity};
    for (int k = 0; k <= 200'000; ++k) {
        const double slope = curve.inside(k / 200'000.0).slope;
        sampled = sampled.with({slope, slope});
    }
    const Interval slopes = detail::static_bounds(curve, infinity).slope;
    EXPECT_LE(slopes.lower, sampled.lower);
    EXPECT_GE(slopes.lower, sampled.lower - 1e-4 * sampled.largest());
    EXPECT_GE(slopes.upper, sampled.upper);
    EXPECT_LE(slopes.upper, sampled.upper + 1e-4 * sampled.largest());
}

TEST(ForceBounds, OfHysteresisAreTheSlopesOfSlidingAndSticking) {
    test::Random random{6};
    for (int draw = 0; draw < 24; ++draw) {
        auto [force, hysteresis] = random_pair(random, static_cast<std::size_t>(draw % 4));
        if (draw % 3 == 0) {  // a force that falls everywhere
            force.linear = {-5.0};
        }
        for (double& weight : hysteresis.weight) {
            weight *= 0.1;
        }
        const bool free = draw % 2 == 0;
        const Domain domain = test::unit_domain(free ? Continuation::Free : Continuation::Linear,
                                                draw % 4 < 2 ? Continuation::Free : Continuation::Linear);
        const double radius = std::exp(test::uniform(random, -4.0, -1.0));
        const ForceModel model{force, hysteresis, domain, radius};
        const NetworkCurve& g = model.hysteresis()->force();
        const NetworkCurve& h = model.hysteresis()->hysteresis_force();
        Interval slide{infinity, -infinity};
        Interval slope = slide;
        Interval loss = slide;
        double steepest = 0.0;
        double sliding = 0.0;
        for (int k = 0; k <= 60'000; ++k) {
            const double x = -5.0 + 11.0 * k / 60'000;
            const Curve force_at = g.at(x);
            const Curve loss_at = h.at(x);
            loss = loss.with({loss_at.value, loss_at.value});
            for (const double s : {-1.0, 1.0}) {
                const double sliding_slope = force_at.slope + s * loss_at.slope;
                const double stick = sliding_slope + loss_at.value / radius;
                slope = slope.with({sliding_slope, std::max(sliding_slope, stick)});
                sliding = std::max(sliding, std::abs(sliding_slope));
                steepest =
                    std::max(steepest, std::abs(sliding_slope) + std::max(0.0, loss_at.value) / radius);
            }
        }
        const ForceBounds bounds = force_bounds(model);
        const double margin = 2e-3 * steepest;
        EXPECT_TRUE(bounds.hysteresis);
        const auto tight = [&](double bound, double found, const char* name) {
            EXPECT_GE(bound, found - 1e-9 * steepest) << draw << " " << name;
            if (domain.below == Continuation::Linear && domain.above == Continuation::Linear) {
                EXPECT_LE(bound, found + margin) << draw << " " << name;
            }
        };
        tight(-bounds.slope.lower, -slope.lower, "slope_min");
        tight(bounds.slope.upper, slope.upper, "slope_max");
        tight(bounds.sliding, sliding, "sliding");
        tight(bounds.steepest, steepest, "steepest");
        EXPECT_LE(bounds.hysteresis_force.lower, loss.lower + 1e-12) << draw;
        EXPECT_GE(bounds.hysteresis_force.lower, loss.lower - 1e-3 * loss.largest()) << draw;
        EXPECT_GE(bounds.hysteresis_force.upper, loss.upper) << draw;
        EXPECT_LE(bounds.hysteresis_force.upper, loss.upper + 1e-3 * loss.largest()) << draw;
        EXPECT_DOUBLE_EQ(bounds.hysteresis_per_play, std::max(0.0, bounds.hysteresis_force.upper) / radius);
        // Another play radius changes the slope of sticking.
        const ForceBounds wider = force_bounds(model, 2.0 * radius);
        EXPECT_DOUBLE_EQ(wider.hysteresis_per_play, 0.5 * bounds.hysteresis_per_play);
        EXPECT_EQ(force_bounds(model, 0.0).slope.upper, bounds.slope.upper);
    }
}

TEST(ForceBounds, OfANegativeHysteresisHaveNoSlopeOfSticking) {
    NetworkParameters force;
    force.linear = {1.0};
    const ForceModel negative{force, {{}, 0.0, -0.2}, test::unit_domain(), 0.1};
    EXPECT_EQ(force_bounds(negative).hysteresis_per_play, 0.0);
    EXPECT_LT(force_bounds(negative).hysteresis_force.lower, -0.19);
    EXPECT_NEAR(force_bounds(negative).slope.upper, 1.0, 0.01) << "sticking subtracts 2 from the slope";
}

// Outside the domain [0, 1] the hysteresis 0.2 falls to zero with the slope 0.2, because the force of size 1 at the edge
// falls to zero with the slope 1. The play radius 0.1 adds the slope 2.
TEST(ForceBounds, OfHysteresisIncludeTheLinesOutsideTheDomain) {
    struct Case {
        double linear;
        double bias;
        Continuation below;
        Continuation above;
        double lower, upper, sliding, steepest;
    };
    const Continuation free = Continuation::Free;
    const Continuation straight = Continuation::Linear;
    for (const Case& one : {// x, which falls above the domain: slopes -1 - 0.2 to 0 + 0.2 + 2 there
                            Case{1.0, 0.0, straight, free, -1.2, 3.0, 1.2, 3.2},
                            // x - 1, which falls below the domain
                            Case{1.0, -1.0, free, straight, -1.2, 3.0, 1.2, 3.2},
                            // -x, which rises above the domain: slopes 0 - 0.2 to 1 + 0.2 + 2 there
                            Case{-1.0, 0.0, straight, free, -1.0, 3.2, 1.2, 3.2},
                            Case{-1.0, 1.0, free, straight, -1.0, 3.2, 1.2, 3.2},
                            Case{1.0, 0.0, straight, straight, 1.0, 3.0, 1.0, 3.0}}) {
        NetworkParameters force;
        force.linear = {one.linear};
        force.bias = one.bias;
        const ForceModel model{force, {{}, 0.0, 0.2}, test::unit_domain(one.below, one.above), 0.1};
        const ForceBounds bounds = force_bounds(model);
        constexpr double margin = 0.03;  // the largest force is bounded to 1 % of its size
        const auto outer = [&](double bound, double expected) {
            EXPECT_GE(bound, expected - 1e-12) << one.linear << " " << one.bias;
            EXPECT_LE(bound, expected + margin) << one.linear << " " << one.bias;
        };
        outer(bounds.slope.upper, one.upper);
        outer(-bounds.slope.lower, -one.lower);
        outer(bounds.sliding, one.sliding);
        outer(bounds.steepest, one.steepest);
        outer(-bounds.hysteresis_force.lower, one.below == free || one.above == free ? 0.0 : -0.2);
        outer(bounds.hysteresis_force.upper, 0.2);
    }
}

TEST(ForceBounds, SmallestHysteresisIsResolvedToAMillionthIfItIsNearZero) {
    // A hysteresis with a minimum of 1e-5 of its largest value: the first, coarser bound is below zero or not; the
    // second bound is above zero.
    NetworkParameters network;
    network.alpha = {6.0, 9.0};
    network.beta = {0.4, 0.8};
    network.weight = {-1.0, 0.3};
    network.bias = 0.0;
    const NetworkCurve curve{network, test::unit_domain()};
    double least = infinity;
    double most = -infinity;
    for (int k = 0; k <= 200'000; ++k) {
        const double value = curve.inside(k / 200'000.0).value;
        least = std::min(least, value);
        most = std::max(most, value);
    }
    for (const double above : {-0.5, 1e-5, 3e-6, 0.3}) {
        network.bias = above * (most - least) - least;
        const Interval bounds = detail::hysteresis_force_bounds(network, 0.0, 1.0);
        const double true_least = above * (most - least);
        EXPECT_LE(bounds.lower, true_least + 1e-12);
        EXPECT_GE(bounds.lower, true_least - (above > 0.1 ? 1e-4 : 2e-6) * 2.0 * (most - least)) << above;
        EXPECT_EQ(bounds.lower >= 0.0, above > 0.0) << above;
        EXPECT_GE(bounds.upper, true_least + most - least - 1e-12);
    }
}

TEST(ForceBounds, OfAPeriodicForceHaveNoLines) {
    NetworkParameters network;
    network.alpha = {9.0, 9.0};
    network.beta = {0.3, 0.7};
    network.weight = {1.0, -1.0};
    const Domain turn{{0.0}, {1.0}, Continuation::Linear, Continuation::Linear, 1.0};
    const ForceModel model{network, turn};
    const ForceBounds bounds = force_bounds(model);
    const Interval sampled =
        sampled_slopes(0.0, 1.0, 20'000, [&](double x) { return model.network()->at(x, {}).force; });
    EXPECT_NEAR(bounds.slope.lower, sampled.lower, 5e-4 * sampled.largest());
    EXPECT_NEAR(bounds.slope.upper, sampled.upper, 5e-4 * sampled.largest());
    const ForceModel pair{network, {{0.0, 0.0}, 0.0, 0.5}, turn, 0.1};
    EXPECT_NEAR(force_bounds(pair).slope.upper, sampled.upper + 5.0, 5e-4 * (sampled.largest() + 5.0));
}

TEST(ForceBounds, OfVelocityAreTight) {
    test::Random random{9};
    for (int draw = 0; draw < 8; ++draw) {
        NetworkParameters network = test::random_network(random, static_cast<std::size_t>(draw % 4), 2);
        for (double& alpha : network.alpha) {
            alpha = std::min(alpha, 8.0);  // wide enough for the samples
        }
        const ForceModel model =
            ForceModel::of_velocity(network, {{0.0, -1.0}, {1.0, 1.0}, {}, {}, std::nullopt});
        const VelocityNetwork& f = *model.velocity();
        const ForceBounds bounds = force_bounds(model);
        const Interval rest = sampled_slopes(-2.0, 3.0, 5000, [&](double x) { return f.force(x, 0.0); });
        double sliding = rest.largest();
        double drag = 0.0;
        for (int k = 0; k <= 100; ++k) {
            const double v = -1.0 + 0.02 * k;
            sliding = std::max(
                sliding, sampled_slopes(0.0, 1.0, 500, [&](double x) { return f.force(x, v); }).largest());
        }
        for (int k = 0; k <= 100; ++k) {
            const double x = 0.01 * k;
            drag = std::max(
                drag, sampled_slopes(-1.0, 1.0, 500, [&](double v) { return f.force(x, v); }).largest());
        }
        const auto tight = [&](double bound, double found, const char* name) {
            EXPECT_GE(bound, found - 1e-6 * std::max(sliding, 1.0)) << draw << " " << name;
            EXPECT_LE(bound, found + 0.02 * std::max(sliding, 1.0)) << draw << " " << name;
        };
        tight(bounds.slope.upper, rest.upper, "slope_max");
        tight(-bounds.slope.lower, -rest.lower, "slope_min");
        tight(bounds.sliding, sliding, "sliding");
        tight(bounds.drag, drag, "drag");
        EXPECT_EQ(bounds.steepest, bounds.slope.largest());
        EXPECT_GE(bounds.sliding, bounds.steepest);
        EXPECT_FALSE(bounds.hysteresis);
    }
}

TEST(ForceBounds, OfAMemoryAreSumsOverItsBranches) {
    MemoryParameters memory;
    memory.stiffness = {4.0, 10.0};
    memory.time_constant_s = {0.5, 0.02};
    memory.yield_stretch = {0.25, 50.0};          // the second branch never slips
    memory.ratio = {1, {}, {}, {}, {-2.0}, 3.0};  // 3 - 2 x: 3 to 1, with an integral of 2
    const NetworkParameters spring{1, {}, {}, {}, {0.5}, 0.0};
    const ForceModel plain{spring, test::unit_domain()};
    const ForceModel model = plain.with_memory(memory);
    const MemoryNetwork& network = *model.memory();
    const MemoryBounds bounds = *memory_bounds(model);
    const double P = network.largest_ratio();
    const double slope = network.steepest_ratio();
    EXPECT_NEAR(P, 3.0, 0.05);
    EXPECT_NEAR(slope, 2.0, 0.05);
    EXPECT_NEAR(bounds.stiffness, P * P * 14.0, 1e-12);
    EXPECT_NEAR(bounds.bending, slope * (4.0 * 0.25 + 10.0 * 2.0), 0.5);
    EXPECT_NEAR(bounds.bending_per_m, P * slope * 14.0, 1e-12);
    EXPECT_NEAR(bounds.relaxation_per_s, P * P * (4.0 / 0.5 + 10.0 / 0.02), 1e-9);
    EXPECT_FALSE(memory_bounds(plain).has_value());
    ASSERT_TRUE(force_bounds(model).memory.has_value());
    EXPECT_EQ(force_bounds(model).memory->bending, bounds.bending);
}

TEST(ForceBounds, ShiftOfAModelWithoutAPeriodIsZero) {
    const NetworkParameters spring{1, {}, {}, {}, {0.5}, 3.0};
    EXPECT_EQ(passive_shift(ForceModel{spring, test::unit_domain()}, 1.0), 0.0);
    const ForceModel moving = ForceModel::of_velocity(NetworkParameters{2, {}, {}, {}, {1.0, 1.0}, 3.0},
                                                      {{0.0, -1.0}, {1.0, 1.0}, {}, {}, std::nullopt});
    EXPECT_EQ(passive_shift(moving, 1.0), 0.0);
}

TEST(ForceBounds, OfAForceOfOtherInputsAreRefused) {
    const ForceModel other{NetworkParameters{2, {}, {}, {}, {1.0, 1.0}, 0.0},
                           {{0.0, 0.0}, {1.0, 1.0}, {}, {}, std::nullopt}};
    EXPECT_THROW((void)force_bounds(other), std::invalid_argument);
}

}  // namespace
}  // namespace palpate
