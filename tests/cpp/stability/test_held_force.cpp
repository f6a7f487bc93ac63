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
    std::vector<Event> events;
    for (int k = 0; k < count; ++k) {
        const double at = k + cycle.late[static_cast<std::size_t>(k)];
        const double acts = at + timing.delay;
        events.push_back({at, k, -1});
        events.push_back({acts - count * std::floor(acts / count), -1, k});
    }
    std::stable_sort(events.begin(), events.end(),
                     [](const Event& one, const Event& other) { return one.time < other.time; });
    // The handle does not move in a part of duration 0; the other displacements are reduced in proportion to time, so
    // that the motion closes.
    std::vector<double> time(events.size());
    std::vector<double> moved(events.size());
    double turn = 0.0;
    for (std::size_t e = 0; e < events.size(); ++e) {
        const double until = e + 1 < events.size() ? events[e + 1].time : events[0].time + count;
        time[e] = until - events[e].time;
        moved[e] = time[e] > 1e-9 ? cycle.moved[e] : 0.0;
        turn += moved[e];
    }
    std::vector<double> position(cycle.late.size());
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
    const auto at = [&](int k) { return position[static_cast<std::size_t>((k % count + count) % count)]; };
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

/// Returns the least ratio of the energy that a hand must put in to the energy that the damping dissipates; the search
/// changes closed motions at random and keeps each improvement.
double worst_share(const Zigzag& law, const Timing& timing, double b, std::mt19937& random) {
    std::uniform_real_distribution<double> unit{0.0, 1.0};
    std::normal_distribution<double> normal;
    double worst = std::numeric_limits<double>::infinity();
    for (int start = 0; start < 4; ++start) {
        Cycle best;
        best.start = 4.0 * unit(random);
        best.late.resize(static_cast<std::size_t>(6 + 6 * start));
        best.moved.resize(2 * best.late.size());
        double least = std::numeric_limits<double>::infinity();
        double change = 1.0;
        for (int trial = 0; trial < 4000; ++trial) {
            Cycle next = best;
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

/// Returns the number of scenes in which a motion takes energy out at `share` of the needed damping. At the full need
/// this number must be 0.
template <class Need>
int violated(double share, int scenes, Need need) {
    std::mt19937 random{7};
    int found = 0;
    for (int k = 0; k < scenes; ++k) {
        const Scene scene = random_scene(static_cast<std::size_t>(2 + k % 4), random);
        Timing timing;
        const double b = need(k, scene.slopes, timing, random);
        found += worst_share(scene.law, timing, share * b, random) < -1e-9 ? 1 : 0;
    }
    return found;
}

TEST(HeldForce, NoMotionTakesEnergyOutOfADelayedForce) {
    const auto need = [](int k, SlopeRange slopes, Timing& timing, std::mt19937& random) {
        std::uniform_real_distribution<double> unit{0.0, 1.0};
        const double tau = k % 2 == 0 ? unit(random) : 0.0;
        timing.delay = k % 3 + tau;
        return delayed_need(k % 3, tau, slopes);
    };
    EXPECT_EQ(violated(1.0, 40, need), 0);
    // With 0.6 times the required damping the search finds motions that take energy out.
    EXPECT_GE(violated(0.6, 40, need), 10);
}

TEST(HeldForce, NoMotionTakesEnergyOutWithJitter) {
    const auto need = [](int k, SlopeRange slopes, Timing& timing, std::mt19937& random) {
        std::uniform_real_distribution<double> unit{0.0, 1.0};
        timing.delay = k % 2 == 0 ? 2.5 * unit(random) : 1.0 + k % 3;
        timing.jitter = std::array{0.03, 0.1, 0.3, 0.6}[static_cast<std::size_t>(k % 4)];
        return (1.0 + timing.jitter) * detail::jittered_need(timing.delay, 1.0, timing.jitter, slopes);
    };
    EXPECT_EQ(violated(1.0, 40, need), 0);
    EXPECT_GE(violated(0.4, 40, need), 8);
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
    EXPECT_EQ(violated(1.0, 40, need), 0);
    EXPECT_GE(violated(0.4, 40, need), 8);
}

}  // namespace
}  // namespace palpate
