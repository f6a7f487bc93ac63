// SPDX-License-Identifier: Apache-2.0
#include "palpate/solver/resolvent.hpp"
#include "special_values.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/model/derivatives.hpp"
#include "palpate/model/network.hpp"
#include "palpate/rendering/implicit.hpp"
#include "palpate/rendering/massless.hpp"
#include "support.hpp"

namespace palpate {
namespace {

using test::cases;
using test::Random;
using test::uniform;

using test::epsilon;

WaveletNetwork random_scene(Random& random, std::size_t wavelets,
                            Continuation continuation = Continuation::Linear) {
    return {test::random_network(random, wavelets), test::unit_domain(continuation, continuation)};
}

/// Returns a slope p of the load line for which p + f' > 0 at every position (model slope f'); the least value of p +
/// f' is random.
double unique_slope(Random& random, const WaveletNetwork& network) {
    const double edges =
        std::min(network.curve().below().at_edge.slope, network.curve().above().at_edge.slope);
    const Interval slope = network.curve().slope_bounds();
    return -std::min({slope.lower, edges, 0.0}) +
           (slope.upper - slope.lower) * std::exp(uniform(random, -2.5, 4.0));
}

/// Returns the force f in extended precision, at positions inside the domain.
long double exact(const NetworkParameters& network, long double x) {
    long double sum = static_cast<long double>(network.linear[0]) * x + network.bias;
    for (std::size_t i = 0; i < network.weight.size(); ++i) {
        const long double u = network.alpha[i] * (x - network.beta[i]);
        sum += network.weight[i] * (u * u - 1.0L) * std::exp(-0.5L * u * u);
    }
    return sum;
}

/// Returns the solution y of f(y) + p y = q inside the domain in extended precision, by bisection.
long double exact_solution(const NetworkParameters& network, long double p, long double q) {
    long double low = 0.0L;
    long double high = 1.0L;
    for (int k = 0; k < 64; ++k) {
        const long double middle = 0.5L * (low + high);
        (exact(network, middle) + p * middle < q ? low : high) = middle;
    }
    return 0.5L * (low + high);
}

/// Returns the force of a soft spring, a click that falls with slope -15, and a wall: 10 wavelets over [0, 0.6] rad.
WaveletNetwork switch_and_wall() {
    NetworkParameters network{1, {}, {}, {}, {12.0}, 0.0};
    const auto add = [&](double alpha, double beta, double weight) {
        network.alpha.push_back(alpha);
        network.beta.push_back(beta);
        network.weight.push_back(weight);
    };
    add(30.0, 0.15, -0.45);
    add(25.0, 0.45, 0.3);
    add(15.0, 0.5, -0.8);
    add(8.0, 0.62, 1.5);
    add(40.0, 0.3, 0.02);
    add(60.0, 0.41, 0.02);
    return {network, {{0.0}, {0.6}, Continuation::Free, Continuation::Linear, std::nullopt}};
}

TEST(Resolvent, KeepsItsCertifiedErrorEverywhere) {
    Random random{61};
    int tabulated = 0;
    for (int k = 0; k < cases(25); ++k) {
        const WaveletNetwork network = random_scene(random, static_cast<std::size_t>(1 + k % 16));
        const double p = unique_slope(random, network);
        const Resolvent resolvent{network.curve(), p};
        if (!resolvent.tabulated()) {
            continue;
        }
        ++tabulated;
        EXPECT_LE(resolvent.position_error(), 1e-12);
        const double from = network.curve().inside(0.0).value;
        const double to = network.curve().inside(1.0).value + p;
        for (int j = 0; j < 200; ++j) {
            const double q = uniform(random, from, to);
            const Solution solution = resolvent.solve(network, {}, {p, q}, {});
            ASSERT_EQ(solution.evaluations, 0);
            ASSERT_LE(std::abs(solution.position - exact_solution(network.parameters(), p, q)),
                      resolvent.position_error())
                << k << " p = " << p << " q = " << q;
        }
    }
    EXPECT_GE(tabulated, cases(25) * 7 / 10);
}

TEST(Resolvent, AgreesWithNewtonInsideAndBeyondTheDomain) {
    Random random{62};
    for (const auto continuation : {Continuation::Linear, Continuation::Free}) {
        for (int k = 0; k < cases(20); ++k) {
            const WaveletNetwork network = random_scene(random, 6, continuation);
            const double p = unique_slope(random, network);
            const Resolvent resolvent{network.curve(), p};
            if (!resolvent.tabulated()) {
                continue;
            }
            for (int j = 0; j < 200; ++j) {
                const double q = uniform(random, -2.0, 3.0) * p;
                const Solution table = resolvent.solve(network, {}, {p, q}, {});
                const Solution newton = LoadLineSolver{}.solve(network, {}, {p, q}, 0.5);
                ASSERT_EQ(table.status, Status::Ok);
                ASSERT_NEAR(table.position, newton.position, 4e-12 * (1.0 + std::abs(newton.position)))
                    << p << " " << q;
                ASSERT_NEAR(table.environment.force, newton.environment.force, 1e-11 * (p + std::abs(q)));
                if (std::min(std::abs(table.position), std::abs(table.position - 1.0)) > 1e-9) {
                    ASSERT_EQ(table.environment.extrapolated, newton.environment.extrapolated) << q;
                }
            }
        }
    }
}

TEST(Resolvent, IsExactAtTheEdges) {
    Random random{63};
    const WaveletNetwork network = random_scene(random, 7);
    const double p = 2000.0;
    const Resolvent resolvent{network.curve(), p};
    ASSERT_TRUE(resolvent.tabulated());
    for (const double edge : {0.0, 1.0}) {
        const double q = network.curve().inside(edge).value + p * edge;
        for (const double near : {q, std::nextafter(q, -1e300), std::nextafter(q, 1e300)}) {
            EXPECT_NEAR(resolvent.solve(network, {}, {p, near}, {}).position, edge, 1e-12);
        }
    }
}

TEST(Resolvent, HasNoTableIfTheErrorCannotBeCertified) {
    Random random{64};
    const WaveletNetwork network = random_scene(random, 8);
    // Cases without a table of the inverse function, in which Newton's method solves: a NaN, an accuracy beyond double
    // precision, too few table cells, and the slope of another load line.
    EXPECT_FALSE((Resolvent{network.curve(), std::nan("")}).tabulated());
    EXPECT_FALSE((Resolvent{network.curve(), 2000.0, {1e-18}}).tabulated());
    EXPECT_FALSE((Resolvent{network.curve(), 2000.0, {1e-12, 100}}).tabulated());
    const Resolvent resolvent{network.curve(), 2000.0};
    ASSERT_TRUE(resolvent.tabulated());
    const Solution other = resolvent.solve(network, {}, {3000.0, 1000.0}, {});
    EXPECT_GT(other.evaluations, 0);
    EXPECT_NEAR(network.at(other.position, {}).force + 3000.0 * other.position, 1000.0, 1e-8);
    const double infinity = std::numeric_limits<double>::infinity();
    for (const double q : {std::nan(""), infinity, -infinity}) {
        EXPECT_EQ(resolvent.solve(network, {}, {2000.0, q}, {}).status, Status::NonFinite);
    }
}

TEST(Resolvent, CertifiedErrorIsAtMostTheRequiredOne) {
    Random random{65};
    const WaveletNetwork network = random_scene(random, 8);
    int tabulated = 0;
    for (double required_error = 1e-6; required_error > 1e-18; required_error *= 0.5) {
        const Resolvent resolvent{network.curve(), 500.0, {required_error}};
        EXPECT_LE(resolvent.position_error(), required_error);
        tabulated += resolvent.tabulated() ? 1 : 0;
    }
    EXPECT_GE(tabulated, 20);
    EXPECT_LE(tabulated, 36) << "a few units in the last place are out of reach";
}

/// Returns the position of a hand that presses and releases, at 1 kHz.
double hand(int tick) {
    const double time = 1e-3 * tick;
    return 0.25 - 0.24 * std::cos(std::numbers::pi * time) + 0.01 * std::sin(14.0 * std::numbers::pi * time);
}

TEST(Resolvent, RendersLikeNewton) {
    const WaveletNetwork network = switch_and_wall();
    const Inertia inertia{0.001, 0.5};
    const VirtualCoupling coupling{100.0, 0.02};
    const LoadLineSolver exact_solver;
    Implicit newton{network, inertia, coupling, 1e-3, exact_solver};
    const Resolvent resolvent{network.curve(), decltype(newton)::load_line_slope(inertia, coupling, 1e-3)};
    ASSERT_TRUE(resolvent.tabulated());
    Implicit table{network, inertia, coupling, 1e-3, resolvent};
    Massless massless_newton{network, coupling, 1e-3};
    const Resolvent massless_resolvent{network.curve(),
                                       decltype(massless_newton)::load_line_slope(coupling, 1e-3)};
    ASSERT_TRUE(massless_resolvent.tabulated());
    Massless massless_table{network, coupling, 1e-3, massless_resolvent};
    for (int k = 0; k < 4000; ++k) {
        const Rendered expected = newton.step(hand(k));
        const Rendered rendered = table.step(hand(k));
        ASSERT_EQ(rendered.evaluations, 0) << k;
        ASSERT_NEAR(rendered.environment_position, expected.environment_position, 1e-11) << k;
        ASSERT_NEAR(rendered.force, expected.force, 1e-9) << k;
        const Rendered massless_expected = massless_newton.step(hand(k));
        const Rendered massless = massless_table.step(hand(k));
        ASSERT_EQ(massless.evaluations, 0) << k;
        ASSERT_NEAR(massless.environment_position, massless_expected.environment_position, 1e-12) << k;
        ASSERT_NEAR(massless.force, massless_expected.force, 1e-10) << k;
    }
}

/// Returns the force of a click that falls with slope -15, a second click after it, and a wall: 8 wavelets over [0,
/// 0.6] rad.
WaveletNetwork two_clicks() {
    NetworkParameters network = switch_and_wall().parameters();
    network.alpha.insert(network.alpha.end(), {45.0, 38.0});
    network.beta.insert(network.beta.end(), {0.27, 0.36});
    network.weight.insert(network.weight.end(), {-0.5, -0.3});
    return {network, switch_and_wall().domain()};
}

TEST(RisingIntervals, AgreeWithADenseSearch) {
    Random random{67};
    int folds = 0;
    for (int k = 0; k < cases(200); ++k) {
        const WaveletNetwork network = random_scene(random, static_cast<std::size_t>(1 + k % 20));
        const Interval slope = network.curve().slope_bounds();
        const double p = -uniform(random, slope.lower, slope.upper);
        const auto stretches = rising_intervals(network.parameters(), p, 0.0, 1.0);
        ASSERT_TRUE(stretches);
        folds += static_cast<int>(stretches->size());
        for (int j = 0; j <= 4000; ++j) {
            const double y = j / 4000.0;
            const double rise = p + network.curve().inside(y).slope;
            const bool inside = std::any_of(stretches->begin(), stretches->end(), [&](Interval stretch) {
                return y >= stretch.lower && y <= stretch.upper;
            });
            ASSERT_EQ(inside, rise > 0.0) << k << " " << y << " " << rise;
        }
    }
    EXPECT_GT(folds, cases(200));
}

TEST(Resolvent, KeepsItsCertifiedErrorOnEveryBranch) {
    Random random{68};
    double tabulated = 0.0;
    double range = 0.0;
    for (int k = 0; k < cases(25); ++k) {
        const WaveletNetwork network = random_scene(random, static_cast<std::size_t>(1 + k % 16));
        const double p = uniform(random, 0.1, 0.9) * std::max(1.0, -network.curve().slope_bounds().lower);
        const Resolvent resolvent{network.curve(), p};
        EXPECT_LE(resolvent.position_error(), 1e-12);
        for (std::size_t b = 1; b < resolvent.branches().size(); ++b) {
            const Branch& branch = resolvent.branches()[b];
            if (branch.line_slope == 0.0) {
                range += branch.values.upper - branch.values.lower;
            }
            if (branch.table.empty()) {
                continue;
            }
            tabulated += branch.values.upper - branch.values.lower;
            for (int j = 0; j < 100; ++j) {
                const double q = uniform(random, branch.values.lower, branch.values.upper);
                const double start = uniform(random, branch.positions.lower, branch.positions.upper);
                const Solution solution = resolvent.solve(network, {}, {p, q}, start);
                ASSERT_EQ(solution.evaluations, 0);
                long double low = branch.positions.lower - 1e-9L;
                long double high = branch.positions.upper + 1e-9L;
                for (int i = 0; i < 64; ++i) {
                    const long double middle = 0.5L * (low + high);
                    (exact(network.parameters(), middle) + p * middle < q ? low : high) = middle;
                }
                ASSERT_LE(std::abs(solution.position - 0.5L * (low + high)), branch.table.error)
                    << k << " p = " << p << " q = " << q;
            }
        }
    }
    EXPECT_GT(tabulated, 0.95 * range);
}

// Required: "from the previous solution, the first root met in the direction of -residual". Tests 401 x 401 pairs
// of start and right-hand side, for load lines that fold once, twice and in the steep wall of a knob's detent.
TEST(Resolvent, FollowsTheBranchRuleAtEveryFold) {
    const WaveletNetwork network = two_clicks();
    const double lowest = -network.curve().slope_bounds().lower;
    constexpr int fine = 120'000;
    const auto place = [](int k) { return -0.3 + 1.2 * k / fine; };
    for (const double p : {0.3 * lowest, 0.5 * lowest, 0.7 * lowest, 0.98 * lowest}) {
        const Resolvent table{network.curve(), p};
        const Resolvent newton{network.curve(), p, {1e-12, 0}};
        ASSERT_TRUE(table.tabulated());
        ASSERT_FALSE(newton.tabulated());
        std::vector<double> total(fine + 1);
        for (int k = 0; k <= fine; ++k) {
            total[static_cast<std::size_t>(k)] = network.at(place(k), {}).force + p * place(k);
        }
        std::vector<double> folds;
        for (std::size_t k = 1; k < fine; ++k) {
            if ((total[k] > total[k - 1]) != (total[k + 1] > total[k])) {
                folds.push_back(total[k]);
            }
        }
        ASSERT_GE(folds.size(), 2U);
        int several = 0;
        int worst = 0;
        int by_table = 0;
        int tried = 0;
        for (int i = 0; i <= 400; ++i) {
            const double start = place(i * (fine / 400));
            const double at_start = total[static_cast<std::size_t>(i * (fine / 400))];
            // The right-hand sides q are sorted, those above the start upward and those below the start downward. The
            // first solution then only moves away from the start.
            for (const int direction : {1, -1}) {
                int k = i * (fine / 400);
                const double highest = *std::max_element(folds.begin(), folds.end()) + 2.0;
                const double deepest = *std::min_element(folds.begin(), folds.end()) - 2.0;
                for (int j = 0; j <= 400; ++j) {
                    const double q = direction > 0 ? deepest + (highest - deepest) * j / 400.0
                                                   : highest - (highest - deepest) * j / 400.0;
                    if (direction * (q - at_start) <= 0.0 ||
                        std::any_of(folds.begin(), folds.end(),
                                    [&](double fold) { return std::abs(q - fold) < 1e-6; })) {
                        continue;
                    }
                    while (k > 0 && k < fine && direction * (total[static_cast<std::size_t>(k)] - q) < 0.0) {
                        k += direction;
                    }
                    if (k == 0 || k == fine) {
                        break;
                    }
                    const double low = place(direction > 0 ? k - 1 : k) - 1e-12;
                    const double high = place(direction > 0 ? k : k + 1) + 1e-12;
                    const Solution by_tables = table.solve(network, {}, {p, q}, start);
                    const Solution by_search = newton.solve(network, {}, {p, q}, start);
                    for (const Solution& solution : {by_tables, by_search}) {
                        ASSERT_EQ(solution.status, Status::Ok) << p << " " << start << " " << q;
                        ASSERT_GE(solution.position, low) << p << " " << start << " " << q;
                        ASSERT_LE(solution.position, high) << p << " " << start << " " << q;
                        worst = std::max(worst, solution.evaluations);
                    }
                    ASSERT_NEAR(by_tables.position, by_search.position, 1e-8)
                        << p << " " << start << " " << q;
                    const double slope = p + network.at(by_search.position, {}).slope;
                    ASSERT_NEAR(by_tables.position, by_search.position, 2e-12 + 1e-13 * (p + 70.0) / slope)
                        << p << " " << start << " " << q;
                    by_table += by_tables.evaluations == 0 ? 1 : 0;
                    ++tried;
                    several += std::count_if(folds.begin(), folds.end(),
                                             [&](double fold) {
                                                 return direction * (fold - at_start) > 0.0 &&
                                                        direction * (q - fold) > 0.0;
                                             }) > 0
                                   ? 1
                                   : 0;
                }
            }
        }
        EXPECT_GT(tried, 130'000);
        EXPECT_GT(several, 1000) << "the case is about steps that snap through";
        EXPECT_GT(by_table, tried * 9 / 10);
        EXPECT_LE(worst, 16) << p;
    }
}

TEST(Resolvent, RepeatsWithEveryTurnOfAKnob) {
    Random random{69};
    int folded = 0;
    for (int k = 0; k < cases(20); ++k) {
        const Domain knob{{0.1}, {1.1}, Continuation::Linear, Continuation::Linear, 1.0};
        NetworkParameters parameters = test::random_network(random, static_cast<std::size_t>(2 + k % 9));
        const WaveletNetwork network{parameters, knob};
        const double fall = -network.curve().slope_bounds().lower;
        const double p = std::max(1.0, fall) * (k % 2 == 0 ? 1.2 : uniform(random, 0.3, 0.9));
        const Resolvent resolvent{network.curve(), p};
        ASSERT_TRUE(resolvent.tabulated()) << k;
        Resolvent::Memory memory{0.5};
        double x = 0.5;
        double before = 0.5;
        for (int j = 0; j < 2000; ++j) {
            x += uniform(random, -0.1, 0.1) + (j == 1000 ? 37.0 : 0.0);
            const double q = p * x;
            const Solution solution = resolvent.solve(network, {}, {p, q}, memory);
            ASSERT_EQ(solution.status, Status::Ok);
            const auto residual = [&](double y) { return network.at(y, {}).force + p * y - q; };
            ASSERT_NEAR(residual(solution.position), 0.0, 1e-11 * (p + fall) * (1.0 + std::abs(x)))
                << k << " " << j;
            // No solution may lie between the previous position and the returned solution; the test checks positions at
            // distances of 0.002.
            const double direction = residual(before) < 0.0 ? 1.0 : -1.0;
            const double distance = direction * (solution.position - before);
            ASSERT_GE(distance, -1e-9) << k << " " << j;
            for (double along = 0.002; along < std::min(distance, 3.0) - 0.002; along += 0.002) {
                ASSERT_LT(direction * residual(before + direction * along), 1e-3) << k << " " << j;
            }
            before = solution.position;
        }
        folded += resolvent.branches().size() > 2 ? 1 : 0;
        for (const double far : {1e9, -1e15, 1e300}) {
            EXPECT_TRUE(std::isfinite(resolvent.solve(network, {}, {p, far}, memory).position));
        }
    }
    EXPECT_GT(folded, cases(20) / 5);
}

// With a predicted start position the solver needs 1.008 evaluations of the force for each time step; the implicit
// solvers of textbooks need 2.5 to 3.4.
TEST(CertifiedSolver, NeedsOneEvaluationAStep) {
    const WaveletNetwork network = switch_and_wall();
    const Inertia inertia{0.001, 0.5};
    const VirtualCoupling coupling{100.0, 0.02};
    const double p = Implicit<WaveletNetwork>::load_line_slope(inertia, coupling, 1e-3);
    Implicit quick{network, inertia, coupling, 1e-3, CertifiedSolver{piecewise(network.curve()), p}};
    Implicit slow{network, inertia, coupling, 1e-3};
    int evaluations = 0;
    for (int k = 0; k < 4000; ++k) {
        const Rendered rendered = quick.step(hand(k));
        const Rendered expected = slow.step(hand(k));
        evaluations += rendered.evaluations;
        ASSERT_EQ(rendered.status, Status::Ok);
        ASSERT_NEAR(rendered.environment_position, expected.environment_position, 1e-11) << k;
        ASSERT_NEAR(rendered.force, expected.force, 1e-9) << k;
    }
    EXPECT_LE(evaluations, 4000 * 105 / 100);
}

TEST(CertifiedSolver, IsExactAtTheKinksAtTheEdges) {
    Random random{66};
    for (int k = 0; k < cases(100); ++k) {
        const WaveletNetwork network =
            random_scene(random, 8, k % 2 == 0 ? Continuation::Linear : Continuation::Free);
        const double p = unique_slope(random, network);
        const CertifiedSolver solver{piecewise(network.curve()), p};
        ASSERT_TRUE(solver.unique(p));
        for (int j = 0; j < 100; ++j) {
            const double edge = j % 2 == 0 ? 0.0 : 1.0;
            // From a start position slightly farther from the edge of the domain, the tangent of the force may lead to
            // a position on the wrong side of this edge.
            const auto near_kink = [&](double from, double to) {
                return edge +
                       (uniform(random, -1.0, 1.0) < 0.0 ? -1.0 : 1.0) * std::exp(uniform(random, from, to));
            };
            const double start = near_kink(-14.0, -5.0);
            const double wanted = near_kink(-28.0, -12.0);
            const auto intercept = [&](double y) { return network.at(y, {}).force + p * y; };
            CertifiedSolver::Memory memory;
            ASSERT_NEAR(solver.solve(network, {}, {p, intercept(start)}, memory).position, start, 1e-12);
            const double q = intercept(wanted);
            ASSERT_NEAR(solver.solve(network, {}, {p, q}, memory).position, wanted, 1e-12)
                << p << " " << start;
        }
    }
}

// Tests 401 x 401 pairs of the last and the new right-hand side q, for load lines from just above the least unique
// slope to steep slopes.
TEST(CertifiedSolver, EndsWithinFourEvaluationsAfterEveryJump) {
    const WaveletNetwork network = switch_and_wall();
    const double fall = test::steepest_fall(piecewise(network.curve()));
    for (const double p : {1.0001 * fall, 1.02 * fall, 1.3 * fall, 120.0, 1620.0}) {
        const CertifiedSolver solver{piecewise(network.curve()), p};
        ASSERT_TRUE(solver.unique(p));
        const Resolvent resolvent{network.curve(), p};
        const auto intercept = [&](int j) { return p * (-0.3 + 1.2 * j / 400.0) + 5.0 * j / 400.0; };
        int worst = 0;
        for (int i = 0; i <= 400; ++i) {
            CertifiedSolver::Memory start;
            ASSERT_EQ(solver.solve(network, {}, {p, intercept(i)}, start).status, Status::Ok);
            for (int j = 0; j <= 400; ++j) {
                const double q = intercept(j);
                CertifiedSolver::Memory memory = start;
                const Solution solution = solver.solve(network, {}, {p, q}, memory);
                ASSERT_EQ(solution.status, Status::Ok) << p << " " << i << " " << q;
                const EnvironmentSample there = network.at(solution.position, {});
                const double residual = there.force + p * solution.position - q;
                ASSERT_LE(std::abs(residual),
                          1e-13 * (p + there.slope) + 16.0 * epsilon * (8.0 + std::abs(q)))
                    << p << " " << i << " " << q;
                if (i == 0) {
                    ASSERT_NEAR(resolvent.solve(network, {}, {p, q}, {}).position, solution.position,
                                1e-12 + 4e-14 / (p - fall));
                }
                worst = std::max(worst, solution.evaluations);
            }
        }
        EXPECT_LE(worst, 4) << p;
    }
}

// The load line is close to non-unique: a slope p smaller by a thousandth would give several solutions. The full test
// tier tests 10^6 steps.
TEST(CertifiedSolver, EndsWithinFourEvaluationsNearAFold) {
    Random random{70};
    long steps = 0;
    long evaluations = 0;
    std::vector<std::size_t> cells;
    for (int k = 0; k < cases(10); ++k) {
        Domain domain = test::unit_domain(k % 2 == 0 ? Continuation::Linear : Continuation::Free,
                                          k % 2 == 0 ? Continuation::Linear : Continuation::Free);
        if (k % 5 == 4) {
            domain = {{0.1}, {1.1}, Continuation::Linear, Continuation::Linear, 1.0};
        }
        const WaveletNetwork network{test::random_network(random, static_cast<std::size_t>(1 + k % 16)),
                                     domain};
        const double fall = test::steepest_fall(piecewise(network.curve()));
        if (!(fall > 0.0)) {
            continue;
        }
        const double p = fall * (1.0 + std::exp(uniform(random, std::log(1e-4), 0.0)));
        // Compares two solvers: one uses the table of the inverse function, and cells for the positions outside the
        // table; the second uses only cells.
        const Resolvent resolvent{network.curve(), p};
        const CertifiedSolver& solver = resolvent.solver();
        ASSERT_TRUE(resolvent.unique(p)) << k << " p / fall = " << p / fall;
        cells.push_back(solver.cells());
        const double rounding = jet_rounding(network.parameters(), 1.1)[0];
        Resolvent::Memory memory{0.5};
        CertifiedSolver::Memory alone{0.5};
        for (int j = 0; j < 500; ++j) {
            const double x = uniform(random, -0.3, 1.4);
            const double q = network.at(x, {}).force + p * x;
            for (const Solution& solution :
                 {resolvent.solve(network, {}, {p, q}, memory), solver.solve(network, {}, {p, q}, alone)}) {
                ASSERT_EQ(solution.status, Status::Ok) << k << " " << j;
                ASSERT_LE(solution.evaluations, 4) << k << " " << j;
                const EnvironmentSample there = network.at(solution.position, {});
                const double residual = there.force + p * solution.position - q;
                ASSERT_LE(std::abs(residual), 1.1e-12 * (p + std::abs(there.slope)) + 2.0 * rounding +
                                                  8.0 * epsilon * (std::abs(there.force) + std::abs(q)))
                    << k << " " << j << " " << x << " " << solution.position;
                ++steps;
                evaluations += solution.evaluations;
            }
        }
    }
    ASSERT_GT(steps, cases(7) * 1000);
    std::sort(cells.begin(), cells.end());
    RecordProperty("steps", std::to_string(steps));
    RecordProperty("evaluations_per_step", std::to_string(static_cast<double>(evaluations) / steps));
    RecordProperty("cells_median", std::to_string(cells[cells.size() / 2]));
    RecordProperty("cells_most", std::to_string(cells.back()));
    EXPECT_LE(cells.back(), 1000U);
}

using test::infinity;

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
    EXPECT_EQ(branch.first_guess(109.0, 2.25), 2.5);  // 9 = 8 / 2 (3/2)^2
    EXPECT_EQ(branch.first_guess(110.0, 2.5), 2.5);
    EXPECT_EQ(branch.first_guess(199.0, 1.5), 2.75);
    branch.curvature_high = 0.0;
    EXPECT_EQ(branch.first_guess(199.0, 1.5), 1.5);
    EXPECT_EQ(branch.first_guess(100.0, 2.5), 2.0) << "the fold itself is not inside";
    branch.curvature_low = 0.5;
    EXPECT_EQ(branch.first_guess(100.5625, 1.25), 2.5);  // 9/16 = 1/4 (3/2)^2
    branch.curvature_high = 0.5;
    EXPECT_EQ(branch.first_guess(199.4375, 1.25), 1.5);
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
        for (const double invalid : {std::nan(""), infinity, -infinity}) {
            ASSERT_EQ(resolvent.solve(network, {}, {1.0, invalid}, memory).status, Status::NonFinite);
            ASSERT_EQ(memory.branch, before.branch);
            ASSERT_EQ(memory.newton.position, before.newton.position);
        }
        Resolvent::Memory near = memory;
        const double steeper = resolvent.solve(network, {}, {1.125, q}, near).position;
        ASSERT_NEAR(total(network, 1.125, steeper), q, 1e-11) << "the table is for another slope";
        const Solution other = resolvent.solve(network, {}, {200.0, 200.0 * y}, memory);
        ASSERT_EQ(other.status, Status::Ok);
        ASSERT_NEAR(total(network, 200.0, other.position), 200.0 * y, 1e-9);
        ASSERT_EQ(memory.branch, 0U);
        ASSERT_EQ(memory.turns, 0.0);
        ASSERT_EQ(memory.newton.position, other.position);
    }
    EXPECT_EQ(resolvent.solve(network, {}, {1.0, 1.0}, std::nan("")).status, Status::NonFinite);
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
        const Solution again = resolvent.without_evaluation({60.0, q}, memory);
        EXPECT_EQ(again.position, first.position);
        EXPECT_EQ(again.environment.extrapolated, first.environment.extrapolated);
        EXPECT_TRUE(std::isnan(resolvent.without_evaluation({61.0, q}, memory).position));
        EXPECT_TRUE(std::isnan(resolvent.without_evaluation({60.0, infinity}, memory).position));
        Resolvent::Memory solved;
        for (int k = 0; k < 2; ++k) {
            const Solution solution = resolvent.solve(network, {}, {60.0, q}, solved);
            EXPECT_EQ(solution.evaluations, 0);
            EXPECT_EQ(solution.position, first.position);
            EXPECT_EQ(solution.environment.extrapolated, first.environment.extrapolated);
            EXPECT_EQ(solved.newton.position, first.position);
        }
        const Solution other = resolvent.solve(network, {}, {61.0, q + y}, y);
        EXPECT_GT(other.evaluations, 0);
        EXPECT_NEAR(other.position, y, 1e-11);
    }
    // Outside the domain F has a slope below 1.
    const WaveletNetwork line{{1, {}, {}, {}, {0.25}, 0.0}, test::unit_domain()};
    const Resolvent flat{line.curve(), 0.25};
    for (const double y : {-3.0, 0.5, 7.0}) {
        Resolvent::Memory memory;
        EXPECT_NEAR(flat.without_evaluation({0.25, 0.5 * y}, memory).position, y, 1e-12);
    }
}

