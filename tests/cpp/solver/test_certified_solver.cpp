// SPDX-License-Identifier: Apache-2.0
#include "palpate/solver/certified_solver.hpp"
#include "special_values.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
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

using test::epsilon;
using test::infinity;

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

/// Returns the largest max|F''| / (2 min F') of press, release, and sticking, by samples. Of the positions of the play
/// operator at which it can stick, the extreme ones are at the distance r from an end of the cell.
double sampled(const HysteresisNetwork& pair, double p, double low, double high) {
    const double r = pair.play_radius();
    double worst = 0.0;
    for (const bool sticks : {false, true}) {
        for (const double sign : {-1.0, 1.0}) {
            const double play = sign > 0.0 ? low - r : high + r;
            Steepness of;
            for (int j = 0; j <= samples; ++j) {
                const double y = sample_of(low, high, j);
                const double s = sticks ? (y - play) / r : sign;
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

/// Numbers of cells and sums of their curvatures, compared with the fewest possible cells and the true curvatures.
struct Tightness {
    std::size_t cells = 0;
    std::size_t fewest = 0;
    double proved = 0.0;
    double sampled = 0.0;

    /// Adds the cells of one force over [0, 1], and tests that they are adjacent and satisfy condition (C).
    template <class Ratio>
    void add(const std::vector<CertifiedSolver::Memory>& added, Ratio ratio) {
        double last = 0.0;
        for (const auto& cell : added) {
            ASSERT_NEAR(cell.low, last, 1e-14) << "the cells are adjacent";
            last = cell.high;
            const double width = cell.high - cell.low;
            const double expected = ratio(cell.low, cell.high);
            ASSERT_LE(8.0 * width * cell.curvature, 1.0);
            ASSERT_GE(cell.curvature, expected * (1.0 - 1e-9));
            proved += width * cell.curvature;
            sampled += width * expected;
        }
        ASSERT_NEAR(last, 1.0, 1e-14);
        cells += added.size();
        fewest += fewest_cells(0.0, 1.0, ratio);
    }
    /// Tests that the proof needs few more cells than possible, and that its curvatures are near the true ones.
    void expect_at_most(double more_cells, double more_curvature) const {
        EXPECT_GE(cells, fewest);
        EXPECT_LE(static_cast<double>(cells), more_cells * static_cast<double>(fewest));
        EXPECT_LE(proved, more_curvature * sampled);
    }
};

TEST(CertifiedSolver, HasTightCellsThatSatisfyItsCondition) {
    Random random{321};
    Tightness tightness;
    for (int k = 0; k < cases(16); ++k) {
        const WaveletNetwork network = random_scene(random, k);
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
        ASSERT_LE(cells.size(), solver.cells());
        ASSERT_LE(solver.cells(), cells.size() + (k % 2 == 0 ? 20 : 0))
            << "other cells are on the lines to zero force outside the domain";
        tightness.add(cells,
                      [&](double low, double high) { return sampled(network.parameters(), p, low, high); });
    }
    tightness.expect_at_most(1.45, 1.25);
}

TEST(CertifiedSolver, HasTightCellsForPressReleaseAndSticking) {
    Random random{322};
    Tightness tightness;
    for (int k = 0; k < cases(6); ++k) {
        const HysteresisNetwork pair = random_pair(random, k);
        const double p = rising_slope(random, pair);
        const CertifiedSolver solver{pair, p};
        ASSERT_TRUE(solver.unique(p)) << k;
        const double r = pair.play_radius();
        const double far = k % 2 == 0 ? -5.0 : 5.0;
        const auto cells = all_cells(0.0, 1.0, [&](double y) {
            CertifiedSolver::Memory memory;
            EXPECT_EQ(solver.solve(pair, {far}, {p, pair.at(y, {far}).force + p * y}, memory).status,
                      Status::Ok);
            EXPECT_EQ(memory.play, far);
            return memory;
        });
        tightness.add(cells, [&](double low, double high) { return sampled(pair, p, low, high); });
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
    tightness.expect_at_most(1.55, 1.3);
}

// g = 2 y and h = 0.3 + h1 y: while sticking, F' = p + 2 + s h1 + h / r with |s| <= 1 + w / r, and F'' = 2 h1 / r.
TEST(CertifiedSolver, HasTheExactCurvatureOfALinearHysteresis) {
    constexpr double p = 1.0;
    constexpr double r = 0.25;
    for (const double h1 : {0.2, -0.2}) {
        const HysteresisNetwork pair{{1, {}, {}, {}, {2.0}, 0.5}, {{}, h1, 0.3}, test::unit_domain(), r};
        const CertifiedSolver solver{pair, p};
        ASSERT_TRUE(solver.unique(p));
        for (double y = 1e-9; y < 1.0;) {
            CertifiedSolver::Memory memory;
            ASSERT_EQ(solver.solve(pair, {-9.0}, {p, pair.at(y, {-9.0}).force + p * y}, memory).status,
                      Status::Ok);
            const double width = memory.high - memory.low;
            const double h = 0.3 + h1 * (h1 > 0.0 ? memory.low : memory.high);
            const double least = p + 2.0 - (1.0 + width / r) * std::abs(h1) + h / r;
            ASSERT_NEAR(memory.curvature * least, std::abs(h1) / r, 1e-12);
            y = memory.high + 1e-9;
        }
    }
}

// The polynomials g and h with the coefficients a and b: derivative n at 0 is n! times coefficient n. A sheet is g + (s +
// y / r) h.
TEST(Sheet, HasTheDerivativesOfTheProduct) {
    const Derivatives a{0.5, -2.0, 3.0, 0.25, -7.0};
    const Derivatives b{1.5, 4.0, -0.5, 2.0, 0.75};
    const Derivatives factorials{1.0, 1.0, 2.0, 6.0, 24.0};
    detail::Expansion g;
    detail::Expansion h;
    for (std::size_t n = 0; n < a.size(); ++n) {
        g.middle[n] = factorials[n] * a[n];
        h.middle[n] = factorials[n] * b[n];
        // Much larger than the rounding of the sum
        g.rounding[n] = 0.01 * static_cast<double>(n + 1);
        h.rounding[n] = 0.03 * static_cast<double>(5 - n);
    }
    g.over[5] = 11.0;
    h.over[5] = 13.0;
    h.over[4] = 17.0;
    for (const double by_radius : {0.0, 4.0}) {
        for (const double s : {-1.5, 1.0}) {
            const detail::Expansion f = detail::sheet(g, h, s, by_radius);
            for (std::size_t n = 1; n < a.size(); ++n) {
                const double times = static_cast<double>(n) * by_radius;
                EXPECT_NEAR(f.middle[n], factorials[n] * (a[n] + s * b[n] + by_radius * b[n - 1]), 1e-11);
                EXPECT_NEAR(f.rounding[n],
                            g.rounding[n] + std::abs(s) * h.rounding[n] + times * h.rounding[n - 1], 1e-11);
            }
            EXPECT_EQ(f.over[5], 11.0 + std::abs(s) * 13.0 + 5.0 * by_radius * 17.0);
        }
    }
}

// Two of the three terms nearly cancel, so the rounding error is much larger than the last digit of the sum.
TEST(Sheet, BoundsTheRoundingOfItsSum) {
    Random random{327};
    for (int k = 0; k < cases(3000); ++k) {
        detail::Expansion g;
        detail::Expansion h;
        const double s = uniform(random, 1.0, 1.5);
        const double by_radius = uniform(random, 1.0, 5.0);
        h.middle[k % 2] = uniform(random, 1.0, 2.0);
        g.middle[1] = -s * h.middle[1] - by_radius * h.middle[0] + uniform(random, -1e-15, 1e-15);
        if (k % 3 == 0) {
            g.middle[1] = uniform(random, -1e-15, 1e-15);
            h.middle = {s / by_radius, -1.0, 0.0, 0.0, 0.0};
        }
        const detail::Expansion f = detail::sheet(g, h, s, by_radius);
        const long double exact = static_cast<long double>(g.middle[1]) +
                                  static_cast<long double>(s) * h.middle[1] +
                                  static_cast<long double>(by_radius) * h.middle[0];
        ASSERT_LE(std::abs(f.middle[1] - exact), f.rounding[1]) << k;
    }
}

// Slopes F' that are polynomials of degree 2 have an exact bound; of higher terms, the lowest slope and the largest
// curvature are at an end of the cell.
TEST(Sheet, HasTheExactCurvatureOfACubic) {
    Random random{328};
    for (int k = 0; k < cases(2000); ++k) {
        const double r = uniform(random, 0.02, 0.1);
        const double p = uniform(random, 1.0, 2.0);
        detail::Expansion f;
        f.middle = {0.0, uniform(random, 0.5, 1.0), uniform(random, -1.0, 1.0), uniform(random, -20.0, 20.0),
                    0.0};
        double least = infinity;
        double most = 0.0;
        const double lowest = std::clamp(-f.middle[2] / f.middle[3], -r, r);
        for (const double y : {-r, r, lowest}) {
            least = std::min(least, p + f.middle[1] + f.middle[2] * y + 0.5 * f.middle[3] * y * y);
            most = std::max(most, std::abs(f.middle[2] + f.middle[3] * y));
        }
        const double c = detail::proved_curvature(f, p, r);
        if (8.0 * r * most < least * (1.0 - 1e-9)) {
            ASSERT_NEAR(c, 0.5 * most / least, 1e-12 * c);
        } else if (8.0 * r * most > least * (1.0 + 1e-9)) {
            ASSERT_EQ(c, infinity);
        }
    }
    EXPECT_EQ(detail::proved_curvature({}, 0.0, 1.0), infinity);
}

// With one more term than the slope 1000, the lowest slope and the largest curvature have closed forms.
TEST(Sheet, CountsEachTermOfTaylorsFormula) {
    constexpr double r = 0.5;
    const auto expect = [&](const detail::Expansion& f, double fall, double most) {
        EXPECT_NEAR(detail::proved_curvature(f, 1000.0, r), 0.5 * most / (1000.0 - fall), 1e-12);
    };
    for (const double sign : {1.0, -1.0}) {
        detail::Expansion fourth;
        fourth.middle[4] = sign * 48.0;
        expect(fourth, 48.0 * r * r * r / 6.0, 48.0 * r * r / 2.0);
    }
    detail::Expansion fifth;
    fifth.over[5] = 96.0;
    expect(fifth, 96.0 * r * r * r * r / 24.0, 96.0 * r * r * r / 6.0);
    // An error e_n of derivative n changes F' by e_n r^(n-1) / (n-1)! and F'' by e_n r^(n-2) / (n-2)!.
    const Derivatives falls{0.0, 1.0, r, r * r / 2.0, r * r * r / 6.0};
    const Derivatives bends{0.0, 0.0, 1.0, r, r * r / 2.0};
    for (std::size_t n = 1; n < falls.size(); ++n) {
        detail::Expansion rounded;
        rounded.middle[2] = 1.0;
        rounded.rounding[n] = 24.0;
        expect(rounded, r + 24.0 * falls[n], 1.0 + 24.0 * bends[n]);
    }
    // The sum of slopes p + f' has a rounding error.
    detail::Expansion cancelled;
    cancelled.middle[1] = -1000.0 + 1e-13;
    EXPECT_EQ(detail::proved_curvature(cancelled, 1000.0, r), infinity);
}

/// An object that records the positions at which its force is evaluated.
struct RecordedPoints {
    using State = Stateless;
    const WaveletNetwork& network;
    std::vector<double>& visited;

    [[nodiscard]] EnvironmentSample at(double y, const State& state) const noexcept {
        visited.push_back(y);
        return network.at(y, state);
    }
    void advance(double /*y*/, State& /*stateless*/) const noexcept {}
    [[nodiscard]] State start(double /*y*/) const noexcept { return {}; }
};

// Also around position 0, at which a force without hysteresis has no kink
TEST(CertifiedSolver, EvaluatesOnlyTheCellsOfTheLastAndTheNewSolution) {
    const NetworkParameters parameters{1, {3.0, 9.0}, {0.2, -0.4}, {0.5, 0.2}, {1.0}, 0.0};
    const WaveletNetwork network{parameters,
                                 {{-1.0}, {1.0}, Continuation::Linear, Continuation::Linear, std::nullopt}};
    const double p = 1.2 * test::steepest_fall(piecewise(network.curve()));
    const CertifiedSolver solver{piecewise(network.curve()), p};
    ASSERT_TRUE(solver.unique(p));
    std::vector<double> visited;
    const RecordedPoints object{network, visited};
    const auto solve = [&](double y, CertifiedSolver::Memory& memory) {
        visited.clear();
        return solver.solve(object, {}, {p, network.at(y, {}).force + p * y}, memory).position;
    };
    std::size_t cells = 0;
    CertifiedSolver::Memory cell;
    for (double y = -1.0 + 1e-9; y < 1.0; y = cell.high + 1e-9) {
        cell = {};
        ASSERT_NEAR(solve(y, cell), y, 1e-12);
        ++cells;
        for (int j = 0; j <= 100; ++j) {
            const double target = -1.4 + 2.8 * j / 100.0;
            CertifiedSolver::Memory memory = cell;
            ASSERT_NEAR(solve(target, memory), target, 1e-12);
            for (const double position : visited) {
                ASSERT_TRUE((position > cell.low && position < cell.high) ||
                            (position >= memory.low - 1e-14 && position <= memory.high + 1e-14));
            }
        }
    }
    EXPECT_EQ(cells, solver.cells());
    for (const double q : {std::nan(""), infinity, -infinity}) {
        visited.clear();
        CertifiedSolver::Memory memory{0.5};
        EXPECT_EQ(solver.solve(object, {}, {p, q}, memory).status, Status::NonFinite);
        EXPECT_EQ(visited, std::vector<double>{0.5});
    }
    EXPECT_FALSE(CertifiedSolver::tabulated());
}

// The last tangent is 10^4 times too steep, so a correction by this tangent is small at positions far from the solution.
TEST(CertifiedSolver, IsExactAfterALargeChangeOfTheLoadLine) {
    const WaveletNetwork line{{1, {}, {}, {}, {0.001}, 0.0},
                              {{-1.0}, {1.0}, Continuation::Linear, Continuation::Linear, std::nullopt}};
    const CertifiedSolver solver{piecewise(line.curve()), 0.01};
    for (const double q : {2e-12, -2e-12, 1e-9}) {
        CertifiedSolver::Memory memory;
        ASSERT_EQ(solver.solve(line, {}, {100.0, 0.0}, memory).position, 0.0);
        EXPECT_NEAR(solver.solve(line, {}, {0.01, q}, memory).position, q / 0.011, 2e-13);
    }
    // A load line without proof has the same solution, and leaves no prediction.
    CertifiedSolver::Memory memory;
    ASSERT_EQ(solver.solve(line, {}, {0.01, 0.0}, memory).position, 0.0);
    ASSERT_LT(memory.low, memory.high);
    EXPECT_EQ(solver.solve(line, {}, {0.0099, 0.0}, memory).position, 0.0);
    EXPECT_GT(memory.low, memory.high);
}

// Positions inside the domain, on the lines that end at zero force, and beyond these lines
TEST(CertifiedSolver, SolvesAtEveryPositionOfTheLinesOutsideTheDomain) {
    Random random{329};
    for (int k = 0; k < cases(20); ++k) {
        const HysteresisNetwork pair = random_pair(random, k);
        const double p = rising_slope(random, pair);
        const CertifiedSolver solver{pair, p};
        ASSERT_TRUE(solver.unique(p));
        CertifiedSolver::Memory memory;
        for (int j = 0; j < 300; ++j) {
            const double y = uniform(random, -1.5, 2.5);
            const HysteresisNetwork::State state{y + pair.play_radius() * uniform(random, -1.5, 1.5)};
            const double q = pair.at(y, state).force + p * y;
            const Solution solution = solver.solve(pair, state, {p, q}, memory);
            ASSERT_NEAR(solution.position, y, 1e-11) << k << " " << j;
            ASSERT_LE(solution.evaluations, 4);
        }
    }
}

// The slope of g is 2 and rises to 12 in the last 2 % of the domain, so the line outside has a slope near 2. There h / r
// is -10, and the sticking sheet rises only for p > 8; inside the domain it rises for p > 0.
TEST(CertifiedSolver, NeedsARisingStickingSheetOutsideTheDomain) {
    const double u = -std::sqrt(3.0 + std::sqrt(6.0));
    const double slope = (3.0 - u * u) * u * std::exp(-0.5 * u * u);
    const double value = (u * u - 1.0) * std::exp(-0.5 * u * u);
    const HysteresisNetwork pair{{1, {200.0}, {1.0 - u / 200.0}, {10.0 / (200.0 * slope)}, {2.0}, 0.5},
                                 {{-0.01 / value}, 0.0, 0.0},
                                 test::unit_domain(),
                                 0.001};
    const double outside = pair.force().above().at_edge.slope;
    ASSERT_NEAR(outside, 2.0, 0.1);
    EXPECT_FALSE((CertifiedSolver{pair, 9.9 - outside}.unique(9.9 - outside)));
    EXPECT_TRUE((CertifiedSolver{pair, 10.1 - outside}.unique(10.1 - outside)));
}

// Each wavelet adds a few dozen cells to a load line that is close to non-unique.
TEST(CertifiedSolver, HasNoCellsIfMoreThan4096AreNeeded) {
    const auto solver = [](int wavelets) {
        NetworkParameters network{1, {}, {}, {}, {0.0}, 0.0};
        for (int k = 0; k < wavelets; ++k) {
            network.alpha.push_back(8.0 * wavelets);
            network.beta.push_back((k + 0.5) / wavelets);
            network.weight.push_back(1.0 / wavelets);
        }
        const WaveletNetwork all{network, test::unit_domain()};
        const PiecewiseForce force = piecewise(all.curve());
        return CertifiedSolver{force, 1.01 * test::steepest_fall(force)};
    };
    const std::size_t of_ten = solver(10).cells();
    EXPECT_GT(of_ten, 200U);
    EXPECT_EQ(solver(static_cast<int>(60000 / of_ten)).cells(), 0U);
    EXPECT_GT(solver(static_cast<int>(30000 / of_ten)).cells(), 2000U);
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
            ASSERT_TRUE(std::isfinite(memory.low) && std::isfinite(memory.high));
        }
    }
}

// Press and release force differ by 2 N. The load line rises by this in 16 turns of 2 rad.
TEST(CertifiedSolver, FindsTheTurnOfAKnobWhoseHysteresisIsLargeForTheLoadLine) {
    const double p = 0.0625;
    const Domain knob{{37.25}, {39.25}, Continuation::Linear, Continuation::Linear, 2.0};
    const HysteresisNetwork pair{{1, {10.0}, {37.75}, {0.002}, {0.0}, 0.5}, {{0.0}, 0.0, 1.0}, knob, 0.125};
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
        const Domain domain{{0.0}, {8.0}, Continuation::Linear, Continuation::Linear, std::nullopt};
        if (radius > 0.0) {
            const HysteresisNetwork pair{network, {std::vector<double>(n, 0.0), 0.0, 0.1}, domain, radius};
            return CertifiedSolver{pair, 100.0}.uncertified().longest_step;
        }
        return CertifiedSolver{piecewise(WaveletNetwork{network, domain}.curve()), 100.0}
            .uncertified()
            .longest_step;
    };
    EXPECT_EQ(longest({}, 0.0), 2.0);             // a quarter of the domain
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
