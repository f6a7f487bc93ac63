// SPDX-License-Identifier: Apache-2.0
#include "palpate/model/wavelet.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "palpate/model/derivatives.hpp"

namespace palpate {
namespace {

double psi(double u) {
    return mexican_hat(u).value;
}

// The mother wavelet psi(u) satisfies |psi| < 9e-5 at u = 5, < 6e-7 at 6, < 1.5e-14 at 8.5 and < 3e-15 at 8.7.
TEST(Wavelet, IsNegligibleFarFromItsCentre) {
    EXPECT_LT(std::abs(psi(5.0)), 9e-5);
    EXPECT_GT(std::abs(psi(5.0)), 8.9e-5);
    EXPECT_LT(std::abs(psi(6.0)), 6e-7);
    EXPECT_GT(std::abs(psi(6.0)), 5e-7);
    EXPECT_LT(std::abs(psi(8.5)), 1.5e-14);
    EXPECT_GT(std::abs(psi(8.5)), 1.4e-14);
    EXPECT_LT(std::abs(psi(8.7)), 3e-15);
    EXPECT_GT(std::abs(psi(8.7)), 2.7e-15);
}

// At u = 8.5 the value of a wavelet is below 1.5e-14, but its slope is still 1.2e-13 alpha.
TEST(Wavelet, SlopeNeedsAWiderSupport) {
    EXPECT_NEAR(std::abs(mexican_hat(8.5).slope), 1.2e-13, 0.05e-13);
}

// The slope of the mother wavelet satisfies |psi'| <= 1.38012; the maximum 1.3801190461 is at |u| = sqrt(3 - sqrt 6) =
// 0.741964.
TEST(Wavelet, SlopeHasItsBoundAtTheSteepestPoint) {
    const double steepest = std::sqrt(3.0 - std::sqrt(6.0));
    EXPECT_NEAR(steepest, 0.741964, 5e-7);
    EXPECT_NEAR(mexican_hat(steepest).slope, 1.3801190461, 1e-10);
    EXPECT_LE(mexican_hat(steepest).slope, detail::hat_suprema[1]);
}

// The second derivative of the mother wavelet satisfies |psi''| <= 3 (largest at u = 0), the third derivative |psi'''|
// <= 5.7831.
TEST(Wavelet, DerivativesStayWithinTheirBounds) {
    double slope = 0.0;
    double curvature = 0.0;
    double jerk = 0.0;
    for (int k = 0; k <= 200'000; ++k) {
        const double u = -10.0 + 1e-4 * k;
        slope = std::max(slope, std::abs(mexican_hat(u).slope));
        curvature = std::max(curvature, std::abs(mexican_hat_curvature(u)));
        jerk = std::max(jerk, std::abs(mexican_hat_jerk(u)));
    }
    EXPECT_LE(slope, detail::hat_suprema[1]);
    EXPECT_NEAR(slope, 1.38012, 5e-6);
    EXPECT_DOUBLE_EQ(curvature, detail::hat_suprema[2]);
    EXPECT_LE(jerk, detail::hat_suprema[3]);
    EXPECT_NEAR(jerk, 5.7831, 5e-5);
}

// The gradient of the mother wavelet of d inputs at the distance r from its centre has the size r |d + 2 - r^2|
// e^{-r^2/2}; for d = 2 this is at most 1.95209.
TEST(Wavelet, RadialGradientOfTwoInputsHasItsBound) {
    double largest = 0.0;
    for (int k = 0; k <= 100'000; ++k) {
        const double r = 1e-4 * k;
        largest = std::max(largest, r * std::abs(radial_mexican_hat(r * r, 2.0).gradient_over_u));
    }
    EXPECT_NEAR(largest, 1.95209, 5e-6);
}

TEST(Wavelet, DerivativesAndAntiderivativesAgreeWithDifferences) {
    constexpr double h = 1e-5;
    for (double u = -6.0; u <= 6.0; u += 0.173) {
        const auto slope_of = [&](auto function) { return (function(u + h) - function(u - h)) / (2.0 * h); };
        EXPECT_NEAR(slope_of([](double v) { return mexican_hat(v).value; }), mexican_hat(u).slope, 1e-9);
        EXPECT_NEAR(slope_of([](double v) { return mexican_hat(v).slope; }), mexican_hat_curvature(u), 1e-9);
        EXPECT_NEAR(slope_of(mexican_hat_curvature), mexican_hat_jerk(u), 1e-9);
        EXPECT_NEAR(slope_of([](double v) { return mexican_hat(v).integral; }), mexican_hat(u).value, 1e-9);
        EXPECT_NEAR(slope_of([](double v) { return mexican_hat(v).double_integral; }),
                    mexican_hat(u).integral, 1e-9);
    }
}

TEST(Wavelet, OneInputIsTheRadialHat) {
    for (double u = -8.0; u <= 8.0; u += 0.31) {
        const RadialMexicanHat radial = radial_mexican_hat(u * u, 1.0);
        EXPECT_DOUBLE_EQ(radial.value, mexican_hat(u).value);
        EXPECT_NEAR(radial.gradient_over_u * u, mexican_hat(u).slope, 1e-15);
    }
}

TEST(Wavelet, HugeArgumentsGiveZeroAndNanStaysNan) {
    for (const double u : {50.0, -1e10, 1e300, std::numeric_limits<double>::infinity()}) {
        EXPECT_EQ(mexican_hat(u).value, 0.0);
        EXPECT_EQ(mexican_hat(u).slope, 0.0);
        EXPECT_EQ(radial_mexican_hat(u * u, 3.0).value, 0.0);
    }
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_TRUE(std::isnan(mexican_hat(nan).value));
    EXPECT_TRUE(std::isnan(radial_mexican_hat(nan, 2.0).value));
}

TEST(Wavelet, HigherDerivativesOfHugeArgumentsAreZero) {
    for (const double u : {50.0, -1e10, 1e300, std::numeric_limits<double>::infinity()}) {
        EXPECT_EQ(mexican_hat(u).integral, 0.0);
        EXPECT_EQ(mexican_hat(u).double_integral, 0.0);
        EXPECT_EQ(mexican_hat_curvature(u), 0.0);
        EXPECT_EQ(mexican_hat_jerk(u), 0.0);
        EXPECT_EQ(radial_mexican_hat(u * u, 3.0).gradient_over_u, 0.0);
    }
    EXPECT_TRUE(std::isnan(mexican_hat_curvature(std::nan(""))));
    EXPECT_TRUE(std::isnan(mexican_hat_jerk(std::nan(""))));
}

// Differences of value and gradient along each of three inputs
TEST(Wavelet, RadialDerivativesAgreeWithDifferences) {
    constexpr double h = 1e-5;
    const auto hat = [](const std::array<double, 3>& u) {
        return radial_mexican_hat(u[0] * u[0] + u[1] * u[1] + u[2] * u[2], 3.0);
    };
    for (const std::array<double, 3> u : {std::array{0.3, -0.8, 1.1}, {1.5, 0.2, -0.4}, {-2.0, 0.7, 0.0}}) {
        for (std::size_t j = 0; j < 3; ++j) {
            auto up = u;
            auto down = u;
            up[j] += h;
            down[j] -= h;
            EXPECT_NEAR((hat(up).value - hat(down).value) / (2.0 * h), hat(u).gradient_over_u * u[j], 1e-9);
            for (std::size_t l = 0; l < 3; ++l) {
                const double change = hat(up).gradient_over_u * up[l] - hat(down).gradient_over_u * down[l];
                const double second = j == l ? hat(u).curvature(u[j]) : hat(u).mixed(u[j], u[l]);
                EXPECT_NEAR(change / (2.0 * h), second, 1e-9);
            }
        }
    }
}

}  // namespace
}  // namespace palpate
