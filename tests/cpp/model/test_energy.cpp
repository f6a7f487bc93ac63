// SPDX-License-Identifier: Apache-2.0
#include "palpate/model/energy.hpp"
#include "special_values.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <utility>

#include <gtest/gtest.h>

#include "palpate/model/detail/limited_energy.hpp"
#include "palpate/model/force_model.hpp"
#include "support.hpp"

namespace palpate {
namespace {

using test::cases;
using test::Random;
using test::uniform;

using test::infinity;

/// A force whose evaluations are counted: the straight line f(x) = slope (x - zero) with an antiderivative that is not
/// zero at any edge.
struct Line {
    double slope;
    double zero;
    mutable int evaluations = 0;

    Curve operator()(double x) const {
        ++evaluations;
        const double d = x - zero;
        return {slope * d, slope, 7.0 + 0.5 * slope * d * d, 0.0};
    }
};

/// A force that crosses its limits several times: f(x) = 2 cos(5 x) + 0.5 and its antiderivative.
Curve wave(double x) {
    return {2.0 * std::cos(5.0 * x) + 0.5, -10.0 * std::sin(5.0 * x), 0.4 * std::sin(5.0 * x) + 0.5 * x, 0.0};
}

/// Returns the integral of a function by the midpoint rule with 20 000 steps.
template <class F>
double midpoints(const F& f, double from, double to) {
    constexpr int steps = 20'000;
    double sum = 0.0;
    for (int k = 0; k < steps; ++k) {
        sum += f(from + (to - from) * (k + 0.5) / steps);
    }
    return sum * (to - from) / steps;
}

TEST(Energy, SpanIncludesTheError) {
    EXPECT_EQ((EnergyRange{-2.0, 3.0, 0.5}).span(), 5.5);
}

// Both ends within the limit, both beyond it, and one or two crossings of either limit between the ends.
TEST(Energy, WorkBeyondTheLimitIsTheIntegralOfTheRemovedForce) {
    const auto removed = [](double x) {
        const double force = wave(x).value;
        return force - std::clamp(force, -1.0, 1.0);
    };
    const auto work = [&](double from, double to) {
        return detail::work_beyond(wave, from, wave(from), to, wave(to), 1.0);
    };
    for (const auto& [from, to] : {std::pair{0.2, 0.3},
                                   {0.28, 0.4},
                                   {-0.1, 0.1},
                                   {0.6, 0.66},
                                   {0.0, 0.62},
                                   {0.4, 0.63},
                                   {0.1, 0.35},
                                   {-0.6, 0.05}}) {
        EXPECT_NEAR(work(from, to), midpoints(removed, from, to), 1e-8) << from << " to " << to;
    }
}

TEST(Energy, WorkBeyondTheLimitHalvesTheIntervalOnlyAtACrossing) {
    const auto evaluations = [](const Line& line, double from, double to, double limit,
                                std::optional<int> halvings = std::nullopt) {
        const Curve at_from = line(from);
        const Curve at_to = line(to);
        line.evaluations = 0;
        (void)(halvings ? detail::work_beyond(line, from, at_from, to, at_to, limit, *halvings)
                        : detail::work_beyond(line, from, at_from, to, at_to, limit));
        return line.evaluations;
    };
    const Line rising{1.0, 0.0};
    EXPECT_EQ(evaluations(rising, -1.0, 1.0, 1.0), 0) << "a force at the limit is not beyond it";
    EXPECT_EQ(evaluations(rising, 2.0, 3.0, 1.0), 0);
    EXPECT_EQ(evaluations(rising, -3.0, -2.0, 1.0), 0);
    EXPECT_EQ(evaluations(rising, 0.1, 3.0, 1.0), 40);
    EXPECT_EQ(evaluations(rising, 0.1, 3.0, 1.0, 3), 3);
    EXPECT_EQ(evaluations(rising, 0.1, 3.0, 1.0, 0), 0);
}

TEST(Energy, RestIsTheLastPositionWithANegativeForce) {
    const Line line{2.0, 0.0};
    const double rest = detail::rest_between(line, -1.0, 1.0);
    EXPECT_LT(line(rest).value, 0.0);
    EXPECT_GE(rest, -0x1p-59) << "60 halvings of an interval of width 2";
    EXPECT_NEAR(detail::rest_between(Line{2.0, 0.3}, 0.1, 0.7), 0.3, 1e-16);
    EXPECT_NEAR(detail::rest_between(Line{0.5, 0.3}, -0.1, 0.35), 0.3, 1e-16);
}

// The decrease is compared with the integral of the limited force on the line, from the edge to zero force.
TEST(Energy, DecreaseBeyondAnEdgeIsTheWorkOfTheForceThatPushesOut) {
    for (const double outward : {-1.0, 1.0}) {
        for (const double size : {0.4, 3.0}) {
            const EdgeLine line{5.0, {-outward * size, 2.5, 0.0, 0.0}};
            for (const double limit : {0.3, 1.0, 10.0, infinity}) {
                const double work =
                    midpoints([&](double x) { return std::clamp(line.at(x).value, -limit, limit); }, 5.0,
                              5.0 + outward * size / 2.5);
                EXPECT_NEAR(detail::decrease_beyond(line, outward, limit), -work, 1e-8);
            }
            EXPECT_EQ(detail::decrease_beyond(line, -outward, 1.0), 0.0) << "a force that pulls back";
        }
        const EdgeLine none{5.0, {0.0, 0.0, 0.0, 0.0}};
        EXPECT_EQ(detail::decrease_beyond(none, outward, 1.0), 0.0);
    }
}

TEST(Energy, LimitedEnergyOfALineIsExact) {
    // f = 2 (x - 0.3) from -0.2 to 0.8. Without limit the energy is (x - 0.3)^2 + 7. With the limit 0.2 it changes by
    // -0.2 per length up to x = 0.2, by -0.01 up to x = 0.3, and symmetrically afterwards.
    const Line line{2.0, 0.3};
    const auto unlimited = detail::limited_energy(line, -0.2, 0.8, 7, 2.0, infinity);
    EXPECT_NEAR(unlimited.at_lower, 7.25, 1e-14);
    EXPECT_NEAR(unlimited.at_upper, 7.25, 1e-14);
    EXPECT_NEAR(unlimited.range.largest, 7.25, 1e-14);
    EXPECT_NEAR(unlimited.range.least, 7.0, 1e-14);
    EXPECT_NEAR(unlimited.range.missed, 0.25 * 2.0 / 49.0, 1e-16);
    const auto limited = detail::limited_energy(line, -0.2, 0.6, 7, 2.0, 0.2);
    EXPECT_NEAR(limited.at_lower, 7.25, 1e-14);
    EXPECT_NEAR(limited.range.largest, 7.25, 1e-14);
    EXPECT_NEAR(limited.range.least, 7.25 - 0.08 - 0.01, 1e-12);
    EXPECT_NEAR(limited.at_upper, 7.25 - 0.08 + 0.04, 1e-12);
    // A single cell, with both ends beyond the limit
    EXPECT_NEAR(detail::limited_energy(line, -0.2, 0.6, 1, 2.0, 0.2).range.least, 7.25 - 0.08 - 0.01, 1e-12);
    const auto falling = detail::limited_energy(Line{-2.0, 0.3}, -0.2, 0.7, 7, 2.0, 0.2);
    EXPECT_NEAR(falling.range.least, falling.at_lower, 1e-14);
    EXPECT_NEAR(falling.at_upper, 6.75 + 0.08 - 0.06, 1e-12);
    EXPECT_NEAR(falling.range.largest, 6.75 + 0.09, 0.25 * 2.0 * 0.0166);
}

// w = 1/8 and L = 2: a crossing is possible in a cell with an end whose force differs from the limit by at most
// L w / 2 = 1/8. The force k / 4 at the borders has this difference from 3/8 at k = 1 and k = 2, so at three cells.
TEST(Energy, ErrorIncludesEachCellInWhichTheForceCanCrossTheLimit) {
    const double one = 0.25 * 2.0 / 64.0;
    for (const double sign : {-1.0, 1.0}) {
        const Line line{sign * 2.0, 0.0};
        const auto missed = [&](double limit) {
            return detail::limited_energy(line, 0.0, 1.0, 8, 2.0, limit).range.missed;
        };
        EXPECT_EQ(missed(0.375), 4.0 * one);
        EXPECT_EQ(missed(0.5), 3.0 * one);
        EXPECT_EQ(missed(2.0), 2.0 * one);
        EXPECT_EQ(missed(2.125), 2.0 * one);
        EXPECT_EQ(missed(std::nextafter(2.125, 3.0)), one);
    }
}

TEST(Energy, EvaluatesTheForceOnceAtEachBorderUnlessItCrossesZeroOrTheLimit) {
    const auto evaluations = [](const Line& line) {
        line.evaluations = 0;
        (void)detail::limited_energy(line, 0.0, 1.0, 8, 2.0, infinity);
        return line.evaluations;
    };
    EXPECT_EQ(evaluations(Line{2.0, 0.0}), 9);
    EXPECT_EQ(evaluations(Line{2.0, -1.0}), 9);
    EXPECT_EQ(evaluations(Line{2.0, 1.5}), 9);
    EXPECT_GT(evaluations(Line{2.0, 0.3}), 9);
}

// f = 3 cos(16 pi x) + 4 (x - 0.5) is positive at all borders of the cells, at which its energy is 2 (x - 0.5)^2.
TEST(Energy, RangeContainsTheEnergyAtEachBorder) {
    const auto force = [](double x) {
        const double angle = 16.0 * std::numbers::pi * x;
        return Curve{3.0 * std::cos(angle) + 4.0 * (x - 0.5), 0.0,
                     3.0 * std::sin(angle) / (16.0 * std::numbers::pi) + 2.0 * (x - 0.5) * (x - 0.5), 0.0};
    };
    const auto energy = detail::limited_energy(force, 0.0, 1.0, 8, 155.0, infinity);
    EXPECT_NEAR(energy.range.least, 0.0, 1e-14);
    EXPECT_NEAR(energy.range.largest, 0.5, 1e-14);
}

// With few cells, the error must cover the difference from the energy at 20 000 positions.
TEST(Energy, LimitedEnergyDiffersFromDenseSamplesByAtMostItsError) {
    Random random{61};
    for (int k = 0; k < cases(60); ++k) {
        const double lower = uniform(random, -1.0, 0.0);
        const double upper = lower + uniform(random, 0.5, 2.0);
        const double limit = uniform(random, 0.2, 3.0);
        const auto cells = static_cast<std::size_t>(uniform(random, 5.0, 60.0));
        const auto found = detail::limited_energy(wave, lower, upper, cells, 10.0, limit);
        constexpr int steps = 20'000;
        double energy = wave(lower).integral;
        double least = energy;
        double largest = energy;
        for (int j = 0; j < steps; ++j) {
            energy += std::clamp(wave(lower + (upper - lower) * (j + 0.5) / steps).value, -limit, limit) *
                      (upper - lower) / steps;
            least = std::min(least, energy);
            largest = std::max(largest, energy);
        }
        EXPECT_NEAR(found.range.least, least, found.range.missed + 1e-7) << k;
        EXPECT_NEAR(found.range.largest, largest, found.range.missed + 1e-7) << k;
        EXPECT_NEAR(found.at_upper, energy, found.range.missed + 1e-7) << k;
    }
}

TEST(Energy, NumberOfCellsGrowsWithTheFinestWavelet) {
    EXPECT_EQ(detail::energy_cells(1.0, 1.0), 1040U);
    EXPECT_EQ(detail::energy_cells(2.0, 0.25), 1152U);
    EXPECT_EQ(detail::energy_cells(0.5, 0.25), 1056U);
    EXPECT_EQ(detail::energy_cells(1.0, 1e-9), 1'000'000U);
}

/// Least and largest energy of a limited force relative to the energy at the lower end of its domain, by the midpoint
/// rule. The least energy is found over the domain and its length on both sides: there the line of a force that pushes
/// out of the domain ends, because its slope is at least max|f| / travel.
template <class F>
EnergyRange dense_range(const F& force, double lower, double upper, double limit) {
    constexpr int steps = 20'000;
    const double travel = upper - lower;
    EnergyRange range;
    const auto follow = [&](double from, double step, double energy, bool inside) {
        for (int k = 0; k < steps; ++k) {
            energy += std::clamp(force(from + step * (k + 0.5)), -limit, limit) * step;
            range.least = std::min(range.least, energy);
            range.largest = inside ? std::max(range.largest, energy) : range.largest;
        }
        return energy;
    };
    const double at_upper = follow(lower, travel / steps, 0.0, true);
    (void)follow(upper, 1.001 * travel / steps, at_upper, false);
    (void)follow(lower, -1.001 * travel / steps, 0.0, false);
    return range;
}

TEST(Energy, RangeOfAPositionForceIncludesItsContinuation) {
    Random random{62};
    int outside = 0;
    for (int k = 0; k < cases(60); ++k) {
        const auto side = [&] { return random() % 2 == 0 ? Continuation::Linear : Continuation::Free; };
        const Domain domain{{-0.4}, {0.8}, side(), side(), std::nullopt};
        NetworkParameters network = test::random_network(random, static_cast<std::size_t>(k % 4));
        if (k % 3 == 0) {
            network.bias += uniform(random, -2.0, 2.0);
        }
        const ForceModel model{network, domain};
        const NetworkCurve& curve = model.network()->curve();
        const double limit = k % 2 == 0 ? infinity : uniform(random, 0.2, 2.0);
        const EnergyRange found = energy_range(model, limit);
        const EnergyRange dense = dense_range([&](double x) { return curve.at(x).value; }, -0.4, 0.8, limit);
        const double start = curve.at(-0.4).integral;
        const double slack = std::isinf(limit) ? 2e-7 : found.missed + 2e-7;
        EXPECT_NEAR(found.least - start, dense.least, slack) << k;
        EXPECT_NEAR(found.largest - start, dense.largest, found.missed + 2e-7) << k;
        EXPECT_LE(found.missed, 0.02 * (1.0 + found.largest - found.least)) << k;
        outside += dense.least < 0.0 ? 1 : 0;
    }
    EXPECT_GT(outside, 10);
}

TEST(Energy, ErrorOfASpringIsAQuarterOfItsSlopeTimesTheSquareOfACell) {
    const ForceModel spring{{1, {}, {}, {}, {2.0}, 0.0}, {{1.0}, {3.0}, {}, {}, std::nullopt}};
    EXPECT_NEAR(energy_range(spring).missed, 0.25 * 2.0 * std::pow(2.0 / 1040.0, 2), 1e-15);
}

TEST(Energy, RangeOfAVelocityForceIsTakenAtVelocityZero) {
    // f(x, 0) = 2 (x - 0.8) + offset over [0.5, 1.5], whose energy has a formula
    const Domain domain{{0.5, -1.0}, {1.5, 2.0}, {}, {}, std::nullopt};
    const auto range = [&](double zero, double limit) {
        const ForceModel model = ForceModel::of_velocity({2, {}, {}, {}, {2.0, 0.7}, -2.0 * zero}, domain);
        return energy_range(model, limit);
    };
    const EnergyRange inside = range(0.8005, infinity);
    EXPECT_NEAR(inside.least, -0.3005 * 0.3005, 1e-13);
    EXPECT_NEAR(inside.largest, 0.6995 * 0.6995 - 0.3005 * 0.3005, 1e-12);
    // The rule of the header, with L = 2 and 1040 cells
    EXPECT_NEAR(inside.missed, (5.0 / 36.0 * 1040.0 + 0.25) * 2.0 / (1040.0 * 1040.0), 1e-15);
    const EnergyRange falling = range(2.0, infinity);
    // At the upper edge the force -1 pushes out of the domain. The slope of its line is max|f| / travel = 3.
    EXPECT_NEAR(falling.least, -2.0 - 0.5 / 3.0, 1e-10);
    EXPECT_EQ(falling.largest, 0.0);
    const EnergyRange rising = range(0.0, infinity);
    EXPECT_NEAR(rising.least, -0.5 / 3.0, 1e-10);
    EXPECT_NEAR(rising.largest, 2.0, 1e-12);
    // With the limit 0.5 the force is constant over the domain, and along the line while it is beyond the limit
    EXPECT_NEAR(range(0.0, 0.5).least, -0.5 * (0.5 / 3.0) - 0.5 * 0.5 * (0.5 / 3.0), 1e-10);
    EXPECT_NEAR(range(2.0, 0.5).least, -0.5 - 0.5 * (0.5 / 3.0) - 0.5 * 0.5 * (0.5 / 3.0), 1e-10);
    EXPECT_NEAR(range(0.0, 0.5).largest, 0.5, 1e-12);
}

TEST(Energy, RangeOfARandomVelocityForceAgreesWithDenseSamples) {
    Random random{63};
    const Domain domain{{0.0, -1.0}, {1.0, 1.0}, {}, {}, std::nullopt};
    for (int k = 0; k < cases(20); ++k) {
        NetworkParameters network = test::random_network(random, 5, 2);
        for (double& alpha : network.alpha) {
            alpha = std::min(alpha, 20.0);
        }
        const ForceModel model = ForceModel::of_velocity(network, domain);
        const VelocityNetwork& force = *model.velocity();
        const double limit = k % 2 == 0 ? infinity : uniform(random, 0.2, 2.0);
        const EnergyRange found = energy_range(model, limit);
        const EnergyRange dense = dense_range([&](double x) { return force.force(x, 0.0); }, 0.0, 1.0, limit);
        double steepest = 0.0;
        for (int j = 0; j <= 5'000; ++j) {
            std::array<double, 2> gradient{};
            (void)force.network().at(std::array{j / 5e3, 0.0}, gradient);
            steepest = std::max(steepest, std::abs(gradient[0]));
        }
        const double cells = 1024.0 + 16.0 / force.finest_width();
        EXPECT_NEAR(found.least, dense.least, 2.0 * steepest / (cells * cells) + 1e-7) << k;
        EXPECT_NEAR(found.largest, dense.largest, 2.0 * steepest / (cells * cells) + 1e-7) << k;
        // The error grows with the largest slope, whose bound is at most 1 % too large
        const double least_error = (5.0 / 36.0 * std::floor(cells) + 0.25) * steepest;
        EXPECT_GE(found.missed * std::floor(cells) * std::floor(cells), 0.9999 * least_error) << k;
        EXPECT_LE(found.missed * std::floor(cells) * std::floor(cells), 1.0101 * least_error) << k;
    }
}

TEST(Energy, HysteresisStoresHalfOfItsForceOverThePlayRadius) {
    const NetworkParameters spring{1, {}, {}, {}, {2.0}, 0.0};
    const auto largest = [&](double h) {
        return energy_range(ForceModel{spring, {{}, 0.0, h}, test::unit_domain(), 0.1}).largest;
    };
    EXPECT_NEAR(largest(0.0), 1.0, 1e-12);
    EXPECT_NEAR(largest(0.3), 1.0 + 0.5 * 0.1 * 0.3, 1e-12);
    EXPECT_NEAR(largest(-0.3), 1.0, 1e-12) << "a negative hysteresis stores nothing";
}

// A detent of one wavelet across the border of the period: E(x) = -w u exp(-u^2 / 2) / alpha, with u = -1 at both ends.
TEST(Energy, PeriodicForceHasALeastEnergyOnlyWithoutAMeanForce) {
    const auto least = [](double mean) {
        const Domain turn{{0.0}, {1.0}, {}, {}, 1.0};
        return energy_range(ForceModel{{1, {20.0, 20.0}, {0.05, 1.05}, {1.0, 1.0}, {0.0}, mean}, turn}).least;
    };
    EXPECT_NEAR(least(0.0), -std::exp(-0.5) / 20.0, 1e-9);
    EXPECT_NEAR(least(1e-12), -std::exp(-0.5) / 20.0, 1e-9);
    EXPECT_EQ(least(1e-9), -infinity);
    EXPECT_EQ(least(2e-10), -infinity);
    EXPECT_EQ(least(-0.5), -infinity);
    const Domain turn{{0.0}, {1.0}, {}, {}, 1.0};
    EXPECT_EQ(energy_range(ForceModel{{1, {}, {}, {}, {0.0}, 0.0}, turn}).least, 0.0);
}

TEST(Energy, RefusesAModelOfTwoPositions) {
    Random random{64};
    const ForceModel model{test::random_network(random, 2, 2),
                           {{0.0, 0.0}, {1.0, 1.0}, {}, {}, std::nullopt}};
    EXPECT_THROW((void)energy_range(model), std::invalid_argument);
}

}  // namespace
}  // namespace palpate
