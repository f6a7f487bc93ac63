// SPDX-License-Identifier: Apache-2.0
#include "palpate/model/compiled_network.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "support.hpp"

namespace palpate {
namespace {

using test::cases;
using test::Random;
using test::uniform;

/// Returns the n-th derivative of the network's force in extended precision, from psi^(n) = (-1)^n He_{n+2} E with the
/// Hermite polynomials He and E = exp(-u^2/2).
long double exact(const NetworkParameters& network, double x, int order) {
    const long double c = network.linear[0];
    long double sum = order == 0 ? c * x + network.bias : order == 1 ? c : 0.0L;
    for (std::size_t i = 0; i < network.weight.size(); ++i) {
        const long double alpha = network.alpha[i];
        const long double u = alpha * (static_cast<long double>(x) - network.beta[i]);
        if (i >= network.hats()) {
            sum += network.weight[i] * std::pow(alpha, static_cast<long double>(order)) *
                   std::cos(u + 0.5L * std::numbers::pi_v<long double> * order);
            continue;
        }
        long double before = 1.0L;
        long double hermite = u;
        for (int n = 1; n < order + 2; ++n) {
            const long double next = u * hermite - n * before;
            before = hermite;
            hermite = next;
        }
        const long double sign = order % 2 == 0 ? 1.0L : -1.0L;
        sum += sign * network.weight[i] * std::pow(alpha, static_cast<long double>(order)) * hermite *
               std::exp(-0.5L * u * u);
    }
    return sum;
}

WaveletNetwork random_scene(Random& random, std::size_t wavelets, Domain domain = test::unit_domain()) {
    return {test::random_network(random, wavelets), std::move(domain)};
}

TEST(DerivativeBounds, HoldAtEveryPointOfRandomNetworks) {
    Random random{41};
    for (int k = 0; k < cases(200); ++k) {
        const NetworkParameters network = test::random_network(random, static_cast<std::size_t>(k % 9));
        const double from = uniform(random, -2.0, 2.0);
        const double to = from + std::exp(uniform(random, -8.0, 1.0));
        const DerivativeBounds bounds = derivative_bounds(network, from, to);
        for (int order = 0; order <= 8; ++order) {
            for (int j = 0; j < 20; ++j) {
                const double x = uniform(random, from, to);
                ASSERT_LE(std::abs(exact(network, x, order)), bounds[static_cast<std::size_t>(order)])
                    << order << " " << x;
            }
        }
    }
}

TEST(DerivativeBounds, AreReachedAtTheCentreOfAWavelet) {
    const NetworkParameters one{1, {3.0}, {0.5}, {-2.0}, {0.0}, 0.0};
    for (const int order : {0, 2, 4, 6, 8}) {
        const double bound = derivative_bounds(one, 0.4, 0.6)[static_cast<std::size_t>(order)];
        EXPECT_NEAR(std::abs(exact(one, 0.5, order)) / bound, 1.0, 1e-8) << order;
    }
}

TEST(PiecewiseSeptic, IsExactForPolynomialsOfDegreeSeven) {
    // Polynomial x^7 + x^4 - x on cells of width 1/2, in which the highest powers contribute most.
    const auto jet = [](double x) noexcept {
        return Jet{std::pow(x, 7) + std::pow(x, 4) - x, 7.0 * std::pow(x, 6) + 4.0 * std::pow(x, 3) - 1.0,
                   42.0 * std::pow(x, 5) + 12.0 * x * x, 210.0 * std::pow(x, 4) + 24.0 * x};
    };
    const auto integrals = [](double x) noexcept {
        return std::array{std::pow(x, 8) / 8.0 + std::pow(x, 5) / 5.0 - x * x / 2.0,
                          std::pow(x, 9) / 72.0 + std::pow(x, 6) / 30.0 - x * x * x / 6.0};
    };
    PiecewiseSeptic table{-2, 4, 0.5, jet};
    table.integrate(integrals);
    Random random{49};
    for (int k = 0; k < cases(1000); ++k) {
        const double x = uniform(random, -1.0, 2.0);
        const Curve here = table.at(x);
        EXPECT_NEAR(here.value, jet(x)[0], 1e-12) << x;
        EXPECT_EQ(here.value, table.value(x)) << x;
        EXPECT_NEAR(here.slope, jet(x)[1], 1e-12) << x;
        EXPECT_NEAR(here.integral, integrals(x)[0], 1e-12) << x;
        EXPECT_NEAR(here.double_integral, integrals(x)[1], 1e-12) << x;
    }
}

TEST(CompiledCurve, KeepsItsCertifiedErrorEverywhere) {
    Random random{42};
    int compiled = 0;
    for (int k = 0; k < cases(60); ++k) {
        const WaveletNetwork network = random_scene(random, static_cast<std::size_t>(2 + k % 40));
        const CompiledCurve curve{network.curve()};
        compiled += curve.compiled() ? 1 : 0;
        const double required_error = 1e-12 * network.curve().value_bounds().largest();
        EXPECT_LE(curve.value_error(), required_error);
        for (int j = 0; j < 2000; ++j) {
            const double x = uniform(random, 0.0, 1.0);
            const Curve here = curve.at(x);
            ASSERT_LE(std::abs(here.value - exact(network.parameters(), x, 0)),
                      curve.compiled() ? curve.value_error() : required_error)
                << k << " " << x;
            if (curve.compiled()) {
                ASSERT_LE(std::abs(here.slope - exact(network.parameters(), x, 1)), curve.slope_error())
                    << k << " " << x;
            }
        }
    }
    EXPECT_GE(compiled, cases(60) * 9 / 10);
}

TEST(CompiledCurve, KeepsItsCertifiedErrorForHarmonics) {
    Random random{55};
    Domain turn = test::unit_domain();
    turn.period = 1.0;
    int compiled = 0;
    for (int k = 0; k < cases(20); ++k) {
        NetworkParameters of_order = test::random_network(random, static_cast<std::size_t>(k % 2));
        of_order.linear = {0.0};
        const WaveletNetwork network{
            test::with_harmonics(random, of_order, 2 + static_cast<std::size_t>(k % 40)), turn};
        const CompiledCurve curve{network.curve()};
        compiled += curve.compiled() ? 1 : 0;
        for (int j = 0; j < 500; ++j) {
            const double x = uniform(random, 0.0, 1.0);
            const Curve here = curve.at(x);
            const double error =
                std::abs(static_cast<double>(here.value - exact(network.parameters(), x, 0)));
            ASSERT_LE(error, curve.compiled() ? curve.value_error()
                                              : derivatives_rounding(network.parameters(), 1.0)[0])
                << k << " " << x;
        }
    }
    EXPECT_GE(compiled, cases(20) / 2);
}

TEST(CompiledCurve, UsesMoreCellsForASmallerError) {
    Random random{43};
    const WaveletNetwork network = random_scene(random, 12);
    std::size_t before = 0;
    for (const double error : {1e-4, 1e-6, 1e-9, 1e-12}) {
        const CompiledCurve curve{network.curve(), {error}};
        ASSERT_TRUE(curve.compiled());
        EXPECT_GE(curve.cells(), before);
        EXPECT_LE(curve.value_error(), error * network.curve().value_bounds().largest());
        before = curve.cells();
    }
    EXPECT_GT(before, CompiledCurve(network.curve(), {1e-4}).cells());
}

// If the error of a table of the force cannot be proved, the network is not compiled and its values are returned
// exactly.
TEST(CompiledCurve, IsNotCompiledIfTheErrorCannotBeCertified) {
    Random random{44};
    NetworkParameters cancelling = test::random_network(random, 8);
    for (std::size_t i = 0; i + 1 < 8; i += 2) {
        cancelling.alpha[i + 1] = cancelling.alpha[i] * (1.0 + 1e-6);
        cancelling.beta[i + 1] = cancelling.beta[i];
        cancelling.weight[i] = 1e6;
        cancelling.weight[i + 1] = -1e6;
    }
    NetworkParameters needle = test::random_network(random, 8);
    needle.alpha[3] = 1e6;
    NetworkParameters far = test::random_network(random, 8);
    const Domain distant{{1e13}, {1e13 + 1.0}, Continuation::Linear, Continuation::Linear, std::nullopt};
    for (double& beta : far.beta) {
        beta += 1e13;
    }
    for (const auto& [parameters, domain] :
         {std::pair{cancelling, test::unit_domain()}, std::pair{needle, test::unit_domain()},
          std::pair{far, distant}, std::pair{test::random_network(random, 1), test::unit_domain()},
          std::pair{test::random_network(random, 0), test::unit_domain()}}) {
        const WaveletNetwork network{parameters, domain};
        const CompiledCurve curve{network.curve()};
        EXPECT_FALSE(curve.compiled()) << parameters.weight.size();
        for (int j = 0; j < 100; ++j) {
            const double x = domain.lower[0] + uniform(random, -0.5, 1.5);
            EXPECT_EQ(curve.at(x).value, network.curve().at(x).value);
            EXPECT_EQ(curve.at(x).slope, network.curve().at(x).slope);
        }
    }
}

TEST(CompiledCurve, ContinuesLikeTheNetwork) {
    Random random{45};
    for (const auto continuation : {Continuation::Linear, Continuation::Free}) {
        const WaveletNetwork network = random_scene(random, 9, test::unit_domain(continuation, continuation));
        const CompiledCurve curve{network.curve()};
        ASSERT_TRUE(curve.compiled());
        for (const double x : {-1e300, -3.0, -0.1, -1e-9, 1.0 + 1e-9, 1.2, 5.0, 1e300}) {
            EXPECT_EQ(curve.at(x).value, network.curve().at(x).value) << x;
            EXPECT_EQ(curve.at(x).integral, network.curve().at(x).integral) << x;
            EXPECT_TRUE(curve.extrapolated(x));
        }
        for (const double edge : {0.0, 1.0}) {
            EXPECT_NEAR(curve.at(edge).value, network.curve().at(edge).value, curve.value_error());
            EXPECT_FALSE(curve.extrapolated(edge));
        }
        const double infinity = std::numeric_limits<double>::infinity();
        for (const double none : {std::nan(""), infinity, -infinity}) {
            for (const Curve& here : {curve.at(none), network.curve().at(none)}) {
                EXPECT_TRUE(std::isnan(here.value) && std::isnan(here.slope) && std::isnan(here.integral))
                    << none;
            }
            EXPECT_TRUE(curve.extrapolated(none));
        }
    }
}

TEST(CompiledCurve, RepeatsLikeTheNetwork) {
    Random random{46};
    const Domain knob{{0.1}, {0.8}, Continuation::Linear, Continuation::Linear, 0.8 - 0.1};
    const WaveletNetwork network = random_scene(random, 9, knob);
    const CompiledCurve curve{network.curve()};
    ASSERT_TRUE(curve.compiled());
    for (int k = 0; k < cases(2000); ++k) {
        const double x = uniform(random, -5.0, 5.0);
        EXPECT_NEAR(curve.at(x).value, network.curve().at(x).value, 2e-12 * (1.0 + std::abs(x))) << x;
        EXPECT_NEAR(curve.at(x).integral, network.curve().at(x).integral, 1e-11) << x;
    }
    // At distant positions rounding loses the place within the period; the result is still a force that the model has
    // at some position.
    const Interval bounds = network.curve().value_bounds();
    for (int k = 0; k < cases(2000); ++k) {
        const double x = uniform(random, -1.0, 1.0) * std::pow(10.0, uniform(random, 10.0, 300.0));
        EXPECT_LE(curve.at(x).value, bounds.upper) << x;
        EXPECT_GE(curve.at(x).value, bounds.lower) << x;
    }
    EXPECT_TRUE(std::isnan(curve.at(std::numeric_limits<double>::infinity()).value));
}

TEST(CompiledCurve, EnergyIsTheAntiderivativeOfTheForce) {
    Random random{47};
    const WaveletNetwork network = random_scene(random, 16);
    const CompiledCurve curve{network.curve()};
    ASSERT_TRUE(curve.compiled());
    for (int k = 0; k < cases(2000); ++k) {
        const double x = uniform(random, 0.0, 1.0);
        EXPECT_NEAR(curve.at(x).integral, network.curve().at(x).integral, 1e-13) << x;
        EXPECT_NEAR(curve.at(x).double_integral, network.curve().at(x).double_integral, 1e-13) << x;
    }
}

/// Two wavelets whose dilation and distance are so large that each one is zero where the other one is not, over a domain
/// of length 2. The eighth derivative is largest at the centre of the first one: 945 times weight and dilation^8.
struct TwoWavelets {
    static constexpr double alpha = 64.0;
    NetworkParameters network;
    Domain domain{{-0.5}, {1.5}, {}, {}, std::nullopt};

