// SPDX-License-Identifier: Apache-2.0
#include "palpate/model/continuation.hpp"
#include "special_values.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace palpate {
namespace {

using test::infinity;

/// Returns the integral of a polynomial of degree at most 3 by Simpson's rule, which is exact for it.
template <class F>
double simpson(const F& f, double from, double to) {
    return (to - from) / 6.0 * (f(from) + 4.0 * f(0.5 * (from + to)) + f(to));
}

// The antiderivatives are compared with integrals of the force, on both sides, within and beyond the reach.
TEST(EdgeLine, AntiderivativesAreTheIntegralsOfTheForce) {
    for (const double reach : {0.5, infinity}) {
        for (const double outward : {-1.0, 1.0}) {
            const double slope = std::isinf(reach) ? 3.0 : -outward * 1.5 / reach;
            const EdgeLine line{2.0, {1.5, slope, 0.7, -0.4}, reach};
            const auto force = [&](double x) {
                return std::abs(x - 2.0) <= reach ? 1.5 + slope * (x - 2.0) : 0.0;
            };
            const auto integral = [&](double x) {
                const double end = 2.0 + outward * std::min(std::abs(x - 2.0), reach);
                return 0.7 + simpson(force, 2.0, end);
            };
            for (const double distance : {0.0, 0.1, 0.3, 0.4999, 0.5001, 0.8, 2.0}) {
                const double x = 2.0 + outward * distance;
                const double middle = 2.0 + outward * std::min(distance, reach);
                const Curve curve = line.at(x);
                EXPECT_NEAR(curve.value, force(x), 1e-14) << x;
                EXPECT_EQ(curve.slope, distance < reach ? slope : 0.0) << x;
                EXPECT_NEAR(curve.integral, integral(x), 1e-14) << x;
                EXPECT_NEAR(curve.double_integral,
                            -0.4 + simpson(integral, 2.0, middle) + simpson(integral, middle, x), 1e-13)
                    << x;
            }
        }
    }
}

TEST(EdgeLine, EndsExactlyAtItsReach) {
    const EdgeLine line{2.0, {1.5, -3.0, 0.0, 0.0}, 0.5};
    EXPECT_EQ(line.at(2.5).value, 0.0);
    EXPECT_EQ(line.at(2.5).slope, 0.0);
    EXPECT_EQ(line.at(std::nextafter(2.5, 2.0)).slope, -3.0);
}

TEST(EdgeLine, WithoutReachIsALineUpToInfinity) {
    const EdgeLine line{2.0, {1.5, 3.0, 0.0, 0.0}};
    EXPECT_EQ(line.at(infinity).value, infinity);
    EXPECT_EQ(line.at(-infinity).value, -infinity);
    EXPECT_EQ(line.at(infinity).slope, 3.0);
}

/// A domain of length 4 with the largest force 6: the least slope of a force that pushes outward is 1.5.
constexpr CurveExtent extent{4.0, 6.0, 5.0};

// At each edge, a force of sign `outward` pulls the tool back into the domain, and one of the other sign pushes it out.
TEST(ContinueForce, LimitsTheSlopeOfTheLine) {
    for (const double outward : {-1.0, 1.0}) {
        const auto slope = [&](double force, double fitted) {
            const EdgeLine line =
                continue_force(7.0, {force, fitted, 0.3, 0.2}, outward, Continuation::Linear, extent);
            EXPECT_EQ(line.edge, 7.0);
            EXPECT_EQ(line.at_edge.value, force);
            EXPECT_EQ(line.at_edge.integral, 0.3);
            EXPECT_EQ(line.at_edge.double_integral, 0.2);
            EXPECT_EQ(line.reach, infinity);
            return line.at_edge.slope;
        };
        for (const double pull : {0.0, outward * 0.2, outward * 3.0}) {
            EXPECT_EQ(slope(pull, -1.0), 0.0) << pull;
            EXPECT_EQ(slope(pull, 0.5), 0.5) << pull;
            EXPECT_EQ(slope(pull, 4.0), 4.0) << pull;
            EXPECT_EQ(slope(pull, 9.0), 5.0) << pull;
        }
        for (const double push : {-outward * 0.2, -outward * 3.0}) {
            EXPECT_EQ(slope(push, -1.0), 1.5) << push;
            EXPECT_EQ(slope(push, 0.5), 1.5) << push;
            EXPECT_EQ(slope(push, 4.0), 4.0) << push;
            EXPECT_EQ(slope(push, 9.0), 5.0) << push;
        }
    }
}

TEST(ContinueForce, FreeLineEndsAtZeroForceOutsideTheDomain) {
    for (const double outward : {-1.0, 1.0}) {
        for (const double fitted : {-1.0, 0.5, 4.0}) {
            for (const double force : {-3.0, -0.2, 0.2, 1.0, 3.0}) {
                const EdgeLine line =
                    continue_force(7.0, {force, fitted, 0.0, 0.0}, outward, Continuation::Free, extent);
                const bool pulls = outward * force > 0.0;
                EXPECT_EQ(line.at_edge.slope, pulls ? -1.5 : std::max(1.5, fitted));
                EXPECT_GT(line.reach, 0.0);
                EXPECT_NEAR(line.at_edge.value + line.at_edge.slope * outward * line.reach, 0.0, 1e-15);
            }
            const EdgeLine none =
                continue_force(7.0, {0.0, fitted, 0.0, 0.0}, outward, Continuation::Free, extent);
            EXPECT_EQ(none.reach, 0.0) << "without force the tool leaves at once";
            EXPECT_EQ(none.at_edge.slope, std::max(0.0, fitted));
            EXPECT_EQ(none.at(7.0 + 1e-9 * outward).value, 0.0);
        }
    }
}

TEST(ContinueHysteresis, IsConstantOrFallsToZeroOverTheReach) {
    for (const double outward : {-1.0, 1.0}) {
        const Curve at_edge{0.6, 8.0, 0.3, 0.2};
        const EdgeLine constant = continue_hysteresis(7.0, at_edge, outward, Continuation::Linear, 0.2);
        EXPECT_EQ(constant.reach, infinity);
        const EdgeLine falling = continue_hysteresis(7.0, at_edge, outward, Continuation::Free, 0.2);
        EXPECT_EQ(falling.reach, 0.2);
        for (const double share : {0.0, 0.25, 0.5, 0.99, 1.0, 1.5}) {
            const double x = 7.0 + outward * share * 0.2;
            EXPECT_EQ(constant.at(x).value, 0.6);
            EXPECT_EQ(constant.at(x).slope, 0.0);
            EXPECT_NEAR(falling.at(x).value, 0.6 * std::max(0.0, 1.0 - share), 1e-14);
        }
    }
}

}  // namespace
}  // namespace palpate
