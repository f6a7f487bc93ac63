// SPDX-License-Identifier: Apache-2.0
#include "palpate/model/radial_network.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <span>
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
