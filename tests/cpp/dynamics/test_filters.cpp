// SPDX-License-Identifier: Apache-2.0
#include "palpate/dynamics/filters.hpp"

#include <cmath>
#include <complex>
#include <numbers>

#include <gtest/gtest.h>

namespace palpate {
namespace {

std::complex<double> unit(double omega) {
    return std::polar(1.0, omega * paper_sample_time);
}

std::complex<double> product(FilterPair pair, FilterDesign design, double omega) {
    const EnvironmentFilters filters = environment_filters(pair, design);
    return filters.g1.at(unit(omega)) * filters.i1.at(unit(omega));
}

double degrees(std::complex<double> value) {
    return std::arg(value) * 180.0 / std::numbers::pi;
}

// The differentiators G of the paper have the poles 0.836 and 0.819 (179 and 199 rad/s).
TEST(Filters, DifferentiatorsHaveThePolesOfThePaper) {
    const auto poles = environment_filters(FilterPair::Implicit).g1.poles();
    EXPECT_NEAR(poles[0].real(), 0.836, 5e-4);
    EXPECT_NEAR(poles[1].real(), 0.819, 5e-4);
    EXPECT_NEAR(-std::log(poles[0].real()) / paper_sample_time, 179.0, 1.0);
    EXPECT_NEAR(-std::log(poles[1].real()) / paper_sample_time, 199.0, 1.0);
}

// With the explicit gain 31 of the paper the product of differentiator G1 and integrator I1 at low frequency is 1.048
// (with the gain 29.58 it is 1); with the implicit gain 14.8379 it is 1.0032.
TEST(Filters, LowFrequencyGainOfThePaperIsSlightlyAboveOne) {
    constexpr double low = 1e-3;
    EXPECT_NEAR(std::abs(product(FilterPair::Explicit, FilterDesign::Paper, low)), 1.048, 5e-4);
    EXPECT_NEAR(std::abs(product(FilterPair::Implicit, FilterDesign::Paper, low)), 1.0032, 5e-5);
}

TEST(Filters, MatchedGainIsExactAtLowFrequency) {
    constexpr double low = 1e-3;
    EXPECT_NEAR(environment_filters(FilterPair::Explicit, FilterDesign::Matched).g1.numerator()[1], 29.58,
                5e-3);
    EXPECT_NEAR(std::abs(product(FilterPair::Explicit, FilterDesign::Matched, low)), 1.0, 1e-9);
    EXPECT_NEAR(std::abs(product(FilterPair::Implicit, FilterDesign::Matched, low)), 1.0, 1e-9);
}

// At 100 rad/s the product of differentiator G and integrator I has the size 0.78 and the phase -53 degrees (implicit
// pair of the paper), or 0.82 and -62 degrees (explicit pair).
TEST(Filters, PaperGainIsLowAtHundredRadiansPerSecond) {
    const auto implicit = product(FilterPair::Implicit, FilterDesign::Paper, 100.0);
    EXPECT_NEAR(std::abs(implicit), 0.78, 5e-3);
    EXPECT_NEAR(degrees(implicit), -53.0, 0.5);
    const auto explicit_pair = product(FilterPair::Explicit, FilterDesign::Paper, 100.0);
    EXPECT_NEAR(std::abs(explicit_pair), 0.82, 5e-3);
    EXPECT_NEAR(degrees(explicit_pair), -62.0, 0.5);
}

TEST(Filters, OnlyTheExplicitForceIntegratorIsDelayed) {
    for (const FilterPair pair : {FilterPair::Implicit, FilterPair::Explicit}) {
        EnvironmentFilters filters = environment_filters(pair);
        EXPECT_EQ(filters.i1.step(1.0), pair == FilterPair::Implicit ? paper_sample_time : 0.0);
        EXPECT_EQ(filters.i2.step(1.0), paper_sample_time);
    }
}

TEST(TransferFunction, ComputesItsDifferenceEquation) {
    TransferFunction filter{{0.5, -0.25, 0.125}, {1.0, -0.9, 0.3}};
    double u1 = 0.0;
    double u2 = 0.0;
    double y1 = 0.0;
    double y2 = 0.0;
    for (int k = 0; k < 50; ++k) {
        const double u = std::sin(0.3 * k) + (k == 7 ? 5.0 : 0.0);
        const double expected = 0.5 * u - 0.25 * u1 + 0.125 * u2 + 0.9 * y1 - 0.3 * y2;
        const double y = filter.step(u);
        EXPECT_NEAR(y, expected, 1e-13);
        u2 = u1;
        u1 = u;
        y2 = y1;
        y1 = y;
    }
    filter.reset();
    EXPECT_EQ(filter.step(2.0), 1.0);
}

TEST(TransferFunction, ResponseToASineAgreesWithItsFrequencyResponse) {
    TransferFunction filter = environment_filters(FilterPair::Implicit).g1;
    constexpr double omega = 60.0;
    const std::complex<double> response = filter.at(unit(omega));
    double last = 0.0;
    int k = 0;
    for (; k < 4000; ++k) {
        last = filter.step(std::sin(omega * paper_sample_time * k));
    }
    const double phase = omega * paper_sample_time * (k - 1) + std::arg(response);
    EXPECT_NEAR(last, std::abs(response) * std::sin(phase), 1e-9);
}

TEST(TransferFunction, RefusesADenominatorThatIsNotMonic) {
    EXPECT_THROW(TransferFunction({1.0, 0.0, 0.0}, {2.0, 0.0, 0.0}), std::invalid_argument);
}

}  // namespace
}  // namespace palpate
