// SPDX-License-Identifier: Apache-2.0
#include "palpate/solver/rising.hpp"
#include "special_values.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "palpate/model/derivatives.hpp"
#include "support.hpp"

namespace palpate {
namespace {

using test::cases;
using test::Random;
using test::uniform;

using test::epsilon;

TEST(RisingIntervals, BeginAndEndAtTheLastDigitOfEachFold) {
    Random random{311};
    int folds = 0;
    int unknown = 0;
    for (int k = 0; k < cases(60); ++k) {
        const double shift = k % 3 == 0 ? 0.0 : k % 3 == 1 ? -40.0 : -0.5;
        NetworkParameters network = test::random_network(random, static_cast<std::size_t>(1 + k % 12));
        for (double& beta : network.beta) {
            beta += shift;
        }
        const double lower = shift;
        const double upper = shift + 1.0;
        const double p = -jet(network, shift + uniform(random, 0.0, 1.0))[1];
        const auto slope = [&](double y) { return p + jet(network, y)[1]; };
        const auto intervals = rising_intervals(network, p, lower, upper);
        if (!intervals) {
            ++unknown;
            continue;
        }
        double last = -std::numeric_limits<double>::infinity();
        for (const Interval& each : *intervals) {
            ASSERT_GT(each.lower, last) << "in the order of position, and apart";
            ASSERT_LT(each.lower, each.upper);
            ASSERT_GT(slope(each.lower), 0.0);
            ASSERT_GT(slope(each.upper), 0.0);
            if (each.lower != lower) {
                ASSERT_LE(slope(std::nextafter(each.lower, lower)), 0.0) << k;
                ++folds;
            }
            if (each.upper != upper) {
                ASSERT_LE(slope(std::nextafter(each.upper, upper)), 0.0) << k;
                ++folds;
            }
            last = each.upper;
        }
        for (int j = 0; j <= 2000; ++j) {
            const double y = lower + j / 2000.0;
            bool inside = false;
            for (const Interval& each : *intervals) {
                inside = inside || (y >= each.lower && y <= each.upper);
            }
            ASSERT_EQ(inside, slope(y) > 0.0) << k << " " << y;
        }
    }
    EXPECT_GT(folds, cases(60));
    EXPECT_LE(unknown, cases(3)) << "rounding rarely hides a fold";
}

// One wavelet of dilation a and weight -w has its least slope -w a 1.3801190462 at u = -sqrt(3 - sqrt(6)) / a from
// its centre (zero of psi'': u^4 - 6 u^2 + 3 = 0). Its curvature's slope there gives the distance of both folds:
// (p + f') = d + jerk e^2 / 2.
TEST(RisingIntervals, SeparateTwoFoldsThatAreAboutToMeet) {
    for (const double sign : {1.0, -1.0}) {
        const NetworkParameters network{1, {10.0}, {0.5}, {sign}, {3.0}, 0.0};
        const double at = 0.5 - sign * std::sqrt(3.0 - std::sqrt(6.0)) / 10.0;
        const Jet there = jet(network, at);
        ASSERT_NEAR(there[2], 0.0, 1e-12);
        ASSERT_GT(there[3], 0.0);
        for (double distance = 1e-2; distance > 1e-11; distance *= 0.3) {
            const auto apart = rising_intervals(network, -there[1] - distance, 0.0, 1.0);
            ASSERT_TRUE(apart) << distance;
            ASSERT_EQ(apart->size(), 2U);
            const double half = std::sqrt(2.0 * distance / there[3]);
            const double near = 1e-9 + 20.0 * half * half + 1e-13 / half;
            EXPECT_NEAR((*apart)[0].upper, at - half, near) << distance;
            EXPECT_NEAR((*apart)[1].lower, at + half, near) << distance;
            const auto together = rising_intervals(network, -there[1] + distance, 0.0, 1.0);
            ASSERT_TRUE(together) << distance;
            ASSERT_EQ(together->size(), 1U);
            EXPECT_EQ((*together)[0].lower, 0.0);
            EXPECT_EQ((*together)[0].upper, 1.0);
        }
        // Rounding hides whether there are folds.
        for (const double distance : {0.0, 1e-15, -1e-15}) {
            EXPECT_FALSE(rising_intervals(network, -there[1] + distance, 0.0, 1.0)) << distance;
        }
    }
}

// The slope of a straight line counts as positive or negative if it exceeds twice its rounding error, a bound of the
// error of f' plus half a unit in the last digit of p on either side.
TEST(RisingIntervals, AreUnknownIfTheSlopeOfALineIsBelowRounding) {
    for (const double linear : {1.0, -1.0, 16.0}) {
        for (const double upper : {0.5, 300.0}) {
            const NetworkParameters line{1, {}, {}, {}, {linear}, 0.25};
            const double margin = 2.0 * (jet_rounding(line, upper)[1] + epsilon * std::abs(linear));
            for (const double share : {0.6, 0.9, 1.25, 1.6, 10.0}) {
                for (const double sign : {-1.0, 1.0}) {
                    const double p = -linear + sign * share * margin;
                    const double slope = p + linear;
                    const auto intervals = rising_intervals(line, p, 0.0, upper);
                    ASSERT_EQ(intervals.has_value(), std::abs(slope) > margin) << linear << " " << share;
                    if (intervals) {
                        ASSERT_EQ(intervals->size(), slope > 0.0 ? 1U : 0U);
                    }
                }
            }
        }
    }
}

TEST(RisingIntervals, AreNoneIfTheFunctionFallsEverywhere) {
    const NetworkParameters network{1, {10.0}, {0.5}, {0.1}, {1.0}, 0.0};
    const auto none = rising_intervals(network, -8.0, 0.0, 1.0);
    ASSERT_TRUE(none);
    EXPECT_TRUE(none->empty());
    const auto all = rising_intervals(network, 8.0, 0.0, 1.0);
    ASSERT_TRUE(all);
    ASSERT_EQ(all->size(), 1U);
    EXPECT_EQ(all->front().lower, 0.0);
    EXPECT_EQ(all->front().upper, 1.0);
    EXPECT_FALSE(rising_intervals(network, std::nan(""), 0.0, 1.0));
    for (const double edge : {0.0, 1.0}) {
        EXPECT_FALSE(rising_intervals(network, -jet(network, edge)[1], 0.0, 1.0)) << "a fold at the edge";
    }
}

// f' is odd about the centre of the wavelet, so the slope is exactly zero at the fold. This position is the middle of a
// cell of the first domain, and a border of two cells of the second one.
TEST(RisingIntervals, DoNotContainTheirFold) {
    for (const Interval& domain : {Interval{-1.0, 1.0}, Interval{-30.0 / 32.0, 31.0 / 32.0}}) {
        const NetworkParameters network{1, {1.0}, {0.0}, {1.0}, {0.0}, 0.0};
        const auto intervals = rising_intervals(network, 0.0, domain.lower, domain.upper);
        ASSERT_TRUE(intervals);
        ASSERT_FALSE(intervals->empty());
        EXPECT_GT(intervals->front().lower, 0.0);
        EXPECT_LT(intervals->front().lower, 1e-300);
    }
}

// The wavelets cancel each other, so f' = f'' = 0, but they count in the bound J of |f'''|. A cell of radius r needs the
// slope J r^2 / 2. Bisection of 61 cells into 128 parts each examines 61 * 255 cells; 256 parts are too many.
TEST(RisingIntervals, NeedCellsAsNarrowAsTaylorsFormula) {
    const NetworkParameters network{1, {1.0, 1.0}, {0.5, 0.5}, {1.0, -1.0}, {1.0}, 0.0};
    const double radius = 0.5 / 61.0 / 128.0;
    const double least = 0.5 * derivative_bounds(network, 0.0, 1.0)[3] * radius * radius;
    for (const double sign : {1.0, -1.0}) {
        EXPECT_TRUE(rising_intervals(network, sign * 1.01 * least - 1.0, 0.0, 1.0));
        EXPECT_FALSE(rising_intervals(network, sign * 0.99 * least - 1.0, 0.0, 1.0));
    }
}

// Folds of a narrow wavelet at every place, also on the borders of the cells of the search (61 parts of the domain and
// their halves).
TEST(RisingIntervals, FindANarrowFallAtAnyPlace) {
    for (int k = 0; k <= 244; ++k) {
        const double centre = 0.1 + 0.8 * k / 244.0;
        const NetworkParameters network{1, {400.0}, {centre}, {0.1}, {1.0}, 0.0};
        const auto intervals = rising_intervals(network, 1.0, 0.0, 1.0);
        ASSERT_TRUE(intervals) << k;
        // f' = 1 + 40 psi'(u), and psi'(u) = (3 - u^2) u exp(-u^2/2) is < -2/40 between two pairs of zeros: for
        // -sqrt(3) < u < 0 and for u > sqrt(3).
        ASSERT_EQ(intervals->size(), 3U) << k;
        EXPECT_LT((*intervals)[0].upper, centre);
        EXPECT_GT((*intervals)[2].lower, centre);
        EXPECT_NEAR((*intervals)[1].lower, centre, 1e-3);
    }
}

}  // namespace
}  // namespace palpate
