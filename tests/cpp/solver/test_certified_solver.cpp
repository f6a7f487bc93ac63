// SPDX-License-Identifier: Apache-2.0
#include "palpate/solver/certified_solver.hpp"

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
constexpr double epsilon = std::numeric_limits<double>::epsilon();

WaveletNetwork random_scene(Random& random, int k) {
    const auto continuation = k % 2 == 0 ? Continuation::Free : Continuation::Linear;
    return {test::random_network(random, static_cast<std::size_t>(1 + k % 9)),
            test::unit_domain(continuation, continuation)};
}

/// Returns a pair with a hysteresis that changes with the position, and with a play radius from 0.02 to 0.3.
HysteresisNetwork random_pair(Random& random, int k, bool periodic = false) {
    const auto wavelets = static_cast<std::size_t>(1 + k % 7);
    HysteresisParameters hysteresis{std::vector<double>(wavelets),
                                    periodic ? 0.0 : uniform(random, -0.1, 0.3), uniform(random, 0.3, 1.0)};
    for (double& weight : hysteresis.weight) {
        weight = uniform(random, -0.2, 0.2) / static_cast<double>(wavelets);
    }
    const auto continuation = k % 2 == 0 ? Continuation::Free : Continuation::Linear;
    Domain domain = test::unit_domain(continuation, continuation);
    if (periodic) {
        domain = {{0.1}, {1.1}, Continuation::Linear, Continuation::Linear, 1.0};
    }
    return {test::random_network(random, wavelets), hysteresis, domain, uniform(random, 0.02, 0.3)};
}

/// Returns a slope p for which all sheets rise, by a small or large margin.
double rising_slope(Random& random, const HysteresisNetwork& pair) {
    const double gain = std::max(0.0, -pair.hysteresis_force().value_bounds().lower) / pair.play_radius();
    const double fall = std::max(
        {0.0, test::steepest_fall(piecewise(pair, 1.0)), test::steepest_fall(piecewise(pair, -1.0))});
    return (fall + gain + 0.1) * (1.01 + std::exp(uniform(random, -2.0, 2.0)));
}

/// Least slope and largest curvature of a function.
struct Steepness {
    double least = infinity;
    double curvature = 0.0;

    void add(double slope, double bend) {
        least = std::min(least, slope);
        curvature = std::max(curvature, std::abs(bend));
    }
    [[nodiscard]] double ratio() const { return 0.5 * curvature / least; }
};

constexpr int samples = 64;

double sample_of(double low, double high, int j) {
    return low + (high - low) * j / samples;
}

/// Returns max|F''| / (2 min F') over the positions from `low` to `high`, by samples.
double sampled(const NetworkParameters& network, double p, double low, double high) {
    Steepness of;
    for (int j = 0; j <= samples; ++j) {
        const Jet f = jet(network, sample_of(low, high, j));
        of.add(p + f[1], f[2]);
    }
    return of.ratio();
}

/// Returns the largest max|F''| / (2 min F') of press, release, and sticking with |s| <= 1 + width / r, by samples.
double sampled(const HysteresisNetwork& pair, double p, double low, double high) {
    const double r = pair.play_radius();
    double worst = 0.0;
    for (const bool sticks : {false, true}) {
        for (const double sign : {-1.0, 1.0}) {
            const double s = sign * (sticks ? 1.0 + (high - low) / r : 1.0);
            Steepness of;
            for (int j = 0; j <= samples; ++j) {
                const double y = sample_of(low, high, j);
                const Jet g = jet(pair.force().parameters(), y);
                const Jet h = jet(pair.hysteresis_force().parameters(), y);
                of.add(p + g[1] + s * h[1] + (sticks ? h[0] / r : 0.0),
                       g[2] + s * h[2] + (sticks ? 2.0 * h[1] / r : 0.0));
            }
            worst = std::max(worst, of.ratio());
        }
    }
    return worst;
}

/// Returns the memory after a solution at each cell between `lower` and `upper`, in the order of position. `solve(y)`
/// solves the load line whose solution is y and returns the memory.
template <class Solve>
std::vector<CertifiedSolver::Memory> all_cells(double lower, double upper, Solve solve) {
    std::vector<CertifiedSolver::Memory> cells;
    for (double y = lower + 1e-9; y < upper && cells.size() < 5000;) {
        cells.push_back(solve(y));
        y = cells.back().high + 1e-9;
    }
    return cells;
}

