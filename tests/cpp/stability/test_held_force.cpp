// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/stability/held_force.hpp"

namespace palpate {
namespace {

/// Returns the filter weights of the prediction x + (x - mean of the m previous readings) / (m + 1), as factors of the
/// displacements between the readings.
std::vector<double> prediction(int m) {
    std::vector<double> taps;
    for (int j = 1; j <= m; ++j) {
        taps.push_back(-static_cast<double>(m - j + 1) / (m * (m + 1)));
    }
    return taps;
}

/// A periodic force of straight pieces of equal width, and its stored energy minus the least stored energy.
struct Zigzag {
    std::vector<double> force;  ///< at 0, 1, 2, ...; then periodic

    [[nodiscard]] double at(double x) const {
        const auto pieces = static_cast<double>(force.size());
        const double along = x - pieces * std::floor(x / pieces);
        const auto k = std::min(static_cast<std::size_t>(along), force.size() - 1);
        return force[k] + (along - static_cast<double>(k)) * (force[(k + 1) % force.size()] - force[k]);
    }
};

TEST(HeldForce, ASpringNeedsHalfASampleMoreThanItsDelay) {
    for (int n = 0; n <= 5; ++n) {
        EXPECT_NEAR(delayed_need(n, 0.0, {2.0, 0.0}), 2.0 * (n + 0.5), 1e-12);
        EXPECT_NEAR(delayed_need(n, 0.0, {2.0, 2.0}), 2.0 * (n + 0.5), 1e-12);
    }
}

TEST(HeldForce, ClosedFormIsTheMinimumOverGamma) {
    for (const double lag : {0.3, 0.5, 1.0, 1.7, 2.0, 3.0, 6.5}) {
        for (const double falling : {0.0, 0.4, 1.0, 1.3, 2.0, 3.1, 10.0}) {
            const SlopeRange slopes{1.0, falling};
            double least = std::numeric_limits<double>::infinity();
            for (double gamma = 1e-3; gamma < 1e3; gamma *= 1.001) {
                least = std::min(least, detail::step_coefficient(slopes, 0.0, gamma) + gamma * lag * lag);
            }
            EXPECT_NEAR(held_need(lag, slopes), least, 3e-4 * least) << lag << " " << falling;
            EXPECT_LE(held_need(lag, slopes), least * (1.0 + 1e-12)) << lag << " " << falling;
        }
    }
}

TEST(HeldForce, StepEnergyIsTheLargestOverAllRatios) {
    for (const auto& [M, s, l, gamma] : std::vector<std::array<double, 4>>{{1.0, 0.5, 0.0, 0.4},
                                                                           {1.0, 0.5, 0.7, 2.0},
                                                                           {0.0, 1.0, -0.6, 0.3},
                                                                           {0.2, 3.0, 0.1, 1.0},
                                                                           {1.0, 1.0, -0.8, 5.0}}) {
        double most = -1e300;
        for (double rho = -50.0; rho <= 50.0; rho += 1e-4) {
            const double h = rho >= 0.0    ? M * (0.5 + rho)
                             : rho >= -1.0 ? 0.5 * (M * (1.0 + rho) * (1.0 + rho) + s * rho * rho)
                                           : s * (-rho - 0.5);
            most = std::max(most, h - l * rho - gamma * rho * rho);
        }
        EXPECT_NEAR(detail::step_coefficient({M, s}, l, gamma), most, 1e-6);
    }
}

/// Returns the energy h of one sample divided by the square of the handle's step, for the ratio rho of position error
/// and step: the integral of max(M (t + rho), -s (t + rho)) over t from 0 to 1, in 2000 steps.
double energy_of_a_step(SlopeRange slopes, double rho) {
    double sum = 0.0;
    for (int k = 0; k < 2000; ++k) {
        const double at = (k + 0.5) / 2000.0 + rho;
        sum += std::max(slopes.rising * at, -slopes.falling * at) / 2000.0;
    }
    return sum;
}

TEST(HeldForce, StepEnergyIsTheLargestOfTheIntegratedSlopes) {
    std::mt19937 random{12};
    std::uniform_real_distribution<double> unit{0.0, 1.0};
    for (int draw = 0; draw < 60; ++draw) {
        const SlopeRange slopes{draw % 5 == 0 ? 0.0 : 2.0 * unit(random),
                                draw % 7 == 0 ? 0.0 : 2.0 * unit(random)};
        const double l = (2.0 * unit(random) - 1.0) * (slopes.rising + slopes.falling);
        const double gamma = std::exp(5.0 * unit(random) - 2.0);
        double most = -1e300;
        for (double rho = -16.0; rho <= 16.0; rho += 0.02) {
            most = std::max(most, energy_of_a_step(slopes, rho) - l * rho - gamma * rho * rho);
        }
        const double a = detail::step_coefficient(slopes, l, gamma);
        EXPECT_GE(a, most - 1e-6) << draw;
        EXPECT_LE(a, most + 1e-4 * (gamma + 4.0) + 1e-6) << draw;
    }
}

TEST(HeldForce, ResponseIsTheSumOfTheDelays) {
    const std::vector<double> taps{0.7, -1.3, 0.2, 2.0};
    EXPECT_DOUBLE_EQ(detail::size_of(taps), 4.2);
    for (const double theta : {0.0, 0.3, 1.0, 2.2, std::numbers::pi}) {
        std::complex<double> sum;
        for (std::size_t j = 0; j < taps.size(); ++j) {
            sum += taps[j] * std::polar(1.0, static_cast<double>(j + 1) * theta);
        }
        EXPECT_NEAR(std::abs(detail::response(taps, std::polar(1.0, theta)) - sum), 0.0, 1e-14) << theta;
    }
}

// The cosine of N theta with its maximum in the middle between two samples is the worst case of the proof: there the
// bound is exact.
TEST(HeldForce, ProvedMaximumIsExactForACosineBetweenTwoSamples) {
    for (const int resolution : {2, 8, 64}) {
        constexpr int degree = 3;
        const std::size_t last = static_cast<std::size_t>(resolution) * degree;
        const double half = 0.5 * std::numbers::pi / static_cast<double>(last);
        const auto value = [&](std::size_t k) {
            return 5.0 + 2.0 * std::cos(degree * (std::numbers::pi * static_cast<double>(k) /
                                                      static_cast<double>(last) -
                                                  (2.0 * half + half)));
        };
        const double bound = detail::maximum_of(detail::Maximum::Proved, resolution, last, 2.0, value);
        EXPECT_GE(bound, 7.0);
        EXPECT_LE(bound, 7.0 + 5e-12);
    }
}

TEST(HeldForce, LikelyMaximumIsThatOfAParabola) {
    for (const double peak : {3.0, 3.3, 3.49, 3.51, 4.2}) {
        const auto parabola = [&](std::size_t k) {
            const double off = static_cast<double>(k) - peak;
            return 2.0 - 0.25 * off * off;
        };
        EXPECT_NEAR(detail::maximum_of(detail::Maximum::Likely, 8, 10, 100.0, parabola), 2.0, 1e-13) << peak;
    }
    const auto rises = [](std::size_t k) { return static_cast<double>(k * k); };
    EXPECT_EQ(detail::maximum_of(detail::Maximum::Likely, 8, 10, 100.0, rises), 100.0);
    const auto falls = [](std::size_t k) { return -static_cast<double>(k * k); };
    EXPECT_EQ(detail::maximum_of(detail::Maximum::Likely, 8, 10, 100.0, falls), 0.0);
    EXPECT_EQ(detail::maximum_of(detail::Maximum::Likely, 8, 10, 100.0, [](std::size_t) { return 3.0; }),
              3.0);
    // The last sample counts, and the maximum may be at the second or the last but one sample.
    const auto second = [](std::size_t k) { return k == 1 ? 1.0 : 0.0; };
    EXPECT_EQ(detail::maximum_of(detail::Maximum::Likely, 8, 4, 100.0, second), 1.0);
    const auto last_but_one = [](std::size_t k) { return k == 3 ? 1.0 : k == 4 ? 0.5 : 0.0; };
    EXPECT_NEAR(detail::maximum_of(detail::Maximum::Likely, 8, 4, 100.0, last_but_one),
                1.0 + 0.125 * 0.25 / 1.5, 1e-15);
}

/// Returns the largest value over `count` + 1 equally spaced frequencies from 0 to pi.
template <class Value>
double most_over_frequencies(int count, Value value) {
    double most = -std::numeric_limits<double>::infinity();
    for (int k = 0; k <= count; ++k) {
        most = std::max(most, value(std::numbers::pi * k / count));
    }
    return most;
}

/// Returns the frequency response of a filter of the handle's steps.
std::complex<double> filter_response(const std::vector<double>& taps, double theta) {
    std::complex<double> sum;
    for (std::size_t j = 0; j < taps.size(); ++j) {
        sum += taps[j] * std::polar(1.0, -static_cast<double>(j + 1) * theta);
    }
    return sum;
}

TEST(HeldForce, GainOfAFilterIsItsSampledMaximumPlusTheMarginOfTheProof) {
    for (const std::vector<double>& taps :
         {std::vector<double>{}, {0.5}, {1.0, 1.0, -0.4}, {-0.3, 0.1, 0.7, -0.2}}) {
        for (const int resolution : {4, 32}) {
            const int last = resolution * std::max(1, static_cast<int>(taps.size()));
            const detail::FilterGain gain{taps, detail::Maximum::Proved, resolution};
            EXPECT_EQ(gain.size(), detail::size_of(taps));
            for (const auto& [l, gamma] : {std::pair{0.7, 0.3}, {-0.4, 1.5}, {0.0, 1.0}, {-2.0, 0.1}}) {
                // clang before version 16 cannot capture the names of a structured binding.
                const double sampled = most_over_frequencies(last, [&, l = l, gamma = gamma](double theta) {
                    const std::complex<double> Q = filter_response(taps, theta);
                    return l * Q.real() + gamma * std::norm(Q);
                });
                const double size = detail::size_of(taps);
                const double margin = (1.0 - std::cos(0.5 * std::numbers::pi / resolution)) *
                                      (std::abs(l) * size + gamma * size * size);
                EXPECT_NEAR(gain.most(l, gamma), sampled + margin, 1e-10);
            }
        }
    }
}

TEST(HeldForce, MinimumOfAConvexFunctionIsFoundAnywhere) {
    for (const double at : {-1.0, -0.9999, -0.3, 0.0, 0.4142, 1.999, 2.0}) {
        int calls = 0;
        const detail::Minimum found = detail::minimum_between(-1.0, 2.0, [&](double x) {
            ++calls;
            return 3.0 + std::abs(x - at);
        });
        EXPECT_NEAR(found.at, at, 2e-8) << at;
        EXPECT_DOUBLE_EQ(found.value, 3.0 + std::abs(found.at - at)) << at;
        EXPECT_EQ(calls, 42);
    }
}

/// Returns the minimum of a convex function of one number between two numbers, by thirds.
template <class Function>
double least_between(double low, double high, int steps, Function function) {
    double least = std::numeric_limits<double>::infinity();
    for (int k = 0; k < steps; ++k) {
        const double left = low + (high - low) / 3.0;
        const double right = high - (high - low) / 3.0;
        const double at_left = function(left);
        const double at_right = function(right);
        least = std::min({least, at_left, at_right});
        (at_left < at_right ? high : low) = at_left < at_right ? right : left;
    }
    return least;
}

/// Returns the minimum over l and gamma of `cost`, by a search that shares no code with the header.
template <class Cost>
double least_over_factors(SlopeRange slopes, Cost cost, int steps = 36) {
    const double reach = slopes.rising + slopes.falling;
    return least_between(-reach, reach, steps, [&](double l) {
        return least_between(-9.0, 3.0, steps,
                             [&](double log_gamma) { return cost(l, reach * std::exp(log_gamma)); });
    });
}

TEST(HeldForce, FilteredNeedIsTheMinimumOverBothFactors) {
    int number = 0;
    for (const SlopeRange slopes : {SlopeRange{1.0, 1.0}, {0.3, 1.0}, {0.0, 2.0}, {1.0, 0.2}}) {
        for (const std::vector<double>& taps :
             {std::vector<double>{1.0}, {1.0, 1.0}, {-1.0 / 3.0, -1.0 / 6.0}, {1.0, -0.5}}) {
            if (!test::is_sampled(number++, 3)) {
                continue;
            }
            const double size = detail::size_of(taps);
            const double least = least_over_factors(slopes, [&](double l, double gamma) {
                const double sum = most_over_frequencies(96, [&](double theta) {
                    const std::complex<double> Q = filter_response(taps, theta);
                    return l * Q.real() + gamma * std::norm(Q);
                });
                return detail::step_coefficient(slopes, l, gamma) + sum;
            });
            const double expected = std::min(least, held_need(size, slopes));
            EXPECT_NEAR(filtered_need(taps, slopes), expected, 3e-4 * expected) << slopes.falling;
        }
    }
}

TEST(HeldForce, NeedIsProportionalToTheSlopes) {
    const std::vector<double> taps{1.0, -0.5};
    const auto needs = [&](double size) {
        const SlopeRange slopes{0.4 * size, size};
        return std::array{filtered_need(taps, slopes),
                          filtered_need(taps, 0.3, slopes, 0.7),
                          delayed_need(1, 0.4, slopes),
                          detail::roughly_filtered_need(taps, 1.3, 0.1, slopes),
                          detail::jittered_need(1.2, 1.0, 0.1, slopes),
                          held_need(1.4, slopes)};
    };
    const auto unit = needs(1.0);
    for (const double size : {1e-6, 1e6}) {
        const auto scaled = needs(size);
        for (std::size_t k = 0; k < unit.size(); ++k) {
            EXPECT_NEAR(scaled[k] / size, unit[k], 1e-9 * unit[k]) << size << " " << k;
        }
    }
}

TEST(HeldForce, NeedWithoutASlopeOrAFilterIsTheClosedForm) {
    const std::vector<double> taps{1.0, 0.5};
    const double infinite = std::numeric_limits<double>::infinity();
    EXPECT_EQ(filtered_need(taps, {0.0, 0.0}), 0.0);
    EXPECT_EQ(filtered_need(taps, {infinite, 0.0}), infinite);
    EXPECT_TRUE(std::isinf(filtered_need(taps, {0.0, infinite})));
    EXPECT_EQ(filtered_need({}, {3.0, 1.0}), 1.5);
    EXPECT_EQ(filtered_need(std::vector<double>{0.0, 0.0}, {3.0, 1.0}), 1.5);
    EXPECT_EQ(filtered_need(taps, 0.5, {0.0, 0.0}, 0.5), 0.0);
    EXPECT_EQ(filtered_need(taps, 0.5, {infinite, 0.0}, 0.5), infinite);
    EXPECT_EQ(filtered_need(taps, 0.0, {1.0, 0.5}, 1.0), filtered_need(taps, {1.0, 0.5}));
    EXPECT_EQ(delayed_need(1, 0.5, {0.0, 0.0}), 0.0);
    EXPECT_EQ(delayed_need(1, 0.5, {infinite, 0.0}), infinite);
    EXPECT_EQ((SlopeRange{2.0, 3.0}).steepest(), 3.0);
    EXPECT_EQ((SlopeRange{4.0, 3.0}).steepest(), 4.0);
}

TEST(HeldForce, ClosedFormHasTheValuesOfItsThreeBranches) {
    EXPECT_DOUBLE_EQ(held_need(2.0, {3.0, 4.5}), 7.5);   // Lambda s = (1 + Lambda) M
    EXPECT_DOUBLE_EQ(held_need(3.0, {2.0, 3.0}), 7.5);   // (Lambda - 1) s = Lambda M, where both others agree
    EXPECT_DOUBLE_EQ(held_need(3.0, {1.0, 4.0}), 10.0);  // s (Lambda - 1/2)
    EXPECT_DOUBLE_EQ(held_need(1.0, {1.0, 3.0}), 1.75);  // (M + M^2 / (s - M) + Lambda^2 (s - M)) / 2
    EXPECT_DOUBLE_EQ(held_need(0.5, {1.0, 5.0}), 0.5 * (1.0 + 0.25 + 1.0));
    EXPECT_EQ(held_need(0.0, {2.0, 7.0}), 1.0);
    EXPECT_EQ(held_need(5.0, {0.0, 0.0}), 0.0);
}

/// Returns the largest eigenvalue of a Hermitian form of two complex numbers against |u|^2 / first + |v|^2 / second.
/// The matrix is computed from values of the form.
template <class Form>
double largest_eigenvalue(double first, double second, Form form) {
    const double uu = form(1.0, 0.0) * first;
    const double vv = form(0.0, 1.0) * second;
    const double real = 0.5 * (form(1.0, 1.0) - form(1.0, 0.0) - form(0.0, 1.0));
    const double imaginary =
        0.5 * (form(1.0, std::complex<double>{0.0, 1.0}) - form(1.0, 0.0) - form(0.0, 1.0));
    const double across = first * second * (real * real + imaginary * imaginary);
    return 0.5 * (uu + vv) + std::sqrt(0.25 * (uu - vv) * (uu - vv) + across);
}

// The handle moves by u in the first part of a sample, tau of it, and by v in the rest; d = u + v. The filtered motion is
// D = (z^-1 + ... + z^-n) d + z^-(n+1) u. The energy is at most a |d|^2 + l Re(d* D) + gamma |D|^2.
TEST(HeldForce, NeedOfASplitSampleIsTheMinimumOverBothFactors) {
    for (const SlopeRange slopes : {SlopeRange{1.0, 1.0}, {0.2, 1.5}, {0.0, 1.0}}) {
        for (const auto& [whole, tau] : {std::pair{0, 0.25}, {1, 0.4}, {2, 0.7}}) {
            const double least = least_over_factors(
                slopes,
                [&, whole = whole, tau = tau](double l, double gamma) {
                    const double a = detail::step_coefficient(slopes, l, gamma);
                    return most_over_frequencies(72, [&](double theta) {
                        std::complex<double> late;
                        for (int j = 1; j <= whole; ++j) {
                            late += std::polar(1.0, j * theta);
                        }
                        const std::complex<double> one_more = std::polar(1.0, (whole + 1) * theta);
                        return largest_eigenvalue(
                            tau, 1.0 - tau, [&](std::complex<double> u, std::complex<double> v) {
                                const std::complex<double> d = u + v;
                                const std::complex<double> D = late * d + one_more * u;
                                return a * std::norm(d) + l * (std::conj(d) * D).real() +
                                       gamma * std::norm(D);
                            });
                    });
                },
                30);
            const double lag = std::sqrt(whole * (whole + 2.0 * tau) + tau);
            const double expected = std::min(least, held_need(lag, slopes));
            EXPECT_NEAR(detail::split_sample_need(whole, tau, slopes), expected, 2e-3 * expected)
                << whole << " " << slopes.falling;
            EXPECT_GE(detail::split_sample_need(whole, tau, slopes), expected * (1.0 - 2e-5));
        }
    }
    // The bound R(Lambda) is the smaller one for a spring that is late by almost no time.
    EXPECT_LE(detail::split_sample_need(3, 0.5, {1.0, 0.0}), held_need(std::sqrt(12.5), {1.0, 0.0}));
}

TEST(HeldForce, ALaterFallingForceNeedsAtLeastTheDampingOfAnEarlierOne) {
    // Just after one whole sample, the need of exactly n + tau samples of a falling force is below the need of n.
    const SlopeRange falling{1.0, 3.0};
    bool smaller = false;
    for (const double tau : {0.01, 0.03, 0.1, 0.2}) {
        const double exact = detail::split_sample_need(1, tau, falling);
        const double earlier = delayed_need(1, 0.0, falling);
        smaller = smaller || exact < earlier * (1.0 - 1e-6);
        EXPECT_EQ(delayed_need(1, tau, falling), std::max(exact, earlier));
    }
    RecordProperty("smaller", smaller ? 1 : 0);
}

/// Returns the energy of both parts of a sample, as a form of the handle's motions u and v. The previous force acts in
/// the first part; its position error is q' = (1 + Q) z^-1 (u + v). The new force acts in the second part, at q + u.
double split_form(const std::vector<double>& taps, double theta, SlopeRange slopes, double l,
                  double gamma_first, double gamma_second, std::complex<double> u, std::complex<double> v) {
    const std::complex<double> q = filter_response(taps, theta) * (u + v);
    const std::complex<double> before = std::polar(1.0, -theta) * (u + v + q);
    const std::complex<double> now = q + u;
    return detail::step_coefficient(slopes, l, gamma_first) * std::norm(u) +
           l * (std::conj(u) * before).real() + gamma_first * std::norm(before) +
           detail::step_coefficient(slopes, l, gamma_second) * std::norm(v) +
           l * (std::conj(v) * now).real() + gamma_second * std::norm(now);
}

TEST(HeldForce, GainOfASplitFilterIsTheLargestEigenvalueOfBothParts) {
    const SlopeRange slopes{1.0, 0.7};
    for (const std::vector<double>& taps : {std::vector<double>{}, {-0.5}, {1.0, -0.3}}) {
        const int resolution = 16;
        const int last = resolution * (static_cast<int>(taps.size()) + 1);
        const detail::SplitGain gain{taps, detail::Maximum::Proved, resolution};
        EXPECT_EQ(gain.size(), 1.0 + detail::size_of(taps));
        for (const auto& [l, first, second] :
             {std::array{0.4, 0.3, 0.6}, std::array{-0.7, 1.0, 0.2}, std::array{0.0, 0.5, 0.5}}) {
            for (const auto& [tau, rest] : {std::pair{0.3, 0.7}, {0.8, 0.25}}) {
                const double sampled = most_over_frequencies(last, [&, l = l, first = first, second = second,
                                                                    tau = tau, rest = rest](double theta) {
                    return largest_eigenvalue(tau, rest, [&](std::complex<double> u, std::complex<double> v) {
                        return split_form(taps, theta, slopes, l, first, second, u, v);
                    });
                });
                const double size = 1.0 + detail::size_of(taps);
                const double margin = (1.0 - std::cos(0.5 * std::numbers::pi / resolution)) *
                                      (2.0 * std::abs(l) + (first + second) * size) * size;
                EXPECT_NEAR(gain.most(tau, rest, slopes, l, first, second), sampled + margin, 1e-10);
            }
        }
    }
}

TEST(HeldForce, NeedOfASplitFilterIsTheSmallerOfTwoMinima) {
    int number = 0;
    for (const SlopeRange slopes : {SlopeRange{1.0, 1.0}, {0.2, 1.0}}) {
        for (const double tau : {0.2, 0.6}) {
            if (!test::is_sampled(number++, 3)) {
                continue;
            }
            const std::vector<double> taps{-0.5};
            const auto least = [&](double first, double second) {
                return least_over_factors(
                    slopes,
                    [&](double l, double gamma) {
                        return most_over_frequencies(48, [&](double theta) {
                            return largest_eigenvalue(
                                tau, 1.0 - tau, [&](std::complex<double> u, std::complex<double> v) {
                                    return split_form(taps, theta, slopes, l, first * gamma, second * gamma,
                                                      u, v);
                                });
                        });
                    },
                    26);
            };
            const double expected =
                std::min(least(tau, 1.0 - tau), least(std::sqrt(tau), std::sqrt(1.0 - tau)));
            EXPECT_NEAR(filtered_need(taps, tau, slopes, 1.0 - tau), expected, 2e-3 * expected) << tau;
        }
    }
}

TEST(HeldForce, UnknownMotionAddsItsShareToTheFilter) {
    for (const SlopeRange slopes : {SlopeRange{1.0, 1.0}, {0.1, 1.0}, {0.0, 1.0}}) {
        for (const double nu : {0.01, 0.3}) {
            const std::vector<double> taps{1.0, 1.0};
            const double gain = 1.4;
            const double off = gain * std::sqrt(nu);
            const double eta = off / 2.0;
            const double expected = least_over_factors(slopes, [&](double l, double gamma) {
                const double sum = most_over_frequencies(96, [&](double theta) {
                    const std::complex<double> Q = filter_response(taps, theta);
                    return l * Q.real() + gamma * (1.0 + eta) * std::norm(Q);
                });
                return detail::step_coefficient(slopes, l, gamma) + sum +
                       gamma * (1.0 + 1.0 / eta) * gain * gain * nu + std::abs(l) * off;
            });
            EXPECT_NEAR(detail::roughly_filtered_need(taps, gain, nu, slopes), expected, 1e-3 * expected)
                << nu;
        }
    }
}

/// Returns the largest number of intervals that contain one instant. Interval k lies between the time k + `whole` of
/// a sample and the time k + `delay` at which a force begins to act; each of both is late by 0 to `jitter`.
int most_intervals_at_once(double delay, double jitter, int whole) {
    int most = 0;
    for (double at = 0.005; at < 1.0; at += 0.01) {
        int count = 0;
        for (int k = -30; k <= 30; ++k) {
            const double lower = std::min(k + whole + 0.0, k + delay);
            const double upper = std::max(k + whole + jitter, k + delay + jitter);
            count += lower < at && at < upper ? 1 : 0;
        }
        most = std::max(most, count);
    }
    return most;
}

TEST(HeldForce, UncertainTimeCountsTheIntervalsThatOverlap) {
    // Off by 0.25 of the period with a jitter of 0.125: one interval of 0.375 in each period of 1.125.
    EXPECT_DOUBLE_EQ(detail::uncertain_time(1.25, 1.0, 0.125, 1), 0.375 / 1.125);
    EXPECT_DOUBLE_EQ(detail::uncertain_time(0.75, 1.0, 0.125, 1), 0.375 / 1.125);
    // Off by 0.125, jitter 0.25: the span is 0.125 + 0.25 + 0.125 = 0.5 of a shortest distance of 0.75.
    EXPECT_DOUBLE_EQ(detail::uncertain_time(2.125, 1.0, 0.25, 2), 0.375 / 1.25);
    // Off by 0.25, jitter 0.5: a span of 1 needs two intervals at a shortest distance of 0.5.
    EXPECT_DOUBLE_EQ(detail::uncertain_time(1.25, 1.0, 0.5, 1), 2.0 * 0.75 / 1.5);
    EXPECT_DOUBLE_EQ(detail::uncertain_time(2.5, 2.0, 1.0, 1), 2.0 * 1.5 / 3.0);
    for (const double delay : {0.9, 1.2, 1.4, 2.1, 2.45}) {
        for (const double jitter : {0.05, 0.2, 0.4, 0.6}) {
            const int whole = static_cast<int>(std::lround(delay));
            const double one = std::abs(delay - whole) + jitter;
            EXPECT_GE(detail::uncertain_time(delay, 1.0, jitter, whole) * (1.0 + jitter),
                      one * most_intervals_at_once(delay, jitter, whole) * (1.0 - 1e-12))
                << delay << " " << jitter;
        }
    }
}

/// Returns the time that all delays share with one delay, the largest over the times of the samples. Each sample is
/// late by 0 or by `jitter`; a delay begins at its sample.
double shared_time(double delay, double jitter) {
    double most = 0.0;
    for (const double own : {0.0, jitter}) {
        double sum = delay;
        for (int k = -30; k <= 30; ++k) {
            double shared = 0.0;
            for (const double late : {0.0, jitter}) {
                shared = std::max(shared, delay - std::abs(k + late - own));
            }
            // A delay inside the other one cannot share more than its own length.
            sum += k == 0 ? 0.0 : std::min(delay, shared);
        }
        most = std::max(most, sum);
    }
    return most;
}

TEST(HeldForce, JitterNeedsTheSmallerOfTheSharedTimeAndTheNearestSample) {
    for (const double delay : {0.7, 0.9999, 1.0, 1.3, 1.75, 2.0, 2.6, 3.1}) {
        for (const double jitter : {1e-4, 0.05, 0.3, 0.45}) {
            for (const SlopeRange slopes : {SlopeRange{1.0, 0.0}, {0.0, 1.0}, {0.3, 1.0}}) {
                if (delay <= 1.0 - jitter) {
                    continue;
                }
                const double T = 1.0 + jitter;
                const double shared = held_need(std::sqrt(shared_time(delay, jitter) / T), slopes);
                const int whole = static_cast<int>(std::lround(delay));
                const double nearest = detail::roughly_filtered_need(
                    std::vector<double>(static_cast<std::size_t>(whole), 1.0), 1.0,
                    detail::uncertain_time(delay, 1.0, jitter, whole), slopes);
                EXPECT_NEAR(detail::jittered_need(0.25 * delay, 0.25, 0.25 * jitter, slopes),
                            std::min(shared, nearest), 1e-9)
                    << delay << " " << jitter << " " << slopes.rising;
            }
        }
    }
}

TEST(HeldForce, JitterChangesTheFormulaWhereAForceCanMeetTheNextSample) {
    const SlopeRange slopes{1.0, 0.5};
    EXPECT_EQ(detail::jittered_need(0.75, 1.0, 0.25, slopes), delayed_need(0, 0.6, slopes));
    // One step later the force can act after the next sample, so the time that delays share decides.
    const double later = std::nextafter(0.75, 1.0);
    EXPECT_NEAR(detail::jittered_need(later, 1.0, 0.25, slopes), held_need(std::sqrt(0.75 / 1.25), slopes),
                1e-9);
    // With a jitter of a period or more, or without a nearest sample, only the shared time gives a bound.
    EXPECT_NEAR(detail::jittered_need(1.0, 1.0, 1.0, slopes), held_need(std::sqrt(2.0 / 2.0), slopes), 1e-12);
    EXPECT_NEAR(detail::jittered_need(0.4, 1.0, 0.8, slopes), held_need(std::sqrt(0.6 / 1.8), slopes), 1e-12);
    EXPECT_EQ(detail::jittered_need(1.0, 1.0, 0.5, {0.0, 0.0}), 0.0);
    EXPECT_TRUE(
        std::isinf(detail::jittered_need(1.0, 1.0, 0.5, {std::numeric_limits<double>::infinity(), 0.0})));
}

TEST(HeldForce, JitterWithoutDelayNeedsOnlyTheHold) {
    DeviceProfile device;
    device.jitter_s = 1.5 * device.period_s;
    EXPECT_EQ(device_need(device, {1.0, 4.0}), 0.5);
    device.delay_s = 1.25 * device.period_s;
    device.jitter_s = 0.0;
    EXPECT_EQ(device_need(device, {1.0, 4.0}), delayed_need(1, 0.25, {1.0, 4.0}));
    device.jitter_s = 0.5 * device.period_s;
    EXPECT_EQ(device_need(device, {1.0, 4.0}), detail::jittered_need(1.25e-3, 1e-3, 0.5e-3, {1.0, 4.0}));
}

TEST(HeldForce, FallingSlopesNeedLessThanRisingOnesWithDelay) {
    EXPECT_NEAR(delayed_need(1, 0.0, {0.0, 1.0}), 0.50, 0.005);
    EXPECT_NEAR(delayed_need(2, 0.0, {0.0, 1.0}), 0.82, 0.005);
    EXPECT_NEAR(delayed_need(3, 0.0, {0.0, 1.0}), 1.15, 0.005);
    // With one sample of delay, the required damping does not increase with the steepest falling slope while this slope
    // is at most twice the steepest rising slope.
    EXPECT_NEAR(delayed_need(1, 0.0, {1.0, 2.0}), 1.5, 1e-12);
    EXPECT_GT(delayed_need(1, 0.0, {1.0, 2.2}), 1.505);
}

TEST(HeldForce, PredictionFromMoreSamplesNeedsLess) {
    EXPECT_NEAR(filtered_need(prediction(1), {1.0, 1.0}), 1.00, 0.005);
    EXPECT_NEAR(filtered_need(prediction(2), {1.0, 1.0}), 0.77, 0.005);
    EXPECT_NEAR(filtered_need(prediction(4), {1.0, 1.0}), 0.66, 0.005);
    EXPECT_NEAR(filtered_need(prediction(8), {1.0, 1.0}), 0.60, 0.005);
}

TEST(HeldForce, FractionalDelayOfASpringNeedsMoreThanItsShare) {
    EXPECT_NEAR(delayed_need(0, 0.25, {1.0, 0.0}), 0.808, 5e-4);
    for (const double tau : {0.01, 0.1, 0.25, 0.5, 0.9}) {
        const double exact = 0.5 * (0.5 + tau + std::sqrt(0.25 + 2.0 * tau));
        EXPECT_NEAR(delayed_need(0, tau, {1.0, 1.0}), exact, 1e-4) << tau;
        EXPECT_GE(delayed_need(0, tau, {1.0, 1.0}), exact) << tau;
    }
}

TEST(HeldForce, NeedIsContinuousAndRisesWithTheDelay) {
    for (const SlopeRange slopes : {SlopeRange{1.0, 0.0}, {1.0, 1.0}, {0.5, 1.5}, {0.0, 1.0}}) {
        for (const int n : {0, 1, 2}) {
            double before = delayed_need(n, 0.0, slopes);
            for (const double tau : {1e-6, 0.1, 0.2, 0.4, 0.6, 0.8, 0.9, 1.0 - 1e-6}) {
                const double now = delayed_need(n, tau, slopes);
                EXPECT_GE(now, before * (1.0 - 1e-7)) << n << " " << tau;
                before = now;
            }
            const double next = delayed_need(n + 1, 0.0, slopes);
            EXPECT_NEAR(before, next, 2e-5 * next) << n << " " << slopes.falling;
            EXPECT_NEAR(delayed_need(n, 1e-9, slopes), delayed_need(n, 0.0, slopes), 2e-4);
        }
    }
}

TEST(HeldForce, NeverBelowTheTrueMaximumOverFrequency) {
    std::mt19937 random{5};
    std::normal_distribution<double> normal;
    for (int scene = 0; scene < 100; ++scene) {
        std::vector<double> taps(static_cast<std::size_t>(1 + scene % 6));
        for (double& tap : taps) {
            tap = normal(random);
        }
        const detail::FilterGain few{taps, detail::Maximum::Proved, 8};
        const detail::FilterGain many{taps, detail::Maximum::Proved, 4096};
        const detail::FilterGain likely{taps, detail::Maximum::Likely, 64};
        const double l = normal(random);
        const double gamma = std::abs(normal(random));
        const double size = (std::abs(l) + gamma * few.size()) * few.size();
        EXPECT_GE(few.most(l, gamma), many.most(l, gamma) - 1e-6 * size);
        EXPECT_LE(few.most(l, gamma), many.most(l, gamma) + 0.02 * size);
        EXPECT_NEAR(likely.most(l, gamma), many.most(l, gamma), 1e-5 * size);
    }
}

TEST(HeldForce, AFilterWithAFractionOfASampleIsContinuousInTheDelay) {
    for (const int m : {1, 4}) {
        for (const SlopeRange slopes : {SlopeRange{1.0, 0.0}, {1.0, 1.0}, {0.2, 1.0}}) {
            const std::vector<double> taps = prediction(m);
            // Filter weights of the same prediction with a delay of one more sample: 1, then `taps`.
            std::vector<double> late = taps;
            late.insert(late.begin(), 1.0);
            EXPECT_NEAR(filtered_need(taps, 1e-9, slopes, 1.0 - 1e-9), filtered_need(taps, slopes), 1e-3);
            EXPECT_NEAR(filtered_need(taps, 1.0 - 1e-9, slopes, 1e-9), filtered_need(late, slopes), 1e-3);
        }
    }
}

TEST(HeldForce, WithoutAFilterBothLinesOfAFractionAreClose) {
    for (const double tau : {0.25, 0.5, 0.75}) {
        for (int n = 0; n <= 2; ++n) {
            const std::vector<double> taps(static_cast<std::size_t>(n), 1.0);
            const double delayed = delayed_need(n, tau, {1.0, 1.0});
            const double filtered = filtered_need(taps, tau, {1.0, 1.0}, 1.0 - tau);
            EXPECT_GE(filtered, delayed * (1.0 - 1e-5));
            EXPECT_LE(filtered, 1.04 * delayed);
        }
    }
}

/// Delay and jitter in nominal periods, and the weights of the prediction filter.
struct Timing {
    /// Filter weights: the command of sample k is f(x_k - sum of taps[j - 1] d_{k-j}), where d_i = x_{i+1} - x_i.
    std::vector<double> taps;
    double delay = 0.0;   ///< time from a sample to the instant at which its command acts
    double jitter = 0.0;  ///< sample k is taken at the time k + u_k, where 0 <= u_k <= jitter
};

/// A closed motion that repeats after as many samples as `late` has elements.
struct Cycle {
    double start = 0.0;
    std::vector<double> late;   ///< u_k
    std::vector<double> moved;  ///< displacement between two events (samples and commands), in order of time
};

/// Returns the energy that a hand must put in for one repetition of a closed motion, divided by the energy that the
/// damping b dissipates.
double share_put_in(const Zigzag& law, const Cycle& cycle, const Timing& timing, double b) {
    const auto count = static_cast<int>(cycle.late.size());
    struct Event {
        double time;
        int sample;   ///< number of the sample taken at this time, or -1
        int command;  ///< number of the command that starts to act at this time, or -1
    };
    // Memory of the calls before, because the search calls often
    static std::vector<Event> events;
    static std::vector<double> time;
    static std::vector<double> moved;
    static std::vector<double> position;
    events.clear();
    for (int k = 0; k < count; ++k) {
        const double at = k + cycle.late[static_cast<std::size_t>(k)];
        const double acts = at + timing.delay;
        events.push_back({at, k, -1});
        events.push_back({acts - count * std::floor(acts / count), -1, k});
    }
    for (auto event = events.begin(); event != events.end(); ++event) {
        const auto place = std::upper_bound(events.begin(), event, event->time,
                                            [](double at, const Event& other) { return at < other.time; });
        std::rotate(place, event, event + 1);
    }
    // The handle does not move in a part of duration 0; the other displacements are reduced in proportion to time, so
    // that the motion closes.
    time.resize(events.size());
    moved.resize(events.size());
    double turn = 0.0;
    for (std::size_t e = 0; e < events.size(); ++e) {
        const double until = e + 1 < events.size() ? events[e + 1].time : events[0].time + count;
        time[e] = until - events[e].time;
        moved[e] = time[e] > 1e-9 ? cycle.moved[e] : 0.0;
        turn += moved[e];
    }
    position.resize(cycle.late.size());
    double x = cycle.start;
    int acting = -1;
    for (std::size_t e = 0; e < events.size(); ++e) {
        if (events[e].sample >= 0) {
            position[static_cast<std::size_t>(events[e].sample)] = x;
        } else {
            // The last command of the closed motion still acts when the motion begins again
            acting = events[e].command;
        }
        moved[e] -= time[e] > 1e-9 ? turn * time[e] / count : 0.0;
        x += moved[e];
    }
    // No filter is longer than the shortest motion
    const auto at = [&](int k) { return position[static_cast<std::size_t>(k < 0 ? k + count : k)]; };
    const auto command = [&](int k) {
        double where = at(k);
        for (std::size_t j = 0; j < timing.taps.size(); ++j) {
            const int step = k - static_cast<int>(j) - 1;
            where -= timing.taps[j] * (at(step + 1) - at(step));
        }
        return law.at(where);
    };
    double force = command(acting);
    double work = 0.0;
    double lost = 0.0;
    for (std::size_t e = 0; e < events.size(); ++e) {
        if (events[e].command >= 0) {
            force = command(events[e].command);
        }
        work += force * moved[e];
        lost += moved[e] == 0.0 ? 0.0 : b * moved[e] * moved[e] / time[e];
    }
    return lost > 0.0 ? work / lost + 1.0 : 1.0;
}

/// Returns true if a search finds a closed motion for which the hand puts in less than no energy. The search changes
/// motions at random and keeps each improvement.
bool takes_energy_out(const Zigzag& law, const Timing& timing, double b, std::mt19937& random) {
    std::uniform_real_distribution<double> unit{0.0, 1.0};
    std::normal_distribution<double> normal;
    for (int start = 0; start < 4; ++start) {
        Cycle best;
        best.start = 4.0 * unit(random);
        best.late.resize(static_cast<std::size_t>(6 + 6 * start));
        best.moved.resize(2 * best.late.size());
        double least = std::numeric_limits<double>::infinity();
        double change = 1.0;
        Cycle next;
        for (int trial = 0; trial < 4000; ++trial) {
            next = best;
            const bool all = trial % 4 == 0;
            const auto one = static_cast<std::size_t>(unit(random) * static_cast<double>(next.moved.size()));
            next.start += all ? change * normal(random) : 0.0;
            if (timing.jitter > 0.0 && trial % 3 == 0) {
                next.late[one / 2] = unit(random) < 0.5 ? 0.0 : timing.jitter;
            }
            for (std::size_t e = 0; e < next.moved.size(); ++e) {
                next.moved[e] += all || e == one ? change * normal(random) : 0.0;
            }
            if (const double now = share_put_in(law, next, timing, b); now < least) {
                if (now < -1e-9) {
                    return true;
                }
                least = now;
                best = next;
                change *= 1.5;
            } else {
                change = std::max(1e-3, 0.97 * change);
            }
        }
    }
    return false;
}

struct Scene {
    Zigzag law;
    SlopeRange slopes;
};

Scene random_scene(std::size_t pieces, std::mt19937& random) {
    std::uniform_real_distribution<double> unit{0.0, 1.0};
    Scene scene{{std::vector<double>(pieces)}, {}};
    double mean = 0.0;
    for (double& force : scene.law.force) {
        force = unit(random);
        mean += force / static_cast<double>(pieces);
    }
    for (std::size_t k = 0; k < pieces; ++k) {
        const double slope = scene.law.force[(k + 1) % pieces] - scene.law.force[k];
        scene.slopes.rising = std::max(scene.slopes.rising, slope);
        scene.slopes.falling = std::max(scene.slopes.falling, -slope);
    }
    for (double& force : scene.law.force) {
        force -= mean;
    }
    return scene;
}

/// Returns true if a motion takes energy out in at least `enough` of the scenes at `share` of the needed damping. The
/// search ends with the scene that decides.
template <class Need>
bool violated(double share, int scenes, int enough, Need need) {
    std::mt19937 random{7};
    int found = 0;
    for (int k = 0; k < scenes && found < enough; ++k) {
        const Scene scene = random_scene(static_cast<std::size_t>(2 + k % 4), random);
        Timing timing;
        const double b = need(k, scene.slopes, timing, random);
        found += takes_energy_out(scene.law, timing, share * b, random) ? 1 : 0;
    }
    return found >= enough;
}

TEST(HeldForce, NoMotionTakesEnergyOutOfADelayedForce) {
    const auto need = [](int k, SlopeRange slopes, Timing& timing, std::mt19937& random) {
        std::uniform_real_distribution<double> unit{0.0, 1.0};
        const double tau = k % 2 == 0 ? unit(random) : 0.0;
        timing.delay = k % 3 + tau;
        return delayed_need(k % 3, tau, slopes);
    };
    EXPECT_FALSE(violated(1.0, 40, 1, need));
    // With 0.6 times the required damping the search finds motions that take energy out.
    EXPECT_TRUE(violated(0.6, 40, 10, need));
}

TEST(HeldForce, NoMotionTakesEnergyOutWithJitter) {
    const auto need = [](int k, SlopeRange slopes, Timing& timing, std::mt19937& random) {
        std::uniform_real_distribution<double> unit{0.0, 1.0};
        timing.delay = k % 2 == 0 ? 2.5 * unit(random) : 1.0 + k % 3;
        timing.jitter = std::array{0.03, 0.1, 0.3, 0.6}[static_cast<std::size_t>(k % 4)];
        return (1.0 + timing.jitter) * detail::jittered_need(timing.delay, 1.0, timing.jitter, slopes);
    };
    EXPECT_FALSE(violated(1.0, 40, 1, need));
    EXPECT_TRUE(violated(0.4, 40, 8, need));
}

TEST(HeldForce, NoMotionTakesEnergyOutOfAPredictedForce) {
    const auto need = [](int k, SlopeRange slopes, Timing& timing, std::mt19937& random) {
        std::uniform_real_distribution<double> unit{0.0, 1.0};
        const int whole = k % 2;
        const double tau = k % 3 == 0 ? 0.0 : unit(random);
        timing.delay = whole + tau;
        timing.taps = prediction(1 + k % 4);
        std::vector<double> taps(static_cast<std::size_t>(whole), 1.0);
        taps.insert(taps.end(), timing.taps.begin(), timing.taps.end());
        return filtered_need(taps, tau, slopes, 1.0 - tau);
    };
    EXPECT_FALSE(violated(1.0, 40, 1, need));
    EXPECT_TRUE(violated(0.4, 40, 8, need));
}

}  // namespace
}  // namespace palpate