// A knob with a period of 2 whose function falls in one or two places, also at the end of the period. The first solution
// in the direction of -residual is found by small steps and bisection.
TEST(Branches, LeadToTheFirstSolutionFromAnyTurn) {
    Random random{343};
    int at_end = 0;
    for (int k = 0; k < cases(12); ++k) {
        const double lower = 5.25;
        NetworkParameters parameters{1, {5.0, 6.0}, {lower + 0.3, lower + 1.2}, {1.0, -0.7}, {0.0}, 0.0};
        for (double& beta : parameters.beta) {
            beta = lower + std::fmod(beta - lower + 0.17 * k, 2.0);
        }
        const Domain knob{{lower}, {lower + 2.0}, Continuation::Linear, Continuation::Linear, 2.0};
        const WaveletNetwork network{parameters, knob};
        const double p = -uniform(random, 0.3, 0.6) * network.curve().slope_bounds().lower;
        const Resolvent resolvent{network.curve(), p};
        ASSERT_GT(resolvent.branches().size(), 2U);
        at_end += resolvent.branches().back().positions.upper < lower + 2.0 - 1e-6 ? 1 : 0;
        for (int j = 0; j < 150; ++j) {
            const double start =
                lower + uniform(random, 0.0, 2.0) + 2.0 * std::floor(uniform(random, -20.0, 20.0));
            const double jump = j % 3 == 0 ? uniform(random, -3.0, 3.0) : uniform(random, -0.3, 0.3);
            const double q = total(network, p, start) + p * jump;
            const auto residual = [&](double y) { return total(network, p, y) - q; };
            const double direction = residual(start) < 0.0 ? 1.0 : -1.0;
            constexpr double step = 1e-3;
            double before = start;
            while (direction * residual(before + direction * step) < 0.0) {
                before += direction * step;
            }
            double after = before + direction * step;
            for (int i = 0; i < 60; ++i) {
                const double middle = 0.5 * (before + after);
                (direction * residual(middle) < 0.0 ? before : after) = middle;
            }
            if (p + network.at(before, {}).slope < 0.2 * p) {
                continue;  // so near a fold that a step of 1e-3 may miss it
            }
            Resolvent::Memory memory{start};
            int evaluations = 0;
            const test::Counted<WaveletNetwork> counted{network, &evaluations};
            const Solution solution = resolvent.solve(counted, {}, {p, q}, memory);
            ASSERT_EQ(solution.status, Status::Ok);
            ASSERT_NEAR(solution.position, before, 1e-9) << k << " " << j << " from " << start;
            ASSERT_EQ(solution.evaluations, evaluations);
        }
        // The number of turns is not exact at these positions, but the search ends.
        for (double far = 1e9; far < 1e300; far *= 7.3) {
            for (const double q : {far, -far}) {
                EXPECT_TRUE(std::isfinite(resolvent.solve(network, {}, {p, q}, 0.0).position));
            }
        }
    }
    EXPECT_GT(at_end, 0);
}