/// Returns the least number of intervals between `lower` and `upper` whose width w satisfies 8 w c <= 1. This is
/// condition (C) of the solver; c is `ratio(low, high)`.
template <class Ratio>
std::size_t fewest_cells(double lower, double upper, Ratio ratio) {
    std::size_t count = 0;
    for (double from = lower; from < upper; ++count) {
        double width = upper - from;
        if (8.0 * width * ratio(from, upper) > 1.0) {
            double enough = 0.0;
            for (int k = 0; k < 24; ++k) {
                const double middle = 0.5 * (enough + width);
                (8.0 * middle * ratio(from, from + middle) <= 1.0 ? enough : width) = middle;
            }
            width = enough;
        }
        from += width;
    }
    return count;
}

TEST(CertifiedSolver, HasTightCellsThatSatisfyItsCondition) {
    Random random{321};
    std::size_t all = 0;
    std::size_t fewest = 0;
    double proved = 0.0;
    double true_sum = 0.0;
    for (int k = 0; k < cases(16); ++k) {
        const WaveletNetwork network = random_scene(random, k);
        const NetworkParameters& parameters = network.parameters();
        const double fall = std::max(0.1, test::steepest_fall(piecewise(network.curve())));
        const double p = fall * (1.01 + std::exp(uniform(random, -4.0, 2.0)));
        const CertifiedSolver solver{piecewise(network.curve()), p};
        ASSERT_TRUE(solver.unique(p)) << k;
        const auto cells = all_cells(0.0, 1.0, [&](double y) {
            CertifiedSolver::Memory memory;
            EXPECT_EQ(solver.solve(network, {}, {p, network.at(y, {}).force + p * y}, memory).status,
                      Status::Ok);
            EXPECT_LE(memory.low, y);
            return memory;
        });
        double last = 0.0;
        for (const auto& cell : cells) {
            ASSERT_NEAR(cell.low, last, 1e-14) << "the cells are adjacent";
            last = cell.high;
            const double expected = sampled(parameters, p, cell.low, cell.high);
            ASSERT_LE(8.0 * (cell.high - cell.low) * cell.curvature, 1.0);
            ASSERT_GE(cell.curvature, expected * (1.0 - 1e-9)) << k;
            proved += (cell.high - cell.low) * cell.curvature;
            true_sum += (cell.high - cell.low) * expected;
        }
        ASSERT_NEAR(last, 1.0, 1e-14);
        ASSERT_LE(cells.size(), solver.cells()) << "outside the domain are other cells";
        ASSERT_LE(solver.cells(), cells.size() + 20);
        all += cells.size();
        fewest += fewest_cells(0.0, 1.0,
                               [&](double low, double high) { return sampled(parameters, p, low, high); });
    }
    // The proof needs at most 1.45 times the fewest possible cells, and its c is at most 1.25 times the true one on average.
    EXPECT_GE(all, fewest);
    EXPECT_LE(static_cast<double>(all), 1.45 * static_cast<double>(fewest));
    EXPECT_LE(proved, 1.25 * true_sum);
}

