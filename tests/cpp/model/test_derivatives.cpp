// SPDX-License-Identifier: Apache-2.0
#include "palpate/model/derivatives.hpp"
#include "special_values.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "support.hpp"

namespace palpate {
namespace {

using test::cases;
using test::Random;
using test::uniform;

using test::epsilon;

/// Returns derivative n of the Mexican hat, (-1)^n He_{n+2}(u) e^{-u^2/2}, from the recursion of the Hermite
/// polynomials He in extended precision.
long double hat_derivative(std::size_t n, long double u) {
    long double before = 1.0L;
    long double hermite = u;
    for (std::size_t k = 1; k < n + 2; ++k) {
        const long double next = u * hermite - static_cast<long double>(k) * before;
        before = hermite;
        hermite = next;
    }
    return (n % 2 == 0 ? hermite : -hermite) * std::exp(-0.5L * u * u);
}

/// Returns derivative n of the network's force in extended precision.
long double exact_derivative(const NetworkParameters& network, long double x, std::size_t n) {
    const long double c = network.linear[0];
    long double sum = n == 0 ? c * x + network.bias : n == 1 ? c : 0.0L;
    for (std::size_t i = 0; i < network.weight.size(); ++i) {
        const long double alpha = network.alpha[i];
        if (i >= network.hats()) {
            const long double quarters = static_cast<long double>(n) * 0.5L * std::numbers::pi_v<long double>;
            sum += network.weight[i] * std::pow(alpha, static_cast<long double>(n)) *
                   std::cos(alpha * (x - network.beta[i]) + quarters);
            continue;
        }
        sum += network.weight[i] * std::pow(alpha, static_cast<long double>(n)) *
               hat_derivative(n, alpha * (x - network.beta[i]));
    }
    return sum;
}

TEST(Derivatives, AgreeWithHermiteFunctionsWithinTheirRoundingBounds) {
    Random random{51};
    for (int k = 0; k < cases(300); ++k) {
        const NetworkParameters network =
            test::with_harmonics(random, test::random_network(random, static_cast<std::size_t>(k % 40)),
                                 static_cast<std::size_t>(k % 3));
        const Derivatives rounding = derivatives_rounding(network, 2.0);
        for (int j = 0; j < 10; ++j) {
            const double x = uniform(random, -2.0, 2.0);
            const Derivatives here = derivatives(network, x);
            for (std::size_t n = 0; n < here.size(); ++n) {
                ASSERT_LE(std::abs(static_cast<double>(here[n] - exact_derivative(network, x, n))),
                          rounding[n])
                    << n << " " << x;
            }
            const Jet four = jet(network, x);
            EXPECT_TRUE(std::equal(four.begin(), four.end(), here.begin()));
        }
        const Jet four = jet_rounding(network, 2.0);
        EXPECT_TRUE(std::equal(four.begin(), four.end(), rounding.begin()));
    }
}

TEST(Derivatives, FarFromAllWaveletsAreThoseOfTheStraightLine) {
    const NetworkParameters network{1, {7.0}, {0.5}, {3.0}, {0.25}, 2.0};
    for (const double x : {-1e300, -1e200, -8.0, 8.0, 1e200}) {
        EXPECT_EQ(derivatives(network, x), (Derivatives{0.25 * x + 2.0, 0.25, 0.0, 0.0, 0.0})) << x;
    }
}

// A line needs two operations, and the numbers are added to a sum of zero wavelets: four units of rounding. With two
// wavelets there are five units for the line and three for the sum of the wavelets.
TEST(Derivatives, RoundingBoundIsTheSumOverLineAndWavelets) {
    const NetworkParameters line{1, {}, {}, {}, {-3.0}, -0.5};
    const Derivatives of_line = derivatives_rounding(line, 2.0);
    EXPECT_DOUBLE_EQ(of_line[0], 4.0 * 6.5 * epsilon);
    EXPECT_DOUBLE_EQ(of_line[1], 4.0 * 3.0 * epsilon);
    EXPECT_EQ(of_line[2] + of_line[3] + of_line[4], 0.0);

    const NetworkParameters two{1, {3.0, 0.5}, {0.1, 0.2}, {-2.0, 5.0}, {-3.0}, -0.5};
    const Derivatives of_two = derivatives_rounding(two, 2.0);
    const Derivatives on_line{5.0 * 6.5, 5.0 * 3.0, 0.0, 0.0, 0.0};
    for (std::size_t n = 0; n < of_two.size(); ++n) {
        const double size = 2.0 * std::pow(3.0, n) + 5.0 * std::pow(0.5, n);
        const double one = detail::hat_rounding[n] + 3.0 * detail::hat_suprema[n];
        EXPECT_NEAR(of_two[n] / epsilon, on_line[n] + size * one, 1e-9 * size * one) << n;
    }
}

TEST(Derivatives, ConstantsAreTheSupremaOfTheirFormulas) {
    // Absolute coefficients of the Hermite polynomials He_2 to He_7
    const auto polynomial = [](std::size_t n, double u) {
        double before = 1.0;
        double hermite = u;
        for (std::size_t k = 1; k < n + 2; ++k) {
            const double next = u * hermite + static_cast<double>(k) * before;
            before = hermite;
            hermite = next;
        }
        return hermite;
    };
    DerivativeBounds largest{};
    Derivatives rounding{};
    for (int k = 0; k <= 80'000; ++k) {
        const double u = 1e-4 * k;
        for (std::size_t n = 0; n <= highest_derivative; ++n) {
            largest[n] = std::max(largest[n], static_cast<double>(std::abs(hat_derivative(n, u))));
        }
        for (std::size_t n = 0; n < rounding.size(); ++n) {
            const double terms =
                (static_cast<double>(n) + 6.0 + u * u) * polynomial(n, u) + 1.5 * u * polynomial(n + 1, u);
            rounding[n] = std::max(rounding[n], terms * std::exp(-0.5 * u * u));
        }
    }
    for (std::size_t n = 0; n <= highest_derivative; ++n) {
        EXPECT_LE(largest[n], detail::hat_suprema[n]) << n;
        EXPECT_GE(largest[n] * (1.0 + 1e-4), detail::hat_suprema[n]) << n;
    }
    for (std::size_t n = 0; n < rounding.size(); ++n) {
        EXPECT_LE(rounding[n], detail::hat_rounding[n] * (1.0 + 1e-12)) << n;
        EXPECT_GE(rounding[n] * (1.0 + 1e-2), detail::hat_rounding[n]) << n;
    }
}

// |psi^(n)(u)| is at most its supremum, and at most 1.0865 sqrt((n + 2)!) e^{-u^2/4} by Cramer's inequality. The
// interval lies on either side of the wavelet, or around it.
TEST(DerivativeBounds, FallWithTheDistanceFromTheIntervalByCramersInequality) {
    const NetworkParameters one{1, {3.0}, {0.5}, {-2.0}, {0.0}, 0.0};
    for (const double u : {0.0, 0.5, 1.5, 2.0, 3.0, 5.0, 10.0, 30.0}) {
        const double near = u / 3.0;
        for (const auto& [from, to] :
             {std::pair{0.5 + near, 0.5 + near + 0.25}, std::pair{0.5 - near - 0.25, 0.5 - near}}) {
            const DerivativeBounds bounds = derivative_bounds(one, from, to);
            for (std::size_t n = 0; n <= highest_derivative; ++n) {
                const double tail =
                    1.0865 * std::sqrt(std::tgamma(static_cast<double>(n) + 3.0)) * std::exp(-0.25 * u * u);
                const double expected = 2.0 * std::pow(3.0, n) * std::min(detail::hat_suprema[n], tail);
                EXPECT_NEAR(bounds[n] / expected, 1.0, 1e-4) << n << " " << u;
            }
        }
    }
    const DerivativeBounds around = derivative_bounds(one, 0.25, 3.0);
    EXPECT_EQ(around, derivative_bounds(one, 0.5, 0.5));
    const DerivativeBounds far = derivative_bounds(one, 1e200, 1e201);
    EXPECT_LT(*std::max_element(far.begin(), far.end()), 1e-290);
}

TEST(DerivativeBounds, OfALineAreExactApartFromTheMarginForRounding) {
    const NetworkParameters line{1, {}, {}, {}, {-3.0}, -0.5};
    constexpr double margin = 1.0 + 1e-9;
    for (const auto& [from, to] : {std::pair{-2.0, 1.0}, std::pair{-1.0, 2.0}}) {
        const DerivativeBounds bounds = derivative_bounds(line, from, to);
        EXPECT_DOUBLE_EQ(bounds[0], 6.5 * margin);
        EXPECT_DOUBLE_EQ(bounds[1], 3.0 * margin);
        EXPECT_EQ(*std::max_element(bounds.begin() + 2, bounds.end()), 0.0);
    }
}

TEST(DerivativeBounds, HoldForTheNinthDerivative) {
    Random random{52};
    for (int k = 0; k < cases(200); ++k) {
        const NetworkParameters network = test::random_network(random, static_cast<std::size_t>(1 + k % 5));
        const double from = uniform(random, 0.0, 1.0);
        const double to = from + uniform(random, 0.0, 0.1);
        const double bound = derivative_bounds(network, from, to)[9];
        for (int j = 0; j < 20; ++j) {
            const double x = uniform(random, from, to);
            ASSERT_LE(std::abs(static_cast<double>(exact_derivative(network, x, 9))), bound) << x;
        }
    }
}

}  // namespace
}  // namespace palpate
