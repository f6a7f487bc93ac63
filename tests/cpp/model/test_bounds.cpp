// SPDX-License-Identifier: Apache-2.0
#include "palpate/model/bounds.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/model/network_curve.hpp"
#include "palpate/model/radial_network.hpp"
#include "palpate/model/radial_sum.hpp"
#include "support.hpp"

namespace palpate {
namespace {

using test::cases;
using test::Random;
using test::uniform;

/// Makes pairs of almost equal wavelets with large weights of opposite sign.
void cancel(NetworkParameters& network, Random& random) {
    const std::size_t d = network.dimension;
    for (std::size_t i = 0; i + 1 < network.weight.size(); i += 2) {
        for (std::size_t j = 0; j < d; ++j) {
            network.alpha[(i + 1) * d + j] = network.alpha[i * d + j] * (1.0 + 1e-6);
            network.beta[(i + 1) * d + j] = network.beta[i * d + j];
        }
        network.weight[i] = uniform(random, -1e6, 1e6);
        network.weight[i + 1] = -network.weight[i];
    }
}

/// Returns random networks; in every third network large weights cancel.
NetworkParameters difficult_network(Random& random, int kind) {
    NetworkParameters network = test::random_network(random, static_cast<std::size_t>(2 * (1 + kind % 32)));
    if (kind % 3 == 0) {
        cancel(network, random);
    }
    if (kind % 4 == 1) {
        network = test::with_harmonics(random, network, 1 + static_cast<std::size_t>(kind % 5));
    }
    return network;
}

TEST(Bounds, HoldAtEveryPointOfRandomNetworks) {
    Random random{31};
    for (int k = 0; k < cases(100); ++k) {
        const NetworkParameters network = difficult_network(random, k);
        const NetworkCurve curve{network, test::unit_domain()};
        const double from = uniform(random, 0.0, 0.5);
        const double to = uniform(random, 0.5, 1.0);
        const Interval value = value_bounds(network, from, to);
        const Interval slope = slope_bounds(network, from, to);
        for (int j = 0; j < 1000; ++j) {
            const Curve here = curve.inside(uniform(random, from, to));
            ASSERT_GE(here.value, value.lower) << k;
            ASSERT_LE(here.value, value.upper) << k;
            ASSERT_GE(here.slope, slope.lower) << k;
            ASSERT_LE(here.slope, slope.upper) << k;
        }
    }
}

// The computed bounds of the slope are at most 1 % wider than the slopes that a search over many positions finds.
TEST(Bounds, AreWithinOnePercentOfADenseSearch) {
    Random random{32};
    for (int k = 0; k < cases(20); ++k) {
        const NetworkParameters network = difficult_network(random, k);
        const NetworkCurve curve{network, test::unit_domain()};
        Interval slope{1e300, -1e300};
        Interval value{1e300, -1e300};
        for (int j = 0; j <= 50'000; ++j) {
            const Curve here = curve.inside(j / 50'000.0);
            slope = {std::min(slope.lower, here.slope), std::max(slope.upper, here.slope)};
            value = {std::min(value.lower, here.value), std::max(value.upper, here.value)};
        }
        const Interval proved_slope = slope_bounds(network, 0.0, 1.0);
        const Interval proved_value = value_bounds(network, 0.0, 1.0);
        EXPECT_LE(proved_slope.upper - slope.upper, 0.0101 * slope.largest());
        EXPECT_LE(slope.lower - proved_slope.lower, 0.0101 * slope.largest());
        EXPECT_LE(proved_value.upper - value.upper, 0.0101 * value.largest());
        EXPECT_LE(value.lower - proved_value.lower, 0.0101 * value.largest());
    }
}

TEST(Bounds, OfALineAreExact) {
    const NetworkParameters line{1, {}, {}, {}, {3.0}, -1.0};
    EXPECT_NEAR(value_bounds(line, 0.0, 2.0).lower, -1.0, 1e-12);
    EXPECT_NEAR(value_bounds(line, 0.0, 2.0).upper, 5.0, 1e-12);
    EXPECT_NEAR(slope_bounds(line, 0.0, 2.0).lower, 3.0, 1e-12);
    EXPECT_NEAR(slope_bounds(line, 0.0, 2.0).upper, 3.0, 1e-12);
}

TEST(Bounds, IncludeANarrowWaveletBetweenTheFirstCells) {
    const NetworkParameters spike{1, {1e5}, {0.0313}, {1.0}, {0.0}, 0.0};
    EXPECT_LE(value_bounds(spike, 0.0, 1.0).lower, -1.0);
    EXPECT_GE(slope_bounds(spike, 0.0, 1.0).upper, 1.38e5);
}

// Two wavelets at a distance of a millionth of their width with weights of a million: the weights cancel and the sum
// has a size of about one.
TEST(Bounds, AreTightForLargeWeightsThatCancel) {
    Random random{33};
    for (int k = 0; k < cases(20); ++k) {
        NetworkParameters network = test::random_network(random, 8);
        for (std::size_t i = 0; i + 1 < 8; i += 2) {
            network.alpha[i + 1] = network.alpha[i];
            network.beta[i + 1] = network.beta[i] + uniform(random, -1e-6, 1e-6) / network.alpha[i];
            network.weight[i] = uniform(random, 0.5e6, 1e6);
            network.weight[i + 1] = -network.weight[i];
        }
        const NetworkCurve curve{network, test::unit_domain()};
        Interval sampled{1e300, -1e300};
        for (int j = 0; j <= 20'000; ++j) {
            const double slope = curve.inside(j / 20'000.0).slope;
            sampled = sampled.with({slope, slope});
        }
        const Interval proved = slope_bounds(network, 0.0, 1.0);
        EXPECT_LE(proved.upper - sampled.upper, 0.011 * sampled.largest()) << k;
        EXPECT_LE(sampled.lower - proved.lower, 0.011 * sampled.largest()) << k;
        EXPECT_GE(proved.upper, sampled.upper - 1e-6 * sampled.largest());
    }
}

/// Returns the binomial coefficient.
double choose(int n, int k) {
    return std::round(std::tgamma(n + 1.0) / (std::tgamma(k + 1.0) * std::tgamma(n - k + 1.0)));
}

// For a polynomial of degree 7, the range of a cell is given by the Bernstein coefficients sum_j binomial(i, j) /
// binomial(7, j) a_j, with the coefficients a_j of the powers of the place in the cell.
TEST(Bounds, RangeOfACellIsThatOfItsBernsteinCoefficients) {
    Random random{41};
    for (int k = 0; k < cases(1000); ++k) {
        const double left = uniform(random, -2.0, 2.0);
        const double h = std::ldexp(1.0, static_cast<int>(random() % 5) - 2);
        std::array<double, 8> a;
        for (double& coefficient : a) {
            coefficient = uniform(random, -1.0, 1.0);
        }
        std::array<Jet, 2> ends{};
        Interval expected{1e300, -1e300};
        for (int j = 0; j < 8; ++j) {
            double product = 1.0;
            for (int d = 0; d < 4; ++d) {
                const auto order = static_cast<std::size_t>(d);
                ends[0][order] += j == d ? product * a[static_cast<std::size_t>(j)] : 0.0;
                ends[1][order] += product * a[static_cast<std::size_t>(j)];
                product *= (j - d) / h;
            }
            double bernstein = 0.0;
            for (int l = 0; l <= j; ++l) {
                bernstein += choose(j, l) / choose(7, l) * a[static_cast<std::size_t>(l)];
            }
            expected = expected.with({bernstein, bernstein});
        }
        const detail::BoundedCell cell{left, left + h, ends[0], ends[1], 0.25};
        EXPECT_NEAR(cell.range.lower, expected.lower - 0.25, 1e-12) << k;
        EXPECT_NEAR(cell.range.upper, expected.upper + 0.25, 1e-12) << k;
    }
}

TEST(Bounds, CellsAreOrderedByTheirLargestAbsoluteValue) {
    const auto cell = [](double value) {
        return detail::BoundedCell{0.0, 1.0, {value, 0.0, 0.0, 0.0}, {value, 0.0, 0.0, 0.0}, 0.0};
    };
    EXPECT_TRUE(cell(1.0) < cell(-2.0));
    EXPECT_FALSE(cell(-2.0) < cell(1.0));
    EXPECT_FALSE(cell(2.0) < cell(-2.0));
}

// The line is zero at one end of the interval, so its bound there is the remainder of the last of 16 cells. Value and
// slope have rounding errors of 4 epsilon (see `derivatives_rounding`), and the products with them 8 epsilon.
TEST(Bounds, OfALineExceedItByItsRoundingErrors) {
    const NetworkParameters line{1, {}, {}, {}, {1.0}, 0.0};
    const double rounding =
        ((4.0 + 8.0 / 16.0) + 3.0 / 7.0 / 16.0 * (4.0 + 8.0)) * std::numeric_limits<double>::epsilon();
    EXPECT_DOUBLE_EQ(value_bounds(line, -1.0, 0.0).upper, rounding);
    EXPECT_DOUBLE_EQ(value_bounds(line, 0.0, 1.0).lower, -rounding);
    const NetworkParameters constant{1, {}, {}, {}, {0.0}, 2.0};
    EXPECT_EQ(slope_bounds(constant, 0.0, 1.0).lower, 0.0);
    EXPECT_EQ(slope_bounds(constant, 0.0, 1.0).upper, 0.0);
}

// The Mexican hat rises to zero at u = 1. The bound is the distance of the polynomial of degree 7 from it in the last
// of 16 cells, plus the errors of the derivatives at the ends multiplied by their factors in the Bernstein coefficients.
TEST(Bounds, OfARisingWaveletExceedItByTheRemainderOfItsLastCell) {
    constexpr double unit = 8.0 * std::numeric_limits<double>::epsilon();
    const NetworkParameters hat{1, {1.0}, {0.0}, {1.0}, {0.0}, 0.0};
    for (const double from : {0.5, 0.0}) {
        const double h = (1.0 - from) / 16.0;
        const Derivatives rounding = derivatives_rounding(hat, 1.0);
        const Derivatives left = derivatives(hat, 1.0 - h);
        const Derivatives right = derivatives(hat, 1.0);
        const auto part = [&](std::size_t d) {
            return rounding[d] + unit * std::max(std::abs(left[d]), std::abs(right[d]));
        };
        const double remainder = derivative_bounds(hat, 1.0 - h, 1.0)[8] * std::pow(h / 2.0, 8) / 40320.0 +
                                 part(0) +
                                 h * (part(1) * 3.0 / 7.0 + h * (part(2) + h * part(3) / 15.0) / 14.0);
        ASSERT_EQ(right[0], 0.0);
        EXPECT_NEAR(value_bounds(hat, from, 1.0).upper / remainder, 1.0, 1e-12);
    }
}

/// Returns the largest value of the network over [0, 1], from a search over many positions and Newton's method.
double largest_value(const NetworkParameters& network) {
    double largest = -1e300;
    for (int j = 0; j <= 500; ++j) {
        double x = j / 500.0;
        for (int step = 0; step < 6; ++step) {
            const Derivatives f = derivatives(network, x);
            largest = std::max(largest, f[0]);
            x = f[2] < 0.0 ? std::clamp(x - f[1] / f[2], 0.0, 1.0) : x;
        }
    }
    return largest;
}

TEST(Bounds, WithoutToleranceExceedTheMaximumByAtMostFourRoundingErrors) {
    Random random{42};
    for (int k = 0; k < cases(40); ++k) {
        const NetworkParameters network = test::random_network(random, static_cast<std::size_t>(1 + k % 4));
        const double rounding = derivatives_rounding(network, 1.0)[0];
        const double largest = largest_value(network);
        const double bound = value_bounds(network, 0.0, 1.0, 0.0).upper;
        EXPECT_GE(bound, largest) << k;
        EXPECT_LE(bound, largest + 4.1 * rounding) << k;
    }
}

TEST(Bounds, ToleranceIsRelativeToTheSizeOfTheForce) {
    Random random{43};
    for (int k = 0; k < cases(40); ++k) {
        NetworkParameters network = test::random_network(random, 4);
        const double scale = k % 2 == 0 ? 0x1p-10 : 0x1p10;
        const auto scaled = [&](double number) { return number * scale; };
        NetworkParameters other = network;
        std::transform(other.weight.begin(), other.weight.end(), other.weight.begin(), scaled);
        other.linear[0] *= scale;
        other.bias *= scale;
        for (const double relative : {1e-4, 0.01, 0.3}) {
            const Interval one = value_bounds(network, 0.0, 1.0, relative);
            const Interval two = value_bounds(other, 0.0, 1.0, relative);
            EXPECT_EQ(one.lower * scale, two.lower);
            EXPECT_EQ(one.upper * scale, two.upper);
        }
        EXPECT_EQ(value_bounds(network, 0.0, 1.0).upper, value_bounds(network, 0.0, 1.0, 0.01).upper);
        EXPECT_EQ(slope_bounds(network, 0.0, 1.0).upper, slope_bounds(network, 0.0, 1.0, 0.01).upper);
        EXPECT_EQ(value_bounds(network, 0.0, 1.0).lower, value_bounds(network, 0.0, 1.0, 0.01).lower);
        EXPECT_EQ(slope_bounds(network, 0.0, 1.0).lower, slope_bounds(network, 0.0, 1.0, 0.01).lower);
    }
}

TEST(Bounds, OfForcesThatAreNotFiniteEndAtTheLargestNumberOfCells) {
    const double infinity = std::numeric_limits<double>::infinity();
    const NetworkParameters steep{1, {1e40}, {0.5}, {1.0}, {0.0}, 0.0};
    EXPECT_EQ(value_bounds(steep, 0.0, 1.0).upper, infinity);
    const NetworkParameters none{1, {}, {}, {}, {0.0}, std::nan("")};
    EXPECT_TRUE(std::isnan(value_bounds(none, 0.0, 1.0).upper));
}

// One wavelet is as narrow as the distance between two neighbouring numbers, so the bounds of its cells stay uncertain.
// The cells of the wider wavelet, with the smallest force, must still be divided.
TEST(Bounds, CellsWithoutAPositionInsideAreNotDividedAgain) {
    constexpr double step = 0x1p-53;  // distance between two numbers from 0.5 to 1
    for (const double place : {2.0, 3.0}) {
        const NetworkParameters network{
            1, {1.0 / step, 0.3 / step}, {0.75 + place * step, 0.75 + 32.0 * step}, {-1.0, 2.0}, {0.0}, 10.0};
        const Interval bounds = value_bounds(network, 0.75, 0.75 + 64.0 * step, 1e-6);
        EXPECT_GE(bounds.upper, 11.0);
        EXPECT_LE(bounds.upper, 11.001);
        EXPECT_LE(bounds.lower, 8.0);
        EXPECT_GE(bounds.lower, 8.0 - 2e-5);
    }
}

Domain unit_box(std::size_t dimension) {
    return {std::vector<double>(dimension, 0.0), std::vector<double>(dimension, 1.0), Continuation::Linear,
            Continuation::Linear, std::nullopt};
}

// Along a straight line, the mother wavelet psi of several inputs is a sum of two Hermite functions. The test uses all
// angles of the line at every distance from the centre.
TEST(RadialBounds, HigherDerivativesAreWithinTheirBounds) {
    for (std::size_t d = 1; d <= 5; ++d) {
        const double others = static_cast<double>(d) - 1.0;
        const double supremum = (1.0 + 1e-15) * detail::fourth_derivative_supremum(d);
        for (double r = 0.0; r < 12.0; r += 0.02) {
            double fourth = 0.0;
            double fifth = 0.0;
            for (int angle = 0; angle <= (d == 1 ? 0 : 90); ++angle) {
                const double x = r * std::cos(angle * std::numbers::pi / 180.0);
                const double s = x * x;
                const double across = r * r - s - others;
                fourth = std::max(
                    fourth, std::abs(((s - 15.0) * s + 45.0) * s - 15.0 + ((s - 6.0) * s + 3.0) * across));
                fifth = std::max(
                    fifth,
                    std::abs((((s - 21.0) * s + 105.0) * s - 105.0 + ((s - 10.0) * s + 15.0) * across) * x));
            }
            fourth *= std::exp(-0.5 * r * r);
            fifth *= std::exp(-0.5 * r * r);
            ASSERT_LE(fourth, supremum * std::exp(-detail::fourth_derivative_decay * r * r));
            ASSERT_LE(fifth * std::max(r, 1.0) + 4.0 * fourth,
                      detail::fourth_derivative_change * supremum * std::exp(-0.24 * r * r));
        }
    }
}

/// Returns the fourth derivative of a wavelet at u in the direction t, D^4 psi(t, t, t, t), divided by |t|^4.
double fourth_derivative(std::span<const double> u, std::span<const double> t) {
    double square = 0.0;
    double along = 0.0;
    double length = 0.0;
    for (std::size_t j = 0; j < u.size(); ++j) {
        square += u[j] * u[j];
        along += u[j] * t[j];
        length += t[j] * t[j];
    }
    const double x = along * along / length;
    const double sixth = ((x - 15.0) * x + 45.0) * x - 15.0;
    const double fourth = (x - 6.0) * x + 3.0;
    const double others = static_cast<double>(u.size()) - 1.0;
    return (sixth + fourth * (square - x - others)) * std::exp(-0.5 * square) * length * length;
}

TEST(RadialBounds, AccountForNearWaveletsThatCancel) {
    Random random{38};
    for (int k = 0; k < cases(20'000); ++k) {
        const std::size_t d = 1 + static_cast<std::size_t>(k % 3);
        NetworkParameters pair = test::random_network(random, 2, d);
        std::vector<double> u(2 * d);
        std::vector<double> t(2 * d);
        double square = 0.0;
        double length = 0.0;
        for (std::size_t j = 0; j < d; ++j) {
            pair.alpha[d + j] = pair.alpha[j] * (1.0 + uniform(random, -0.006, 0.006));
            pair.beta[d + j] = pair.beta[j] + uniform(random, -0.004, 0.004) / pair.alpha[j];
            const double x = pair.beta[j] + uniform(random, -5.0, 5.0) / pair.alpha[j];
            const double step = uniform(random, -1.0, 1.0) / pair.alpha[j];
            for (std::size_t i = 0; i < 2; ++i) {
                u[i * d + j] = pair.alpha[i * d + j] * (x - pair.beta[i * d + j]);
                t[i * d + j] = pair.alpha[i * d + j] * step;
            }
            square += u[j] * u[j];
            length += t[j] * t[j];
        }
        pair.weight = {1.0, -1.0};
        const std::span<const double> all_u{u};
        const std::span<const double> all_t{t};
        const double difference = fourth_derivative(all_u.first(d), all_t.first(d)) -
                                  fourth_derivative(all_u.last(d), all_t.last(d));
        const std::vector<double> counted = detail::uncancelled_weights(pair);
        ASSERT_EQ(counted[1], 0.0);
        ASSERT_LT(counted[0], 0.4);
        ASSERT_LE(std::abs(difference), counted[0] * detail::fourth_derivative_supremum(d) *
                                            std::exp(-detail::fourth_derivative_decay * square) * length *
                                            length)
            << k;
    }
}

TEST(RadialBounds, AreTightForLargeWeightsThatCancel) {
    Random random{39};
    for (int k = 0; k < cases(3); ++k) {
        NetworkParameters network = test::random_network(random, 8, 2);
        for (double& alpha : network.alpha) {
            alpha = std::min(alpha, 10.0);
        }
        cancel(network, random);
        const std::vector<double> lower{0.0, 0.0};
        const std::vector<double> upper{1.0, 1.0};
        const RadialSum hats{network, lower, upper};
        Interval sampled{1e300, -1e300};
        for (int i = 0; i <= 200; ++i) {
            for (int j = 0; j <= 200; ++j) {
                const std::vector<double> x{i / 200.0, j / 200.0};
                double value = 0.0;
                std::vector<double> gradient = network.linear;
                hats.add(x.data(), value, gradient.data());
                sampled = sampled.with({gradient[0], gradient[0]});
            }
        }
        const Interval proved = radial_bounds(network, lower, upper).gradient[0];
        EXPECT_LE(proved.upper - sampled.upper, 0.012 * sampled.largest()) << k;
        EXPECT_LE(sampled.lower - proved.lower, 0.012 * sampled.largest()) << k;
    }
}

// Repeats the test with every instruction set of this machine. In small boxes the remainder of Taylor's formula is
// small, so an error of any derivative is visible.
TEST(RadialBounds, RemainderBoundsTheErrorOfTaylorsFormula) {
    for (const detail::HatKernel& kernel : detail::usable_hat_kernels()) {
        Random random{36};
        for (int k = 0; k < cases(200); ++k) {
            const std::size_t d = 1 + static_cast<std::size_t>(k % 3);
            const NetworkParameters parameters =
                test::random_network(random, static_cast<std::size_t>(k % 19), d);
            const std::vector<double> lower(d, -1.0);
            const std::vector<double> upper(d, 2.0);
            const RadialSum hats{parameters, lower, upper, kernel};
            detail::RadialExpansion sums = hats.expansion();
            std::vector<double> middle(d);
            std::vector<double> radius(d);
            for (std::size_t j = 0; j < d; ++j) {
                middle[j] = uniform(random, 0.0, 1.0);
                radius[j] = std::exp(uniform(random, -9.0, -2.0));
            }
            hats.expand(middle.data(), radius.data(), sums);
            const double rest = std::accumulate(sums.rest.begin(), sums.rest.end(), 0.0);
            for (int point = 0; point < 10; ++point) {
                std::vector<double> t(d);
                std::vector<double> x(d);
                for (std::size_t j = 0; j < d; ++j) {
                    t[j] = uniform(random, -1.0, 1.0);
                    x[j] = middle[j] + radius[j] * t[j];
                }
                double value = 0.0;
                std::vector<double> gradient(d, 0.0);
                hats.add(x.data(), value, gradient.data());
                double cubic = sums.value;
                for (std::size_t j = 0; j < d; ++j) {
                    double along = sums.gradient[j];
                    cubic += sums.gradient[j] * t[j];
                    for (std::size_t l = 0; l < d; ++l) {
                        along += sums.second_derivative[j * d + l] * t[l];
                        cubic += sums.second_derivative[j * d + l] * t[j] * t[l] / 2.0;
                        for (std::size_t m = 0; m < d; ++m) {
                            const double twist = sums.third_derivative[(j * d + l) * d + m];
                            along += twist * t[l] * t[m] / 2.0;
                            cubic += twist * t[j] * t[l] * t[m] / 6.0;
                        }
                    }
                    ASSERT_LE(std::abs(radius[j] * gradient[j] - along),
                              std::sqrt(sums.rest[j] * rest) / 6.0 + 1e-10 * radius[j])
                        << k;
                }
                ASSERT_LE(std::abs(value - cubic), rest / 24.0 + 1e-12) << k;
            }
        }
    }
}

// Boxes of positions in which every term of Taylor's formula can reach its largest size.
TEST(RadialBounds, HoldAtTheCornersOfAnyBox) {
    Random random{37};
    for (int k = 0; k < cases(500); ++k) {
        const std::size_t d = 1 + static_cast<std::size_t>(k % 3);
        NetworkParameters network = test::random_network(random, static_cast<std::size_t>(1 + k % 5), d);
        const RadialSum hats{network, std::vector<double>(d, -9.0), std::vector<double>(d, 9.0)};
        std::vector<double> lower(d);
        std::vector<double> upper(d);
        for (std::size_t j = 0; j < d; ++j) {
            lower[j] = uniform(random, 0.0, 1.0);
            upper[j] = lower[j] + std::exp(uniform(random, -7.0, -2.0));
        }
        detail::RadialEnclosure box{network, hats};
        box.over(lower.data(), upper.data());
        for (std::size_t corner = 0; corner < (std::size_t{1} << d); ++corner) {
            std::vector<double> x = lower;
            double value = network.bias;
            for (std::size_t j = 0; j < d; ++j) {
                x[j] = (corner >> j) % 2 == 0 ? lower[j] : upper[j];
                value += network.linear[j] * x[j];
            }
            std::vector<double> gradient = network.linear;
            hats.add(x.data(), value, gradient.data());
            ASSERT_GE(value, box.ranges.value.lower - 1e-12) << k;
            ASSERT_LE(value, box.ranges.value.upper + 1e-12) << k;
            for (std::size_t j = 0; j < d; ++j) {
                ASSERT_GE(gradient[j], box.ranges.gradient[j].lower - 1e-10) << k;
                ASSERT_LE(gradient[j], box.ranges.gradient[j].upper + 1e-10) << k;
            }
        }
    }
}

TEST(RadialBounds, HoldAtEveryPointOfTheDomain) {
    Random random{34};
    for (int k = 0; k < cases(30); ++k) {
        const std::size_t d = k % 10 == 9 ? 3 : 2;
        NetworkParameters parameters = test::random_network(random, static_cast<std::size_t>(1 + k % 16), d);
        for (double& alpha : parameters.alpha) {
            alpha = d == 3 ? std::min(alpha, 4.0) : std::min(alpha, 20.0);
        }
        if (d == 2 && k % 5 == 3) {
            cancel(parameters, random);
        }
        const RadialNetwork network{parameters, unit_box(d)};
        const RadialBounds bounds = radial_bounds(parameters, network.domain().lower, network.domain().upper);
        std::vector<double> x(d);
        std::vector<double> gradient(d);
        for (int j = 0; j < 1000; ++j) {
            for (double& one : x) {
                one = uniform(random, 0.0, 1.0);
            }
            (void)network.at(x, gradient);
            for (std::size_t i = 0; i < d; ++i) {
                ASSERT_GE(gradient[i], bounds.gradient[i].lower) << k;
                ASSERT_LE(gradient[i], bounds.gradient[i].upper) << k;
            }
            ASSERT_GE(network.value(x), bounds.value.lower) << k;
            ASSERT_LE(network.value(x), bounds.value.upper) << k;
        }
    }
}

TEST(RadialBounds, AreWithinOnePercentOfADenseSearch) {
    Random random{35};
    for (int k = 0; k < cases(4); ++k) {
        const std::size_t size = static_cast<std::size_t>(1 + 4 * (k % 4));
        NetworkParameters parameters = test::random_network(random, size, 2);
        for (double& alpha : parameters.alpha) {
            alpha = std::min(alpha, 10.0);
        }
        const RadialNetwork network{parameters, unit_box(2)};
        Interval value{1e300, -1e300};
        std::array<Interval, 2> slopes{value, value};
        std::vector<double> gradient(2);
        for (int i = 0; i <= 200; ++i) {
            for (int j = 0; j <= 200; ++j) {
                const std::vector<double> x{i / 200.0, j / 200.0};
                const double here = network.value(x);
                value = value.with({here, here});
                (void)network.at(x, gradient);
                for (std::size_t l = 0; l < 2; ++l) {
                    slopes[l] = slopes[l].with({gradient[l], gradient[l]});
                }
            }
        }
        const RadialBounds bounds = radial_bounds(parameters, network.domain().lower, network.domain().upper);
        EXPECT_LE(bounds.value.upper - value.upper, 0.012 * value.largest());
        EXPECT_LE(value.lower - bounds.value.lower, 0.012 * value.largest());
        for (std::size_t l = 0; l < 2; ++l) {
            EXPECT_LE(bounds.gradient[l].upper - slopes[l].upper, 0.012 * slopes[l].largest());
            EXPECT_LE(slopes[l].lower - bounds.gradient[l].lower, 0.012 * slopes[l].largest());
        }
    }
}

}  // namespace
}  // namespace palpate
