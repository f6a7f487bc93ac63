// SPDX-License-Identifier: Apache-2.0
#include "palpate/model/piecewise_septic.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "support.hpp"

namespace palpate {
namespace {

using test::cases;
using test::Random;
using test::uniform;

using Coefficients = std::array<double, 8>;

/// Returns value and seven derivatives of the polynomial sum_j c_j t^j in extended precision.
std::array<long double, 8> expand(const Coefficients& c, long double t) {
    std::array<long double, 8> derivatives{};
    for (std::size_t d = 0; d < 8; ++d) {
        for (std::size_t j = 8; j-- > d;) {
            long double factor = 1.0L;
            for (std::size_t k = 0; k < d; ++k) {
                factor *= static_cast<long double>(j - k);
            }
            derivatives[d] = derivatives[d] * t + factor * c[j];
        }
    }
    return derivatives;
}

/// Returns the first and the second antiderivative from 0 of the polynomial sum_j c_j t^j.
std::array<long double, 2> integrate(const Coefficients& c, long double t) {
    std::array<long double, 2> sums{};
    for (std::size_t j = 0; j < 8; ++j) {
        const auto power = static_cast<long double>(j);
        sums[0] += c[j] * std::pow(t, power + 1.0L) / (power + 1.0L);
        sums[1] += c[j] * std::pow(t, power + 2.0L) / ((power + 1.0L) * (power + 2.0L));
    }
    return sums;
}

/// Returns `count` random jets of size 1 in the variable t = x / width.
std::vector<Jet> random_jets(Random& random, std::size_t count, double width) {
    std::vector<Jet> jets(count);
    for (Jet& jet : jets) {
        for (std::size_t d = 0; d < jet.size(); ++d) {
            jet[d] = uniform(random, -1.0, 1.0) / std::pow(width, d);
        }
    }
    return jets;
}

TEST(PiecewiseSeptic, HasTheGivenDerivativesAtEveryBorder) {
    Random random{61};
    for (const double width : {0.25, 1.0, 8.0}) {
        const std::vector<Jet> jets = random_jets(random, 6, width);
        std::vector<double> borders;
        const PiecewiseSeptic table{-3, 1, width, [&](double x) {
                                        borders.push_back(x / width);
                                        return jets[borders.size() - 1];
                                    }};
        EXPECT_EQ(borders, (std::vector<double>{-3.5, -2.5, -1.5, -0.5, 0.5, 1.5}));
        ASSERT_EQ(table.size(), 5u);
        EXPECT_EQ(table.width(), width);
        for (std::size_t k = 0; k < table.size(); ++k) {
            EXPECT_EQ(table.middle(k), (static_cast<double>(k) - 3.0) * width);
            for (const std::size_t side : {0u, 1u}) {
                const auto here = expand(table.coefficients(k), side == 0 ? -0.5L : 0.5L);
                for (std::size_t d = 0; d < 4; ++d) {
                    const double by_t = jets[k + side][d] * std::pow(width, d);
                    EXPECT_NEAR(static_cast<double>(here[d]), by_t, 2e-13) << width << " " << k << " " << d;
                }
            }
        }
    }
}

TEST(PiecewiseSeptic, EvaluatesItsPolynomialsAndTheirAntiderivatives) {
    Random random{62};
    for (const double width : {0.25, 1.0, 8.0}) {
        const std::vector<Jet> jets = random_jets(random, 6, width);
        std::size_t next = 0;
        PiecewiseSeptic table{5, 9, width, [&](double) { return jets[next++]; }};
        std::vector<std::array<double, 2>> at_middle;
        table.integrate([&](double x) {
            EXPECT_EQ(x, (5.0 + static_cast<double>(at_middle.size())) * width);
            at_middle.push_back({uniform(random, -1.0, 1.0), uniform(random, -1.0, 1.0)});
            return at_middle.back();
        });
        for (int j = 0; j < cases(500); ++j) {
            const std::size_t k = random() % table.size();
            const double t = uniform(random, -0.5, 0.5);
            const double x = (5.0 + static_cast<double>(k) + t) * width;
            const long double u = static_cast<long double>(x) / width - 5.0L - static_cast<long double>(k);
            const Coefficients c = table.coefficients(k);
            const auto expected = expand(c, u);
            const auto sums = integrate(c, u);
            const auto [first, second] = at_middle[k];
            const Curve here = table.at(x);
            EXPECT_NEAR(here.value, static_cast<double>(expected[0]), 1e-14) << k << " " << t;
            EXPECT_NEAR(table.value(x), static_cast<double>(expected[0]), 1e-14) << k << " " << t;
            EXPECT_NEAR(here.slope * width, static_cast<double>(expected[1]), 1e-13) << k << " " << t;
            const auto once = static_cast<double>(first + width * sums[0]);
            const auto twice = static_cast<double>(second + width * u * first + width * width * sums[1]);
            EXPECT_NEAR(here.integral, once, 1e-14 * width) << k << " " << t;
            EXPECT_NEAR(here.double_integral, twice, 1e-14 * width * width + 1e-15) << k << " " << t;
        }
    }
}

TEST(PiecewiseSeptic, KeepsTheChosenCells) {
    Random random{63};
    const std::vector<Jet> jets = random_jets(random, 9, 0.5);
    std::size_t next = 0;
    const PiecewiseSeptic all{-4, 3, 0.5, [&](double) { return jets[next++]; }};
    PiecewiseSeptic some = all;
    some.keep(2, 3);
    ASSERT_EQ(some.size(), 3u);
    for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_EQ(some.middle(k), all.middle(k + 2));
        EXPECT_EQ(some.coefficients(k), all.coefficients(k + 2));
        for (const double t : {-0.2, 0.0, 0.2}) {
            EXPECT_EQ(some.value(some.middle(k) + t), all.value(some.middle(k) + t));
        }
    }
    EXPECT_FALSE(some.empty());
    some.keep(1, 0);
    EXPECT_TRUE(some.empty());
    EXPECT_TRUE(PiecewiseSeptic{}.empty());
}

TEST(PiecewiseSeptic, CellIsTheNearestMultipleOfTheWidth) {
    for (const double width : {0.125, 1.0, 4.0}) {
        for (const std::int64_t k : {-1'000'000, -3, -1, 0, 1, 7, 1'000'000}) {
            for (const double t : {-0.499, 0.0, 0.499}) {
                EXPECT_EQ(PiecewiseSeptic::cell((static_cast<double>(k) + t) * width, width), k) << t;
            }
        }
    }
}

TEST(PiecewiseSeptic, SoundWidthsExcludeTheirLimits) {
    const auto up = [](double x) { return std::nextafter(x, 1e300); };
    const auto down = [](double x) { return std::nextafter(x, 0.0); };
    EXPECT_FALSE(PiecewiseSeptic::is_sound(0x1p-100));
    EXPECT_TRUE(PiecewiseSeptic::is_sound(up(0x1p-100)));
    EXPECT_TRUE(PiecewiseSeptic::is_sound(1.0));
    EXPECT_TRUE(PiecewiseSeptic::is_sound(down(0x1p100)));
    EXPECT_FALSE(PiecewiseSeptic::is_sound(0x1p100));
    EXPECT_FALSE(PiecewiseSeptic::is_sound(std::nan("")));
}

// In the cell around zero, the derivatives of x^n are largest at the border x = h / 2.
TEST(PiecewiseSeptic, RoundingBoundsOfPowersFollowFromTheirLargestDerivatives) {
    constexpr double unit = 8.0 * std::numeric_limits<double>::epsilon();
    for (const double h : {0.5, 1.0, 4.0}) {
        for (int n = 0; n <= 7; ++n) {
            const auto derivative = [n](int d, double x) {
                return d > n ? 0.0 : std::tgamma(n + 1.0) / std::tgamma(n - d + 1.0) * std::pow(x, n - d);
            };
            const PiecewiseSeptic table{0, 0, h, [&](double x) {
                                            return Jet{derivative(0, x), derivative(1, x), derivative(2, x),
                                                       derivative(3, x)};
                                        }};
            const double at_zero = n == 0 ? 1.0 : 0.0;
            const double first = h * derivative(1, 0.5 * h);
            const double second = h * h * derivative(2, 0.5 * h);
            const double third = h * h * h * derivative(3, 0.5 * h);
            const double value = at_zero + 6.0 * first + 1.5 * second + 0.1 * third;
            const double slope = (36.0 * first + 6.0 * second + third) / h;
            const auto [of_value, of_slope] = table.rounding(0);
            EXPECT_NEAR(of_value / unit, value, 1e-12 * value) << n << " " << h;
            EXPECT_NEAR(of_slope / unit, slope, 1e-12 * slope) << n << " " << h;
        }
    }
}

// The coefficients and the borders have so few digits that the jets have no rounding error.
TEST(PiecewiseSeptic, RoundingBoundsHoldForRandomPolynomials) {
    Random random{64};
    for (int k = 0; k < cases(300); ++k) {
        const double width = std::ldexp(1.0, static_cast<int>(random() % 6) - 3);
        Coefficients c;
        for (double& coefficient : c) {
            coefficient = static_cast<double>(random() % 17) - 8.0;
        }
        PiecewiseSeptic table{-2, 2, width, [&](double x) {
                                  const auto here = expand(c, x);
                                  return Jet{static_cast<double>(here[0]), static_cast<double>(here[1]),
                                             static_cast<double>(here[2]), static_cast<double>(here[3])};
                              }};
        table.integrate([](double) { return std::array{0.0, 0.0}; });
        for (int j = 0; j < 50; ++j) {
            const std::size_t cell = random() % 5;
            const double x = (static_cast<double>(cell) - 2.0 + uniform(random, -0.5, 0.5)) * width;
            const auto exact = expand(c, x);
            const auto [value, slope] = table.rounding(cell);
            ASSERT_LE(std::abs(static_cast<double>(table.value(x) - exact[0])), value) << x;
            ASSERT_LE(std::abs(static_cast<double>(table.at(x).slope - exact[1])), slope) << x;
        }
    }
}

}  // namespace
}  // namespace palpate
