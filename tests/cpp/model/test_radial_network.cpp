// SPDX-License-Identifier: Apache-2.0
#include "palpate/model/radial_network.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/model/network.hpp"
#include "support.hpp"

namespace palpate {
namespace {

using test::cases;
using test::Random;
using test::random_network;
using test::uniform;

TEST(RadialNetwork, GradientAgreesWithDifferences) {
    Random random{5};
    for (int k = 0; k < cases(100); ++k) {
        const RadialNetwork network{random_network(random, 7, 3),
                                    {{0, 0, 0}, {1, 1, 1}, {}, {}, std::nullopt}};
        std::array<double, 3> x{uniform(random, 0.01, 0.99), uniform(random, 0.01, 0.99),
                                uniform(random, 0.01, 0.99)};
        std::array<double, 3> gradient{};
        (void)network.at(x, gradient);
        for (std::size_t j = 0; j < 3; ++j) {
            constexpr double h = 1e-6;
            auto up = x;
            auto down = x;
            up[j] += h;
            down[j] -= h;
            const double slope = (network.value(up) - network.value(down)) / (2.0 * h);
            EXPECT_NEAR(gradient[j], slope, 1e-4 * (1.0 + std::abs(slope)));
        }
    }
}

TEST(RadialNetwork, ContinuesOutsideTheBoxWithAClampedGradient) {
    Random random{6};
    for (int k = 0; k < cases(50); ++k) {
        const RadialNetwork network{random_network(random, 7, 2), {{0, 0}, {1, 1}, {}, {}, std::nullopt}};
        const std::array<double, 2> edge{1.0, 0.4};
        const std::array<double, 2> outside{1.5, 0.4};
        std::array<double, 2> gradient{};
        (void)network.at(outside, gradient);
        EXPECT_GE(gradient[0], 0.0);
        EXPECT_NEAR(network.value(outside), network.value(edge) + 0.5 * gradient[0], 1e-12);
        EXPECT_TRUE(network.extrapolated(outside));
        EXPECT_FALSE(network.extrapolated(edge));
    }
}

// Every region: each input below, inside or above the domain, with slopes that are limited and slopes that are not.
TEST(RadialNetwork, GradientOutsideAgreesWithDifferencesOfTheValue) {
    Random random{12};
    constexpr double h = 1e-6;
    for (std::size_t d = 1; d <= 3; ++d) {
        const Domain domain{std::vector<double>(d, 0.0), std::vector<double>(d, 1.0), {}, {}, std::nullopt};
        for (int k = 0; k < cases(300); ++k) {
            const RadialNetwork network{random_network(random, 7, d), domain};
            std::vector<double> x(d);
            for (double& one : x) {
                const double along = uniform(random, 0.01, 0.99);
                const auto region = random() % 3;
                one = region == 0 ? along - 1.0 : region == 1 ? along : along + 1.0;
            }
            std::vector<double> gradient(d);
            (void)network.at(x, gradient);
            for (std::size_t j = 0; j < d; ++j) {
                std::vector<double> up = x;
                std::vector<double> down = x;
                up[j] += h;
                down[j] -= h;
                const double slope = (network.value(up) - network.value(down)) / (2.0 * h);
                EXPECT_NEAR(gradient[j], slope, 2e-4 * (1.0 + std::abs(slope)))
                    << d << " inputs, input " << j;
            }
        }
    }
}

TEST(RadialNetwork, OfOneInputIsTheWaveletNetwork) {
    Random random{7};
    for (int k = 0; k < cases(100); ++k) {
        const NetworkParameters parameters = random_network(random, 6);
        const RadialNetwork radial{parameters, test::unit_domain()};
        const WaveletNetwork network{parameters, test::unit_domain()};
        const std::array<double, 1> x{uniform(random, 0.0, 1.0)};
        EXPECT_NEAR(radial.value(x), network.at(x[0], {}).force, 1e-13);
    }
}

/// Returns a network of one wavelet and a plane with d inputs over the box from 0.5 to 2. Each slope increases with its
/// input and falls with the other inputs.
RadialNetwork rising(std::size_t d, double scale) {
    const NetworkParameters network{d,
                                    std::vector<double>(d, 0.25),
                                    std::vector<double>(d, -0.25),
                                    {2.0 * scale},
                                    std::vector<double>(d, 0.5 * scale),
                                    0.125};
    return {network, {std::vector<double>(d, 0.5), std::vector<double>(d, 2.0), {}, {}, std::nullopt}};
}

// At the edge where the network is steepest, the slope of the continuation is the largest of 1024 points inside the
// domain: multiples of the powers of 1/g, with g^(d+1) = g + 1. For one input g is the golden ratio.
TEST(RadialNetwork, SlopesOutsideAreLimitedToTheLargestAtEvenlyDistributedPoints) {
    const std::array<double, 3> ratios{std::numbers::phi, 1.32471795724474602596, 1.22074408460575947536};
    for (std::size_t d = 1; d <= 3; ++d) {
        for (const double scale : {0.125, 4.0}) {
            const RadialNetwork network = rising(d, scale);
            const auto gradient_at = [&](const std::vector<double>& x) {
                std::vector<double> gradient(d);
                (void)network.at(x, gradient);
                return gradient;
            };
            std::vector<double> largest(d, -1e300);
            for (int k = 1; k <= 1024; ++k) {
                std::vector<double> x(d);
                for (std::size_t j = 0; j < d; ++j) {
                    const double multiple = k * std::pow(ratios[d - 1], -static_cast<double>(j + 1));
                    x[j] = 0.5 + 1.5 * (multiple - std::floor(multiple));
                }
                const std::vector<double> gradient = gradient_at(x);
                for (std::size_t j = 0; j < d; ++j) {
                    largest[j] = std::max(largest[j], gradient[j]);
                }
            }
            for (std::size_t j = 0; j < d; ++j) {
                std::vector<double> edge(d, 0.5);
                edge[j] = 2.0;
                ASSERT_GT(gradient_at(edge)[j], largest[j]);
                std::vector<double> x = edge;
                x[j] = 3.0;
                EXPECT_NEAR(gradient_at(x)[j], largest[j], 1e-9) << d << " inputs, input " << j;
                EXPECT_NEAR(network.value(x) - network.value(edge), largest[j], 1e-9);
            }
        }
    }
}

// The second wavelet has no weight, but its centre lies where the first one is steepest. The third wavelet makes the
// force steeper at the edge.
TEST(RadialNetwork, SlopesOutsideAreLimitedToTheLargestAtTheCentresOfWavelets) {
    const double flank = 0.5 + 0.741964 / 1e5;
    for (const std::size_t d : {1u, 2u}) {
        const std::vector<double> first(d, 0.5);
        NetworkParameters network;
        network.dimension = d;
        network.weight = {1.0, 1e-12, 10.0};
        network.linear.assign(d, 0.25);
        for (const double centre : {0.5, flank, 1.0 - 0.741964 / 1e5}) {
            for (std::size_t j = 0; j < d; ++j) {
                network.alpha.push_back(j == 0 ? 1e5 : 1.0);
                network.beta.push_back(j == 0 ? centre : 0.0);
            }
        }
        const RadialNetwork radial{
            network, {std::vector<double>(d, 0.0), std::vector<double>(d, 1.0), {}, {}, std::nullopt}};
        std::vector<double> x(d, 0.0);
        std::vector<double> gradient(d);
        x[0] = flank;
        (void)radial.at(x, gradient);
        const double largest = gradient[0];
        EXPECT_GT(largest, 1.3e5);
        x[0] = 1.0;
        (void)radial.at(x, gradient);
        EXPECT_GT(gradient[0], 1.3e6);
        x[0] = 2.0;
        (void)radial.at(x, gradient);
        EXPECT_DOUBLE_EQ(gradient[0], largest);
    }
}

// A force that falls everywhere has no slope outside.
TEST(RadialNetwork, SlopesOutsideAreNeverNegative) {
    const RadialNetwork falling{{2, {}, {}, {}, {-2.0, 0.0}, 1.0}, {{0, 0}, {1, 1}, {}, {}, std::nullopt}};
    std::array<double, 2> gradient{};
    for (const double x : {-3.0, 4.0}) {
        const double inside = falling.value(std::array{std::clamp(x, 0.0, 1.0), 0.5});
        EXPECT_EQ(falling.at(std::array{x, 0.5}, gradient), inside);
        EXPECT_EQ(falling.value(std::array{x, 0.5}), inside);
        EXPECT_EQ(gradient, (std::array{0.0, 0.0}));
    }
}

TEST(RadialNetwork, InputsOutsideTheDomainAreExtrapolated) {
    const RadialNetwork network{{2, {}, {}, {}, {1.0, 1.0}, 0.0}, {{0, -1}, {1, 2}, {}, {}, std::nullopt}};
    const auto up = [](double x) { return std::nextafter(x, 9.0); };
    const auto down = [](double x) { return std::nextafter(x, -9.0); };
    for (const double x : {0.0, 0.5, 1.0}) {
        for (const double y : {-1.0, 0.5, 2.0}) {
            EXPECT_FALSE(network.extrapolated(std::array{x, y}));
        }
        EXPECT_TRUE(network.extrapolated(std::array{x, down(-1.0)}));
        EXPECT_TRUE(network.extrapolated(std::array{x, up(2.0)}));
    }
    EXPECT_TRUE(network.extrapolated(std::array{down(0.0), 0.0}));
    EXPECT_TRUE(network.extrapolated(std::array{up(1.0), 0.0}));
    EXPECT_TRUE(network.extrapolated(std::array{0.5, std::nan("")}));
    EXPECT_EQ(network.dimension(), 2u);
    EXPECT_EQ(network.size(), 0u);
}

TEST(RadialNetwork, RefusesInvalidParameters) {
    EXPECT_THROW((RadialNetwork{{2, {}, {}, {}, {1.0}, 0.0}, {{0, 0}, {1, 1}, {}, {}, std::nullopt}}),
                 std::invalid_argument);
}

/// Returns force and gradient of the network of several inputs (eq. 4 of the paper), term by term with the standard
/// library's exponential.
double plain(const NetworkParameters& network, std::span<const double> x, std::span<double> gradient) {
    const std::size_t d = network.dimension;
    double sum = network.bias;
    for (std::size_t j = 0; j < d; ++j) {
        sum += network.linear[j] * x[j];
        gradient[j] = network.linear[j];
    }
    for (std::size_t i = 0; i < network.weight.size(); ++i) {
        double square = 0.0;
        for (std::size_t j = 0; j < d; ++j) {
            square += std::pow(network.alpha[i * d + j] * (x[j] - network.beta[i * d + j]), 2);
        }
        const RadialMexicanHat psi = radial_mexican_hat(square, static_cast<double>(d));
        sum += network.weight[i] * psi.value;
        for (std::size_t j = 0; j < d; ++j) {
            const double alpha = network.alpha[i * d + j];
            gradient[j] +=
                network.weight[i] * psi.gradient_over_u * alpha * alpha * (x[j] - network.beta[i * d + j]);
        }
    }
    return sum;
}

// Repeats the test with every instruction set of this machine.
TEST(RadialNetwork, ValueAndGradientInOnePassSatisfyEquation4) {
    for (const detail::HatKernel& kernel : detail::usable_hat_kernels()) {
        Random random{8};
        for (int k = 0; k < cases(80); ++k) {
            const std::size_t d = 1 + static_cast<std::size_t>(k % 4);
            const NetworkParameters parameters = random_network(random, static_cast<std::size_t>(k % 71), d);
            const RadialNetwork network{
                parameters,
                {std::vector<double>(d, 0.0), std::vector<double>(d, 1.0), {}, {}, std::nullopt},
                kernel};
            std::vector<double> x(d);
            std::vector<double> gradient(d);
            std::vector<double> expected(d);
            for (double& one : x) {
                one = uniform(random, 0.0, 1.0);
            }
            const double value = plain(parameters, x, expected);
            EXPECT_NEAR(network.at(x, gradient), value, 1e-12);
            EXPECT_NEAR(network.value(x), value, 1e-12);
            for (std::size_t j = 0; j < d; ++j) {
                EXPECT_NEAR(gradient[j], expected[j], 1e-10);
            }
            x[0] = 1.5;  // beyond the box
            EXPECT_NEAR(network.at(x, gradient), network.value(x), 1e-10);
            x[d - 1] = std::numeric_limits<double>::quiet_NaN();
            EXPECT_TRUE(std::isnan(network.value(x)));
        }
    }
}

}  // namespace
}  // namespace palpate