// The function falls inside one edge of the domain, so branches on both sides of the edge contain the same values.
TEST(Branches, KeepASolutionOnALineOutsideTheDomain) {
    for (const bool above : {false, true}) {
        const WaveletNetwork network{{1, {10.0}, {above ? 0.9 : 0.1}, {above ? -1.0 : 1.0}, {2.0}, 0.0},
                                     test::unit_domain()};
        const Resolvent resolvent{network.curve(), 1.0};
        ASSERT_GT(resolvent.branches().size(), 2U);
        for (int k = 1; k <= 50; ++k) {
            const double y = above ? 1.0 + 0.01 * k : -0.01 * k;
            EXPECT_NEAR(resolvent.solve(network, {}, {1.0, total(network, 1.0, y)}, y).position, y, 1e-12);
        }
    }
}

// Beyond the end of a table, Newton's method solves between the ends of its branch.
TEST(Branches, AreContinuousAtTheEndsOfATable) {
    const WaveletNetwork network = click();
    const Resolvent resolvent{network.curve(), 1.0};
    const auto& branches = resolvent.branches();
    int ends = 0;
    for (std::size_t b = 1; b < branches.size(); ++b) {
        if (branches[b].table.empty()) {
            continue;
        }
        const Interval values = branches[b].values;
        const Interval positions = branches[b].positions;
        for (const double q :
             {std::nextafter(values.lower, -infinity), std::nextafter(values.upper, infinity)}) {
            const double y = q < values.lower ? positions.lower : positions.upper;
            const Solution solution = resolvent.solve(network, {}, {1.0, q}, y);
            ends += solution.evaluations > 0 ? 1 : 0;
            EXPECT_NEAR(solution.position, y, 1e-11);
        }
    }
    EXPECT_GE(ends, 2);
}

