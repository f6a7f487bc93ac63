// SPDX-License-Identifier: Apache-2.0
#include "palpate/model/radial_network.hpp"

#include <array>

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
        network.gradient(x, gradient);
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

TEST(RadialNetwork, GoesOnFromTheBoxWithAClampedGradient) {
    Random random{6};
    for (int k = 0; k < cases(50); ++k) {
        const RadialNetwork network{random_network(random, 7, 2), {{0, 0}, {1, 1}, {}, {}, std::nullopt}};
        const std::array<double, 2> edge{1.0, 0.4};
        const std::array<double, 2> outside{1.5, 0.4};
        std::array<double, 2> gradient{};
        network.gradient(outside, gradient);
        EXPECT_GE(gradient[0], 0.0);
        EXPECT_NEAR(network.value(outside), network.value(edge) + 0.5 * gradient[0], 1e-12);
        EXPECT_TRUE(network.extrapolated(outside));
        EXPECT_FALSE(network.extrapolated(edge));
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

}  // namespace
}  // namespace palpate
