// SPDX-License-Identifier: Apache-2.0
#include "palpate/solver/newton.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "palpate/model/network.hpp"
#include "support.hpp"

namespace palpate {
namespace {

using test::cases;
using test::Random;
using test::uniform;

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

}  // namespace
}  // namespace palpate
