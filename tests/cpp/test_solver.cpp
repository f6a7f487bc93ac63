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
        const double lowest = std::min(network.curve().slope_range().first, -network.curve().extent().largest_force);
        const double p = -lowest + std::exp(uniform(random, -2.0, 8.0));
        const double q = uniform(random, -2.0, 2.0) * p;
        const Solution solution = LoadLineSolver{}.solve(network, {}, {p, q}, uniform(random, -2.0, 3.0));
        ASSERT_EQ(solution.status, Status::Ok) << "case " << k;
        const double residual = network.at(solution.position, {}).force + p * solution.position - q;
        EXPECT_NEAR(residual, 0.0, 1e-9 * (1.0 + std::abs(q) + p)) << "case " << k;
        EXPECT_LE(solution.evaluations, 40) << "case " << k;
    }
}

TEST(LoadLineSolver, NeedsOneEvaluationWhereItAlreadyIs) {
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

TEST(LoadLineSolver, SaysWhyItStopped) {
    const WaveletNetwork network{{1, {20.0}, {0.5}, {1.0}, {2.0}, 0.0}, test::unit_domain()};
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(LoadLineSolver{}.solve(network, {}, {100.0, nan}, 0.0).status, Status::NonFinite);
    EXPECT_EQ(LoadLineSolver{}.solve(network, {}, {100.0, 50.0}, nan).status, Status::NonFinite);
    EXPECT_EQ(LoadLineSolver{}.solve(network, {}, {100.0, 1e308}, 1e308).status, Status::NonFinite);
    LoadLineSolver hasty;
    hasty.max_evaluations = 1;
    EXPECT_EQ(hasty.solve(network, {}, {100.0, 50.0}, 0.0).status, Status::MaxIterations);
}

// spec section 5: "from the previous solution, the first root met in the direction of -residual"
TEST(LoadLineSolver, FollowsTheBranchThatASlowMotionWould) {
    // A snap-through whose falling flank (-15) is steeper than the load line rises (5): three roots in between.
    const test::ClickAndWall object;
    const double p = 5.0;
    LoadLineSolver solver;
    solver.longest_step = 0.005;
    double last = 0.0;
    double jump = 0.0;
    for (double q = 0.0; q <= 2.2; q += 1e-3) {
        const Solution solution = solver.solve(object, {}, {p, q}, last);
        ASSERT_EQ(solution.status, Status::Ok) << q;
        // The first root above the last solution: no sign change of the residual in between.
        for (double x = last + 1e-4; x < solution.position - 1e-4; x += 1e-4) {
            ASSERT_LT(object.at(x, {}).force + p * x - q, 1e-6) << "a root was stepped over at " << x;
        }
        jump = std::max(jump, solution.position - last);
        last = solution.position;
    }
    EXPECT_GT(jump, 0.01) << "the load line must have snapped through";
}

}  // namespace
}  // namespace palpate
