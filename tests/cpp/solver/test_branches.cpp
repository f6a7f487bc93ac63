// SPDX-License-Identifier: Apache-2.0
#include "palpate/solver/resolvent.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>
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

constexpr double infinity = std::numeric_limits<double>::infinity();

TEST(Branch, ComputesALineFromItsFiniteEnd) {
    Branch line;
    line.line_slope = 4.0;
    line.positions = {-infinity, 2.0};
    line.values = {-infinity, 10.0};
    EXPECT_EQ(line.on_line(10.0), 2.0);
    EXPECT_EQ(line.on_line(2.0), 0.0);
    line.positions = {2.0, infinity};
    line.values = {10.0, infinity};
    EXPECT_EQ(line.on_line(10.0), 2.0);
    EXPECT_EQ(line.on_line(18.0), 4.0);
}

// At a fold with the curvature c the values are F = F_fold -+ c d^2 / 2 at the distance d.
TEST(Branch, GuessesAParabolaInTheTenthNextToAFold) {
    Branch branch;
    branch.positions = {1.0, 3.0};
    branch.values = {100.0, 200.0};
    // Without folds: the last position if it lies inside, otherwise the middle
    EXPECT_EQ(branch.first_guess(199.0, 2.5), 2.5);
    EXPECT_EQ(branch.first_guess(101.0, 1.5), 1.5);
    for (const double outside : {1.0, 3.0, -7.0, 7.0}) {
        EXPECT_EQ(branch.first_guess(150.0, outside), 2.0);
    }
    branch.curvature_high = 32.0;
    EXPECT_EQ(branch.first_guess(199.0, 1.5), 2.75);  // 1 = 32 / 2 (1/4)^2
    EXPECT_EQ(branch.first_guess(190.0, 1.5), 1.5);   // at a tenth of the range: the last position
    EXPECT_EQ(branch.first_guess(std::nextafter(190.0, 200.0), 1.5),
              3.0 - std::sqrt(2.0 * (200.0 - std::nextafter(190.0, 200.0)) / 32.0));
    EXPECT_EQ(branch.first_guess(101.0, 1.5), 1.5);
    branch.curvature_low = 8.0;
    EXPECT_EQ(branch.first_guess(101.0, 2.5), 1.5);  // 1 = 8 / 2 (1/2)^2
    EXPECT_EQ(branch.first_guess(110.0, 2.5), 2.5);
    EXPECT_EQ(branch.first_guess(199.0, 1.5), 2.75);
    branch.curvature_high = 0.0;
    EXPECT_EQ(branch.first_guess(199.0, 1.5), 1.5);
    EXPECT_EQ(branch.first_guess(100.0, 2.5), 2.0) << "the fold itself is not inside";
}

/// Returns f(y) + p y.
double total(const WaveletNetwork& network, double p, double y) {
    return network.at(y, {}).force + p * y;
}

