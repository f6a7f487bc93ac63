// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/stability/coupling_need.hpp"
#include "slopes.hpp"
#include "special_values.hpp"

namespace palpate {
namespace {

using test::infinity;
using test::slopes;

// The maximum of this polynomial lies between two samples, as far from both as possible.
TEST(CouplingNeed, LargestOverFrequenciesIsAboveTheTrueMaximumByAtMostAShare) {
    for (const int degree : {1, 3, 8}) {
        const double between = 0.5 * std::numbers::pi / (1024.0 * degree) * (100.0 * degree + 0.5);
        const auto most = [&](double least) {
            return detail::largest_over_frequencies(
                degree, least, [&](double phi) { return 1.0 + std::cos(2.0 * degree * (phi - between)); });
        };
        for (const double least : {0.0, 1.9999}) {
            EXPECT_GE(most(least), 2.0) << degree;
            EXPECT_LE(most(least), 2.0 * (1.0 + 2e-6)) << degree;
        }
        EXPECT_EQ(most(2.01), 2.01);
        // Maximum at the first and at the last frequency, theta = 0 and theta = pi
        for (const double at : {0.0, 0.5 * std::numbers::pi}) {
            const double edge = detail::largest_over_frequencies(
                degree, 0.0, [&](double phi) { return phi == at ? 1.0 : 0.0; });
            const double spacing = std::numbers::pi / 1024.0;
            EXPECT_DOUBLE_EQ(edge, 1.0 / (1.0 - spacing * spacing / 8.0));
        }
    }
}

/// Returns the need of n samples of delay at one frequency, s / 2 + |H_n - s|^2 / (2 (K_c + 2 beta - s)).
double need_at(double theta, double K, double beta, int whole, double falling) {
    std::complex<double> H = beta * (1.0 - std::polar(1.0, -theta * (whole + 1)));
    for (int j = 0; j <= whole; ++j) {
        H += K * std::polar(1.0, -theta * j);
    }
    return 0.5 * falling + 0.5 * std::norm(H - falling) / (K + 2.0 * beta - falling);
}

TEST(CouplingNeed, IsTheLargestOfAllShorterDelaysAndFrequencies) {
    constexpr double T = 1e-3;
    for (const auto& [K, beta] : {std::pair{100.0, 0.0}, {100.0, 30.0}, {1.0, 50.0}}) {
        for (const double share : {0.0, 0.3, 0.9, 1.0}) {
            const double falling = share * (K + beta);
            for (int whole = 0; whole <= 3; ++whole) {
                for (const double fraction : {0.0, 0.35, 0.8}) {
                    double most = 0.5 * K + beta;
                    for (int k = 0; k <= 3001; ++k) {
                        const double theta = std::numbers::pi * k / 3001;
                        for (int n = 1; n <= whole; ++n) {
                            most = std::max(most, need_at(theta, K, beta, n, falling));
                        }
                        if (fraction > 0.0) {
                            most = std::max(most, (1.0 - fraction) * need_at(theta, K, beta, whole, falling) +
                                                      fraction * need_at(theta, K, beta, whole + 1, falling));
                        }
                    }
                    const double need = coupling_need({K, beta * T}, T, whole, fraction, falling);
                    EXPECT_GE(need, most * (1.0 - 1e-12)) << K << " " << share << " " << whole;
                    EXPECT_LE(need, most * (1.0 + 1e-5)) << K << " " << share << " " << whole;
                }
            }
        }
    }
}

TEST(CouplingNeed, ExistsUpToTheSlopeOfTheCoupling) {
    EXPECT_EQ(coupling_need({100.0, 0.03125}, 1.0 / 1024.0, 0, 0.0, 132.0), 82.0);
    EXPECT_EQ(coupling_need({100.0, 0.03125}, 1.0 / 1024.0, 0, 0.0, std::nextafter(132.0, 200.0)), infinity);
    EXPECT_EQ(coupling_need({100.0, 0.03125}, 1.0 / 1024.0, 2, 0.0, 140.0), infinity);
    EXPECT_EQ(coupling_need({100.0, 0.0}, 1e-3, 0, 0.0, std::numeric_limits<double>::quiet_NaN()), infinity);
    EXPECT_EQ(coupling_need({0.0, 0.0}, 1e-3, 3, 0.5, 0.0), 0.0);
    EXPECT_EQ(coupling_need({100.0, 0.02}, 1e-3, 2), coupling_need({100.0, 0.02}, 1e-3, 2, 0.0, 0.0));
}

// An encoder error e moves the object by y with f'(y) y = K_c (e - y) + beta (change of e - y). The largest force error
// is found by running the step with all errors of size 1 and with both slopes.
TEST(CouplingNeed, GainOfAMasslessObjectBoundsEveryErrorOfTheForce) {
    constexpr double K = 100.0;
    for (const auto& [falling, rising, beta] :
         {std::array{0.0, 300.0, 20.0}, std::array{20.0, 30.0, 20.0}, std::array{80.0, 300.0, 20.0},
          std::array{60.0, 10.0, 5.0}, std::array{40.0, 1.0, 50.0}, std::array{10.0, 50.0, 0.0}}) {
        const double p = K + beta;
        const double amplification = std::max(1.0, falling / (K - falling));
        const double expected = std::max(falling * (p + beta * amplification) / (p - falling),
                                         rising * (p + beta * amplification) / (p + rising));
        const double gain = massless_gain(slopes(-falling, rising), {K, beta * 1e-3}, 1e-3);
        EXPECT_NEAR(gain, expected, 1e-12 * expected);
        // y_k (p + f') = p e_k - beta e_{k-1} + beta y_{k-1}; signs of e that add up
        for (const double slope : {-falling, rising}) {
            double largest = 0.0;
            for (const int pattern : {0, 1, 2}) {
                double y = 0.0;
                double e_before = 0.0;
                for (int k = 0; k < 200; ++k) {
                    const double e = pattern == 0 ? 1.0 : pattern == 1 ? (k % 2 == 0 ? 1.0 : -1.0) : k == 199;
                    y = (p * e - beta * e_before + beta * y) / (p + slope);
                    e_before = e;
                    largest = std::max(largest, std::abs(slope * y));
                }
            }
            EXPECT_LE(largest, gain * (1.0 + 1e-12));
        }
    }
    EXPECT_EQ(massless_gain(slopes(-100.0, 1.0), {K, 0.02}, 1e-3), infinity);
    EXPECT_EQ(massless_gain(slopes(-100.0, 1.0), {K, 0.0}, 1e-3), infinity);
    EXPECT_LT(massless_gain(slopes(std::nextafter(-100.0, 0.0), 1.0), {K, 0.02}, 1e-3), infinity);
    EXPECT_EQ(massless_gain(slopes(0.0, 0.0), {K, 0.02}, 1e-3), 0.0);
}

/// Returns the sum of the absolute impulse response from position to force: C A / (C + A) as a recursion of the object
/// position y, with the coupling force C (x - y) = A y.
double summed_response(double K, Inertia inertia, VirtualCoupling coupling, double T, int samples) {
    const double m = inertia.mass / (T * T);
    const double drag = inertia.damping / T;
    const double beta = coupling.damping / T;
    double y1 = 0.0;
    double y2 = 0.0;
    double x1 = 0.0;
    double sum = 0.0;
    for (int k = 0; k < samples; ++k) {
        const double x = k == 0 ? 1.0 : 0.0;
        const double pushed = coupling.stiffness * x + beta * (x - x1 + y1) + m * (2.0 * y1 - y2) + drag * y1;
        const double y = pushed / (coupling.stiffness + beta + m + drag + K);
        sum += std::abs(coupling.stiffness * (x - y) + beta * ((x - y) - (x1 - y1)));
        y2 = y1;
        y1 = y;
        x1 = x;
    }
    return sum;
}

TEST(CouplingNeed, GainOfAnImplicitSpringIsTheSummedResponse) {
    constexpr double T = 1e-3;
    for (const double K : {0.0, 5.0, 300.0}) {
        for (const Inertia inertia : {Inertia{1e-3, 0.05}, {1e-4, 0.0}, {1e-5, 0.3}, {3e-2, 1.0}}) {
            for (const VirtualCoupling coupling : {VirtualCoupling{100.0, 0.02}, {30.0, 0.2}, {400.0, 0.0}}) {
                const double sum = summed_response(K, inertia, coupling, T, 30'000);
                const double gain = implicit_gain(K, inertia, coupling, T);
                EXPECT_GE(gain, sum * (1.0 - 1e-12)) << K << " " << inertia.mass;
                EXPECT_LE(gain, sum * 1.0101) << K << " " << inertia.mass;
            }
        }
    }
}

TEST(CouplingNeed, GainOfAnImplicitSpringIsTightWhereTheRemainderCounts) {
    // Without mass and object damping there is one pole, beta / p, and the response is a geometric series: the first
    // value is (K_c + beta) K / p, the others decrease by the pole.
    constexpr double T = 1e-3;
    const double K = 50.0;
    const double beta = 400.0;
    const double gain = implicit_gain(K, {0.0, 0.0}, {100.0, beta * T}, T);
    const double sum = summed_response(K, {0.0, 0.0}, {100.0, beta * T}, T, 10'000);
    EXPECT_GE(gain, sum * (1.0 - 1e-12));
    EXPECT_LE(gain, sum * (1.0 + 1e-9)) << "the remainder of one pole is exact";
    // With two real poles the remainder still has the right size: all terms beyond the first few have one sign.
    const double two = implicit_gain(K, {2e-5, 0.4}, {100.0, beta * T}, T);
    const double exact = summed_response(K, {2e-5, 0.4}, {100.0, beta * T}, T, 100'000);
    EXPECT_GE(two, exact * (1.0 - 1e-12));
    EXPECT_LE(two, exact * 1.0101);
}

TEST(CouplingNeed, NeedAndGainAreProportionalToTheUnitOfForce) {
    constexpr double T = 1e-3;
    const auto all = [](double unit) {
        const VirtualCoupling coupling{100.0 * unit, 0.02 * unit};
        return std::array{
            coupling_need(coupling, T, 2, 0.25, 30.0 * unit) / unit,
            massless_gain(slopes(-40.0 * unit, 70.0 * unit), coupling, T) / unit,
            implicit_gain(20.0 * unit, {1e-3 * unit, 0.05 * unit}, coupling, T) / unit,
        };
    };
    const auto expected = all(1.0);
    for (const double unit : {1e-6, 1e6}) {
        for (std::size_t k = 0; k < expected.size(); ++k) {
            EXPECT_NEAR(all(unit)[k], expected[k], 1e-9 * expected[k]) << unit << " " << k;
        }
    }
}

TEST(CouplingNeed, GainOfAnUnstableSpringIsInfinite) {
    constexpr double T = 1e-3;
    // The object falls away if -K is larger than the coupling stiffness; at exactly K + K_c = 0 a pole is at 1.
    EXPECT_EQ(implicit_gain(-101.0, {1e-3, 0.1}, {100.0, 0.02}, T), infinity);
    EXPECT_EQ(implicit_gain(-128.0, {0.0, 0.0}, {128.0, 0.0}, 1.0), infinity);
    EXPECT_LT(implicit_gain(-90.0, {1e-3, 0.1}, {100.0, 0.02}, T), infinity);
    // Negative leading coefficient with poles inside the unit circle
    EXPECT_EQ(implicit_gain(-1000.0, {0.0, 0.0}, {100.0, 0.02}, T), infinity);
    // Ten million terms are not enough for a pole this close to the unit circle.
    EXPECT_EQ(implicit_gain(0.0, {1.0, 1e-7}, {1e-6, 0.0}, 1e-3), infinity);
}

}  // namespace
}  // namespace palpate
