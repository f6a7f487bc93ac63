// SPDX-License-Identifier: Apache-2.0
#include "palpate/model/hat_sum.hpp"

#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/model/network.hpp"
#include "support.hpp"

namespace palpate {
namespace {

using test::cases;
using test::Random;
using test::uniform;

/// Sums of the wavelets, added term by term with the standard library's exponential, and sums of the absolute terms.
struct Plain {
    Curve sum;
    Curve absolute;
};

Plain plain(const NetworkParameters& network, double x) {
    Plain result;
    const auto add = [&](double Curve::* member, double term) {
        result.sum.*member += term;
        result.absolute.*member += std::abs(term);
    };
    for (std::size_t i = 0; i < network.weight.size(); ++i) {
        const double alpha = network.alpha[i];
        const double weight = network.weight[i];
        const MexicanHat psi = mexican_hat(alpha * (x - network.beta[i]));
        add(&Curve::value, weight * psi.value);
        add(&Curve::slope, weight * alpha * psi.slope);
        add(&Curve::integral, weight / alpha * psi.integral);
        add(&Curve::double_integral, weight / alpha / alpha * psi.double_integral);
        // The rounding error of the argument u = alpha (x - beta) changes the value of a wavelet even where this value
        // is zero.
        result.absolute.value += std::abs(weight) * std::abs(psi.integral);
        result.absolute.slope += std::abs(weight) * alpha * psi.double_integral;
        result.absolute.integral += 1e-290;
        result.absolute.double_integral += 1e-290;
    }
    return result;
}

/// Returns positions of all kinds: inside the domain, at the centres of wavelets, distant, tiny and huge.
double position(Random& random, int k) {
    switch (k % 6) {
        case 0:
            return std::ldexp(uniform(random, -1.0, 1.0), static_cast<int>(uniform(random, -1070.0, 1020.0)));
        case 1:
            return uniform(random, -40.0, 40.0);
        default:
            return uniform(random, -0.5, 1.5);
    }
}

// Repeats the test with every instruction set of this machine.
TEST(HatSum, IsAccurateToThirteenDigitsOnEveryInstructionSet) {
    for (const detail::HatKernel& kernel : detail::usable_hat_kernels()) {
        Random random{71};
        for (int k = 0; k < cases(5000); ++k) {
            const NetworkParameters network = test::random_network(random, static_cast<std::size_t>(k % 37));
            const HatSum hats{network, kernel};
            const double x = position(random, k);
            const Plain expected = plain(network, x);
            Curve sum;
            hats.add(x, sum);
            // Each term of the slope is a sum of products that may cancel: an error of the exponential is multiplied
            // by u^2, with u the argument of the wavelet.
            for (const auto member :
                 {&Curve::value, &Curve::slope, &Curve::integral, &Curve::double_integral}) {
                ASSERT_NEAR(sum.*member, expected.sum.*member, 1e-13 * (expected.absolute.*member) + 1e-280)
                    << x;
            }
        }
    }
}

TEST(HatSum, BatchesAgreeWithSinglePositions) {
    for (const detail::HatKernel& kernel : detail::usable_hat_kernels()) {
        Random random{72};
        for (int k = 0; k < cases(200); ++k) {
            const NetworkParameters network = test::random_network(random, static_cast<std::size_t>(k % 20));
            const HatSum hats{network, kernel};
            std::vector<double> x(static_cast<std::size_t>(k % 23));
            for (std::size_t j = 0; j < x.size(); ++j) {
                x[j] = position(random, static_cast<int>(j));
            }
            for (const auto quantity : {HatQuantity::Force, HatQuantity::Slope, HatQuantity::Integral}) {
                // The array of results has one extra element, which detects writes past the end of the results.
                std::vector<double> sums(x.size() + 1, 1.0);
                hats.add(quantity, x, std::span{sums}.first(x.size()));
                EXPECT_EQ(sums.back(), 1.0);
                for (std::size_t j = 0; j < x.size(); ++j) {
                    Curve one;
                    hats.add(x[j], one);
                    const double expected = quantity == HatQuantity::Force   ? one.value
                                            : quantity == HatQuantity::Slope ? one.slope
                                                                             : one.integral;
                    const Curve absolute = plain(network, x[j]).absolute;
                    const double size = quantity == HatQuantity::Force   ? absolute.value
                                        : quantity == HatQuantity::Slope ? absolute.slope
                                                                         : absolute.integral;
                    ASSERT_NEAR(sums[j] - 1.0, expected, 1e-13 * size + 1e-15 * (2.0 + std::abs(expected)));
                }
            }
        }
    }
}

TEST(HatSum, IsSafeForEveryDouble) {
    Random random{73};
    const NetworkParameters network = test::random_network(random, 9);
    const double infinity = std::numeric_limits<double>::infinity();
    for (const detail::HatKernel& kernel : detail::usable_hat_kernels()) {
        const HatSum hats{network, kernel};
        for (const double x : {infinity, -infinity, 1e300, -1e300, 1e10}) {
            Curve sum;
            hats.add(x, sum);
            EXPECT_LT(std::abs(sum.value) + std::abs(sum.slope) + std::abs(sum.integral), 1e-280) << x;
            std::vector<double> batch{0.0};
            hats.add(HatQuantity::Slope, std::vector<double>{x}, batch);
            EXPECT_LT(std::abs(batch[0]), 1e-280) << x;
        }
        Curve sum;
        hats.add(std::nan(""), sum);
        EXPECT_TRUE(std::isnan(sum.value) && std::isnan(sum.slope) && std::isnan(sum.integral));
    }
}

#if defined(__GNUC__) && defined(__x86_64__)
TEST(HatSum, EveryInstructionSetOfTheProcessorIsUsable) {
    const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    const bool avx512 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
                        __builtin_cpu_supports("avx512vl");
    const std::vector<detail::HatKernel> kernels = detail::usable_hat_kernels();
    ASSERT_EQ(kernels.size(), 2u + (avx2 ? 1u : 0u) + (avx512 ? 1u : 0u));
    EXPECT_EQ(kernels[0].lanes, 1);
    EXPECT_EQ(kernels[1].lanes, 2);
    if (avx2) {
        EXPECT_EQ(kernels[2].lanes, 4);
    }
    if (avx512) {
        EXPECT_EQ(kernels.back().lanes, 8);
    }
    EXPECT_EQ(detail::hat_kernel().at, kernels.back().at);
}
#endif

TEST(HatSum, ExponentialIsAccurateToTheLastDigits) {
    for (const detail::HatKernel& kernel : detail::usable_hat_kernels()) {
        Random random{74};
        std::vector<double> square{0.0, 1e-300, detail::hat_reach * detail::hat_reach};
        for (int k = 0; k < cases(10000); ++k) {
            square.push_back(std::pow(uniform(random, 0.0, detail::hat_reach), 2));
        }
        std::vector<double> e(square.size());
        kernel.gaussians(square.data(), square.size(), e.data());
        for (std::size_t k = 0; k < square.size(); ++k) {
            const long double exact = std::exp(-0.5L * square[k]);
            ASSERT_NEAR(static_cast<double>(e[k] / exact), 1.0, 1e-15) << square[k];
        }
        double beyond[2] = {1e308, std::nan("")};
        double small[2];
        kernel.gaussians(beyond, 2, small);
        EXPECT_GT(small[0], 0.0);
        EXPECT_LT(small[0], 1e-300);
        EXPECT_TRUE(std::isnan(small[1]));
    }
}

TEST(NetworkCurve, BatchesAcrossTheEdgesAgreeWithSinglePositions) {
    Random random{75};
    for (const bool periodic : {false, true}) {
        Domain domain = test::unit_domain(Continuation::Free);
        if (periodic) {
            domain.period = 1.0;
        }
        const NetworkCurve curve = continued_force(test::random_network(random, 11), domain);
        std::vector<double> x{std::nan(""), 1e300, -1e300, 0.0, 1.0};
        for (int k = 0; k < 1000; ++k) {
            x.push_back(uniform(random, -1.0, 2.0));
        }
        std::vector<double> result(x.size());
        const auto check = [&](HatQuantity quantity, double Curve::* member) {
            curve.at(quantity, x, result);
            for (std::size_t k = 0; k < x.size(); ++k) {
                const double expected = curve.at(x[k]).*member;
                if (!std::isfinite(expected)) {
                    EXPECT_EQ(std::isnan(result[k]), std::isnan(expected)) << x[k];
                } else {
                    EXPECT_NEAR(result[k], expected, 1e-12 * (1.0 + std::abs(expected))) << x[k];
                }
            }
        };
        check(HatQuantity::Force, &Curve::value);
        check(HatQuantity::Slope, &Curve::slope);
        check(HatQuantity::Integral, &Curve::integral);
    }
}

}  // namespace
}  // namespace palpate
