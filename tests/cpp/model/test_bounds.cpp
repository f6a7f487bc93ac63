// SPDX-License-Identifier: Apache-2.0
#include "palpate/model/bounds.hpp"

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