TEST(Branches, CoverTheRisingPartsOfTheFunction) {
    Random random{341};
    int folds = 0;
    int gaps = 0;
    for (int k = 0; k < cases(40); ++k) {
        const auto continuation = k % 2 == 0 ? Continuation::Free : Continuation::Linear;
        Domain domain = test::unit_domain(continuation, continuation);
        if (k % 5 == 4) {
            domain = {{0.1}, {1.1}, Continuation::Linear, Continuation::Linear, 1.0};
        }
        const WaveletNetwork network{test::random_network(random, static_cast<std::size_t>(1 + k % 8)),
                                     domain};
        const double p = std::max(0.1, uniform(random, 0.2, 1.2) * -network.curve().slope_bounds().lower);
        const Resolvent resolvent{network.curve(), p};
        const auto& branches = resolvent.branches();
        const PiecewiseForce force = piecewise(network.curve());
        std::size_t cells = 0;
        double worst = 0.0;
        for (std::size_t b = 1; b < branches.size(); ++b) {
            const Branch& branch = branches[b];
            cells += branch.table.table.size();
            worst = std::max(worst, branch.table.error);
            ASSERT_LT(branch.values.lower, branch.values.upper);
            for (const auto& [y, q] : {std::pair{branch.positions.lower, branch.values.lower},
                                       std::pair{branch.positions.upper, branch.values.upper}}) {
                ASSERT_EQ(std::isfinite(y), std::isfinite(q));
                if (std::isfinite(y)) {
                    ASSERT_NEAR(total(network, p, y), q, 2e-9 * (p + 200.0)) << k << " " << b;
                }
            }
            if (branch.line_slope > 0.0) {
                const double y = std::isfinite(branch.positions.lower)   ? branch.positions.lower + 1e-5
                                 : std::isfinite(branch.positions.upper) ? branch.positions.upper - 1e-5
                                                                         : 0.0;
                ASSERT_NEAR(branch.line_slope, p + network.at(y, {}).slope, 1e-9 * (p + 200.0));
                ASSERT_TRUE(branch.positions.upper <= 0.0 || branch.positions.lower >= 1.0);
                ASSERT_TRUE(branch.table.empty());
            } else {
                ASSERT_GE(branch.positions.lower, force.lower - 1e-12);
                ASSERT_LE(branch.positions.upper, force.upper + 1e-12);
                gaps += branch.table.empty() ? 1 : 0;
            }
            // A fold: the slope is 0 and the curvature is given; only at an end without a table
            for (const auto& [y, curvature] : {std::pair{branch.positions.lower, branch.curvature_low},
                                               std::pair{branch.positions.upper, branch.curvature_high}}) {
                if (curvature > 0.0) {
                    ASSERT_NEAR(curvature, std::abs(jet(network.curve().parameters(), y)[2]),
                                1e-9 * curvature);
                    ASSERT_NEAR(p + network.at(y, {}).slope, 0.0, 1e-9);
                    ++folds;
                } else if (branch.line_slope == 0.0 && branch.table.empty() && y > force.lower + 1e-6 &&
                           y < force.upper - 1e-6) {
                    ASSERT_GT(p + network.at(y, {}).slope, 1e-8) << "a fold has a curvature";
                }
            }
            if (b > 1) {
                const Branch& last = branches[b - 1];
                ASSERT_GE(branch.positions.lower, last.positions.upper - 2.1e-9);
                const bool folded = last.curvature_high > 0.0 || branch.curvature_low > 0.0;
                if (!folded && branch.line_slope == 0.0 && last.line_slope == 0.0) {
                    ASSERT_EQ(branch.values.lower, last.values.upper)
                        << "without a fold between them the branches touch";
                    ASSERT_NEAR(branch.positions.lower, last.positions.upper, 2.1e-9);
                }
            }
        }
        EXPECT_EQ(resolvent.cells(), cells);
        EXPECT_EQ(resolvent.tabulated(), cells > 0);
        EXPECT_EQ(resolvent.position_error(), worst);
        if (!force.periodic && branches.size() > 1) {
            EXPECT_EQ(branches[1].positions.lower, -infinity);
            EXPECT_EQ(branches.back().positions.upper, infinity);
        }
        // Every rising position lies in a branch.
        for (int j = 0; j < 1000 && branches.size() > 1; ++j) {
            const double y = force.lower + (j + 0.5) / 1000.0;
            const bool inside = std::any_of(branches.begin() + 1, branches.end(), [&](const Branch& branch) {
                return y >= branch.positions.lower && y <= branch.positions.upper;
            });
            ASSERT_EQ(inside, p + network.at(y, {}).slope > 0.0) << k << " " << y;
        }
    }
    EXPECT_GT(folds, cases(20));
    EXPECT_GT(gaps, cases(20));
}

/// A click that falls at 0.5, between two rising parts; the load line has the slope 1.
WaveletNetwork click(Continuation continuation = Continuation::Linear) {
    return {{1, {10.0}, {0.5}, {-1.0}, {2.0}, 0.0}, test::unit_domain(continuation, continuation)};
}

TEST(Branches, AreRememberedAndForgottenByTheSolver) {
    const WaveletNetwork network = click();
    const Resolvent resolvent{network.curve(), 1.0};
    ASSERT_TRUE(resolvent.tabulated());
    ASSERT_FALSE(resolvent.unique(1.0));
    for (int k = 0; k <= 100; ++k) {
        const double y = -0.5 + 2.0 * k / 100.0;
        Resolvent::Memory memory{y};
        EXPECT_EQ(memory.branch, 0U);
        const double q = total(network, 1.0, y);
        const Solution solution = resolvent.solve(network, {}, {1.0, q}, memory);
        ASSERT_EQ(solution.status, Status::Ok);
        const Branch& branch = resolvent.branches()[memory.branch];
        ASSERT_GE(memory.branch, 1U);
        ASSERT_GE(solution.position, branch.positions.lower - 1e-8);
        ASSERT_LE(solution.position, branch.positions.upper + 1e-8);
        ASSERT_EQ(memory.newton.position, solution.position);
        if (1.0 + network.at(y, {}).slope > 1e-3) {
            ASSERT_NEAR(solution.position, y, 1e-8) << k;
            if (std::abs(y) > 1e-9 && std::abs(y - 1.0) > 1e-9) {
                ASSERT_EQ(solution.environment.extrapolated, y < 0.0 || y > 1.0) << y;
            }
        }
        ASSERT_NEAR(solution.environment.force, q - solution.position, 1e-12);
        // A value that is not finite changes nothing; another slope forgets the branch.
        const Resolvent::Memory before = memory;
        ASSERT_EQ(resolvent.solve(network, {}, {1.0, std::nan("")}, memory).status, Status::NonFinite);
        ASSERT_EQ(memory.branch, before.branch);
        ASSERT_EQ(memory.newton.position, before.newton.position);
        const Solution other = resolvent.solve(network, {}, {200.0, 200.0 * y}, memory);
        ASSERT_EQ(other.status, Status::Ok);
        ASSERT_NEAR(total(network, 200.0, other.position), 200.0 * y, 1e-9);
        ASSERT_EQ(memory.branch, 0U);
        ASSERT_EQ(memory.turns, 0.0);
        ASSERT_EQ(memory.newton.position, other.position);
    }
}

