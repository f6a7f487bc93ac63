// SPDX-License-Identifier: Apache-2.0
#include "palpate/model/radial_bounds.hpp"
#include "special_values.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/model/radial_sum.hpp"
#include "palpate/model/wavelet.hpp"
#include "support.hpp"

namespace palpate {
namespace {

using test::cases;
using test::Random;
using test::uniform;

using test::epsilon;

/// Margin by which bounds of fourth derivatives are rounded up.
constexpr double margin = 1.0 + 1e-9;

void expect_near(const Interval& interval, const Interval& expected, double tolerance) {
    EXPECT_NEAR(interval.lower, expected.lower, tolerance);
    EXPECT_NEAR(interval.upper, expected.upper, tolerance);
}

void expect_equal(const RadialBounds& one, const RadialBounds& other) {
    EXPECT_EQ(one.value.lower, other.value.lower);
    EXPECT_EQ(one.value.upper, other.value.upper);
    ASSERT_EQ(one.gradient.size(), other.gradient.size());
    for (std::size_t j = 0; j < one.gradient.size(); ++j) {
        EXPECT_EQ(one.gradient[j].lower, other.gradient[j].lower);
        EXPECT_EQ(one.gradient[j].upper, other.gradient[j].upper);
    }
}

/// Returns the smallest and the largest value of b t + a t^2 / 2 for |t| <= 1, from a search over many numbers t.
Interval parabola(double b, double a) {
    Interval range{1e300, -1e300};
    for (int k = -2000; k <= 2000; ++k) {
        const double t = k / 2000.0;
        const double value = (b + 0.5 * a * t) * t;
        range = range.with({value, value});
    }
    return range;
}

TEST(RadialBounds, QuadraticRangeIsExactAlongEachInputAndAddsTheProducts) {
    Random random{81};
    for (int k = 0; k < cases(300); ++k) {
        const std::size_t d = 1 + static_cast<std::size_t>(k % 3);
        const double c = uniform(random, -3.0, 3.0);
        const double rest = uniform(random, 0.0, 1.0);
        std::vector<double> b(d);
        std::vector<double> a(d * d);
        Interval expected{c - rest, c + rest};
        for (std::size_t j = 0; j < d; ++j) {
            b[j] = uniform(random, -2.0, 2.0);
            a[j * d + j] = uniform(random, -4.0, 4.0);
            const Interval along = parabola(b[j], a[j * d + j]);
            expected = {expected.lower + along.lower, expected.upper + along.upper};
            for (std::size_t l = 0; l < j; ++l) {
                a[j * d + l] = a[l * d + j] = uniform(random, -2.0, 2.0);
                expected.lower -= std::abs(a[j * d + l]);
                expected.upper += std::abs(a[j * d + l]);
            }
        }
        expect_near(detail::quadratic_range(d, c, b.data(), a.data(), rest), expected, 1e-6);
    }
    const double zero = 0.0;
    expect_near(detail::quadratic_range(1, 2.0, &zero, &zero, 0.5), {1.5, 2.5}, 0.0);
}

// In the middle of a wavelet the gradient is zero, the second derivatives are those of (d + 2) |u|^2 / 2, the third ones
// are zero, and the fourth ones have their largest size 3 (d + 4).
TEST(RadialBounds, OfABoxAroundTheCentreOfAWaveletFollowFromTaylorsFormula) {
    Random random{82};
    for (int k = 0; k < cases(300); ++k) {
        const std::size_t d = 1 + static_cast<std::size_t>(k % 4);
        NetworkParameters network = test::random_network(random, 1, d);
        const double w = network.weight[0];
        const auto inputs = static_cast<double>(d);
        std::vector<double> lower(d);
        std::vector<double> upper(d);
        std::vector<double> radius(d);
        std::vector<double> square(d);
        double whole = 0.0;
        double middle = network.bias - w * inputs;
        for (std::size_t j = 0; j < d; ++j) {
            network.beta[j] = std::round(64.0 * network.beta[j]) / 64.0;
            radius[j] = std::ldexp(1.0, -static_cast<int>(random() % 6));
            lower[j] = network.beta[j] - radius[j];
            upper[j] = network.beta[j] + radius[j];
            square[j] = std::pow(network.alpha[j] * radius[j], 2);
            whole += square[j];
            middle += network.linear[j] * network.beta[j];
        }
        const double fourth = std::abs(w) * 3.0 * (inputs + 4.0) * whole * margin;
        Interval value{middle - fourth * whole / 24.0, middle + fourth * whole / 24.0};
        const RadialSum hats{network, lower, upper};
        detail::RadialEnclosure box{network, hats};
        box.over(lower.data(), upper.data());
        EXPECT_NEAR(box.value, middle, 1e-13);
        for (std::size_t j = 0; j < d; ++j) {
            const double slope = network.linear[j] * radius[j];
            const double bend = w * (inputs + 2.0) * square[j];
            const double vertex = std::clamp(-slope / bend, -1.0, 1.0);
            const double third = std::sqrt(fourth * square[j] * fourth * whole) / 6.0;
            Interval along{0.5 * bend - std::abs(slope), 0.5 * bend + std::abs(slope)};
            const double at_vertex = (slope + 0.5 * bend * vertex) * vertex;
            along = along.with({at_vertex, at_vertex});
            value = {value.lower + along.lower, value.upper + along.upper};
            const double change = (std::abs(bend) + third) / radius[j];
            EXPECT_NEAR(box.gradient[j], network.linear[j], 1e-12);
            expect_near(box.ranges.gradient[j], {network.linear[j] - change, network.linear[j] + change},
                        1e-12 * (1.0 + change));
        }
        expect_near(box.ranges.value, value, 1e-12 * (1.0 + fourth * whole));
    }
}

// At u = sqrt(3 - sqrt 6) the second derivative of the Mexican hat is zero.
TEST(RadialBounds, OfABoxOnTheFlankOfAWaveletFollowFromTaylorsFormula) {
    const double u = std::sqrt(3.0 - std::sqrt(6.0));
    for (const double w : {2.0, -0.5}) {
        for (const double s : {1e-3, 0.1, 0.5}) {
            const NetworkParameters network{1, {4.0}, {0.0}, {w}, {0.0}, 1.5};
            const double r = s / 4.0;
            const std::vector<double> lower{u / 4.0 - r};
            const std::vector<double> upper{u / 4.0 + r};
            const RadialSum hats{network, lower, upper};
            detail::RadialEnclosure box{network, hats};
            box.over(lower.data(), upper.data());
            const double slope = w * s * mexican_hat(u).slope;
            const double third = w * s * s * s * mexican_hat_jerk(u);
            const double fourth =
                std::abs(w) * 15.0 * std::exp(-0.22 * (u - s) * (u - s)) * s * s * s * s * margin;
            const double value = 1.5 + w * mexican_hat(u).value;
            const double change = std::abs(slope) + std::abs(third) / 6.0 + fourth / 24.0;
            expect_near(box.ranges.value, {value - change, value + change}, 1e-14);
            const double bend = 0.5 * third;
            expect_near(box.ranges.gradient[0],
                        {(slope + std::min(0.0, bend) - fourth / 6.0) / r,
                         (slope + std::max(0.0, bend) + fourth / 6.0) / r},
                        1e-12);
        }
    }
}

TEST(RadialBounds, ABoxIsDividedAlongTheInputOfTheLargestChange) {
    const auto widest = [](const NetworkParameters& network, const std::vector<double>& lower,
                           const std::vector<double>& upper) {
        const RadialSum hats{network, lower, upper};
        detail::RadialEnclosure box{network, hats};
        box.over(lower.data(), upper.data());
        return box.widest();
    };
    const std::vector<double> zero{0.0, 0.0, 0.0};
    const NetworkParameters plane{3, {}, {}, {}, {1.0, -3.0, 2.0}, 0.0};
    EXPECT_EQ(widest(plane, zero, {1.0, 1.0, 1.0}), 1u);
    EXPECT_EQ(widest(plane, zero, {1.0, 1.0, 2.0}), 2u);
    EXPECT_EQ(widest(plane, zero, {4.0, 1.0, 1.0}), 0u);
    EXPECT_EQ(widest({3, {}, {}, {}, {1.0, 1.0, 1.0}, 0.0}, zero, {1.0, 1.0, 1.0}), 0u);
    EXPECT_EQ(widest({3, {}, {}, {}, {0.0, 0.0, 0.0}, 1.0}, zero, {1.0, 1.0, 1.0}), 0u);
    // At the centre of a wavelet the gradient is zero, so the bound of the fourth derivatives decides.
    const NetworkParameters hat{2, {2.0, 3.0}, {0.0, 0.0}, {1.0}, {0.0, 0.0}, 0.0};
    EXPECT_EQ(widest(hat, {-1.0, -1.0}, {1.0, 1.0}), 1u);
    EXPECT_EQ(widest(hat, {-2.0, -1.0}, {2.0, 1.0}), 0u);
    // Gradient and fourth derivatives are added: the changes are about 0.5 and 9.
    const NetworkParameters both{2, {1.0, 2.0}, {0.0, 0.0}, {0.01}, {0.5, 0.01}, 0.0};
    EXPECT_EQ(widest(both, {-1.0, -1.0}, {1.0, 1.0}), 1u);
}

TEST(RadialBounds, OfABoxWithoutWidthAreTheValueAndTheGradient) {
    const NetworkParameters network{2, {2.0, 3.0}, {0.25, 0.0}, {1.5}, {1.0, -1.0}, 0.5};
    const std::vector<double> x{0.5, 0.25};
    const RadialSum hats{network, x, x};
    detail::RadialEnclosure box{network, hats};
    box.over(x.data(), x.data());
    double value = 0.5 + 0.5 - 0.25;
    std::vector<double> gradient = network.linear;
    hats.add(x.data(), value, gradient.data());
    expect_near(box.ranges.value, {value, value}, 1e-14);
    expect_near(box.ranges.gradient[0], {gradient[0], gradient[0]}, 1e-13);
    expect_near(box.ranges.gradient[1], {gradient[1], gradient[1]}, 1e-13);
}

TEST(RadialBounds, ABoxIsFinishedIfItsBoundsExceedTheSamplesByAtMostTheSlack) {
    detail::SampledRange sampled;
    sampled.add(1.0);
    sampled.add(-2.0);
    sampled.add(0.5);
    EXPECT_EQ(sampled.range.lower, -2.0);
    EXPECT_EQ(sampled.range.upper, 1.0);
    EXPECT_TRUE(sampled.is_finished({-2.25, 1.25}, 0.25));
    EXPECT_FALSE(sampled.is_finished({std::nextafter(-2.25, -3.0), 1.25}, 0.25));
    EXPECT_FALSE(sampled.is_finished({-2.25, std::nextafter(1.25, 2.0)}, 0.25));
}

// Two wavelets of two inputs; |psi| <= 2, |grad psi| and its terms <= 6.
TEST(RadialBounds, RoundingErrorsAreSumsOfAbsoluteTerms) {
    const NetworkParameters network{2,           {3.0, 5.0, 7.0, 0.5}, {0.1, 0.2, 0.3, 0.4},
                                    {2.0, -4.0}, {-0.5, 0.25},         -1.0};
    const std::vector<double> lower{-3.0, 1.0};
    const std::vector<double> upper{2.0, 4.0};
    const detail::RadialRounding rounding{network, lower, upper};
    constexpr double units = 640.0 * epsilon;
    EXPECT_DOUBLE_EQ(rounding.value, units * (1.0 + 0.5 * 3.0 + 0.25 * 4.0 + 2.0 * (2.0 + 4.0)));
    EXPECT_DOUBLE_EQ(rounding.gradient[0], units * (0.5 + 6.0 * (2.0 * 3.0 + 4.0 * 7.0)));
    EXPECT_DOUBLE_EQ(rounding.gradient[1], units * (0.25 + 6.0 * (2.0 * 5.0 + 4.0 * 0.5)));
}

/// Returns the centres of the wavelets, and the places 0.742 wavelet widths away from them along every input, limited to
/// the box.
std::vector<std::vector<double>> steep_positions(const NetworkParameters& network,
                                                 const std::vector<double>& lower,
                                                 const std::vector<double>& upper) {
    const std::size_t d = network.dimension;
    std::vector<std::vector<double>> places;
    for (std::size_t i = 0; i < network.weight.size(); ++i) {
        for (std::size_t place = 0; place < 2 * d + 1; ++place) {
            std::vector<double> x(d);
            for (std::size_t j = 0; j < d; ++j) {
                const double side = place == 2 * j + 1 ? -0.742 : place == 2 * j + 2 ? 0.742 : 0.0;
                const double at = network.beta[i * d + j] + side / network.alpha[i * d + j];
                x[j] = std::min(std::max(at, lower[j]), upper[j]);
            }
            places.push_back(x);
        }
    }
    return places;
}

TEST(RadialBounds, SteepPositionsAreTheCentresAndTheFlanksOfTheWavelets) {
    Random random{83};
    for (std::size_t d = 1; d <= 3; ++d) {
        const NetworkParameters network = test::random_network(random, 20, d);
        const std::vector<double> lower(d, 0.0);
        const std::vector<double> upper(d, 0.9);
        std::vector<std::vector<double>> visited;
        detail::visit_steep_positions(network, lower, upper,
                                      [&](const std::vector<double>& x) { visited.push_back(x); });
        EXPECT_EQ(visited, steep_positions(network, lower, upper));
    }
}

/// Returns the bounds of a box as a whole, rounding errors included.
RadialBounds undivided(const NetworkParameters& network, const std::vector<double>& lower,
                       const std::vector<double>& upper, const std::vector<double>& from,
                       const std::vector<double>& to) {
    const RadialSum hats{network, lower, upper};
    detail::RadialEnclosure box{network, hats};
    box.over(from.data(), to.data());
    const detail::RadialRounding rounding{network, lower, upper};
    RadialBounds bounds = box.ranges;
    bounds.value = {bounds.value.lower - rounding.value, bounds.value.upper + rounding.value};
    for (std::size_t j = 0; j < network.dimension; ++j) {
        bounds.gradient[j] = {bounds.gradient[j].lower - rounding.gradient[j],
                              bounds.gradient[j].upper + rounding.gradient[j]};
    }
    return bounds;
}

TEST(RadialBounds, BudgetLimitsTheNumberOfBoxes) {
    Random random{84};
    for (int k = 0; k < cases(50); ++k) {
        const std::size_t d = 1 + static_cast<std::size_t>(k % 3);
        const NetworkParameters network = test::random_network(random, 4, d);
        const std::vector<double> lower(d, 0.0);
        const std::vector<double> upper(d, 1.0);
        expect_equal(radial_bounds(network, lower, upper, 0.0, 1),
                     undivided(network, lower, upper, lower, upper));
        const RadialSum hats{network, lower, upper};
        detail::RadialEnclosure box{network, hats};
        box.over(lower.data(), upper.data());
        std::vector<double> low = lower;
        std::vector<double> high = upper;
        low[box.widest()] = high[box.widest()] = 0.5;
        RadialBounds halves = undivided(network, lower, upper, lower, high);
        const RadialBounds other = undivided(network, lower, upper, low, upper);
        halves.value = halves.value.with(other.value);
        for (std::size_t j = 0; j < d; ++j) {
            halves.gradient[j] = halves.gradient[j].with(other.gradient[j]);
        }
        expect_equal(radial_bounds(network, lower, upper, 0.0, 2), halves);
    }
}

/// Returns the smallest tolerance with which a box is not divided: its bounds exceed the samples at the steep positions
/// and in its middle by at most this tolerance times the largest sample, plus the rounding error.
double sufficient_tolerance(const NetworkParameters& network, const std::vector<double>& lower,
                            const std::vector<double>& upper) {
    const std::size_t d = network.dimension;
    const RadialSum hats{network, lower, upper};
    detail::RadialEnclosure box{network, hats};
    box.over(lower.data(), upper.data());
    const detail::RadialRounding rounding{network, lower, upper};
    std::vector<std::vector<double>> places = steep_positions(network, lower, upper);
    places.emplace_back(d);
    for (std::size_t j = 0; j < d; ++j) {
        places.back()[j] = 0.5 * (lower[j] + upper[j]);
    }
    std::vector<Interval> sampled(d + 1, Interval{1e300, -1e300});
    for (const std::vector<double>& x : places) {
        double value = network.bias;
        std::vector<double> gradient = network.linear;
        for (std::size_t j = 0; j < d; ++j) {
            value += network.linear[j] * x[j];
        }
        hats.add(x.data(), value, gradient.data());
        gradient.push_back(value);
        for (std::size_t j = 0; j <= d; ++j) {
            sampled[j] = sampled[j].with({gradient[j], gradient[j]});
        }
    }
    double tolerance = 0.0;
    for (std::size_t j = 0; j <= d; ++j) {
        const Interval range = j < d ? box.ranges.gradient[j] : box.ranges.value;
        const double error = j < d ? rounding.gradient[j] : rounding.value;
        const double excess = std::max(range.upper - sampled[j].upper, sampled[j].lower - range.lower);
        tolerance = std::max(tolerance, (excess - error) / sampled[j].largest());
    }
    return tolerance;
}

TEST(RadialBounds, ABoxIsDividedUnlessEveryBoundIsWithinTheTolerance) {
    Random random{85};
    const auto check = [](const NetworkParameters& network, const std::vector<double>& lower,
                          const std::vector<double>& upper) {
        const double tolerance = sufficient_tolerance(network, lower, upper);
        const RadialBounds whole = undivided(network, lower, upper, lower, upper);
        expect_equal(radial_bounds(network, lower, upper, tolerance * (1.0 + 1e-6)), whole);
        const RadialBounds parts = radial_bounds(network, lower, upper, tolerance * (1.0 - 1e-6));
        bool narrower = parts.value.upper < whole.value.upper || parts.value.lower > whole.value.lower;
        for (std::size_t j = 0; j < network.dimension; ++j) {
            narrower = narrower || parts.gradient[j].upper < whole.gradient[j].upper ||
                       parts.gradient[j].lower > whole.gradient[j].lower;
        }
        // Below this tolerance the parts can have the same bounds in double precision.
        EXPECT_TRUE(narrower || tolerance < 1e-7) << tolerance;
    };
    for (int k = 0; k < cases(150); ++k) {
        const std::size_t d = 1 + static_cast<std::size_t>(k % 3);
        NetworkParameters network = test::random_network(random, static_cast<std::size_t>(1 + k % 3), d);
        for (std::size_t j = 0; j < network.beta.size(); ++j) {
            network.beta[j] = 0.5 + uniform(random, -1.0, 1.0) / network.alpha[j];
        }
        const double half = std::exp(uniform(random, -6.0, 0.0));
        const std::vector<double> lower(d, 0.5 - half);
        const std::vector<double> upper(d, 0.5 + half);
        if (k % 2 == 0) {
            // Much steeper than the wavelets: the bounds of the value decide.
            std::fill(network.linear.begin(), network.linear.end(), 100.0);
            network.bias = -50.0 * static_cast<double>(d);
        }
        check(network, lower, upper);
    }
    // In a small box the rounding errors of the gradient decide.
    check({1, {1.0}, {0.0}, {1.0}, {0.0}, 0.0}, {-1e-3}, {1e-3});
}

TEST(RadialBounds, DefaultToleranceIsOnePercent) {
    Random random{86};
    for (int k = 0; k < cases(20); ++k) {
        const NetworkParameters network = test::random_network(random, 3, 1);
        const std::vector<double> lower{0.0};
        const std::vector<double> upper{1.0};
        expect_equal(radial_bounds(network, lower, upper), radial_bounds(network, lower, upper, 0.01));
    }
}

TEST(RadialBounds, OfAPlaneAreExactApartFromRounding) {
    const NetworkParameters plane{2, {}, {}, {}, {3.0, -2.0}, 0.5};
    const std::vector<double> lower{-1.0, 0.0};
    const std::vector<double> upper{1.0, 2.0};
    const RadialBounds bounds = radial_bounds(plane, lower, upper, 0.01);
    expect_near(bounds.value, {-6.5, 3.5}, 1e-11);
    EXPECT_LT(bounds.value.lower, -6.5);
    EXPECT_GT(bounds.value.upper, 3.5);
    expect_near(bounds.gradient[0], {3.0, 3.0}, 1e-11);
    expect_near(bounds.gradient[1], {-2.0, -2.0}, 1e-11);
    EXPECT_LT(bounds.gradient[1].lower, -2.0);
    EXPECT_GT(bounds.gradient[1].upper, -2.0);
}

// The change of the fourth derivative from one wavelet to the other is at most 1.11 * 16.8 times their difference (see
// `fourth_derivative_change`).
TEST(RadialSum, CountsTheRestOfWaveletsThatCancel) {
    constexpr double change = 1.11 * 16.8;
    const auto counted = [](std::vector<double> alpha, std::vector<double> beta, std::vector<double> weight) {
        const std::size_t d = alpha.size() / weight.size();
        return detail::uncancelled_weights(
            {d, std::move(alpha), std::move(beta), std::move(weight), {}, 0.0});
    };
    const auto expect = [](const std::vector<double>& result, const std::vector<double>& expected) {
        ASSERT_EQ(result.size(), expected.size());
        for (std::size_t i = 0; i < result.size(); ++i) {
            EXPECT_NEAR(result[i], expected[i], 1e-12) << i;
        }
    };
    // Equal wavelets cancel completely, one after the other.
    expect(counted({2.0, 2.0}, {0.5, 0.5}, {3.0, -3.0}), {0.0, 0.0});
    expect(counted({2.0, 2.0}, {0.5, 0.5}, {-3.0, 1.0}), {2.0, 0.0});
    expect(counted({2.0, 2.0}, {0.5, 0.5}, {0.25, -0.125}), {0.125, 0.0});
    expect(counted({2.0, 2.0, 2.0}, {0.5, 0.5, 0.5}, {3.0, 3.0, -3.0}), {0.0, 3.0, 0.0});
    expect(counted({2.0, 2.0, 2.0}, {0.5, 0.5, 0.5}, {3.0, -1.0, -1.0}), {1.0, 0.0, 0.0});
    // Weights of one sign do not cancel.
    expect(counted({2.0, 2.0}, {0.5, 0.5}, {3.0, 1.0}), {3.0, 1.0});
    expect(counted({2.0, 2.0}, {0.5, 0.5}, {-3.0, -1.0}), {3.0, 1.0});
    expect(counted({2.0, 2.0, 2.0}, {0.5, 0.5, 0.5}, {1.0, 0.0, -1.0}), {0.0, 0.0, 0.0});
    // The difference of dilations is relative to the smaller one; the largest one counts. The differences of
    // translations are multiplied by the dilation of the first wavelet and added.
    expect(counted({2.0, 4.0, 2.02, 4.02}, {0.0, 0.0, 0.0, 0.0}, {3.0, -3.0}), {change * 3.0 * 0.01, 0.0});
    expect(counted({2.02, 4.02, 2.0, 4.0}, {0.0, 0.0, 0.0, 0.0}, {3.0, -3.0}), {change * 3.0 * 0.01, 0.0});
    expect(counted({2.0, 4.0, 2.01, 4.04}, {0.0, 0.0, 0.0, 0.0}, {3.0, -3.0}), {change * 3.0 * 0.01, 0.0});
    expect(counted({2.0, 4.0, 2.0, 4.0}, {0.5, 0.5, 0.501, 0.498}, {3.0, -2.0}),
           {1.0 + change * 2.0 * (2.0 * 0.001 + 4.0 * 0.002), 0.0});
    expect(counted({2.0, 2.02}, {0.5, 0.5025}, {-3.0, 2.0}), {1.0 + change * 2.0 * (0.01 + 0.005), 0.0});
    // Two rests are added.
    expect(counted({1.0, 1.0, 1.0}, {0.5, 0.505, 0.49}, {3.0, -1.0, -1.0}), {1.0 + change * 0.015, 0.0, 0.0});
    // A difference of 0.02 is the largest.
    const double near = 0.02;
    expect(counted({1.0, 1.0}, {0.0, near}, {3.0, -3.0}), {change * 3.0 * near, 0.0});
    expect(counted({1.0, 1.0}, {0.0, std::nextafter(near, 1.0)}, {3.0, -3.0}), {3.0, 3.0});
    // The rest must be less than the weights that cancel: 2 for a weight of 1 and a larger one.
    const double equal = 2.0 / (change * 10.0);
    expect(counted({1.0, 1.0}, {0.0, 0.999 * equal}, {1.0, -10.0}), {9.0 + 2.0 * 0.999, 0.0});
    expect(counted({1.0, 1.0}, {0.0, 1.001 * equal}, {1.0, -10.0}), {1.0, 10.0});
    // A wavelet that does not cancel with the first may cancel with the second.
    expect(counted({9.0, 8.0, 2.0, 4.0, 2.0, 4.0}, {0.0, 0.0, 0.5, 0.5, 0.501, 0.498}, {5.0, 3.0, -2.0}),
           {5.0, 1.0 + change * 2.0 * (2.0 * 0.001 + 4.0 * 0.002), 0.0});
    expect(counted({1.0, 1.0, 1.0}, {0.0, 5.0, 5.0}, {3.0, 2.0, -2.0}), {3.0, 0.0, 0.0});
}

/// Returns component (j, k) of the second derivative of the radial Mexican hat of d inputs.
double second_derivative(const std::vector<double>& u, std::size_t j, std::size_t k) {
    double square = 0.0;
    for (const double component : u) {
        square += component * component;
    }
    const RadialMexicanHat psi = radial_mexican_hat(square, static_cast<double>(u.size()));
    return j == k ? psi.curvature(u[j]) : psi.mixed(u[j], u[k]);
}

// Repeats the test with every instruction set of this machine. The third derivatives are compared with differences of
// the second ones; the bound of the fourth ones has the formula 3 (d + 4) e^{-0.22 r^2} at the distance r of the box.
TEST(RadialSum, TermsOfTaylorsFormulaAreTheDerivativesOfTheWavelets) {
    for (const detail::HatKernel& kernel : detail::usable_hat_kernels()) {
        Random random{87};
        for (int k = 0; k < cases(60); ++k) {
            const std::size_t d = 1 + static_cast<std::size_t>(k % 3);
            const auto inputs = static_cast<double>(d);
            NetworkParameters network = test::random_network(random, static_cast<std::size_t>(1 + k % 9), d);
            std::vector<double> middle(d);
            std::vector<double> radius(d);
            for (std::size_t j = 0; j < d; ++j) {
                middle[j] = uniform(random, 0.0, 1.0);
                radius[j] = std::exp(uniform(random, -4.0, 0.0));
            }
            const RadialSum hats{network, std::vector<double>(d, -9.0), std::vector<double>(d, 9.0), kernel};
            detail::RadialExpansion sums = hats.expansion();
            double value = 0.0;
            std::vector<double> gradient(d);
            std::vector<double> second(d * d);
            std::vector<double> third(d * d * d);
            double largest_third = 0.0;
            std::vector<double> rest(d);
            const std::vector<double> counted = detail::uncancelled_weights(network);
            for (std::size_t i = 0; i < network.weight.size(); ++i) {
                const double w = network.weight[i];
                std::vector<double> u(d);
                std::vector<double> s(d);
                double square = 0.0;
                double nearest = 0.0;
                double whole = 0.0;
                for (std::size_t j = 0; j < d; ++j) {
                    const double alpha = network.alpha[i * d + j];
                    u[j] = std::clamp(alpha * (middle[j] - network.beta[i * d + j]), -detail::hat_reach,
                                      detail::hat_reach);
                    s[j] = alpha * radius[j];
                    square += u[j] * u[j];
                    nearest += std::pow(std::max(0.0, std::abs(u[j]) - s[j]), 2);
                    whole += s[j] * s[j];
                }
                const RadialMexicanHat psi = radial_mexican_hat(square, inputs);
                value += w * psi.value;
                largest_third += std::abs(w) * std::pow(whole, 1.5);
                for (std::size_t j = 0; j < d; ++j) {
                    gradient[j] += w * psi.gradient_over_u * u[j] * s[j];
                    rest[j] +=
                        counted[i] * 3.0 * (inputs + 4.0) * std::exp(-0.22 * nearest) * whole * s[j] * s[j];
                    for (std::size_t l = 0; l < d; ++l) {
                        second[j * d + l] += w * second_derivative(u, j, l) * s[j] * s[l];
                        for (std::size_t m = 0; m < d; ++m) {
                            constexpr double h = 1e-4;
                            std::vector<double> up = u;
                            std::vector<double> down = u;
                            up[m] += h;
                            down[m] -= h;
                            third[(j * d + l) * d + m] +=
                                w * s[j] * s[l] * s[m] *
                                (second_derivative(up, j, l) - second_derivative(down, j, l)) / (2.0 * h);
                        }
                    }
                }
            }
            // The second call must not add to the terms of the first.
            for (int call = 0; call < 2; ++call) {
                hats.expand(middle.data(), radius.data(), sums);
                EXPECT_NEAR(sums.value, value, 1e-13);
                for (std::size_t j = 0; j < d; ++j) {
                    EXPECT_NEAR(sums.gradient[j], gradient[j], 1e-11);
                    EXPECT_NEAR(sums.rest[j], rest[j], 1e-12 * rest[j]);
                }
                for (std::size_t j = 0; j < d * d; ++j) {
                    EXPECT_NEAR(sums.second_derivative[j], second[j], 1e-9);
                }
                for (std::size_t j = 0; j < d * d * d; ++j) {
                    EXPECT_NEAR(sums.third_derivative[j], third[j], 1e-6 * (1e-3 + largest_third));
                }
            }
        }
    }
}

}  // namespace
}  // namespace palpate