TEST(CertifiedSolver, HasTightCellsForPressReleaseAndSticking) {
    Random random{322};
    std::size_t all = 0;
    std::size_t fewest = 0;
    double proved = 0.0;
    double true_sum = 0.0;
    for (int k = 0; k < cases(16); ++k) {
        const HysteresisNetwork pair = random_pair(random, k);
        const double p = rising_slope(random, pair);
        const CertifiedSolver solver{pair, p};
        if (!solver.unique(p)) {
            continue;
        }
        const double r = pair.play_radius();
        // A play operator far above or far below every position
        std::vector<CertifiedSolver::Memory> cells;
        for (const double play : {-5.0, 5.0}) {
            cells = all_cells(0.0, 1.0, [&](double y) {
                CertifiedSolver::Memory memory;
                EXPECT_EQ(solver.solve(pair, {play}, {p, pair.at(y, {play}).force + p * y}, memory).status,
                          Status::Ok);
                EXPECT_EQ(memory.play, play);
                return memory;
            });
            double last = 0.0;
            for (const auto& cell : cells) {
                ASSERT_NEAR(cell.low, last, 1e-14);
                last = cell.high;
                const double expected = sampled(pair, p, cell.low, cell.high);
                ASSERT_LE(8.0 * (cell.high - cell.low) * cell.curvature, 1.0);
                ASSERT_GE(cell.curvature, expected * (1.0 - 1e-9)) << k;
                proved += (cell.high - cell.low) * cell.curvature;
                true_sum += (cell.high - cell.low) * expected;
            }
            ASSERT_NEAR(last, 1.0, 1e-14);
        }
        all += cells.size();
        fewest +=
            fewest_cells(0.0, 1.0, [&](double low, double high) { return sampled(pair, p, low, high); });
        // With the play operator inside, the interval of the memory also ends at play - r and play + r.
        for (int j = 0; j < 200; ++j) {
            const double play = uniform(random, 0.0, 1.0);
            const double y = j % 2 == 0 ? uniform(random, 0.0, 1.0)
                                        : std::clamp(play + r * uniform(random, -2.0, 2.0), 0.01, 0.99);
            const auto cell =
                std::find_if(cells.begin(), cells.end(), [&](const auto& each) { return y < each.high; });
            if (cell == cells.end() || std::abs(std::abs(y - play) - r) < 1e-9 || y - cell->low < 1e-9 ||
                cell->high - y < 1e-9) {
                continue;
            }
            CertifiedSolver::Memory memory;
            const double q = pair.at(y, {play}).force + p * y;
            const Solution solution = solver.solve(pair, {play}, {p, q}, memory);
            ASSERT_NEAR(solution.position, y, 1e-12);
            double low = cell->low;
            double high = cell->high;
            for (const double kink : {play - r, play + r}) {
                (kink < y ? low : high) = kink < y ? std::max(low, kink) : std::min(high, kink);
            }
            ASSERT_NEAR(memory.low, low, 1e-14) << k << " " << j;
            ASSERT_NEAR(memory.high, high, 1e-14) << k << " " << j;
            ASSERT_GE(memory.low, low) << "a margin for rounding";
            ASSERT_LE(memory.high, high) << "a margin for rounding";
            ASSERT_EQ(memory.curvature, cell->curvature);
            ASSERT_EQ(memory.play, play);
            // The tangent at the solution
            const double slope = p + pair.at(y, {play}).slope;
            ASSERT_NEAR(memory.compliance * slope, 1.0, 1e-4);
            ASSERT_NEAR(memory.at_zero + q * memory.compliance, y, 1e-11);
            ASSERT_EQ(memory.position, solution.position);
        }
    }
    // The proof needs at most 1.55 times the fewest possible cells, and its c is at most 1.3 times the true one on average.
    EXPECT_GE(all, fewest);
    EXPECT_LE(static_cast<double>(all), 1.55 * static_cast<double>(fewest));
    EXPECT_LE(proved, 1.3 * true_sum);
}

// The solver is exact to its tolerance 1e-13 and rounding, and most steps of a motion need one evaluation.
TEST(CertifiedSolver, FollowsAMotionWithAboutOneEvaluationPerStep) {
    Random random{323};
    long evaluations = 0;
    long steps = 0;
    for (int k = 0; k < cases(16); ++k) {
        const HysteresisNetwork pair = random_pair(random, k, k % 4 == 3);
        const double p = rising_slope(random, pair);
        const CertifiedSolver solver{pair, p};
        ASSERT_TRUE(solver.unique(p)) << k;
        auto state = pair.start(0.5);
        CertifiedSolver::Memory memory{0.5};
        double phase = 0.0;
        for (int j = 0; j < 800; ++j) {
            phase += 0.004;
            const double y = 0.55 + 0.4 * std::sin(phase) + 0.01 * std::sin(7.0 * phase);
            const double slope = p * (j % 100 == 99 ? 1.5 : 1.0);
            const double q = pair.at(y, state).force + slope * y;
            const Solution solution = solver.solve(pair, state, {slope, q}, memory);
            const double steepest = slope + pair.at(y, state).slope;
            ASSERT_NEAR(solution.position, y,
                        2e-13 + 40.0 * epsilon * (10.0 + std::abs(q)) /
                                    std::min(steepest, slope + pair.sliding(y, 1.0).slope))
                << k << " " << j;
            ASSERT_EQ(solution.environment.force, q - slope * solution.position);
            ASSERT_EQ(solution.residual, 0.0);
            ASSERT_EQ(solution.environment.extrapolated, pair.at(solution.position, state).extrapolated);
            evaluations += solution.evaluations;
            ++steps;
        }
    }
    EXPECT_LE(static_cast<double>(evaluations), 1.55 * static_cast<double>(steps));
}

