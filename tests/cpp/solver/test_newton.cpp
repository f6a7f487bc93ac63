// SPDX-License-Identifier: Apache-2.0
#include "palpate/solver/newton.hpp"
#include "special_values.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/model/network.hpp"
#include "support.hpp"

namespace palpate {
namespace {

using test::cases;
using test::Random;
using test::uniform;

using test::infinity;

TEST(LoadLineSolver, SolvesAnyUniqueLoadLineOfRandomNetworks) {
    Random random{21};
    for (int k = 0; k < cases(2000); ++k) {
        const WaveletNetwork network{test::random_network(random, static_cast<std::size_t>(k % 12)),
                                     test::unit_domain(Continuation::Free)};
        const double lowest =
            std::min(network.curve().slope_bounds().lower, -network.curve().extent().largest_force);
        const double p = -lowest + std::exp(uniform(random, -2.0, 8.0));
        const double q = uniform(random, -2.0, 2.0) * p;
        const Solution solution = LoadLineSolver{}.solve(network, {}, {p, q}, uniform(random, -2.0, 3.0));
        ASSERT_EQ(solution.status, Status::Ok) << "case " << k;
        const double residual = network.at(solution.position, {}).force + p * solution.position - q;
        EXPECT_NEAR(residual, 0.0, 1e-9 * (1.0 + std::abs(q) + p)) << "case " << k;
        EXPECT_LE(solution.evaluations, 40) << "case " << k;
    }
}

TEST(LoadLineSolver, NeedsOneEvaluationAtTheSolution) {
    const test::Spring spring{40.0};
    const Solution solution = LoadLineSolver{}.solve(spring, {}, {60.0, 50.0}, 0.5);
    EXPECT_EQ(solution.status, Status::Ok);
    EXPECT_EQ(solution.evaluations, 1);
    EXPECT_EQ(solution.position, 0.5);
}

TEST(LoadLineSolver, SolvesALineInTwoEvaluations) {
    const test::Spring spring{40.0};
    for (const double scale : {1e-8, 1.0, 1e8}) {
        const Solution solution = LoadLineSolver{}.solve(spring, {}, {60.0, 50.0 * scale}, -3.0 * scale);
        EXPECT_EQ(solution.evaluations, 2);
        EXPECT_NEAR(solution.position, 0.5 * scale, 1e-13 * scale + 1e-13);
    }
}

TEST(LoadLineSolver, StatusIsTheReasonOfTheEnd) {
    const WaveletNetwork network{{1, {20.0}, {0.5}, {1.0}, {2.0}, 0.0}, test::unit_domain()};
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(LoadLineSolver{}.solve(network, {}, {100.0, nan}, 0.0).status, Status::NonFinite);
    EXPECT_EQ(LoadLineSolver{}.solve(network, {}, {100.0, 50.0}, nan).status, Status::NonFinite);
    EXPECT_EQ(LoadLineSolver{}.solve(network, {}, {100.0, 1e308}, 1e308).status, Status::NonFinite);
    LoadLineSolver limited;
    limited.max_evaluations = 1;
    EXPECT_EQ(limited.solve(network, {}, {100.0, 50.0}, 0.0).status, Status::MaxIterations);
}

TEST(LoadLineSolver, ReportsNotUniqueOnAFallingBranch) {
    // The function f(y) + p y has the slope -2 + 1 < 0 for the model force f and the load line slope p: y = 0 is a
    // solution, but no stable one.
    const Solution solution = LoadLineSolver{}.solve(test::Spring{-2.0}, {}, {1.0, 0.0}, 0.0);
    EXPECT_EQ(solution.status, Status::NotUnique);
}

TEST(LoadLineSolver, FindsARootForAnySlopesInItsBracket) {
    const test::ClickAndWall object;
    Random random{23};
    for (int k = 0; k < cases(2000); ++k) {
        const LoadLine line{uniform(random, 0.5, 14.0), uniform(random, 0.0, 3.0)};
        const Solution solution = LoadLineSolver{}.solve(object, {}, line, uniform(random, -0.5, 0.7));
        const double residual =
            object.at(solution.position, {}).force + line.slope * solution.position - line.intercept;
        ASSERT_EQ(solution.status, Status::Ok) << line.slope << " " << line.intercept;
        ASSERT_NEAR(residual, 0.0, 1e-9) << line.slope << " " << line.intercept;
    }
}

// The solver starts at the previous solution, moves in the direction in which the residual approaches zero, and returns
// the first solution that it meets.
TEST(LoadLineSolver, EndsOnTheFirstRootInTheDirectionOfTheResidual) {
    // A force that falls with slope -15, more steeply than the load line rises (slope 5): up to three solutions.
    const test::ClickAndWall object;
    const double p = 5.0;
    LoadLineSolver solver;
    solver.longest_step = 0.005;
    solver.max_evaluations = 200;
    const auto residual = [&](double x, double q) { return object.at(x, {}).force + p * x - q; };
    Random random{22};
    int several = 0;
    for (int k = 0; k < cases(300); ++k) {
        const double start = uniform(random, 0.0, 0.4);
        const double q = uniform(random, 0.3, 2.2);
        const Solution solution = solver.solve(object, {}, {p, q}, start);
        ASSERT_EQ(solution.status, Status::Ok) << start << " " << q;
        const double direction = residual(start, q) < 0.0 ? 1.0 : -1.0;
        const double distance = direction * (solution.position - start);
        ASSERT_GE(distance, 0.0) << start << " " << q;
        for (double along = 0.0; along < distance - 1e-3; along += 1e-3) {
            ASSERT_LT(direction * residual(start + direction * along, q), 1e-9)
                << "a root was stepped over from " << start << " at q = " << q;
        }
        int roots = 0;
        for (double x = -0.5; x < 1.0; x += 1e-3) {
            roots += residual(x, q) < 0.0 && residual(x + 1e-3, q) >= 0.0 ? 1 : 0;
        }
        several += roots > 1 ? 1 : 0;
    }
    EXPECT_GT(several, 20) << "the case is about lines with several roots";
}

/// A virtual object that records the positions of its evaluations. `sample(k, y)` returns evaluation k, at position y.
template <class Sample>
struct Recorded {
    using State = Stateless;
    Sample sample;
    std::vector<double>* visited;