    TwoWavelets(double centre, double other, double weight)
        : network{1, {alpha, alpha}, {centre, other}, {weight, -0.5 * weight}, {0.0}, 0.0} {}
    [[nodiscard]] NetworkCurve curve() const { return {network, domain}; }
};

/// Returns the largest distance of a polynomial of degree 7 from a function with the eighth derivative 1 in a cell.
double septic_error(double h) {
    return std::pow(h / 2.0, 8) / 40320.0;
}

/// Checks that the table has cells of width h if the required error is ten times the error of such cells, and cells of
/// half this width if it is less.
void expect_widest(const NetworkCurve& curve, double eighth, double largest_force, double h) {
    const double travel = curve.upper() - curve.lower();
    const double required = 10.0 * eighth * septic_error(h) / largest_force;
    const CompiledCurve coarse{curve, {required * (1.0 + 1e-6)}};
    EXPECT_EQ(static_cast<double>(coarse.cells()), travel / h + 3.0);
    EXPECT_NEAR(coarse.value_error() / (eighth * septic_error(h)), 1.0, 1e-5);
    const double slope_error = eighth * std::pow(h, 7) / (64.0 * 720.0);
    EXPECT_NEAR(coarse.slope_error() / slope_error, 1.0, 1e-5);
    const CompiledCurve fine{curve, {required * (1.0 - 1e-6)}};
    EXPECT_EQ(static_cast<double>(fine.cells()), 2.0 * travel / h + 3.0);
}

// The largest force is that of the first wavelet, at its centre: inside the domain or at one of its ends.
TEST(CompiledCurve, UsesTheWidestCellsThatTheErrorPermits) {
    for (const double weight : {0.125, -8.0}) {
        for (const auto& [centre, other] :
             {std::pair{0.25, 1.0}, std::pair{-0.5, 1.0}, std::pair{1.5, 0.0}}) {
            const TwoWavelets two{centre, other, weight};
            const double eighth = 945.0 * std::abs(weight) * std::pow(two.alpha, 8);
            for (const double h : {0x1p-7, 0x1p-6}) {
                expect_widest(two.curve(), eighth, std::abs(weight), h);
            }
        }
    }
}

// The outermost cells extend beyond the domain by at most 1/16 of its length. Wavelets beyond this count by the bound of
// their tails.
TEST(CompiledCurve, BoundsTheEighthDerivativeBeyondTheDomain) {
    constexpr double alpha = TwoWavelets::alpha;
    const double scale = std::pow(alpha, 8);
    const double tail = 1e4 * detail::hat_tails[8] * std::exp(-4.0);
    for (const double other : {1.625 + 4.0 / alpha, -0.625 - 4.0 / alpha}) {
        TwoWavelets two{0.25, other, 1.0};
        two.network.weight[1] = 1e4;
        expect_widest(two.curve(), tail * scale, 1.0, 0x1p-7);
    }
}

TEST(CompiledCurve, HasAtLeast32CellsInTheDomain) {
    TwoWavelets two{0.25, 1.0, 1.0};
    two.network.alpha = {0.1, 0.1};
    EXPECT_EQ(CompiledCurve(two.curve(), {1e-6}).cells(), 32u + 3u);
}

TEST(CompiledCurve, IsNotCompiledIfTheTableIsTooLargeOrTheNetworkTooSmall) {
    const TwoWavelets two{0.25, 1.0, 1.0};
    const std::size_t cells = CompiledCurve(two.curve(), {1e-6}).cells();
    EXPECT_TRUE(CompiledCurve(two.curve(), {1e-6, cells + 1}).compiled());
    EXPECT_FALSE(CompiledCurve(two.curve(), {1e-6, cells}).compiled());
    EXPECT_TRUE(CompiledCurve(two.curve(), {1e-6, 8192, 2}).compiled());
    EXPECT_FALSE(CompiledCurve(two.curve(), {1e-6, 8192, 3}).compiled());
}

// Cells have a width of 1/32. The largest position is 2^34, less one.
TEST(CompiledCurve, IsNotCompiledIfPositionsAreTooLargeForItsCells) {
    for (const double side : {-1.0, 1.0}) {
        const auto compiled = [side](double farthest) {
            const double other = farthest - side;
            const double middle = farthest - 0.5 * side;
            const NetworkParameters network{1, {1.0, 1.0}, {middle, middle}, {0.5, 0.5}, {0.0}, 0.0};
            const Domain domain{
                {std::min(farthest, other)}, {std::max(farthest, other)}, {}, {}, std::nullopt};
            return CompiledCurve{NetworkCurve{network, domain}, {1e-3}}.compiled();
        };
        EXPECT_FALSE(compiled(side * 0x1p34));
        EXPECT_TRUE(compiled(side * (0x1p34 - 1.0)));
    }
}

TEST(CompiledCurve, IsNotCompiledIfPowersOfItsCellsLoseDigits) {
    const auto compiled = [](double travel) {
        const NetworkParameters network{
            1, {1.0 / travel, 1.0 / travel}, {0.5 * travel, 0.5 * travel}, {0.5, 0.5}, {0.0}, 0.0};
        return CompiledCurve{NetworkCurve{network, {{0.0}, {travel}, {}, {}, std::nullopt}}, {1e-3}}
            .compiled();
    };
    EXPECT_TRUE(compiled(0x1p-94));
    EXPECT_FALSE(compiled(0x1p-95));
}

// The table has the values of the same polynomials. The rounding errors of the derivatives at the borders are those at
// positions up to twice the farthest end of the domain.
TEST(CompiledCurve, ProvedErrorsIncludeTheRoundingErrors) {
    for (const double slope : {-5.0, 5.0}) {
        TwoWavelets two{0.25, 1.0, 1.0};
        two.network.linear = {slope};
        two.network.bias = slope < 0.0 ? 8.0 : 3.0;
        const CompiledCurve curve{two.curve(), {2e-14}};
        ASSERT_TRUE(curve.compiled());
        const double h = 2.0 / (static_cast<double>(curve.cells()) - 3.0);
        const auto last = static_cast<std::int64_t>(1.5 / h) + 1;
        const PiecewiseSeptic table{last + 1 - static_cast<std::int64_t>(curve.cells()), last, h,
                                    [&](double x) { return jet(two.network, x); }};
        const Jet rounding = jet_rounding(two.network, 3.0);
        double value = 0.0;
        double of_slope = 0.0;
        for (std::size_t k = 0; k < table.size(); ++k) {
            value = std::max(value, table.rounding(k)[0]);
            of_slope = std::max(of_slope, table.rounding(k)[1]);
        }
        const double eighth = 945.0 * std::pow(two.alpha, 8) * (1.0 + 1e-9);
        value += eighth * septic_error(h);
        of_slope += eighth * std::pow(h, 7) / (64.0 * 720.0);
        for (std::size_t d = 0; d < rounding.size(); ++d) {
            const double by_t = rounding[d] * std::pow(h, d);
            value += detail::hermite_value[d] * by_t;
            of_slope += detail::hermite_slope[d] * by_t / h;
        }
        EXPECT_NEAR(curve.value_error() / value, 1.0, 1e-9);
        EXPECT_NEAR(curve.slope_error() / of_slope, 1.0, 1e-9);
    }
}

// The two wavelets cancel, so the force is 1 and the error is that of rounding for any required error.
TEST(CompiledCurve, IsCompiledIfTheProvedErrorIsTheRequiredError) {
    const NetworkParameters network{1, {0.01, 0.01}, {0.5, 0.5}, {1e-3, -1e-3}, {0.0}, 1.0};
    const NetworkCurve curve{network, test::unit_domain()};
    const double error = CompiledCurve(curve, {1e-6}).value_error();
    EXPECT_GT(error, 0.0);
    const CompiledCurve compiled{curve, {error}};
    EXPECT_TRUE(compiled.compiled());
    EXPECT_EQ(compiled.value_error(), error);
    const CompiledCurve refused{curve, {std::nextafter(error, 0.0)}};
    EXPECT_FALSE(refused.compiled());
    EXPECT_EQ(refused.value_error(), 0.0);
    EXPECT_EQ(refused.slope_error(), 0.0);
}

TEST(CompiledNetwork, GivesForceSlopeAndEnergyOfItsCurve) {
    Random random{50};
    const WaveletNetwork network = random_scene(random, 6);
    const CompiledNetwork compiled{network};
    ASSERT_TRUE(compiled.curve().compiled());
    for (const double x : {-0.5, 0.0, 0.3, 1.0, 1.5}) {
        const EnvironmentSample sample = compiled.at(x, compiled.start(x));
        const EnvironmentSample expected = network.at(x, {});
        EXPECT_NEAR(sample.force, expected.force, 1e-11);
        EXPECT_NEAR(sample.slope, expected.slope, 1e-8);
        EXPECT_NEAR(sample.energy, expected.energy, 1e-11);
        EXPECT_EQ(sample.extrapolated, expected.extrapolated);
    }
    EXPECT_FALSE(CompiledNetwork(network, {1e-12, 8192, 7}).curve().compiled());
}

TEST(CompiledHysteresis, AgreesWithTheNetwork) {
    Random random{48};
    NetworkParameters network = test::random_network(random, 10);
    const HysteresisParameters hysteresis{std::vector<double>(10, 0.02), 0.0, 0.5};
    const HysteresisNetwork both{network, hysteresis, test::unit_domain(Continuation::Free), 0.01};
    const CompiledHysteresis compiled{both};
    ASSERT_TRUE(compiled.force().compiled());
    ASSERT_TRUE(compiled.hysteresis_force().compiled());
    auto state = both.start(0.5);
    auto compiled_state = compiled.start(0.5);
    double x = 0.5;
    for (int k = 0; k < cases(2000); ++k) {
        x += uniform(random, -0.02, 0.02);
        x = std::clamp(x, -0.2, 1.2);
        const EnvironmentSample expected = both.at(x, state);
        const EnvironmentSample sample = compiled.at(x, compiled_state);
        ASSERT_NEAR(sample.force, expected.force, 2e-11) << x;
        ASSERT_NEAR(sample.slope, expected.slope, 1e-8) << x;
        ASSERT_NEAR(sample.energy, expected.energy, 1e-11) << x;
        both.advance(x, state);
        compiled.advance(x, compiled_state);
    }
}

}  // namespace
}  // namespace palpate