TEST(CertifiedSolver, FindsTheTurnOfAKnobWithHysteresis) {
    Random random{324};
    for (int k = 0; k < cases(20); ++k) {
        const HysteresisNetwork pair = random_pair(random, k, true);
        const double p = rising_slope(random, pair);
        const CertifiedSolver solver{pair, p};
        ASSERT_TRUE(solver.unique(p)) << k;
        CertifiedSolver::Memory memory{0.5};
        for (int j = 0; j < 300; ++j) {
            const double turns = std::floor(uniform(random, -30.0, 30.0));
            const double y = j % 3 == 0   ? turns + 0.1
                             : j % 3 == 1 ? turns + 0.1 + uniform(random, -1e-6, 1e-6)
                                          : turns + uniform(random, 0.0, 1.0);
            const HysteresisNetwork::State state{y + pair.play_radius() * uniform(random, -2.0, 2.0)};
            const double q = pair.at(y, state).force + p * y;
            const Solution solution = solver.solve(pair, state, {p, q}, memory);
            ASSERT_EQ(solution.status, Status::Ok);
            ASSERT_LE(solution.evaluations, 4);
            ASSERT_NEAR(solution.position, y, 1e-11) << k << " " << j;
        }
    }
}

// Press and release force differ by 2 N. The load line of slope 0.125 N/m rises by this in 16 turns.
TEST(CertifiedSolver, FindsTheTurnOfAKnobWhoseHysteresisIsLargeForTheLoadLine) {
    const double p = 0.125;
    const Domain knob{{0.0}, {1.0}, Continuation::Linear, Continuation::Linear, 1.0};
    const HysteresisNetwork pair{{1, {10.0}, {0.5}, {0.005}, {0.0}, 0.5}, {{0.0}, 0.0, 1.0}, knob, 0.125};
    const CertifiedSolver solver{pair, p};
    ASSERT_TRUE(solver.unique(p));
    for (const double play : {-3.0, 0.5, 2.25, 9.0, 400.0}) {
        for (const double offset : {-200.3, -20.5, -2.0, -0.125, 0.0, 0.0625, 0.125, 1.4, 7.5, 300.0}) {
            CertifiedSolver::Memory memory;
            const double y = play + offset;
            const double q = pair.at(y, {play}).force + p * y;
            const Solution solution = solver.solve(pair, {play}, {p, q}, memory);
            ASSERT_EQ(solution.status, Status::Ok);
            ASSERT_NEAR(solution.position, y, 1e-11) << play;
            ASSERT_LE(solution.evaluations, 4);
        }
    }
}

TEST(CertifiedSolver, SearchesWithStepsShorterThanEveryDetail) {
    const auto longest = [](std::vector<double> alpha, double radius) {
        const std::size_t n = alpha.size();
        const NetworkParameters network{
            1, std::move(alpha), std::vector<double>(n, 0.5), std::vector<double>(n, 0.1), {1.0}, 0.0};
        const Domain domain{{0.0}, {2.0}, Continuation::Linear, Continuation::Linear, std::nullopt};
        if (radius > 0.0) {
            const HysteresisNetwork pair{network, {std::vector<double>(n, 0.0), 0.0, 0.1}, domain, radius};
            return CertifiedSolver{pair, 100.0}.uncertified().longest_step;
        }
        return CertifiedSolver{piecewise(WaveletNetwork{network, domain}.curve()), 100.0}
            .uncertified()
            .longest_step;
    };
    EXPECT_EQ(longest({}, 0.0), 0.5);             // a quarter of the domain
    EXPECT_EQ(longest({4.0, 2.0}, 0.0), 0.0625);  // a quarter of the narrowest wavelet's width
    EXPECT_EQ(longest({2.0, 4.0}, 0.0), 0.0625);
    EXPECT_EQ(longest({2.0, 4.0}, 0.25), 0.0625);
    EXPECT_EQ(longest({2.0, 4.0}, 0.03125), 0.015625);  // half the play radius
}

// A straight line of slope 2 with a constant hysteresis h: while sticking its slope is 2 + h / r.
TEST(CertifiedSolver, ProvesALineUpToItsExactSlope) {
    for (const double h : {1.0, -1.0, 0.0}) {
        const HysteresisNetwork pair{{1, {}, {}, {}, {2.0}, 0.5}, {{}, 0.0, h}, test::unit_domain(), 0.125};
        const double least = h < 0.0 ? 6.0 : -2.0;
        const auto unique = [&](double p) {
            const CertifiedSolver solver{pair, p};
            EXPECT_EQ(solver.unique(p), solver.cells() > 0);
            return solver.unique(p);
        };
        EXPECT_TRUE(unique(least + 1e-12));
        EXPECT_FALSE(unique(least));
        EXPECT_FALSE(unique(least - 1e-12));
    }
    const WaveletNetwork line{{1, {}, {}, {}, {2.0}, 0.5}, test::unit_domain()};
    EXPECT_TRUE((CertifiedSolver{piecewise(line.curve()), -2.0 + 1e-12}.unique(-2.0 + 1e-12)));
    EXPECT_FALSE((CertifiedSolver{piecewise(line.curve()), -2.0}.unique(-2.0)));
    EXPECT_FALSE((CertifiedSolver{piecewise(line.curve()), std::nan("")}.unique(1e300)));
    EXPECT_FALSE((CertifiedSolver{piecewise(line.curve()), infinity}.unique(1e300)));
}