    [[nodiscard]] EnvironmentSample at(double y, const State& /*stateless*/) const noexcept {
        visited->push_back(y);
        return sample(visited->size() - 1, y);
    }
    void advance(double /*y*/, State& /*stateless*/) const noexcept {}
    [[nodiscard]] State start(double /*y*/) const noexcept { return {}; }
};
template <class Sample>
Recorded(Sample, std::vector<double>*) -> Recorded<Sample>;

// Forces and slopes are given for each evaluation, with p = q = 0, so the residual is the force. All numbers are exact.
TEST(LoadLineSolver, TakesNewtonStepsUnlessTheyFailToHalveTheResidualOrLeaveTheBracket) {
    struct Step {
        double force;
        double slope;
        double next;  ///< position after this step
    };
    const std::vector<Step> steps{
        {-1.0, 1.0, 1.0},                // Newton's step.
        {-0.75, 1.0, 3.0},               // The residual is not halved: twice the last step.
        {-0.375, 1.0, 3.375},            // Exactly halved: Newton's step.
        {0.25, 1.0, 3.1875},             // A bracket from 3 to 3.375, the residual is not halved: its middle.
        {-0.0625, 1.0, 3.25},            // Newton's step inside the bracket from 3.1875 to 3.375.
        {0.03125, 0.5, 3.21875},         // Newton's step ends at the lower end of the bracket: the middle.
        {-0.015625, 0.5, 3.234375},      // At the upper end: the middle.
        {0.0078125, -1.0, 3.2265625},    // A falling residual: the middle.
        {0.00390625, 2.0, 3.224609375},  // Exactly halved: Newton's step.
        {0.00390625, 1.0, 3.2216796875},  // The middle between 3.21875 and 3.224609375.
        {0.0, 1.0, 0.0},
    };
    std::vector<double> visited;
    const Recorded object{
        [&](std::size_t k, double) { return EnvironmentSample{steps.at(k).force, steps.at(k).slope}; },
        &visited};
    const Solution solution = LoadLineSolver{}.solve(object, {}, {0.0, 0.0}, 0.0);
    EXPECT_EQ(solution.status, Status::Ok);
    ASSERT_EQ(visited.size(), steps.size());
    EXPECT_EQ(solution.evaluations, static_cast<int>(steps.size()));
    EXPECT_EQ(solution.position, visited.back());
    for (std::size_t k = 0; k + 1 < steps.size(); ++k) {
        EXPECT_EQ(visited[k + 1], steps[k].next) << k;
    }
}

TEST(LoadLineSolver, WalksWithDoublingStepsWhereTheResidualFalls) {
    for (const double direction : {1.0, -1.0}) {
        for (const double slope : {-3.0, -1.0}) {  // slope of the residual: -2 and exactly 0
            for (const double start : {0.0, 3.0, -2.0}) {
                for (const double longest : {infinity, 0.25}) {
                    LoadLineSolver solver;
                    solver.max_evaluations = 40;
                    solver.longest_step = longest;
                    std::vector<double> visited;
                    const Recorded object{[&](std::size_t, double y) {
                                              return EnvironmentSample{
                                                  -direction - y - (slope + 1.0) * (start - y), slope};
                                          },
                                          &visited};
                    const Solution solution = solver.solve(object, {}, {1.0, 0.0}, start);
                    EXPECT_EQ(solution.status, Status::MaxIterations);
                    EXPECT_EQ(solution.evaluations, 40);
                    ASSERT_EQ(visited.size(), 40U);
                    double step = 1e-3 * (1e-3 + std::abs(start));
                    for (std::size_t k = 1; k < visited.size(); ++k) {
                        ASSERT_NEAR(direction * (visited[k] - visited[k - 1]), std::min(step, longest),
                                    1e-12 + 1e-6 * std::min(step, longest))
                            << k;
                        step *= 2.0;
                    }
                }
            }
        }
    }
}

TEST(LoadLineSolver, AcceptsTheToleratedResidualAndNoLargerOne) {
    const auto evaluations = [](LoadLineSolver solver, double force, double slope, LoadLine line, double y) {
        std::vector<double> visited;
        const Recorded object{[&](std::size_t k, double) {
                                  return k == 0 ? EnvironmentSample{force, slope}
                                                : EnvironmentSample{0.0,
                                                                    std::numeric_limits<double>::quiet_NaN()};
                              },
                              &visited};
        return solver.solve(object, {}, line, y).evaluations;
    };
    constexpr double epsilon = std::numeric_limits<double>::epsilon();
    const auto above = [](double x) { return std::nextafter(x, infinity * x); };
    // |residual / slope| <= tolerance (1 + |y|)
    LoadLineSolver solver;
    solver.tolerance = 0x1p-40;
    for (const double y : {0.0, 3.0, -3.0}) {
        for (const double slope : {0.5, 8.0, -8.0}) {
            for (const double sign : {1.0, -1.0}) {
                const double limit = sign * 0x1p-40 * (1.0 + std::abs(y)) * std::abs(slope);
                EXPECT_EQ(evaluations(solver, limit, slope, {0.0, 0.0}, y), 1) << y << " " << slope;
                EXPECT_EQ(evaluations(solver, above(limit), slope, {0.0, 0.0}, y), 2) << y << " " << slope;
            }
        }
    }
    // |residual| <= 4 epsilon (|p y| + |q|): the rounding error of the residual
    solver.tolerance = 0.0;
    for (const LoadLine line :
         {LoadLine{2.0, 0.0}, LoadLine{0.0, -3.0}, LoadLine{-1.0, 1.5}, LoadLine{1.0, -1.5}}) {
        const double sum = line.slope * 1.5 - line.intercept;
        ASSERT_EQ(std::abs(sum), 3.0);
        for (const double sign : {1.0, -1.0}) {
            EXPECT_EQ(evaluations(solver, -sum + sign * 12.0 * epsilon, 9.0, line, 1.5), 1);
            EXPECT_EQ(evaluations(solver, -sum + sign * 14.0 * epsilon, 9.0, line, 1.5), 2);
        }
    }
}

TEST(LoadLineSolver, EndsAtAJumpWhenTheBracketIsAsShortAsTheTolerance) {
    for (const double jump : {0.3, 40.0}) {
        std::vector<double> visited;
        const Recorded object{
            [&](std::size_t, double y) { return EnvironmentSample{y < jump ? -1.0 : 1.0, 0.5}; }, &visited};
        const Solution solution = LoadLineSolver{}.solve(object, {}, {0.0, 0.0}, 0.0);
        EXPECT_EQ(solution.status, Status::Ok);
        EXPECT_EQ(std::abs(solution.residual), 1.0);
        double low = -infinity;
        double high = infinity;
        for (const double y : visited) {
            (y < jump ? low : high) = y < jump ? std::max(low, y) : std::min(high, y);
        }
        EXPECT_LE(high - low, 1e-13 * (1.0 + jump));
        EXPECT_GT(high - low, 0.4e-13 * (1.0 + jump)) << "no unnecessary evaluation";
    }
}

TEST(LoadLineSolver, KeepsTheLastFiniteSolutionInItsMemory) {
    const test::Spring spring{40.0};
    WarmStart memory{0.25};
    EXPECT_EQ(memory.position, 0.25);
    EXPECT_EQ(LoadLineSolver{}.solve(spring, {}, {60.0, std::nan("")}, memory).status, Status::NonFinite);
    EXPECT_EQ(memory.position, 0.25);
    const Solution solution = LoadLineSolver{}.solve(spring, {}, {60.0, 50.0}, memory);
    EXPECT_EQ(solution.position, 0.5);
    EXPECT_EQ(memory.position, 0.5);
    EXPECT_EQ(LoadLineSolver{}.solve(spring, {}, {60.0, 50.0}, memory).evaluations, 1);
    EXPECT_FALSE(LoadLineSolver::unique(1e9));
    EXPECT_FALSE(LoadLineSolver::tabulated());
    // A slope that is not finite ends the search also if the force is finite.
    std::vector<double> visited;
    const Recorded object{[](std::size_t, double) { return EnvironmentSample{1.0, std::nan("")}; }, &visited};
    EXPECT_EQ(LoadLineSolver{}.solve(object, {}, {1.0, 0.0}, memory).status, Status::NonFinite);
    EXPECT_EQ(visited.size(), 1U);
}

TEST(LoadLineSolver, TreatsAnEndOfTheGivenBracketAsTheSolution) {
    // At y = 1 the residual y (2 - y) - 1 has a maximum of 0.
    const auto parabola = [](std::size_t, double y) {
        return EnvironmentSample{y * (2.0 - y) - 1.0, 2.0 - 2.0 * y};
    };
    std::vector<double> visited;
    const Recorded object{parabola, &visited};
    EXPECT_EQ(LoadLineSolver{}.solve(object, {}, {0.0, 0.0}, 1.0).status, Status::NotUnique);
    EXPECT_EQ(LoadLineSolver{}.solve(object, {}, {0.0, 0.0}, 1.0, Bracket{0.0, 1.0}).status, Status::Ok);
    LoadLineSolver hurried;
    hurried.max_evaluations = 1;
    EXPECT_EQ(hurried.solve(object, {}, {0.0, 0.0}, 0.5, Bracket{0.0, 1.0}).status, Status::MaxIterations);
    // A bracket exactly as long as the tolerance: its upper end is the solution.
    const Recorded high{[](std::size_t, double) { return EnvironmentSample{1.0, 1.0}; }, &visited};
    LoadLineSolver rough;
    rough.tolerance = 0x1p-10;
    EXPECT_EQ(rough.solve(high, {}, {0.0, 0.0}, 0.0, Bracket{-0x1p-10, 1.0}).evaluations, 1);
    EXPECT_EQ(rough.solve(high, {}, {0.0, 0.0}, 0.0, Bracket{-0x1.1p-10, 1.0}).evaluations, 2);
    // Newton's step from 0.875 would end outside the bracket.
    visited.clear();
    LoadLineSolver two;
    two.max_evaluations = 2;
    EXPECT_EQ(two.solve(object, {}, {0.0, 1.0}, 0.875, Bracket{0.0, 1.0}).status, Status::MaxIterations);
    EXPECT_EQ(visited, (std::vector<double>{0.875, 0.9375}));
}

}  // namespace
}  // namespace palpate
