// SPDX-License-Identifier: Apache-2.0
#include "palpate/rendering/make_structure.hpp"
#include "palpate/solver/sliding_resolvent.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/model/compiled_network.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/rendering/compensated.hpp"
#include "palpate/rendering/massless.hpp"
#include "palpate/rendering/scheme.hpp"
#include "support.hpp"

namespace palpate {
namespace {

using test::cases;
using test::Random;
using test::uniform;

/// Returns a random mean force and hysteresis over [0, 1]; the hysteresis is one or two bumps above a constant.
HysteresisNetwork random_sliding_pair(Random& random, std::size_t wavelets, double play_radius,
                                      Continuation continuation = Continuation::Free) {
    const NetworkParameters network = test::random_network(random, wavelets);
    HysteresisParameters hysteresis{std::vector<double>(wavelets, 0.0), 0.0, uniform(random, 0.3, 1.0)};
    for (double& weight : hysteresis.weight) {
        weight = uniform(random, -0.2, 0.2) / static_cast<double>(wavelets);
    }
    return {network, hysteresis, test::unit_domain(continuation, continuation), play_radius};
}

/// Returns a slope p of the load line for which the solution is unique in both sliding directions of the play
/// operator, with a small or large margin.
double unique_slope(Random& random, const HysteresisNetwork& pair) {
    const double common = pair.force().slope_bounds().lower;
    const double hysteresis = pair.hysteresis_force().slope_bounds().largest();
    const double edges =
        4.0 * pair.force().value_bounds().largest() + 50.0 * pair.hysteresis_force().value_bounds().largest();
    return std::max(hysteresis - common, edges) * std::exp(uniform(random, 0.1, 2.0));
}

// A motion that presses, releases and reverses at any position, with the play operator at rest or sliding, and past
// both edges of the domain.
TEST(SlidingResolvent, AgreesWithNewton) {
    Random random{71};
    int steps = 0;
    int by_table = 0;
    for (int k = 0; k < cases(30); ++k) {
        const HysteresisNetwork pair =
            random_sliding_pair(random, static_cast<std::size_t>(1 + k % 12), 0.01,
                                k % 2 == 0 ? Continuation::Free : Continuation::Linear);
        const double p = unique_slope(random, pair);
        const SlidingResolvent resolvent{pair, p};
        ASSERT_TRUE(resolvent.tabulated()) << k;
        EXPECT_LE(resolvent.position_error(), 1e-12);
        const CompiledHysteresis compiled{pair};
        auto state = compiled.start(0.5);
        SlidingResolvent::Memory memory{0.5};
        double wanted = 0.5;
        double speed = 0.0;
        for (int j = 0; j < 1000; ++j) {
            speed = 0.95 * speed + uniform(random, -0.002, 0.002);
            wanted = std::clamp(wanted + speed, -0.2, 1.2);
            const LoadLine line{p, compiled.at(wanted, state).force + p * wanted};
            const Solution solution = resolvent.solve(compiled, state, line, memory);
            const Solution expected = LoadLineSolver{}.solve(pair, {state.play}, line, wanted + 0.003);
            ASSERT_EQ(solution.status, Status::Ok) << k << " " << j;
            ASSERT_EQ(expected.status, Status::Ok) << k << " " << j;
            ASSERT_NEAR(solution.position, expected.position, 5e-12 + 1e-12 * p) << k << " " << j;
            ASSERT_NEAR(solution.environment.force, expected.environment.force, 1e-11 * p * (1.0 + p))
                << k << " " << j;
            ASSERT_LE(solution.evaluations, 16);
            ++steps;
            by_table += solution.evaluations == 0 ? 1 : 0;
            compiled.advance(solution.position, state);
        }
    }
    EXPECT_GT(by_table, steps / 2);
}

TEST(SlidingResolvent, NeedsAtMostTwoEvaluationsWhileSticking) {
    Random random{72};
    const HysteresisNetwork pair = random_sliding_pair(random, 8, 0.02);
    const double p = unique_slope(random, pair);
    const SlidingResolvent resolvent{pair, p};
    ASSERT_TRUE(resolvent.tabulated());
    auto state = pair.start(0.5);
    SlidingResolvent::Memory memory{0.5};
    int evaluations = 0;
    constexpr int steps = 400;
    for (int j = 0; j < steps; ++j) {
        const double wanted = 0.5 + 0.015 * std::sin(0.05 * j);
        const Solution solution =
            resolvent.solve(pair, state, {p, pair.at(wanted, state).force + p * wanted}, memory);
        ASSERT_NEAR(solution.position, wanted, 1e-12);
        pair.advance(solution.position, state);
        evaluations += solution.evaluations;
    }
    EXPECT_LE(evaluations, 2 * steps);
    EXPECT_GT(evaluations, 0);
}

/// Returns the rounding error of the force f, and of the direction state s = (y - play) / r.
double rounding_of(const HysteresisNetwork& pair, double x) {
    constexpr double epsilon = std::numeric_limits<double>::epsilon();
    const double hysteresis = pair.hysteresis_force().value_bounds().largest();
    return jet_rounding(pair.force().parameters(), 1.4)[0] +
           jet_rounding(pair.hysteresis_force().parameters(), 1.4)[0] +
           8.0 * epsilon * (std::abs(x) + 1.0) * hysteresis / pair.play_radius();
}

// Random jumps of the right-hand side q and of the play operator. Load lines exceed the slope that makes the solution
// unique by 1e-4 to 1. The full test tier tests 10^6 steps.
TEST(SlidingResolvent, EndsWithinFourEvaluationsNearAFold) {
    constexpr double epsilon = std::numeric_limits<double>::epsilon();
    Random random{76};
    long steps = 0;
    long evaluations = 0;
    long sticking = 0;
    std::vector<std::size_t> cells;
    for (int k = 0; k < cases(10); ++k) {
        const auto continuation = k % 2 == 0 ? Continuation::Free : Continuation::Linear;
        Domain domain = test::unit_domain(continuation, continuation);
        if (k % 5 == 4) {
            domain = {{0.1}, {1.1}, Continuation::Linear, Continuation::Linear, 1.0};
        }
        const auto wavelets = static_cast<std::size_t>(1 + k % 12);
        // Every seventh hysteresis has negative values; the model format allows them, but a passive object cannot have
        // them.
        HysteresisParameters hysteresis{std::vector<double>(wavelets), 0.0,
                                        uniform(random, k % 7 == 6 ? -0.1 : 0.3, k % 7 == 6 ? 0.1 : 1.0)};
        for (double& weight : hysteresis.weight) {
            weight = uniform(random, -0.2, 0.2) / static_cast<double>(wavelets);
        }
        const double radius = k % 7 == 6 ? 0.1 : std::exp(uniform(random, -9.0, 0.0));
        const HysteresisNetwork pair{test::random_network(random, wavelets), hysteresis, domain, radius};
        const double gain = std::max(0.0, -pair.hysteresis_force().value_bounds().lower) / radius;
        const double fall =
            std::max(test::steepest_fall(piecewise(pair, 1.0)), test::steepest_fall(piecewise(pair, -1.0))) +
            gain;
        if (!(fall > 0.0)) {
            continue;
        }
        const double p = fall * (1.0 + std::exp(uniform(random, std::log(1e-4), 0.0)));
        const SlidingResolvent resolvent{pair, p};
        ASSERT_TRUE(resolvent.unique(p)) << k << " p / fall = " << p / fall;
        cells.push_back(resolvent.solver().cells());
        SlidingResolvent::Memory memory{0.5};
        CertifiedSolver::Memory alone{0.5};
        auto state = pair.start(0.5);
        for (int j = 0; j < 500; ++j) {
            // A jump of q together with the play operator, a jump to either side of the position at which the play
            // operator starts to slide, or a short distance.
            if (j % 3 == 0) {
                state = pair.start(uniform(random, -0.3, 1.4));
            }
            const double turn = state.play + (j % 2 == 0 ? radius : -radius);
            const double offset = (j % 5 < 2 ? 1.0 : -1.0) * std::exp(uniform(random, -25.0, -3.0));
            const double x = j % 4 == 0   ? uniform(random, -0.3, 1.4)
                             : j % 4 == 1 ? turn + radius * offset
                                          : state.play + radius * uniform(random, -1.5, 1.5);
            const double q = pair.at(x, state).force + p * x;
            for (const Solution& solution : {resolvent.solve(pair, state, {p, q}, memory),
                                             resolvent.solver().solve(pair, state, {p, q}, alone)}) {
                ASSERT_EQ(solution.status, Status::Ok) << k << " " << j;
                ASSERT_LE(solution.evaluations, 4) << k << " " << j;
                const EnvironmentSample there = pair.at(solution.position, state);
                const double steepest = p + std::abs(there.slope) + hysteresis.bias / radius;
                const double residual = there.force + p * solution.position - q;
                ASSERT_LE(std::abs(residual), 1.1e-12 * steepest + 2.0 * rounding_of(pair, x) +
                                                  8.0 * epsilon * (std::abs(there.force) + std::abs(q)))
                    << k << " " << j << " " << x << " " << solution.position;
                ++steps;
                evaluations += solution.evaluations;
            }
            sticking += std::abs(x - state.play) < radius ? 2 : 0;
        }
    }
    ASSERT_GT(steps, cases(7) * 1000);
    EXPECT_GT(sticking, steps / 4);
    EXPECT_LT(sticking, steps * 3 / 4);
    std::sort(cells.begin(), cells.end());
    RecordProperty("steps", std::to_string(steps));
    RecordProperty("evaluations_per_step", std::to_string(static_cast<double>(evaluations) / steps));
    RecordProperty("cells_median", std::to_string(cells[cells.size() / 2]));
    RecordProperty("cells_most", std::to_string(cells.back()));
    EXPECT_LE(cells.back(), 2000U);
}

TEST(SlidingResolvent, UsesNewtonIfTheLoadLineIsNotUnique) {
    Random random{73};
    const HysteresisNetwork pair = random_sliding_pair(random, 8, 0.01);
    const double p = -0.5 * pair.force().slope_bounds().lower;
    ASSERT_GT(p, 0.0);
    const SlidingResolvent resolvent{pair, p};
    EXPECT_FALSE(resolvent.tabulated());
    SlidingResolvent::Memory memory{0.4};
    const auto state = pair.start(0.4);
    const double q = 1.1 * p;
    const Solution solution = resolvent.solve(pair, state, {p, q}, memory);
    EXPECT_NEAR(pair.at(solution.position, state).force + p * solution.position, q, 1e-9 * (1.0 + p));
    const SlidingResolvent::Memory before = memory;
    EXPECT_EQ(resolvent.solve(pair, state, {p, std::nan("")}, memory).status, Status::NonFinite);
    EXPECT_EQ(memory.newton.position, before.newton.position);
}

/// Checks that two structures render equal forces along the same motion.
template <class S, class T>
void expect_same_rendering(Random& random, S structure, T reference, double tolerance) {
    structure.reset(0.4);
    reference.reset(0.4);
    double x = 0.4;
    double speed = 0.0;
    for (int k = 0; k < 500; ++k) {
        speed = 0.97 * speed + uniform(random, -0.001, 0.001);
        x = std::clamp(x + speed, -0.1, 1.1);
        const Rendered rendered = structure.step(x);
        const Rendered expected = reference.step(x);
        ASSERT_EQ(rendered.status, expected.status) << k;
        ASSERT_NEAR(rendered.force, expected.force, tolerance) << k;
        ASSERT_NEAR(rendered.environment_position, expected.environment_position, tolerance) << k;
    }
}

TEST(CompensatedResolvent, RendersLikeNewton) {
    Random random{74};
    for (int k = 0; k < cases(10); ++k) {
        const WaveletNetwork network{test::random_network(random, static_cast<std::size_t>(1 + k % 9)),
                                     test::unit_domain()};
        const double stiffness = 1.3 * std::max(1.0, network.curve().slope_bounds().largest());
        const VirtualCoupling coupling{stiffness, k % 3 == 0 ? 0.0 : 2e-4 * stiffness};
        const Compensated plain{network, stiffness};
        const CompiledNetwork network_compiled{network};
        const Compensated compiled{network_compiled, stiffness};
        const Inertia inertia{1e-5 * stiffness, 2e-3 * stiffness};
        using S = Compensated<CompiledNetwork>;
        const auto resolvent = [&](double p) {
            CompensatedResolvent solver{piecewise(network.curve()), stiffness, p};
            EXPECT_TRUE(solver.tabulated());
            return solver;
        };
        const double massless = Massless<S>::load_line_slope(coupling, 1e-3);
        const double implicit = Implicit<S>::load_line_slope(inertia, coupling, 1e-3);
        expect_same_rendering(random, Massless{compiled, coupling, 1e-3, resolvent(massless)},
                              Massless{plain, coupling, 1e-3}, 1e-10 * stiffness);
        expect_same_rendering(random, Implicit{compiled, inertia, coupling, 1e-3, resolvent(implicit)},
                              Implicit{plain, inertia, coupling, 1e-3}, 1e-9 * stiffness);
    }
}

TEST(Scheme, TablesRenderTheSameForceAsTheNetwork) {
    Random random{75};
    for (int k = 0; k < cases(10); ++k) {
        const NetworkParameters network = test::random_network(random, static_cast<std::size_t>(2 + k));
        const Domain domain = test::unit_domain(Continuation::Free);
        const WaveletNetwork plain{network, domain};
        const double steepest = plain.curve().slope_bounds().largest();
        Scheme scheme;
        scheme.coupling = {1.5 * steepest, 3e-4 * steepest};
        scheme.inertia = {1e-4 * steepest, 2e-2 * steepest};
        const ForceModel model{network, domain};
        const auto compare = [&](const auto& reference, const char* solver) {
            ASSERT_EQ(solver_name(model, scheme, 1e-3).value_or("none"), solver);
            expect_same_rendering(random, make_structure(model, scheme, 1e-3, 1e9), reference,
                                  1e-8 * steepest);
        };
        scheme.structure = StructureKind::Direct;
        compare(Direct{plain}, "none");
        scheme.structure = StructureKind::Massless;
        compare(Massless{plain, scheme.coupling, 1e-3}, "table");
        scheme.structure = StructureKind::Implicit;
        compare(Implicit{plain, scheme.inertia, scheme.coupling, 1e-3}, "table");
        scheme.structure = StructureKind::EnergyConsistent;
        compare(EnergyConsistent{plain, scheme.inertia, scheme.coupling, 1e-3, 1e-2 * model.finest_width()},
                "table");
    }
}

/// Returns a hysteresis network over [0, 1] whose hysteresis has the slope `linear`, apart from a bump.
HysteresisNetwork sloped_pair(double linear, double bias, double radius) {
    const NetworkParameters network{1, {9.0, 14.0}, {0.3, 0.7}, {0.5, -0.4}, {2.0}, 0.1};
    return {network, {{0.15, -0.12}, linear, bias}, test::unit_domain(), radius};
}

TEST(SlidingResolvent, HasTheTablesOfBothSlidingDirections) {
    const HysteresisNetwork pair = sloped_pair(0.0, 0.5, 0.01);
    const double p = 200.0;
    const SlidingResolvent both{pair, p};
    const Resolvent press{piecewise(pair, 1.0), p};
    const Resolvent release{piecewise(pair, -1.0), p};
    ASSERT_TRUE(both.tabulated());
    EXPECT_EQ(both.cells(), press.cells() + release.cells());
    EXPECT_EQ(both.position_error(), std::max(press.position_error(), release.position_error()));
    EXPECT_NE(press.position_error(), release.position_error());
    EXPECT_TRUE(both.unique(p));
    EXPECT_FALSE(both.unique(std::nextafter(p, 0.0)));
}

TEST(SlidingResolvent, IsTabulatedOnlyIfEveryLoadLineIsUniqueAndBothDirectionsHaveTables) {
    // F rises by about 202 -+ 20 N over the domain. The widest cells have the width 1 N, so that between 182 and 222
    // cells are needed.
    const double p = 200.0;
    int only_press = 0;
    int only_release = 0;
    for (const double linear : {20.0, -20.0}) {
        const HysteresisNetwork pair = sloped_pair(linear, 0.5, 0.2);
        for (const std::size_t most : {150U, 200U, 250U, 8192U}) {
            const ResolventOptions options{1e-12, most};
            const SlidingResolvent both{pair, p, options};
            const bool press = Resolvent{piecewise(pair, 1.0), p, options}.tabulated();
            const bool release = Resolvent{piecewise(pair, -1.0), p, options}.tabulated();
            EXPECT_EQ(both.tabulated(), press && release) << most;
            only_press += press && !release ? 1 : 0;
            only_release += release && !press ? 1 : 0;
        }
    }
    EXPECT_GT(only_press, 0);
    EXPECT_GT(only_release, 0);
    // The sticking force of a negative hysteresis falls with the slope h / r = -1000.
    const SlidingResolvent falling{sloped_pair(0.0, -1.0, 0.001), p};
    EXPECT_GT(falling.cells(), 0U);
    EXPECT_FALSE(falling.unique(p));
    EXPECT_FALSE(falling.tabulated());
}

TEST(SlidingResolvent, NeedsNoEvaluationWhereTheDirectionBeginsToSlide) {
    const double p = 200.0;
    const double radius = 0.015625;
    const HysteresisNetwork pair = sloped_pair(0.0, 0.5, radius);
    const SlidingResolvent resolvent{pair, p};
    for (int k = 0; k < 20; ++k) {
        const double q = 40.0 + 5.0 * k;
        for (const double outward : {1.0, -1.0}) {
            const Resolvent sliding{piecewise(pair, outward), p};
            const double y = sliding.solve(pair, pair.start(0.5), {p, q}, 0.5).position;
            const double play = y - outward * radius;
            ASSERT_EQ(play + outward * radius, y) << "the play operator has no rounding error";
            SlidingResolvent::Memory memory{0.5};
            // Exactly at the position at which the play operator begins to move
            const Solution at = resolvent.solve(pair, {play}, {p, q}, memory);
            ASSERT_EQ(at.evaluations, 0) << q;
            ASSERT_EQ(at.position, y);
            ASSERT_EQ(memory.newton.position, y);
            ASSERT_GT(memory.newton.low, memory.newton.high) << "no prediction";
            // Slightly before it
            const Solution before = resolvent.solve(pair, {play + outward * 1e-9}, {p, q}, memory);
            ASSERT_GT(before.evaluations, 0) << q;
            ASSERT_NEAR(before.position, y, 1e-9);
        }
    }
}

}  // namespace
}  // namespace palpate