TEST(Branches, AreNoneIfTheFunctionFallsOutsideTheDomain) {
    // Continued with its slope at the edge: 2 - 1.5 = 0.5 falls with p = -1, and rises with p = 0.
    const WaveletNetwork line{{1, {}, {}, {}, {0.5}, 0.0}, test::unit_domain()};
    EXPECT_EQ((Resolvent{line.curve(), -1.0}.branches().size()), 1U);
    EXPECT_EQ((Resolvent{line.curve(), -0.5}.branches().size()), 1U);
    EXPECT_GT((Resolvent{line.curve(), 0.0}.branches().size()), 3U - 1U);
    // A fold at the edge of the domain
    const WaveletNetwork folded = click();
    const double fold = -jet(folded.parameters(), 0.0)[1];
    EXPECT_EQ((Resolvent{folded.curve(), fold}.branches().size()), 1U);
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

// Short lines outside the domain, along some of which the function falls or is constant: they are not branches.
TEST(Branches, OmitALineAlongWhichTheFunctionDoesNotRise) {
    const PiecewiseForce force{{1, {}, {}, {}, {0.5}, 0.25},
                               0.0,
                               1.0,
                               false,
                               {{0.5, -3.0}, {0.25, 1.0}, {infinity, 0.0}},
                               {{0.5, 2.0}, {0.125, -4.0}, {0.125, -1.0}, {infinity, 1.0}}};
    const Resolvent resolvent{force, 1.0};
    std::vector<Branch> lines;
    for (const Branch& branch : resolvent.branches()) {
        if (branch.line_slope > 0.0) {
            lines.push_back(branch);
        }
    }
    ASSERT_EQ(lines.size(), 4U);
    // F(0) = 0.25 and F(1) = 1.75. Below: slopes -2 over 0.5, then 2 over 0.25, then 1. Above: 3 over 0.5, -3 over
    // 0.125, 0 over 0.125, 2.
    const std::vector<Interval> positions{{-infinity, -0.75}, {-0.75, -0.5}, {1.0, 1.5}, {1.75, infinity}};
    const std::vector<Interval> values{{-infinity, 0.75}, {0.75, 1.25}, {1.75, 3.25}, {2.875, infinity}};
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