TEST(CertifiedSolver, ProvesNothingBelowTheSteepestFall) {
    Random random{325};
    int proved = 0;
    int tried = 0;
    for (int k = 0; k < cases(30); ++k) {
        const WaveletNetwork network = random_scene(random, k);
        const double fall = test::steepest_fall(piecewise(network.curve()));
        const auto unique = [](const auto& force, double p) { return CertifiedSolver{force, p}.unique(p); };
        EXPECT_FALSE(unique(piecewise(network.curve()), fall - 1e-7 * std::abs(fall)));
        const HysteresisNetwork pair = random_pair(random, k);
        double steepest = -infinity;
        for (int j = 0; j <= 4000; ++j) {
            const Jet g = jet(pair.force().parameters(), j / 4000.0);
            const Jet h = jet(pair.hysteresis_force().parameters(), j / 4000.0);
            const double gain = h[0] / pair.play_radius();
            for (const double s : {-1.0, 1.0}) {
                steepest = std::max({steepest, -(g[1] + s * h[1]), -(g[1] + s * h[1] + gain)});
            }
        }
        EXPECT_FALSE(unique(pair, steepest - 1e-4 * std::abs(steepest))) << k;
        if (fall > 0.1) {
            proved += unique(piecewise(network.curve()), fall * (1.0 + 1e-3)) ? 1 : 0;
            ++tried;
        }
    }
    EXPECT_EQ(proved, tried);
}

TEST(CertifiedSolver, SolvesOutsideTheDomainWithOneEvaluation) {
    Random random{326};
    for (int k = 0; k < cases(10); ++k) {
        const HysteresisNetwork pair = random_pair(random, k);
        const double p = rising_slope(random, pair);
        const CertifiedSolver solver{pair, p};
        ASSERT_TRUE(solver.unique(p));
        for (const double y : {-7.0, -2.5, 3.0, 60.0}) {
            for (const double offset : {-3.0, 3.0, -0.5, 0.5}) {
                const HysteresisNetwork::State state{y + offset * pair.play_radius()};
                CertifiedSolver::Memory memory;
                const LoadLine line{p, pair.at(y, state).force + p * y};
                const Solution solution = solver.solve(pair, state, line, memory);
                ASSERT_NEAR(solution.position, y, 1e-12 * (1.0 + std::abs(y)) * 10.0);
                ASSERT_EQ(solution.evaluations, 1);
                ASSERT_TRUE(solution.environment.extrapolated);
                ASSERT_EQ(memory.curvature, 0.0);
                ASSERT_EQ(solver.solve(pair, state, line, memory).evaluations, 1);
            }
        }
    }
}

TEST(CertifiedSolver, ReportsAForceThatIsNotFinite) {
    struct Broken {
        using State = Stateless;
        [[nodiscard]] EnvironmentSample at(double, const State&) const noexcept {
            return {std::nan(""), 1.0};
        }
        void advance(double, State&) const noexcept {}
        [[nodiscard]] State start(double) const noexcept { return {}; }
    };
    const WaveletNetwork line{{1, {}, {}, {}, {2.0}, 0.5}, test::unit_domain()};
    const CertifiedSolver solver{piecewise(line.curve()), 4.0};
    CertifiedSolver::Memory memory{0.25};
    const Solution broken = solver.solve(Broken{}, {}, {4.0, 2.0}, memory);
    EXPECT_EQ(broken.status, Status::NonFinite);
    EXPECT_EQ(broken.evaluations, 1);
    EXPECT_EQ(memory.position, 0.25);
    for (const double q : {std::nan(""), infinity}) {
        EXPECT_EQ(solver.solve(line, {}, {4.0, q}, memory).status, Status::NonFinite);
        EXPECT_EQ(memory.position, 0.25);
    }
    EXPECT_EQ(solver.solve(line, {}, {4.0, 3.5}, memory).position, 0.5);
    EXPECT_LT(memory.low, memory.high);
    // A load line that is not proved is searched from the last solution, and no prediction remains.
    EXPECT_EQ(solver.solve(line, {}, {3.0, 4.5}, memory).status, Status::Ok);
    EXPECT_NEAR(memory.position, 0.8, 1e-12);
    EXPECT_GT(memory.low, memory.high);
}

}  // namespace
}  // namespace palpate
