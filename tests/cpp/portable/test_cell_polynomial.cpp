// SPDX-License-Identifier: Apache-2.0
#include "palpate/portable/cell_polynomial.hpp"

#include <array>
#include <cmath>
#include <cstddef>

#include <gtest/gtest.h>

namespace palpate {
namespace {

/// Returns value and slope of a polynomial at t.
std::array<double, 2> at(const CellPolynomial& p, double t) {
    std::array<double, 2> sum{};
    for (std::size_t j = p.c.size(); j-- > 0;) {
        sum[1] = sum[1] * t + sum[0];
        sum[0] = sum[0] * t + p.c[j];
    }
    return sum;
}

TEST(CellPolynomial, IsExactForDegreeFive) {
    const CellPolynomial p = CellPolynomial::through(
        [](double t) { return 3.0 - t + 2.0 * t * t - 5.0 * t * t * t * t + 7.0 * std::pow(t, 5); });
    const std::array<double, 6> right{3.0, -1.0, 2.0, 0.0, -5.0, 7.0};
    for (std::size_t j = 0; j < right.size(); ++j) {
        EXPECT_NEAR(p.c[j], right[j], 1e-11) << j;
    }
}

TEST(CellPolynomial, ErrorBoundsHoldAndAreReachedForASixthPower) {
    // f = t^6 / 6! has the sixth derivative 1
    const auto f = [](double t) { return std::pow(t, 6) / 720.0; };
    const CellPolynomial p = CellPolynomial::through(f);
    double value = 0.0;
    double slope = 0.0;
    for (int k = 0; k <= 20'000; ++k) {
        const double t = k / 20'000.0 - 0.5;
        value = std::max(value, std::abs(at(p, t)[0] - f(t)));
        slope = std::max(slope, std::abs(at(p, t)[1] - std::pow(t, 5) / 120.0));
    }
    EXPECT_LE(value, CellPolynomial::value_factor * (1.0 + 1e-6));
    EXPECT_GE(value, 0.999 * CellPolynomial::value_factor);
    EXPECT_LE(slope, CellPolynomial::slope_factor * (1.0 + 1e-6));
    EXPECT_GE(slope, 0.999 * CellPolynomial::slope_factor);
}

TEST(CellPolynomial, ErrorsOfTheValuesAreAmplifiedAtMostByTheStatedFactors) {
    // Sums of the absolute Lagrange polynomials and of their absolute slopes
    double value = 0.0;
    double slope = 0.0;
    for (int k = 0; k <= 2'000; ++k) {
        const double t = k / 2'000.0 - 0.5;
        double values = 0.0;
        double slopes = 0.0;
        for (const double node : CellPolynomial::nodes) {
            for (const double sign : {-1.0, 1.0}) {
                const CellPolynomial one =
                    CellPolynomial::through([&](double x) { return x == sign * node ? 1.0 : 0.0; });
                values += std::abs(at(one, t)[0]);
                slopes += std::abs(at(one, t)[1]);
            }
        }
        value = std::max(value, values);
        slope = std::max(slope, slopes);
    }
    EXPECT_LE(value, CellPolynomial::value_amplification);
    EXPECT_GE(value, 0.98 * CellPolynomial::value_amplification);
    EXPECT_LE(slope, CellPolynomial::slope_amplification);
    EXPECT_GE(slope, 0.97 * CellPolynomial::slope_amplification);
}

TEST(CellPolynomial, IsContinuousBetweenNeighbouringCells) {
    const auto left = CellPolynomial::through([](double t) { return std::sin(3.0 * t); });
    const auto right = CellPolynomial::through([](double t) { return std::sin(3.0 * (t + 1.0)); });
    EXPECT_NEAR(at(left, 0.5)[0], at(right, -0.5)[0], 1e-15);
}

}  // namespace
}  // namespace palpate