TEST(Branches, GiveSolutionsWithoutEvaluationsOnlyForTheirSlope) {
    const WaveletNetwork network = click();
    const Resolvent resolvent{network.curve(), 60.0};
    ASSERT_TRUE(resolvent.unique(60.0));
    for (const double y : {-2.0, -0.1, 0.1, 0.5, 0.9, 1.1, 3.0}) {
        Resolvent::Memory memory;
        const double q = total(network, 60.0, y);
        const Solution first = resolvent.without_evaluation({60.0, q}, memory);
        EXPECT_NEAR(first.position, y, 2e-12);
        EXPECT_EQ(first.evaluations, 0);
        EXPECT_EQ(first.environment.extrapolated, y < 0.0 || y > 1.0);
        EXPECT_EQ(resolvent.without_evaluation({60.0, q}, memory).position, first.position);
        EXPECT_TRUE(std::isnan(resolvent.without_evaluation({61.0, q}, memory).position));
        EXPECT_TRUE(std::isnan(resolvent.without_evaluation({60.0, infinity}, memory).position));
        EXPECT_EQ(resolvent.solve(network, {}, {60.0, q}, y).evaluations, 0);
        const Solution other = resolvent.solve(network, {}, {61.0, q + y}, y);
        EXPECT_GT(other.evaluations, 0);
        EXPECT_NEAR(other.position, y, 1e-11);
    }
}

TEST(Branches, AreNoneIfTheFunctionFallsOutsideTheDomain) {
    // Continued with its slope at the edge: 2 - 1.5 = 0.5 falls with p = -1, and rises with p = 0.
    const WaveletNetwork line{{1, {}, {}, {}, {0.5}, 0.0}, test::unit_domain()};
    EXPECT_EQ((Resolvent{line.curve(), -1.0}.branches().size()), 1U);
    EXPECT_EQ((Resolvent{line.curve(), -0.5}.branches().size()), 1U);
    EXPECT_GT((Resolvent{line.curve(), 0.0}.branches().size()), 3U - 1U);
    for (const bool above : {false, true}) {
        // The force falls on one side only.
        const PiecewiseForce falling{
            {1, {}, {}, {}, {0.5}, 0.0},     0.0, 1.0, false, {{infinity, above ? 0.5 : -2.0}},
            {{infinity, above ? -2.0 : 0.5}}};
        EXPECT_EQ((Resolvent{falling, 1.0}.branches().size()), 1U);
        EXPECT_EQ((Resolvent{falling, 2.0}.branches().size()), 1U);
        EXPECT_GT((Resolvent{falling, 2.5}.branches().size()), 2U);
    }
    // A periodic force needs p > 0.
    const Domain knob{{0.0}, {1.0}, Continuation::Linear, Continuation::Linear, 1.0};
    const WaveletNetwork periodic{{1, {10.0}, {0.5}, {1.0}, {0.0}, 0.0}, knob};
    EXPECT_EQ((Resolvent{periodic.curve(), 0.0}.branches().size()), 1U);
    EXPECT_EQ((Resolvent{periodic.curve(), -1.0}.branches().size()), 1U);
    EXPECT_GT((Resolvent{periodic.curve(), 0.5}.branches().size()), 1U);
}

// Short lines outside the domain, of which one falls: the falling line is not a branch.
TEST(Branches, OmitALineAlongWhichTheFunctionFalls) {
    const PiecewiseForce force{{1, {}, {}, {}, {0.5}, 0.25},
                               0.0,
                               1.0,
                               false,
                               {{0.5, -3.0}, {0.25, 1.0}, {infinity, 0.0}},
                               {{0.5, 2.0}, {0.25, -3.0}, {infinity, 1.0}}};
    const Resolvent resolvent{force, 1.0};
    std::vector<Branch> lines;
    for (const Branch& branch : resolvent.branches()) {
        if (branch.line_slope > 0.0) {
            lines.push_back(branch);
        }
    }
    ASSERT_EQ(lines.size(), 4U);
    // F(0) = 0.25 and F(1) = 1.75. Below: slopes -2 over 0.5, then 2 over 0.25, then 1. Above: 3 over 0.5, -2, 2.
    const std::vector<Interval> positions{{-infinity, -0.75}, {-0.75, -0.5}, {1.0, 1.5}, {1.75, infinity}};
    const std::vector<Interval> values{{-infinity, 0.75}, {0.75, 1.25}, {1.75, 3.25}, {2.75, infinity}};
    const std::vector<double> slopes{1.0, 2.0, 3.0, 2.0};
    for (std::size_t k = 0; k < 4; ++k) {
        EXPECT_EQ(lines[k].positions.lower, positions[k].lower);
        EXPECT_EQ(lines[k].positions.upper, positions[k].upper);
        EXPECT_EQ(lines[k].values.lower, values[k].lower);
        EXPECT_EQ(lines[k].values.upper, values[k].upper);
        EXPECT_EQ(lines[k].line_slope, slopes[k]);
    }
}

}  // namespace
}  // namespace palpate
