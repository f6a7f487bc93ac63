// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/stability/held_force.hpp"

namespace palpate {
namespace {

/// Prediction over m samples: x + (x - mean of the m readings before) / (m + 1), as a filter of the steps.
std::vector<double> prediction(int m) {
    std::vector<double> taps;
    for (int j = 1; j <= m; ++j) {
        taps.push_back(-static_cast<double>(m - j + 1) / (m * (m + 1)));
    }
    return taps;
}

/// A force made of straight pieces of equal width that repeats, and its energy above its least.
struct Zigzag {
    std::vector<double> force;  ///< at 0, 1, 2, ...; the first again after the last

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

TEST(HeldForce, ClosedFormIsTheLeastOverGamma) {
    for (const double lag : {0.3, 0.5, 1.0, 1.7, 2.0, 3.0, 6.5}) {
        for (const double falling : {0.0, 0.4, 1.0, 1.3, 2.0, 3.1, 10.0}) {
            const SlopeRange slopes{1.0, falling};
            double least = std::numeric_limits<double>::infinity();
            for (double gamma = 1e-3; gamma < 1e3; gamma *= 1.001) {
                least = std::min(least, detail::step_energy(slopes, 0.0, gamma) + gamma * lag * lag);
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
        EXPECT_NEAR(detail::step_energy({M, s}, l, gamma), most, 1e-6);
    }
}

TEST(HeldForce, FallingSlopesCostLessThanRisingOnesWithDelay) {
    EXPECT_NEAR(delayed_need(1, 0.0, {0.0, 1.0}), 0.50, 0.005);
    EXPECT_NEAR(delayed_need(2, 0.0, {0.0, 1.0}), 0.82, 0.005);
    EXPECT_NEAR(delayed_need(3, 0.0, {0.0, 1.0}), 1.15, 0.005);
    // With one sample of delay they cost nothing up to twice the rising slope.
    EXPECT_NEAR(delayed_need(1, 0.0, {1.0, 2.0}), 1.5, 1e-12);
    EXPECT_GT(delayed_need(1, 0.0, {1.0, 2.2}), 1.505);
}

TEST(HeldForce, PredictionCostsLessTheMoreSamplesItTakes) {
    EXPECT_NEAR(filtered_need(prediction(1), {1.0, 1.0}), 1.00, 0.005);
    EXPECT_NEAR(filtered_need(prediction(2), {1.0, 1.0}), 0.77, 0.005);
    EXPECT_NEAR(filtered_need(prediction(4), {1.0, 1.0}), 0.66, 0.005);
    EXPECT_NEAR(filtered_need(prediction(8), {1.0, 1.0}), 0.60, 0.005);
}

TEST(HeldForce, ASpringWithAFractionOfASampleNeedsMoreThanInProportion) {
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
    const std::vector<double> taps{0.9, -0.3, 0.4, 0.1};
    const detail::FilterGain few{taps, 8};
    const detail::FilterGain many{taps, 4096};
    for (const double l : {-1.0, -0.2, 0.0, 0.5, 2.0}) {
        for (const double gamma : {0.1, 1.0, 3.0}) {
            EXPECT_GE(few.most(l, gamma), many.most(l, gamma) - 1e-6);
            EXPECT_GE(many.most(l, gamma), l * 1.1 + gamma * 1.21);  // theta = 0
        }
    }
}

/// A periodic motion of the handle that begins at `start`, in the two parts of each sample.
struct Cycle {
    double start = 0.0;
    std::vector<double> first;   ///< moved under the command before
    std::vector<double> second;  ///< moved under the command of the sample
};

/// What a hand must put in for one turn of a cycle, over the throughput of the damping.
double share_put_in(const Zigzag& law, const Cycle& cycle, int n, double tau, double B) {
    const auto steps = static_cast<int>(cycle.first.size());
    std::vector<double> force;
    double x = cycle.start;
    for (std::size_t k = 0; k < cycle.first.size(); ++k) {
        force.push_back(law.at(x));
        x += cycle.first[k] + cycle.second[k];
    }
    const auto late = [&](int k) { return force[static_cast<std::size_t>((k + 4 * steps) % steps)]; };
    double work = 0.0;
    double lost = 0.0;
    for (int k = 0; k < steps; ++k) {
        const double a = cycle.first[static_cast<std::size_t>(k)];
        const double b = cycle.second[static_cast<std::size_t>(k)];
        work += late(k - n - 1) * a + late(k - n) * b;
        lost += B * ((tau > 0.0 ? a * a / tau : 0.0) + b * b / (1.0 - tau));
    }
    return work / lost + 1.0;
}

/// The least share found by hill descent over closed cycles.
double worst_share(const Zigzag& law, int n, double tau, double B, std::mt19937& random) {
    std::uniform_real_distribution<double> unit{0.0, 1.0};
    std::normal_distribution<double> normal;
    double worst = std::numeric_limits<double>::infinity();
    for (int start = 0; start < 4; ++start) {
        Cycle best;
        double least = std::numeric_limits<double>::infinity();
        double change = 1.0;
        best.start = 4.0 * unit(random);
        best.first.resize(static_cast<std::size_t>(4 + 8 * start));
        best.second.resize(best.first.size());
        for (int trial = 0; trial < 4000; ++trial) {
            Cycle next = best;
            const bool all = trial % 4 == 0;
            const auto one = static_cast<std::size_t>(unit(random) * static_cast<double>(next.first.size()));
            next.start += all ? change * normal(random) : 0.0;
            double turn = 0.0;
            for (std::size_t k = 0; k < next.first.size(); ++k) {
                if (all || k == one) {
                    next.first[k] += tau > 0.0 ? tau * change * normal(random) : 0.0;
                    next.second[k] += (1.0 - tau) * change * normal(random);
                }
                turn += next.first[k] + next.second[k];
            }
            for (std::size_t k = 0; k < next.first.size(); ++k) {
                next.first[k] -= tau * turn / static_cast<double>(next.first.size());
                next.second[k] -= (1.0 - tau) * turn / static_cast<double>(next.first.size());
            }
            if (const double now = share_put_in(law, next, n, tau, B); now < least) {
                least = now;
                best = next;
                change *= 1.5;
            } else {
                change = std::max(1e-3, 0.97 * change);
            }
        }
        worst = std::min(worst, least);
    }
    return worst;
}

TEST(HeldForce, NoMotionTakesEnergyOutOfADelayedForce) {
    std::mt19937 random{7};
    std::uniform_real_distribution<double> unit{0.0, 1.0};
    int found = 0;
    constexpr int scenes = 60;
    for (int scene = 0; scene < scenes; ++scene) {
        const int n = scene % 3;
        const double tau = scene % 2 == 0 ? unit(random) : 0.0;
        Zigzag law{std::vector<double>(static_cast<std::size_t>(2 + scene % 4))};
        for (double& force : law.force) {
            force = unit(random);
        }
        double mean = 0.0;
        SlopeRange slopes;
        for (std::size_t k = 0; k < law.force.size(); ++k) {
            const double slope = law.force[(k + 1) % law.force.size()] - law.force[k];
            slopes.rising = std::max(slopes.rising, slope);
            slopes.falling = std::max(slopes.falling, -slope);
            mean += law.force[k] / static_cast<double>(law.force.size());
        }
        for (double& force : law.force) {
            force -= mean;
        }
        const double need = delayed_need(n, tau, slopes);
        EXPECT_GE(worst_share(law, n, tau, need, random), -1e-9) << "scene " << scene;
        found += worst_share(law, n, tau, 0.6 * need, random) < 0.0 ? 1 : 0;
    }
    EXPECT_GE(found, scenes / 4);  // the search finds what is there
}

}  // namespace
}  // namespace palpate
