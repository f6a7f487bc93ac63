// SPDX-License-Identifier: Apache-2.0
#include "palpate/solver/inverse_table.hpp"
#include "special_values.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/model/derivatives.hpp"
#include "support.hpp"

namespace palpate {
namespace {

using test::cases;
using test::Random;
using test::uniform;

using test::epsilon;
using test::infinity;

/// Returns F(y) = f(y) + p y in extended precision.
long double exact(const NetworkParameters& network, long double p, long double y) {
    long double sum = (static_cast<long double>(network.linear[0]) + p) * y + network.bias;
    for (std::size_t i = 0; i < network.weight.size(); ++i) {
        const long double u = network.alpha[i] * (y - network.beta[i]);
        sum += network.weight[i] * (u * u - 1.0L) * std::exp(-0.5L * u * u);
    }
    return sum;
}

/// Returns the position y between `low` and `high` with F(y) = q in extended precision, by bisection.
long double solution(const NetworkParameters& network, double p, double q, long double low,
                     long double high) {
    for (int k = 0; k < 70; ++k) {
        const long double middle = 0.5L * (low + high);
        (exact(network, p, middle) < q ? low : high) = middle;
    }
    return 0.5L * (low + high);
}

RisingForce rising(const NetworkParameters& network, double p, Interval positions = {0.0, 1.0}) {
    return {network,
            p,
            positions,
            {static_cast<double>(exact(network, p, positions.lower)),
             static_cast<double>(exact(network, p, positions.upper))}};
}

/// Returns the largest true error of a table, at the middle and near both ends of each of its cells.
double true_error(const InverseTable& table, const NetworkParameters& network, double p) {
    double worst = 0.0;
    const double width = table.table.width();
    for (std::size_t k = 0; k < table.table.size(); ++k) {
        for (const double t : {-0.35, 0.0, 0.1, 0.35}) {
            const double q = table.table.middle(k) + width * t;
            if (table.covers(q)) {
                // Newton's method in extended precision
                const double start = table.at(q);
                long double y = start;
                for (int step = 0; step < 3; ++step) {
                    y -= (exact(network, p, y) - q) / (p + jet(network, static_cast<double>(y))[1]);
                }
                worst = std::max(worst, static_cast<double>(std::abs(start - y)));
            }
        }
    }
    return worst;
}

double rising_slope(Random& random, const NetworkParameters& network) {
    const Interval slope = slope_bounds(network, 0.0, 1.0, 1e-6);
    return -slope.lower + (slope.upper - slope.lower + 0.1) * std::exp(uniform(random, -1.0, 2.0));
}

// The proved error is never smaller than the true one. While rounding is negligible it is on average at most six
// times as large.
TEST(InverseTable, HasAProvedErrorThatIsTight) {
    Random random{331};
    double logarithms = 0.0;
    int tables = 0;
    for (int k = 0; k < cases(40); ++k) {
        const NetworkParameters network = test::random_network(random, static_cast<std::size_t>(1 + k % 5));
        const double p = rising_slope(random, network);
        const double required = std::pow(10.0, -4.0 - k % 5);
        for (const InverseTable& table : inverse_tables(rising(network, p), required, 1024)) {
            ASSERT_LE(table.error, required);
            const double error = true_error(table, network, p);
            ASSERT_LE(error, table.error) << k;
            if (error > 1e-13) {
                logarithms += std::log(table.error / error);
                ++tables;
            }
        }
    }
    ASSERT_GT(tables, cases(20));
    EXPECT_LE(std::exp(logarithms / tables), 6.0);
}

// For a straight line the polynomial is exact, and only rounding is left.
TEST(InverseTable, HasAnErrorOfAFewRoundingsForALine) {
    for (const double p : {0.0, 3.0, 1000.0}) {
        const NetworkParameters line{1, {}, {}, {}, {1.0}, 0.25};
        const auto tables = inverse_tables(rising(line, p), 1e-12, 8192);
        ASSERT_EQ(tables.size(), 1U);
        EXPECT_LE(true_error(tables[0], line, p), tables[0].error);
        EXPECT_LE(tables[0].error, 22.0 * epsilon);
    }
}

// Cells are at most 1/128 of the range wide; their width is a power of two.
TEST(InverseTable, HasTheFewestCellsForALine) {
    const NetworkParameters line{1, {}, {}, {}, {1.0}, 0.0};
    for (const double upper : {1.0, 1.5, 1.999}) {
        const RisingForce force = rising(line, 0.0, {0.0, upper});
        const double cells = 128.0 * upper + 2.0;
        const auto tables = inverse_tables(force, 1e-12, static_cast<std::size_t>(std::ceil(cells)));
        ASSERT_EQ(tables.size(), 1U);
        EXPECT_EQ(tables[0].table.width(), 1.0 / 128.0);
        EXPECT_TRUE(inverse_tables(force, 1e-12, static_cast<std::size_t>(std::ceil(cells)) - 1).empty());
        EXPECT_EQ(tables[0].values.lower, 0.0);
        EXPECT_EQ(tables[0].values.upper, upper);
    }
    // Rounding alone exceeds the error; a narrower cell would not help.
    const detail::InverseCells precise{rising(line, 0.0), 1e-18, 1.0 / 128.0};
    EXPECT_EQ(precise.size(), 129U);
    EXPECT_EQ(precise.certified(), 0U);
    EXPECT_EQ(precise.improvable(), 0U);
    EXPECT_TRUE(precise.runs().empty());
    EXPECT_TRUE(inverse_tables(rising(line, 0.0), 1e-18, 8192).empty());
}

// A position error that cannot be reached with large values: the numbers of cells would be too large to be exact.
TEST(InverseTable, NeedsValuesThatAreNotFarFromZero) {
    for (const double sign : {1.0, -1.0}) {
        const NetworkParameters far{1, {}, {}, {}, {1.0}, sign * 0x1p36};
        EXPECT_TRUE(
            inverse_tables({far, 0.0, {0.0, 1.0}, {sign * 0x1p36, sign * 0x1p36 + 1.0}}, 1.0, 8192).empty());
        const NetworkParameters near{1, {}, {}, {}, {1.0}, sign * 0x1p31};
        EXPECT_FALSE(inverse_tables({near, 0.0, {0.0, 1.0}, {sign * 0x1p31, sign * 0x1p31 + 1.0}}, 1e-3, 8192)
                         .empty());
    }
}

// The width is halved until no cell could be improved: with cells twice as wide, at least one cell could be.
TEST(InverseTable, HasTheWidestCellsWithTheRequiredError) {
    Random random{332};
    int narrower = 0;
    for (int k = 0; k < cases(30); ++k) {
        const NetworkParameters network = test::random_network(random, static_cast<std::size_t>(1 + k % 5));
        const double p = rising_slope(random, network);
        const double required = std::pow(10.0, -4.0 - k % 9);
        const RisingForce force = rising(network, p);
        const auto tables = inverse_tables(force, required, 1U << 15U);
        if (tables.size() != 1) {
            continue;
        }
        const double width = tables[0].table.width();
        EXPECT_EQ(std::exp2(std::floor(std::log2(width))), width);
        const detail::InverseCells same{force, required, width};
        EXPECT_EQ(same.size(), tables[0].table.size());
        EXPECT_EQ(same.certified(), same.size());
        EXPECT_EQ(same.improvable(), 0U);
        if (width < (force.values.upper - force.values.lower) / 256.0) {
            const detail::InverseCells wide{force, required, 2.0 * width};
            EXPECT_GT(wide.improvable(), 0U);
            EXPECT_LT(wide.certified(), wide.size());
            ++narrower;
        }
    }
    EXPECT_GE(narrower, cases(5));
}

TEST(InverseTable, OmitsCellsWithoutProofAndRunsOfFewerThanFour) {
    Random random{333};
    std::size_t several = 0;
    std::size_t shortest = 1000;
    for (int k = 0; k < cases(60); ++k) {
        const NetworkParameters network = test::random_network(random, static_cast<std::size_t>(1 + k % 8));
        const double p = rising_slope(random, network);
        const RisingForce force = rising(network, p);
        const double width =
            std::exp2(std::floor(std::log2((force.values.upper - force.values.lower) / 128.0)));
        const detail::InverseCells cells{force, std::pow(10.0, -5.0 - k % 5), width};
        const auto runs = cells.runs();
        EXPECT_LE(cells.certified() + cells.improvable(), cells.size());
        std::size_t covered = 0;
        double last = -infinity;
        for (const InverseTable& run : runs) {
            ASSERT_GE(run.table.size(), 4U);
            ASSERT_FALSE(run.empty());
            shortest = std::min(shortest, run.table.size());
            covered += run.table.size();
            const double low = run.table.middle(0) - 0.5 * width;
            const double high = run.table.middle(run.table.size() - 1) + 0.5 * width;
            ASSERT_GE(low - last, width) << "at least one cell is omitted";
            last = high;
            // The values next to the borders of the cells, unless the interval ends before
            ASSERT_EQ(run.values.lower, std::max(std::nextafter(low, high), force.values.lower));
            ASSERT_EQ(run.values.upper, std::min(std::nextafter(high, low), force.values.upper));
            ASSERT_EQ(run.positions.lower, run.at(run.values.lower));
            ASSERT_EQ(run.positions.upper, run.at(run.values.upper));
            ASSERT_TRUE(run.covers(run.values.lower) && run.covers(run.values.upper));
            ASSERT_FALSE(run.covers(std::nextafter(run.values.lower, -infinity)));
            ASSERT_FALSE(run.covers(std::nextafter(run.values.upper, infinity)));
            ASSERT_NEAR(run.positions.lower,
                        static_cast<double>(solution(network, p, run.values.lower, -0.5L, 1.5L)), run.error);
            ASSERT_NEAR(run.positions.upper,
                        static_cast<double>(solution(network, p, run.values.upper, -0.5L, 1.5L)), run.error);
        }
        ASSERT_LE(covered, cells.certified());
        ASSERT_GE(covered + 3 * (cells.size() - cells.certified() + 1), cells.certified());
        several += runs.size() > 1 ? 1 : 0;
    }
    EXPECT_GT(several, 5U);
    EXPECT_LE(shortest, 6U);
    EXPECT_FALSE(InverseTable{}.covers(0.0));
    EXPECT_TRUE(InverseTable{}.empty());
}

// At a fold the inverse is a square root. The table of a function between two folds ends near both folds.
TEST(InverseTable, EndsNearAFold) {
    // f' = 3 + 10 psi'(u) with psi'(u) = (3 - u^2) u exp(-u^2/2); F rises where p + f' > 0.
    const NetworkParameters network{1, {10.0}, {0.5}, {1.0}, {3.0}, 0.0};
    // The zeros of p + f' are found by bisection between the extremum of f' and the centre or a far position.
    const double p = -1.0;
    const auto slope = [&](double y) { return p + jet(network, y)[1]; };
    const auto zero = [&](double falling, double rises) {
        for (int k = 0; k < 80; ++k) {
            const double middle = 0.5 * (falling + rises);
            (slope(middle) > 0.0 ? rises : falling) = middle;
        }
        return rises;
    };
    const double below = zero(0.5 - 0.0742, 0.5);
    const double above = zero(0.5 + 0.2334, 0.5 + 0.1);
    std::size_t halved = 0;
    for (int k = 0; k < 24; ++k) {
        const bool folds_below = k % 2 == 0;
        const bool folds_above = k % 4 < 2;
        const double required = std::pow(10.0, -8.0 - k / 4);
        const Interval positions{folds_below ? below : below + 0.02, folds_above ? above : above - 0.02};
        RisingForce force = rising(network, p, positions);
        force.folds_below = folds_below;
        force.folds_above = folds_above;
        const auto tables = inverse_tables(force, required, 8192);
        ASSERT_EQ(tables.size(), 1U);
        const InverseTable& table = tables[0];
        const double range = force.values.upper - force.values.lower;
        const double share = (table.values.upper - table.values.lower) / range;
        const double width = table.table.width();
        EXPECT_TRUE(table.values.lower > force.values.lower || !folds_below);
        EXPECT_TRUE(table.values.upper < force.values.upper || !folds_above);
        if (folds_below || folds_above) {
            EXPECT_GE(share, 31.0 / 32.0 - 2.0 * width / range);
            const detail::InverseCells wide{force, required, 2.0 * width};
            if (width < range / 256.0) {
                EXPECT_GT(32 * wide.improvable(), wide.size()) << "of wider cells, more would be omitted";
                halved += 32 * wide.improvable() <= 2 * wide.size() ? 1 : 0;
            }
            const detail::InverseCells same{force, required, width};
            EXPECT_LE(32 * same.improvable(), same.size());
        } else {
            EXPECT_EQ(share, 1.0);
        }
        for (int j = 0; j <= 200; ++j) {
            const double q =
                std::clamp(table.values.lower + (table.values.upper - table.values.lower) * j / 200.0,
                           table.values.lower, table.values.upper);
            ASSERT_NEAR(table.at(q), static_cast<double>(solution(network, p, q, below, above)), table.error);
        }
    }
    EXPECT_GT(halved, 0U) << "at least one time from 1/16 to 1/32";
}

// In other units, all numbers are multiplied by powers of two. This adds no rounding, so the proved error is the same
// number in these units.
TEST(InverseTable, HasTheSameErrorInOtherUnits) {
    Random random{334};
    std::size_t tables = 0;
    for (int k = 0; k < cases(12); ++k) {
        const NetworkParameters network = test::random_network(random, static_cast<std::size_t>(1 + k % 4));
        const double p = rising_slope(random, network);
        const RisingForce force = rising(network, p);
        const double required = std::pow(10.0, -6.0 - k % 8);
        const auto expected = inverse_tables(force, required, 4096);
        for (const double length : {0x1p-9, 1.0, 0x1p12}) {
            for (const double unit : {0x1p-80, 1.0, 0x1p80}) {
                NetworkParameters scaled = network;
                for (std::size_t i = 0; i < network.weight.size(); ++i) {
                    scaled.alpha[i] /= length;
                    scaled.beta[i] *= length;
                    scaled.weight[i] *= unit;
                }
                scaled.linear[0] *= unit / length;
                scaled.bias *= unit;
                const RisingForce same{scaled,
                                       p * unit / length,
                                       {0.0, length},
                                       {force.values.lower * unit, force.values.upper * unit}};
                const auto found = inverse_tables(same, required * length, 4096);
                ASSERT_EQ(found.size(), expected.size());
                for (std::size_t j = 0; j < found.size(); ++j) {
                    ASSERT_EQ(found[j].error, expected[j].error * length) << k;
                    ASSERT_EQ(found[j].table.size(), expected[j].table.size());
                    ASSERT_EQ(found[j].positions.lower, expected[j].positions.lower * length);
                    ASSERT_EQ(found[j].values.upper, expected[j].values.upper * unit);
                    ++tables;
                }
            }
        }
    }
    EXPECT_GT(tables, 50U);
    // The seventh power of a cell width must not overflow or lose digits.
    for (const double unit : {0x1p-120, 0x1p120}) {
        const NetworkParameters line{1, {}, {}, {}, {unit}, 0.0};
        EXPECT_TRUE(inverse_tables({line, 0.0, {0.0, 1.0}, {0.0, unit}}, 1e-9, 4096).empty());
    }
}

// A wavelet far away leaves a straight line of slope 2, but it counts in the bounds of the rounding errors of f and its
// derivatives. With the error e_n of derivative n, the derivatives of the inverse have the errors e_0 / (2 - e_1), e_1 /
// 4, e_2 / 8 and e_3 / 16; e_3 counts twice.
TEST(InverseTable, HasTheRoundingErrorsOfAllDerivatives) {
    constexpr double width = 1.0 / 128.0;
    for (const double alpha : {16.0, 512.0, 4096.0}) {
        const auto far = [&](double weight) {
            return NetworkParameters{1, {alpha}, {1000.0}, {weight}, {1.0}, 0.0};
        };
        const double unit = jet_rounding(far(1.0), 0.0)[1];
        for (const double share : {0.05, 0.9}) {
            const NetworkParameters network = far(2.0 * share / unit);
            const Jet e = jet_rounding(network, 1.0);
            const Jet errors{e[0] / (2.0 - e[1]), e[1] / 4.0, e[2] / 8.0, 2.0 * e[3] / 16.0};
            double expected = 0.0;
            for (std::size_t d = 0; d < errors.size(); ++d) {
                expected += detail::hermite_value[d] * errors[d] * std::pow(width, d);
            }
            const RisingForce force{network, 1.0, {0.0, 1.0}, {0.0, 2.0}};
            const auto runs = detail::InverseCells{force, 2.0 * expected, width}.runs();
            ASSERT_EQ(runs.size(), 1U) << alpha;
            EXPECT_NEAR(runs[0].error, expected, 1e-6 * expected);
            const detail::InverseCells precise{force, 0.99 * expected, width};
            EXPECT_EQ(precise.certified() + precise.improvable(), 0U) << "limited by rounding";
        }
        // The slope of F is below its rounding error.
        const NetworkParameters flat = far(2.1 / unit);
        const RisingForce force{flat, 1.0, {0.0, 1.0}, {0.0, 2.0}};
        EXPECT_EQ((detail::InverseCells{force, 1e3, width}.certified()), 0U);
    }
}

// A narrow wavelet in the middle of a line has cells without proof, between two long runs.
TEST(InverseTable, OmitsNoCellWithProofNextToALongRun) {
    std::size_t odd = 0;
    for (int k = 0; k < 12; ++k) {
        const double middle_or_border = k % 2 == 0 ? 0.5 : 0.5 + 1.0 / 256.0;
        const NetworkParameters network{1, {64.0}, {middle_or_border}, {0.005}, {1.0}, 0.0};
        const RisingForce force = rising(network, 0.0);
        const detail::InverseCells cells{force, 1e-9 * std::pow(0.6, k), 1.0 / 128.0};
        const auto runs = cells.runs();
        ASSERT_EQ(runs.size(), 2U) << k;
        ASSERT_EQ(runs[0].table.size() + runs[1].table.size(), cells.certified()) << k;
        odd += (cells.size() - cells.certified()) % 2;
    }
    EXPECT_GT(odd, 0U);
    EXPECT_LT(odd, 12U);
}

// Two narrow wavelets: the run between them grows with their distance, and counts from four cells on.
TEST(InverseTable, HasRunsOfFourCells) {
    std::size_t shortest = 1000;
    for (int k = 0; k < 40; ++k) {
        const double half = 0.05 + 0.002 * k;
        const NetworkParameters network{1,     {64.0, 64.0}, {0.5 - half, 0.5 + half}, {0.005, 0.005},
                                        {1.0}, 0.0};
        const RisingForce force = rising(network, 0.0);
        const detail::InverseCells cells{force, 1e-10, 1.0 / 128.0};
        std::size_t covered = 0;
        for (const InverseTable& run : cells.runs()) {
            covered += run.table.size();
            shortest = std::min(shortest, run.table.size());
        }
        ASSERT_LE(cells.certified() - covered, 3U) << k;
    }
    EXPECT_EQ(shortest, 4U);
}

// F = y^3 + y at y = 1
TEST(InverseJet, ContainsTheDerivativesOfTheInverse) {
    const Jet inverse = detail::inverse_jet(1.0, {2.0, 4.0, 6.0, 6.0});
    EXPECT_EQ(inverse[0], 1.0);
    EXPECT_EQ(inverse[1], 1.0 / 4.0);
    EXPECT_EQ(inverse[2], -6.0 / 64.0);
    EXPECT_EQ(inverse[3], (3.0 * 36.0 - 4.0 * 6.0) / 1024.0);
}

// Changes of all signs: if the third derivative is negative, the largest change reaches the bound.
TEST(InverseJet, ChangesByAtMostItsBound) {
    for (const Jet& f : {Jet{0.0, 2.0, 1.5, -3.0}, Jet{0.0, 0.5, -0.25, -0.125}, Jet{0.0, 2.0, 1.5, 3.0}}) {
        const Jet change{1e-6, 3e-6, 5e-6, 7e-6};
        const Jet bound = detail::inverse_change(f, change);
        const Jet inverse = detail::inverse_jet(0.5, f);
        Jet largest{};
        for (unsigned signs = 0; signs < 16; ++signs) {
            Jet other = f;
            other[0] = 0.5;
            for (std::size_t n = 0; n < other.size(); ++n) {
                other[n] += (signs >> n & 1U) != 0 ? change[n] : -change[n];
            }
            const Jet changed = detail::inverse_jet(other[0], other);
            for (std::size_t n = 0; n < other.size(); ++n) {
                largest[n] = std::max(largest[n], std::abs(changed[n] - inverse[n]));
            }
        }
        for (std::size_t n = 0; n < f.size(); ++n) {
            EXPECT_LE(largest[n], bound[n] * (1.0 + 2e-4)) << n;
            if (f[3] < 0.0) {
                EXPECT_GE(largest[n], bound[n] * (1.0 - 2e-4)) << n;
            }
        }
    }
}

// P = (1 + t)^7: P^(j) / j! = (7 over j) (1 + t)^(7 - j)
TEST(TaylorBounds, AreTheCoefficientsAtTheEndOfTheCell) {
    const std::array<double, 8> binomials{1.0, 7.0, 21.0, 35.0, 35.0, 21.0, 7.0, 1.0};
    auto alternating = binomials;
    for (std::size_t j = 1; j < alternating.size(); j += 2) {
        alternating[j] = -alternating[j];
    }
    for (const auto& c : {binomials, alternating}) {
        const detail::TaylorBounds bounds = detail::taylor_bounds(c);
        for (std::size_t j = 1; j < c.size(); ++j) {
            EXPECT_DOUBLE_EQ(bounds[j], binomials[j] * std::pow(1.5, 7.0 - static_cast<double>(j)));
        }
        EXPECT_EQ(bounds[8], 0.0);
    }
}

// With P = t / (1 - t) the coefficient of t^8 in P^n is (7 over n - 1). With P = -log(1 - t) and F = exp, F(P) = 1 / (1 -
// t) has the coefficient 1, of which 1/8 comes from n = 1.
TEST(TaylorBounds, GiveTheEighthCoefficientOfAComposition) {
    const std::array<double, 8> binomials{1.0, 7.0, 21.0, 35.0, 35.0, 21.0, 7.0, 1.0};
    detail::TaylorBounds geometric{};
    detail::TaylorBounds logarithm{};
    for (std::size_t j = 1; j < geometric.size(); ++j) {
        geometric[j] = 1.0;
        logarithm[j] = 1.0 / static_cast<double>(j);
    }
    double factorial = 1.0;
    for (std::size_t n = 1; n <= highest_derivative; ++n) {
        factorial *= static_cast<double>(n);
        DerivativeBounds outer{};
        outer[n] = factorial;
        EXPECT_DOUBLE_EQ(detail::eighth_coefficient(outer, geometric),
                         n >= 2 && n <= 8 ? binomials[n - 1] : 0.0);
    }
    DerivativeBounds exponential{};
    exponential.fill(1.0);
    EXPECT_DOUBLE_EQ(detail::eighth_coefficient(exponential, logarithm), 7.0 / 8.0);
}

// The proof uses the slope at all positions that differ from the polynomial by at most the required error.
TEST(InverseTable, EndsAtTheRequiredErrorBeforeAFallOutsideTheInterval) {
    // f' = 1 + 20 psi'(u) is negative just below the centre 1.3 of the wavelet.
    const NetworkParameters network{1, {20.0}, {1.3}, {1.0}, {1.0}, 0.0};
    const RisingForce force = rising(network, 0.0);
    const detail::InverseCells cells{force, 0.5, 1.0 / 128.0};
    const auto runs = cells.runs();
    ASSERT_EQ(runs.size(), 1U);
    EXPECT_GT(runs[0].positions.upper, 0.3);
    EXPECT_LT(runs[0].positions.upper, 0.8);
}

TEST(InverseTable, IsEmptyIfTheFunctionDoesNotRise) {
    const NetworkParameters falling{1, {}, {}, {}, {-1.0}, 0.0};
    const detail::InverseCells cells{{falling, 0.0, {0.0, 1.0}, {0.0, 1.0}}, 1e-6, 1.0 / 128.0};
    EXPECT_EQ(cells.certified(), 0U);
    EXPECT_TRUE(cells.runs().empty());
}

}  // namespace
}  // namespace palpate
