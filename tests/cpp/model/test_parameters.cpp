// SPDX-License-Identifier: Apache-2.0
#include "palpate/model/parameters.hpp"
#include "special_values.hpp"

#include <limits>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "support.hpp"

namespace palpate {
namespace {

using test::infinity;
using test::nan;

/// Returns a vector with memory for one more value, which contains `hidden`.
std::vector<double> before(double hidden, std::vector<double> values) {
    values.push_back(hidden);
    values.pop_back();
    return values;
}

/// A network of two inputs and three wavelets, with its domain.
struct Case {
    NetworkParameters network{
        2, {1.0, 2.0, 3.0, 4.0, 5.0, 6.0}, {0.1, 0.2, 0.3, 0.4, 0.5, 0.6}, {1.0, 2.0, 3.0}, {0.5, 0.25}, 0.1};
    Domain domain{{1.0, -1.0}, {3.0, 1.0}, {}, {}, std::nullopt};
};

/// Returns the message for a case that `change` has changed.
template <class Change>
std::string refusal(const Change& change) {
    Case changed;
    change(changed.network, changed.domain);
    return test::refusal([&] { validate(changed.network, changed.domain); });
}

TEST(Parameters, AcceptsANetworkOfTwoInputs) {
    EXPECT_EQ(refusal([](auto&, auto&) {}), "");
    EXPECT_EQ(refusal([](auto& n, auto&) { n.alpha[4] = std::numeric_limits<double>::denorm_min(); }), "");
    EXPECT_EQ(refusal([](auto&, auto& d) { d.lower[1] = 1.0 - 1e-15; }), "");
}

TEST(Parameters, RefusesAWrongNumberOfValues) {
    EXPECT_EQ(refusal([](auto& n, auto&) { n.dimension = 0; }), "dimension is 0, must be at least 1");
    EXPECT_EQ(refusal([](auto& n, auto&) { n.alpha.pop_back(); }), "alpha has 5 values, must have 6");
    EXPECT_EQ(refusal([](auto& n, auto&) { n.beta.push_back(0.0); }), "beta has 7 values, must have 6");
    EXPECT_EQ(refusal([](auto& n, auto&) { n.weight.pop_back(); }), "alpha has 6 values, must have 4");
    EXPECT_EQ(refusal([](auto& n, auto&) { n.linear = {1.0}; }), "linear has 1 values, must have 2");
    EXPECT_EQ(refusal([](auto&, auto& d) { d.lower = {1.0}; }), "lower has 1 values, must have 2");
    EXPECT_EQ(refusal([](auto&, auto& d) { d.upper.push_back(9.0); }), "upper has 3 values, must have 2");
}

TEST(Parameters, RefusesValuesThatAreNotFinite) {
    for (const double bad : {nan, infinity, -infinity}) {
        EXPECT_EQ(refusal([&](auto& n, auto&) { n.alpha[0] = bad; }), "alpha[0] is not a finite number");
        EXPECT_EQ(refusal([&](auto& n, auto&) { n.beta[5] = bad; }), "beta[5] is not a finite number");
        EXPECT_EQ(refusal([&](auto& n, auto&) { n.weight[1] = bad; }), "weight[1] is not a finite number");
        EXPECT_EQ(refusal([&](auto& n, auto&) { n.linear[1] = bad; }), "linear[1] is not a finite number");
        EXPECT_EQ(refusal([&](auto& n, auto&) { n.bias = bad; }), "bias is not a finite number");
        EXPECT_EQ(refusal([&](auto&, auto& d) { d.lower[0] = bad; }), "lower[0] is not a finite number");
        EXPECT_EQ(refusal([&](auto&, auto& d) { d.upper[1] = bad; }), "upper[1] is not a finite number");
    }
}

TEST(Parameters, RefusesADilationThatIsNotPositive) {
    EXPECT_EQ(refusal([](auto& n, auto&) { n.alpha[0] = 0.0; }), "alpha[0][0] is 0.000000, must be > 0");
    EXPECT_EQ(refusal([](auto& n, auto&) { n.alpha[2] = 0.0; }), "alpha[1][0] is 0.000000, must be > 0");
    EXPECT_EQ(refusal([](auto& n, auto&) { n.alpha[5] = -0.5; }), "alpha[2][1] is -0.500000, must be > 0");
}

TEST(Parameters, RefusesAnEmptyDomain) {
    EXPECT_EQ(refusal([](auto&, auto& d) { d.lower[0] = 3.0; }),
              "lower[0] is 3.000000, must be below upper 3.000000");
    EXPECT_EQ(refusal([](auto&, auto& d) { d.upper[1] = -2.0; }),
              "lower[1] is -1.000000, must be below upper -2.000000");
}

TEST(Parameters, PeriodIsTheLengthOfTheDomainOfOneInput) {
    EXPECT_EQ(refusal([](auto&, auto& d) { d.period = 2.0; }),
              "period is set, but the network has 2 inputs, must have 1");
    const auto with_period = [](double period) {
        return test::refusal([&] {
            validate(NetworkParameters{1, {}, {}, {}, {0.5}, 0.0}, Domain{{1.0}, {3.0}, {}, {}, period});
        });
    };
    EXPECT_EQ(with_period(2.0), "");
    EXPECT_EQ(with_period(2.0 + 1.9e-9), "");
    EXPECT_EQ(with_period(2.0 - 1.9e-9), "");
    const std::string refused = "period is 2.000000, must equal upper - lower, 2.000000";
    EXPECT_EQ(with_period(2.0 + 2.1e-9), refused);
    EXPECT_EQ(with_period(2.0 - 2.1e-9), refused);
    EXPECT_EQ(with_period(nan), "period is nan, must equal upper - lower, 2.000000");
}

TEST(Parameters, HarmonicsAreWholeMultiplesOfThePeriod) {
    const auto with = [](double alpha, std::size_t harmonics, std::optional<double> period) {
        return test::refusal([&] {
            validate(NetworkParameters{1, {5.0, alpha}, {0.1, 0.2}, {1.0, 2.0}, {0.0}, 0.0, harmonics},
                     Domain{{1.0}, {3.0}, {}, {}, period});
        });
    };
    EXPECT_EQ(with(7.0 * std::numbers::pi, 1, 2.0), "");
    EXPECT_EQ(with(7.0 * std::numbers::pi * (1.0 + 5e-10), 1, 2.0), "");
    const std::string refused =
        ": must be a whole multiple of 2 pi / period, because it belongs to a harmonic";
    EXPECT_EQ(with(7.0 * std::numbers::pi * (1.0 + 2e-9), 1, 2.0), "alpha[1] is 21.991149" + refused);
    EXPECT_EQ(with(1e-12, 1, 2.0), "alpha[1] is 0.000000" + refused);
    EXPECT_EQ(with(7.0 * std::numbers::pi, 2, 2.0), "alpha[0] is 5.000000" + refused);
    EXPECT_EQ(with(7.0 * std::numbers::pi, 3, 2.0),
              "harmonics is 3, must be at most the number of wavelets, 2");
    EXPECT_EQ(with(7.0 * std::numbers::pi, 1, std::nullopt),
              "harmonics is 1, must be 0 in a network without period");
    EXPECT_EQ(refusal([](auto& n, auto&) { n.harmonics = 1; }),
              "harmonics is 1, must be 0 in a network without period");
}

TEST(Parameters, OneInputIsRequiredWithAMessage) {
    EXPECT_EQ(test::refusal([] { require_one_input({1, {}, {}, {}, {0.5}, 0.0}); }), "");
    EXPECT_EQ(test::refusal([] { require_one_input({2, {}, {}, {}, {0.5, 0.5}, 0.0}); }),
              "the network has 2 inputs, must have 1");
}

TEST(Parameters, FinestWidthIsThatAlongTheFirstInput) {
    const Case two;
    EXPECT_EQ(finest_width(two.network, 2.0), 0.2) << "the dilations along the first input are 1, 3 and 5";
    EXPECT_EQ(finest_width(two.network, 0.125), 0.125);
    const NetworkParameters falling{1, {8.0, 4.0}, {0.1, 0.2}, {1.0, 1.0}, {0.5}, 0.0};
    EXPECT_EQ(finest_width(falling, 2.0), 0.125);
    EXPECT_EQ(finest_width({1, {}, {}, {}, {0.5}, 0.0}, 2.0), 2.0);
}

// The memory behind the last value of a vector contains an invalid number, which no function may read.
TEST(Parameters, ReadsNoValueBehindTheLastOne) {
    EXPECT_EQ(test::refusal([] { detail::require_finite(before(nan, {1.0, 2.0, 3.0}), "x"); }), "");
    Case changed;
    changed.network.alpha = before(-1.0, changed.network.alpha);
    changed.domain.lower = before(7.0, changed.domain.lower);
    changed.domain.upper = before(5.0, changed.domain.upper);
    EXPECT_EQ(test::refusal([&] { validate(changed.network, changed.domain); }), "");
    NetworkParameters one;
    one.alpha = before(100.0, {1.0, 2.0});
    EXPECT_EQ(finest_width(one, 2.0), 0.5);
}

}  // namespace
}  // namespace palpate
