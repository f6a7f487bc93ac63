// SPDX-License-Identifier: Apache-2.0
#include "palpate/solver/limited_resolvent.hpp"
#include "special_values.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <gtest/gtest.h>

#include "palpate/model/compiled_network.hpp"
#include "palpate/model/hysteresis.hpp"
#include "palpate/model/network.hpp"
#include "palpate/rendering/compensated.hpp"
#include "palpate/rendering/massless.hpp"
#include "palpate/solver/resolvent.hpp"
#include "palpate/solver/sliding_resolvent.hpp"
#include "support.hpp"

namespace palpate {
namespace {

using test::cases;
using test::Random;
using test::uniform;

using test::infinity;

/// Finds the only position y with c(f(y)) + p y = q by bisection; c is the force limit, p y the load line.
template <class E>
double bisected(const LimitedEnvironment<E>& object, const typename E::State& state, LoadLine line) {
    double low = (line.intercept - object.force_limit()) / line.slope;
    double high = (line.intercept + object.force_limit()) / line.slope;
    for (int k = 0; k < 100; ++k) {
        const double middle = 0.5 * (low + high);
        (object.at(middle, state).force + line.slope * middle < line.intercept ? low : high) = middle;
    }
    return 0.5 * (low + high);
}

/// Applies random jumps of the position and returns the number of steps in which the force limit is active.
template <class E, class Solver>
int expect_the_bisected_root(Random& random, const LimitedEnvironment<E>& object,
                             const LimitedResolvent<Solver>& solver, double p) {
    auto state = object.start(0.5);
    typename LimitedResolvent<Solver>::Memory memory{0.5};
    int limited = 0;
    for (int k = 0; k < 300; ++k) {
        const LoadLine line{p, uniform(random, -0.5, 1.5) * p};
        const Solution solution = solver.solve(object, state, line, memory);
        EXPECT_EQ(solution.status, Status::Ok) << k;
        EXPECT_NEAR(solution.position, bisected(object, state, line), 5e-12 + 1e-12 * p) << k;
        EXPECT_LE(std::abs(solution.environment.force), object.force_limit());
        EXPECT_NEAR(solution.environment.force, line.intercept - p * solution.position,
                    1e-11 * (1.0 + p) * (1.0 + std::abs(solution.position)));
        EXPECT_EQ(solution.environment.extrapolated, object.at(solution.position, state).extrapolated);
        limited += std::abs(solution.environment.force) == object.force_limit() ? 1 : 0;
        object.advance(solution.position, state);
    }
    return limited;
}

TEST(LimitedEnvironment, ClipsTheForceAndItsSlope) {
    const LimitedEnvironment object{test::Spring{40.0}, 2.0};
    EXPECT_EQ(object.at(0.04, {}).force, 1.6);
    EXPECT_EQ(object.at(0.04, {}).slope, 40.0);
    EXPECT_EQ(object.at(0.06, {}).force, 2.0);
    EXPECT_EQ(object.at(0.06, {}).slope, 0.0);
    EXPECT_EQ(object.at(-1.0, {}).force, -2.0);
    EXPECT_TRUE(std::isnan(object.at(std::nan(""), {}).force));
}

TEST(LimitedResolvent, FindsTheOnlyRootOfALimitedNetwork) {
    Random random{81};
    int limited = 0;
    for (int k = 0; k < cases(30); ++k) {
        const WaveletNetwork network{test::random_network(random, static_cast<std::size_t>(1 + k % 12)),
                                     test::unit_domain(Continuation::Free)};
        const Interval force = network.curve().value_bounds();
        const double p = (4.0 * force.largest() - network.curve().slope_bounds().lower) *
                         std::exp(uniform(random, 0.0, 2.0));
        const CompiledNetwork compiled{network};
        const LimitedEnvironment object{compiled, uniform(random, 0.2, 0.8) * force.largest()};
        const LimitedResolvent solver{Resolvent{network.curve(), p}};
        ASSERT_TRUE(solver.unlimited().unique(p));
        limited += expect_the_bisected_root(random, object, solver, p);
    }
    EXPECT_GT(limited, cases(30) * 30);
    EXPECT_LT(limited, cases(30) * 270);
}

TEST(LimitedResolvent, FindsTheOnlyRootOfALimitedHysteresis) {
    Random random{82};
    int limited = 0;
    for (int k = 0; k < cases(30); ++k) {
        const NetworkParameters parameters = test::random_network(random, 6);
        const HysteresisParameters hysteresis{std::vector<double>(6, 0.02), 0.0, 0.5};
        const HysteresisNetwork pair{parameters, hysteresis, test::unit_domain(), 0.02};
        const Interval force = pair.force().value_bounds();
        const double p = (4.0 * force.largest() - pair.force().slope_bounds().lower + 25.0) *
                         std::exp(uniform(random, 0.0, 2.0));
        const LimitedEnvironment object{CompiledHysteresis{pair},
                                        uniform(random, 0.2, 0.8) * force.largest()};
        const LimitedResolvent solver{SlidingResolvent{pair, p}};
        ASSERT_TRUE(solver.unlimited().unique(p));
        limited += expect_the_bisected_root(random, object, solver, p);
    }
    EXPECT_GT(limited, cases(30) * 30);
    EXPECT_LT(limited, cases(30) * 270);
}

TEST(LimitedResolvent, SolvesACompensatedEnvironment) {
    Random random{83};
    const WaveletNetwork network{test::random_network(random, 7), test::unit_domain()};
    const double stiffness = 1.3 * network.curve().slope_bounds().largest();
    const double p = 1.4 * stiffness;
    const LimitedEnvironment object{Compensated{CompiledNetwork{network}, stiffness},
                                    0.5 * network.curve().value_bounds().largest()};
    const LimitedResolvent solver{CompensatedResolvent{piecewise(network.curve()), stiffness, p}};
    ASSERT_TRUE(solver.unlimited().unique(p));
    EXPECT_GT(expect_the_bisected_root(random, object, solver, p), 30);
}

TEST(LimitedResolvent, FindsARootOfALoadLineThatIsNotUnique) {
    Random random{84};
    int falling = 0;
    for (int k = 0; k < cases(30); ++k) {
        const WaveletNetwork network{test::random_network(random, 6), test::unit_domain()};
        const double p = -0.6 * network.curve().slope_bounds().lower;
        if (!(p > 0.0)) {
            continue;
        }
        ++falling;
        const double largest = network.curve().value_bounds().largest();
        const LimitedEnvironment object{network, uniform(random, 0.3, 0.9) * largest};
        const LimitedResolvent solver{Resolvent{network.curve(), p}};
        LimitedResolvent<Resolvent>::Memory memory{0.5};
        double q = object.at(0.5, {}).force + 0.5 * p;
        for (int j = 0; j < 300; ++j) {
            q += uniform(random, -0.05, 0.05) * p;
            const Solution solution = solver.solve(object, {}, {p, q}, memory);
            ASSERT_EQ(solution.status, Status::Ok) << k << " " << j;
            ASSERT_NEAR(object.at(solution.position, {}).force + p * solution.position, q, 1e-9 * (1.0 + p));
        }
    }
    EXPECT_GT(falling, cases(30) / 2);
}

TEST(LimitedResolvent, NeverExceedsTheLimitBehindAMasslessCoupling) {
    // A spring of 200 N/m behind a coupling of 300 N/m and 0.05 N s/m, on a device with a force limit of 2 N.
    const LimitedEnvironment object{test::Spring{200.0}, 2.0};
    const VirtualCoupling coupling{300.0, 0.05};
    const PiecewiseForce spring{
        {1, {}, {}, {}, {200.0}, 0.0}, -0.1, 0.1, false, {{infinity, 200.0}}, {{infinity, 200.0}}};
    const double p = Massless<test::Spring>::load_line_slope(coupling, 1e-3);
    Massless structure{object, coupling, 1e-3, LimitedResolvent{CertifiedSolver{spring, p}}};
    structure.reset(0.0);
    double last_position = 0.0;
    double last_device = 0.0;
    int limited = 0;
    for (int k = 1; k < 2000; ++k) {
        const double device = 0.05 * std::sin(0.01 * k);
        const Rendered rendered = structure.step(device);
        ASSERT_EQ(rendered.status, std::abs(rendered.force) < 2.0 ? Status::Ok : Status::Limited);
        const double y = rendered.environment_position;
        ASSERT_LE(std::abs(rendered.force), 2.0);
        ASSERT_NEAR(rendered.force, std::clamp(200.0 * y, -2.0, 2.0), 1e-9);
        ASSERT_NEAR(rendered.force,
                    coupling.force(device - y, ((device - last_device) - (y - last_position)) / 1e-3), 1e-9);
        limited += std::abs(rendered.force) == 2.0 ? 1 : 0;
        last_position = y;
        last_device = device;
    }
    EXPECT_GT(limited, 500);
}

TEST(LimitedResolvent, RefusesALoadLineThatIsNotFinite) {
    Random random{85};
    const WaveletNetwork network{test::random_network(random, 5), test::unit_domain()};
    const LimitedEnvironment object{network, 1.0};
    const LimitedResolvent solver{Resolvent{network.curve(), 2000.0}};
    LimitedResolvent<Resolvent>::Memory memory{0.5};
    for (const double q : {std::nan(""), infinity}) {
        EXPECT_EQ(solver.solve(object, {}, {2000.0, q}, memory).status, Status::NonFinite);
    }
    EXPECT_EQ(solver.solve(object, {}, {2000.0, 1000.0}, memory).status, Status::Ok);
}

// A spring of 4 N/m, the force limit 2 N and the load line slope 4 N/m: all numbers are exact.
TEST(LimitedResolvent, AddsOneEvaluationOnlyIfTheLimitIsActive) {
    const LimitedEnvironment object{test::Spring{4.0}, 2.0};
    const PiecewiseForce spring{
        {1, {}, {}, {}, {4.0}, 0.0}, -1.0, 1.0, false, {{infinity, 4.0}}, {{infinity, 4.0}}};
    using Solver = LimitedResolvent<CertifiedSolver>;
    for (const double sign : {1.0, -1.0}) {
        const Solver solver{CertifiedSolver{spring, 4.0}};
        EXPECT_FALSE(solver.tabulated());
        const auto solutions = [&](double q) {
            Solver::Memory memory{0.0};
            CertifiedSolver::Memory unlimited{0.0};
            return std::pair{solver.solve(object, {}, {4.0, q}, memory),
                             solver.unlimited().solve(object.unlimited(), {}, {4.0, q}, unlimited)};
        };
        for (const double q : {sign * 2.0, sign * 4.0}) {  // the force is 1 N, and exactly 2 N
            const auto [limited, unlimited] = solutions(q);
            EXPECT_EQ(limited.position, q / 8.0);
            EXPECT_EQ(limited.environment.force, q / 2.0);
            EXPECT_EQ(limited.environment.slope, 4.0);
            EXPECT_EQ(limited.environment.energy, unlimited.environment.energy);
            EXPECT_EQ(limited.evaluations, unlimited.evaluations);
        }
        const auto [limited, unlimited] = solutions(sign * 6.0);
        EXPECT_EQ(limited.position, sign * 1.0);
        EXPECT_EQ(limited.environment.force, sign * 2.0);
        EXPECT_EQ(limited.environment.slope, 0.0);
        EXPECT_TRUE(std::isnan(limited.environment.energy));
        EXPECT_EQ(limited.residual, 0.0);
        EXPECT_EQ(limited.status, Status::Ok);
        EXPECT_EQ(limited.evaluations, unlimited.evaluations + 1);
    }
}

TEST(LimitedResolvent, UsesTheProofForSmallSlopesOfTheLoadLineButNotForZero) {
    const LimitedEnvironment object{test::Spring{4.0}, 2.0};
    const PiecewiseForce spring{
        {1, {}, {}, {}, {4.0}, 0.0}, -1.0, 1.0, false, {{infinity, 4.0}}, {{infinity, 4.0}}};
    using Solver = LimitedResolvent<CertifiedSolver>;
    const Solver solver{CertifiedSolver{spring, 0.0}};
    ASSERT_TRUE(solver.unlimited().unique(0.0));
    Solver::Memory memory{0.0};
    // y = (3 - 2) / 0.25 m; the residual of a proved solution is not computed.
    const Solution proved = solver.solve(object, {}, {0.25, 3.0}, memory);
    EXPECT_EQ(proved.position, 4.0);
    EXPECT_LE(proved.evaluations, 5);
    EXPECT_EQ(memory.newton.position, 0.0) << "no search";
    // With p = 0 no position has a force above the limit.
    const Solution none = solver.solve(object, {}, {0.0, 3.0}, memory);
    EXPECT_NE(none.status, Status::Ok);
    const Solution inside = solver.solve(object, {}, {0.0, 1.0}, memory = Solver::Memory{0.125});
    EXPECT_EQ(inside.status, Status::Ok);
    EXPECT_EQ(inside.position, 0.25);
    EXPECT_EQ(memory.newton.position, 0.25) << "a search, which starts at the last solution";
}

TEST(LimitedResolvent, ReturnsTheUnlimitedResultIfItIsNotFinite) {
    const LimitedEnvironment object{test::Spring{4.0}, 2.0};
    const PiecewiseForce spring{
        {1, {}, {}, {}, {4.0}, 0.0}, -1.0, 1.0, false, {{infinity, 4.0}}, {{infinity, 4.0}}};
    using Solver = LimitedResolvent<CertifiedSolver>;
    const Solver solver{CertifiedSolver{spring, 4.0}};
    Solver::Memory memory{0.75};  // with a force of 3 N, above the limit
    const Solution solution = solver.solve(object, {}, {4.0, infinity}, memory);
    EXPECT_EQ(solution.status, Status::NonFinite);
    EXPECT_EQ(solution.position, 0.75);
    EXPECT_FALSE(std::isfinite(solution.residual));
}

}  // namespace
}  // namespace palpate
