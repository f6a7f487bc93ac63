// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/rendering/any_structure.hpp"
#include "palpate/rendering/make_structure.hpp"
#include "palpate/stability/certificate.hpp"
#include "palpate/stability/direct_inequalities.hpp"
#include "palpate/stability/renderable_slopes.hpp"
#include "support.hpp"

namespace palpate {
namespace {

DeviceProfile device(double delay, double encoder_step = 0.0) {
    DeviceProfile profile;
    profile.viscous_damping = 0.06;
    profile.coulomb_friction = 0.01;
    profile.encoder_step = encoder_step;
    profile.delay_s = delay * profile.period_s;
    return profile;
}

Scheme direct_scheme() {
    Scheme scheme;
    scheme.structure = StructureKind::Direct;
    return scheme;
}

TEST(DirectLines, JitterAddsTheLongerPeriodAndTheCloserSamples) {
    DeviceProfile late = device(1.0);
    const double steady = device_need(late, {1.0, 1.0});
    EXPECT_NEAR(steady, 1.5, 1e-12);
    late.jitter_s = 1e-9;
    EXPECT_NEAR(device_need(late, {1.0, 1.0}), steady, 1e-5);
    late.jitter_s = 1e-4;
    // Averaging windows of 1 ms; windows before and after overlap by at most 0.1 ms: Lambda^2 = 1.1 / 1.1.
    EXPECT_NEAR(device_need(late, {1.0, 1.0}), 1.5, 1e-9);
    late.delay_s = 2e-3;  // Lambda^2 = (2 + 1.1 + 1 + 0.1) / 1.1
    EXPECT_NEAR(device_need(late, {1.0, 1.0}), 0.5 + std::sqrt(4.2 / 1.1), 1e-9);
    late.delay_s = 0.0;
    EXPECT_DOUBLE_EQ(device_need(late, {1.0, 5.0}), 0.5);
}

TEST(DirectLines, SmallJitterChangesTheNeedOfAFallingForceLittle) {
    DeviceProfile late = device(2.0);
    const double steady = device_need(late, {0.0, 1.0});
    late.jitter_s = 1e-8;
    EXPECT_NEAR(device_need(late, {0.0, 1.0}), steady, 0.01);
    late.jitter_s = 1e-3;
    EXPECT_LE(device_need(late, {0.0, 1.0}), held_need(2.0, {0.0, 1.0}));
}

TEST(DirectLines, JitterWithinTheSampleKeepsTheLineOfAFraction) {
    DeviceProfile late = device(0.25);
    late.jitter_s = 1e-4;
    EXPECT_DOUBLE_EQ(device_need(late, {1.0, 0.5}), delayed_need(0, 0.25 / 1.1, {1.0, 0.5}));
}

TEST(DirectLines, RenderableSlopesAreCertifiedAndNotLessThanWithEqualSides) {
    for (const double delay : {0.0, 0.25, 1.0, 2.0}) {
        for (const double step : {0.0, 1e-4, 4e-4}) {
            const DeviceProfile profile = device(delay, step);
            const Interval any = renderable_slopes(profile);
            ForceBounds bounds;
            bounds.slope = {std::max(any.lower, -1e6), any.upper};
            bounds.steepest = bounds.sliding = step > 0.0 ? bounds.slope.largest() : 0.0;
            const auto certified = [&] { return certify(bounds, direct_scheme(), profile).certified(); };
            EXPECT_TRUE(certified()) << delay << " " << step;
            bounds.slope.upper *= 1.001;
            bounds.steepest = bounds.sliding = step > 0.0 ? bounds.slope.largest() : 0.0;
            EXPECT_FALSE(certified()) << delay << " " << step;
            const double equal =
                profile.viscous_damping / profile.period_s /
                delayed_need(profile.whole_delay_samples(), profile.delay_fraction(), {1, 1});
            const double friction =
                step > 0.0 ? 2.0 * profile.coulomb_friction / step : std::numeric_limits<double>::infinity();
            EXPECT_GE(any.upper, 0.9999 * std::min(equal, friction));
            EXPECT_LE(any.lower, -0.9999 * std::min(equal, friction));
        }
    }
}

TEST(DirectLines, LongestPeriodOfALateForceIsJustCertified) {
    for (const double delay : {0.0, 0.25, 1.0, 2.0}) {
        for (const double falling : {0.0, 5.0, 25.0}) {
            DeviceProfile profile = device(delay);
            ForceBounds bounds;
            bounds.slope = {-falling, 8.0};
            bounds.steepest = bounds.sliding = bounds.slope.largest();
            const Certificate certificate = certify(bounds, direct_scheme(), profile);
            ASSERT_TRUE(certificate.certified());
            profile.jitter_s = 0.9999 * certificate.longest_period_s - profile.period_s;
            EXPECT_TRUE(certify(bounds, direct_scheme(), profile).certified()) << delay << " " << falling;
            profile.jitter_s = 1.0001 * certificate.longest_period_s - profile.period_s;
            EXPECT_FALSE(certify(bounds, direct_scheme(), profile).certified()) << delay << " " << falling;
        }
    }
}

TEST(DirectLines, FallingSlopeUsesTheMarginOfTheRisingSlope) {
    const DeviceProfile late = device(1.0);
    const Interval rises = renderable_slopes(late, 0.0, {100.0, 1.0});
    const Interval falls = renderable_slopes(late, 0.0, {1.0, 1000.0});
    EXPECT_NEAR(rises.upper, 40.0, 0.01);
    EXPECT_LT(rises.lower, -79.0);
    EXPECT_LT(falls.lower, -115.0);
    EXPECT_GE(falls.upper, 0.9999);
}

TEST(DirectLines, NarrowestPlayIsJustCertified) {
    ForceBounds sliding;
    sliding.hysteresis = true;
    sliding.slope = {-5.0, 10.0};
    sliding.sliding = sliding.steepest = 10.0;
    sliding.hysteresis_force = {0.0, 0.1};
    for (const double delay : {0.0, 0.5, 1.0}) {
        for (const double step : {0.0, 2e-4}) {
            const DeviceProfile profile = device(delay, step);
            const double radius = narrowest_play(sliding, profile, 4.0 * step, 1.0);
            const auto certified = [&](double r) {
                ForceBounds bounds = sliding;
                bounds.hysteresis_per_play = 0.1 / r;
                bounds.slope.upper += 0.1 / r;
                return certify(bounds, direct_scheme(), profile).certified();
            };
            EXPECT_TRUE(certified(radius)) << delay << " " << step;
            EXPECT_FALSE(certified(0.999 * radius)) << delay << " " << step;
        }
    }
    sliding.slope.upper = sliding.sliding = 1000.0;
    EXPECT_TRUE(std::isinf(narrowest_play(sliding, device(0.0), 0.0, 1.0)));
}

/// Without delay the play operator of the encoder reading is treated as exact: the slope h / r (hysteresis over play
/// radius) increases the required friction only once.
TEST(DirectLines, EncoderErrorOfHysteresisIncludesStickingOnce) {
    ForceBounds bounds;
    bounds.hysteresis = true;
    bounds.slope = {-10.0, 60.0};
    bounds.sliding = 20.0;
    bounds.hysteresis_force = {0.0, 1.0};
    bounds.hysteresis_per_play = 40.0;
    DeviceProfile profile = device(0.0, 1e-3);
    const double more = 20.0 * 1e-3 / (2.0 * 0.025);
    profile.viscous_damping = 0.5e-3 * (60.0 + more) * (1.0 + 1e-12);
    profile.coulomb_friction = (20.0 + more + 40.0) * 0.5e-3 * (1.0 + 1e-12);
    const Scheme direct = direct_scheme();
    EXPECT_TRUE(certify(bounds, direct, profile).certified());
    profile.coulomb_friction *= 0.999;
    EXPECT_FALSE(certify(bounds, direct, profile).certified());
    profile.coulomb_friction = (20.0 + 80.0) * 0.5e-3;
    // The required friction already includes h / r, so the damping needs to include only the slope 60 of the mean force
    profile.viscous_damping = 0.5e-3 * 60.0;
    EXPECT_TRUE(certify(bounds, direct, profile).certified());
    profile.coulomb_friction *= 0.99;
    EXPECT_FALSE(certify(bounds, direct, profile).certified());
    // Changes the play radius to a value smaller than half an encoder step; the required friction is then larger.
    bounds.hysteresis_per_play = bounds.hysteresis_force.upper / 0.4e-3;
    profile.coulomb_friction = (20.0 + 1.5 * bounds.hysteresis_per_play) * 0.5e-3;
    profile.viscous_damping = 10.0;
    EXPECT_FALSE(certify(bounds, direct, profile).certified());
}

/// g and h of periodic straight pieces of equal width, rendered with the play of the reading.
struct Pieces {
    std::vector<double> at_corner;

    [[nodiscard]] double at(double x) const {
        const auto count = static_cast<double>(at_corner.size());
        const double along = x / 8.0 - count * std::floor(x / 8.0 / count);  // 8 encoder steps wide
        const auto k = std::min(static_cast<std::size_t>(along), at_corner.size() - 1);
        const double next = at_corner[(k + 1) % at_corner.size()];
        return at_corner[k] + (along - static_cast<double>(k)) * (next - at_corner[k]);
    }
    [[nodiscard]] double slope(std::size_t k) const {
        return (at_corner[(k + 1) % at_corner.size()] - at_corner[k]) / 8.0;
    }
};

/// Returns the energy that a hand puts in during the second repetition of a closed motion, divided by the losses of
/// friction and damping.
double share_put_in(const Pieces& g, const Pieces& h, double r, const std::vector<double>& positions,
                    double B, double friction) {
    double work = 0.0;
    double taken = 0.0;
    double play = positions[0];
    for (std::size_t k = 0; k < 2 * positions.size(); ++k) {
        const double x = positions[k % positions.size()];
        const double d = positions[(k + 1) % positions.size()] - x;
        const double reading = std::round(x);
        play = std::clamp(play, reading - r, reading + r);
        if (k >= positions.size()) {
            work += (g.at(reading) + (reading - play) / r * h.at(reading)) * d;
            taken += B * d * d + friction * std::abs(d);
        }
    }
    return taken > 0.0 ? work / taken + 1.0 : 1.0;
}

TEST(DirectLines, NoMotionTakesEnergyOutOfAQuantisedHysteresis) {
    std::mt19937 random{3};
    std::uniform_real_distribution<double> unit{0.0, 1.0};
    std::normal_distribution<double> normal;
    int found = 0;
    for (int scene = 0; scene < 30; ++scene) {
        Pieces g{std::vector<double>(2 + static_cast<std::size_t>(scene % 3))};
        Pieces h{std::vector<double>(g.at_corner.size())};
        double mean = 0.0;
        for (std::size_t k = 0; k < g.at_corner.size(); ++k) {
            g.at_corner[k] = (scene % 2 == 0 ? 1.0 : 0.1) * unit(random);
            h.at_corner[k] = 0.5 * unit(random);
            mean += g.at_corner[k] / static_cast<double>(g.at_corner.size());
        }
        ForceBounds bounds;
        bounds.hysteresis = true;
        const double r = 0.5 + 3.0 * unit(random);
        bounds.hysteresis_force = {0.0, *std::max_element(h.at_corner.begin(), h.at_corner.end())};
        bounds.hysteresis_per_play = bounds.hysteresis_force.upper / r;
        for (std::size_t k = 0; k < g.at_corner.size(); ++k) {
            g.at_corner[k] -= mean;
        }
        for (std::size_t k = 0; k < g.at_corner.size(); ++k) {
            const double steep = std::abs(h.slope(k));
            bounds.slope =
                bounds.slope.with({g.slope(k) - steep, g.slope(k) + steep + bounds.hysteresis_per_play});
            bounds.sliding = std::max(bounds.sliding, std::abs(g.slope(k)) + steep);
        }
        DeviceProfile profile = device(0.0, 1.0);
        // Zero, because this test sets the friction from the inequality that counts h / r once
        profile.coulomb_friction = 0.0;
        const std::vector<Inequality> lines = hysteresis_inequalities(bounds, profile);
        const double B = lines[1].right / profile.period_s;
        for (const double share : {1.0, 0.5}) {
            double least = 1.0;
            for (int start = 0; start < 4; ++start) {
                std::vector<double> best(static_cast<std::size_t>(2 + 2 * start));
                for (double& x : best) {
                    x = 8.0 * unit(random);
                }
                double here = 1e9;
                double change = 2.0;
                for (int trial = 0; trial < 3000; ++trial) {
                    std::vector<double> next = best;
                    const auto one =
                        static_cast<std::size_t>(unit(random) * static_cast<double>(next.size()));
                    for (std::size_t k = 0; k < next.size(); ++k) {
                        next[k] += k == one || trial % 5 == 0 ? change * normal(random) : 0.0;
                        // Moves the handle close to a position at which the encoder count changes.
                        if (k == one && trial % 3 == 0) {
                            next[k] = std::floor(next[k]) + 0.5 + (unit(random) < 0.5 ? -1e-6 : 1e-6);
                        }
                    }
                    const double now = share_put_in(g, h, r, next, share * B, share * lines[2].right);
                    if (now < here) {
                        here = now;
                        best = next;
                        change *= 1.5;
                    } else {
                        change = std::max(1e-3, 0.97 * change);
                    }
                }
                least = std::min(least, here);
            }
            if (share == 1.0) {
                EXPECT_GE(least, -1e-9) << scene;
            } else {
                found += least < 0.0 ? 1 : 0;
            }
        }
    }
    // With half of the required damping and friction the search finds motions that take energy out
    EXPECT_GE(found, 8);
}

/// Returns bounds that differ in every number.
ForceBounds different_bounds() {
    ForceBounds bounds;
    bounds.slope = {-10.0, 60.0};
    bounds.steepest = 65.0;
    bounds.sliding = 20.0;
    bounds.mean_force = 0.003;
    bounds.force_error = 0.0005;
    bounds.hysteresis_force = {0.0, 1.0};
    bounds.hysteresis_per_play = 40.0;
    return bounds;
}

/// Returns a device whose damping and friction are far too small, with different steps, a delay and jitter.
DeviceProfile weak_device(double delay) {
    DeviceProfile profile = device(delay, 1e-4);
    profile.period_s = 0.5e-3;
    profile.delay_s = delay * profile.period_s;
    profile.jitter_s = 0.125e-3;
    profile.force_step = 0.002;
    profile.viscous_damping = 1e-5;
    profile.coulomb_friction = 1e-6;
    return profile;
}

constexpr double weak_longest_period = 0.625e-3;
constexpr double half_encoder_step = 0.5e-4;
// Half a force step, the mean force, and the force error of the program
constexpr double other_friction = 0.001 + 0.003 + 0.0005;

/// Checks id and both sides of a line about damping and of a line about friction.
void expect_sides(const std::vector<Inequality>& lines, std::size_t first, double damping, double friction) {
    ASSERT_EQ(lines.size(), first + 2);
    EXPECT_EQ(lines[first].id, "damping-hold");
    EXPECT_EQ(lines[first].left, 1e-5);
    EXPECT_NEAR(lines[first].right, damping, 1e-12 * damping);
    EXPECT_EQ(lines[first + 1].id, "friction-steps");
    EXPECT_EQ(lines[first + 1].left, 1e-6);
    EXPECT_NEAR(lines[first + 1].right, friction, 1e-12 * friction);
    for (const Inequality& line : lines) {
        EXPECT_EQ(line.basis, Basis::Proved);
        EXPECT_FALSE(line.strict);
    }
    if (first == 1) {
        EXPECT_EQ(lines[0].id, "loss-nonnegative");
        EXPECT_EQ(lines[0].right, 0.0);
    }
}

TEST(DirectLines, OfAStaticForceHaveTheSidesOfTheirFormulas) {
    const ForceBounds bounds = different_bounds();
    for (const double delay : {0.0, 0.5, 1.0}) {
        const DeviceProfile profile = weak_device(delay);
        expect_sides(direct_inequalities(bounds, profile), 0,
                     weak_longest_period * device_need(profile, {60.0, 10.0}),
                     65.0 * half_encoder_step + other_friction);
        expect_sides(direct_inequalities(bounds, profile, 3), 0,
                     weak_longest_period * predicted_need(profile, 3, {60.0, 10.0}),
                     65.0 * 1.5 * half_encoder_step + other_friction);
    }
}

TEST(DirectLines, OfHysteresisHaveTheSidesOfTheirFormulas) {
    ForceBounds bounds = different_bounds();
    bounds.hysteresis_force.lower = -0.5;
    for (const double delay : {0.0, 0.5, 1.0}) {
        DeviceProfile profile = weak_device(delay);
        const double hold = device_need(profile, {60.0, 10.0});
        expect_sides(hysteresis_inequalities(bounds, profile, 3), 1,
                     weak_longest_period * (hold + 60.0 / 2.0),
                     (1.5 * 20.0 + 2.5 * 40.0) * half_encoder_step + other_friction);
        EXPECT_EQ(hysteresis_inequalities(bounds, profile)[0].left, -0.5);
        // The play radius is 1 / 40; e = max(|g'| + |h'|) Delta / (2 r)
        const double more = 20.0 * 1e-4 / (2.0 * 0.025);
        if (delay == 0.0) {
            expect_sides(hysteresis_inequalities(bounds, profile), 1,
                         weak_longest_period * 0.5 * (60.0 + more),
                         (20.0 + more + 40.0) * half_encoder_step + other_friction);
        } else {
            expect_sides(hysteresis_inequalities(bounds, profile), 1, weak_longest_period * hold,
                         (20.0 + 80.0) * half_encoder_step + other_friction);
        }
        // A play radius of exactly half an encoder step still counts h / r once.
        bounds.hysteresis_force.upper = 40.0 * half_encoder_step;
        const double sticks = delay == 0.0 ? 40.0 + 20.0 : 80.0;
        EXPECT_NEAR(hysteresis_inequalities(bounds, profile)[2].right,
                    (20.0 + sticks) * half_encoder_step + other_friction, 1e-15);
        bounds.hysteresis_force.upper = 39.9 * half_encoder_step;
        EXPECT_NEAR(hysteresis_inequalities(bounds, profile)[2].right,
                    (20.0 + 80.0) * half_encoder_step + other_friction, 1e-15);
        bounds.hysteresis_force.upper = 1.0;
        // With sufficient friction for h / r twice, the damping needs no addition.
        profile.coulomb_friction = (20.0 + 80.0) * half_encoder_step + other_friction + 1e-12;
        EXPECT_NEAR(hysteresis_inequalities(bounds, profile)[1].right, weak_longest_period * hold, 1e-12);
    }
}

TEST(DirectLines, OfVelocityAddTheDragOfTheLongerPeriod) {
    ForceBounds bounds = different_bounds();
    bounds.drag = 0.04;
    for (const double delay : {0.0, 1.0}) {
        const DeviceProfile profile = weak_device(delay);
        expect_sides(velocity_inequalities(bounds, profile), 0,
                     weak_longest_period * device_need(profile, {60.0, 10.0}) + 1.25 * 0.04,
                     20.0 * half_encoder_step + 0.04 * 1e-4 / 0.5e-3 + other_friction);
    }
}

TEST(DirectLines, OfAMemoryHaveTheSidesOfTheirFormulas) {
    ForceBounds bounds = different_bounds();
    bounds.memory = MemoryBounds{7.0, 3.0, 2000.0, 90.0};
    const double bending = 3.0 + 1e-4 * 2000.0;
    const double rising = 60.0 + 7.0 + bending;
    const double steepest = 65.0 + 7.0 + bending;
    expect_sides(memory_inequalities(bounds, weak_device(0.0)), 0, weak_longest_period * 0.5 * rising,
                 (steepest + 7.0) * half_encoder_step + other_friction);
    DeviceProfile steady = weak_device(0.5);
    steady.jitter_s = 0.0;
    const double steady_R = 90.0 * steady.period_s;
    expect_sides(memory_inequalities(bounds, steady), 0,
                 steady.period_s * (0.5 * rising + steepest + 1.5 * steady_R),
                 (steepest + 7.0 + 2.0 * (steepest + steady_R)) * half_encoder_step + other_friction);
    const double R = 90.0 * weak_longest_period;
    for (const auto& [delay, n] : {std::pair{1.0, 2.0}, {2.0, 3.0}}) {
        expect_sides(memory_inequalities(bounds, weak_device(delay)), 0,
                     weak_longest_period * (0.5 * rising + n * steepest + (1.0 + 0.5 * n * n) * R),
                     (steepest + 7.0 + 2.0 * n * (steepest + R)) * half_encoder_step + other_friction);
    }
}

TEST(DirectLines, SamplesInADelayAreThoseThatJitterCanBringIntoIt) {
    DeviceProfile profile = device(0.0);
    profile.period_s = 0.5;
    const auto most = [&](double delay, double jitter) {
        profile.delay_s = 0.5 * delay;
        profile.jitter_s = 0.5 * jitter;
        return most_samples_in_delay(profile);
    };
    EXPECT_EQ(most(0.0, 3.0), 0.0);
    EXPECT_EQ(most(1.0, 0.0), 1.0);
    EXPECT_EQ(most(1.25, 0.0), 2.0);
    EXPECT_EQ(most(0.5, 0.25), 1.0);
    EXPECT_EQ(most(0.75, 0.25), 2.0);
    EXPECT_EQ(most(1.5, 0.25), 2.0);
    EXPECT_EQ(most(2.0, 1.0), 4.0);
}

TEST(DirectLines, WithoutEncoderStepsNeedNoFrictionAgainstThem) {
    ForceBounds bounds = different_bounds();
    bounds.steepest = std::numeric_limits<double>::infinity();
    DeviceProfile profile = weak_device(0.0);
    profile.encoder_step = 0.0;
    EXPECT_DOUBLE_EQ(direct_inequalities(bounds, profile)[1].right, other_friction);
    profile.encoder_step = 1e-300;
    EXPECT_TRUE(std::isinf(direct_inequalities(bounds, profile)[1].right));
}

TEST(DirectLines, NameTheTermsThatTheyContain) {
    ForceBounds bounds = different_bounds();
    EXPECT_EQ(direct_inequalities(bounds, weak_device(0.0))[1].formula,
              "f_c >= L Delta / 2 + Delta_F / 2 + |mean c(f)| + epsilon");
    bounds.force_error = 0.0;
    const auto formula = [&](const std::vector<Inequality>& lines, std::size_t k) {
        return lines[k].formula;
    };
    EXPECT_EQ(formula(direct_inequalities(bounds, weak_device(0.0)), 0), "b >= T M / 2");
    EXPECT_EQ(formula(direct_inequalities(bounds, weak_device(1.0)), 0), "b >= T B(M, s_, t_d)");
    EXPECT_EQ(formula(direct_inequalities(bounds, weak_device(0.0)), 1),
              "f_c >= L Delta / 2 + Delta_F / 2 + |mean c(f)|");
    EXPECT_EQ(formula(direct_inequalities(bounds, weak_device(0.0), 2), 0), "b >= T B(M, s_, m)");
    EXPECT_EQ(formula(direct_inequalities(bounds, weak_device(1.0), 2), 0), "b >= T B(M, s_, m, t_d)");
    EXPECT_EQ(formula(hysteresis_inequalities(bounds, weak_device(0.0)), 1), "b >= T (M_h + e) / 2");
    EXPECT_EQ(formula(hysteresis_inequalities(bounds, weak_device(1.0)), 1), "b >= T B(M_h, s_h, t_d)");
    EXPECT_EQ(formula(hysteresis_inequalities(bounds, weak_device(0.0), 1), 1), "b >= T (M_h + L_h) / 2");
    EXPECT_EQ(formula(hysteresis_inequalities(bounds, weak_device(1.0), 1), 1),
              "b >= T (B(M_h, s_h, t_d) + L_h / 2)");
    EXPECT_EQ(formula(velocity_inequalities(bounds, weak_device(0.0)), 0), "b >= T M / 2 + B_v T / period");
    EXPECT_EQ(formula(velocity_inequalities(bounds, weak_device(1.0)), 0),
              "b >= T B(M, s_, t_d) + B_v T / period");
    EXPECT_EQ(direct_inequalities(bounds, weak_device(0.0))[0].source,
              "Colgate and Schenkel 1997; docs/certificate.md");
    EXPECT_EQ(direct_inequalities(bounds, weak_device(0.5))[0].source, "docs/certificate.md");
    bounds.mean_force = 0.0;
    EXPECT_EQ(formula(direct_inequalities(bounds, weak_device(0.0)), 1), "f_c >= L Delta / 2 + Delta_F / 2");
    bounds.memory = MemoryBounds{};
    EXPECT_EQ(formula(memory_inequalities(bounds, weak_device(0.0)), 0), "b >= T (M_g + K (P^2 + U P')) / 2");
    EXPECT_EQ(formula(memory_inequalities(bounds, weak_device(1.0)), 0),
              "b >= T (M / 2 + n L + (1 + n^2 / 2) R)");
    EXPECT_EQ(formula(memory_inequalities(bounds, weak_device(0.0)), 1),
              "f_c >= (L_g + K (2 P^2 + U P')) Delta / 2 + Delta_F / 2");
    EXPECT_EQ(formula(memory_inequalities(bounds, weak_device(1.0)), 1),
              "f_c >= (L_g + K (2 P^2 + U P') + 2 n (L + R)) Delta / 2 + Delta_F / 2");
    EXPECT_EQ(memory_inequalities(bounds, weak_device(0.0))[0].name, "viscous damping against hold");
    EXPECT_EQ(memory_inequalities(bounds, weak_device(1.0))[0].name,
              "viscous damping against hold and delay");
}

TEST(DirectLines, FollowTheKindOfTheForce) {
    const DeviceProfile profile = weak_device(0.0);
    const auto count_and_first = [&](const ForceBounds& bounds, int predict) {
        Scheme scheme = direct_scheme();
        scheme.predict = predict;
        const std::vector<Inequality> lines = inequalities(DirectStructure{}, bounds, scheme, profile);
        return std::pair{lines.size(), lines[0].formula};
    };
    ForceBounds bounds = different_bounds();
    EXPECT_EQ(count_and_first(bounds, 0), (std::pair<std::size_t, std::string>{2, "b >= T M / 2"}));
    EXPECT_EQ(count_and_first(bounds, 2), (std::pair<std::size_t, std::string>{2, "b >= T B(M, s_, m)"}));
    bounds.hysteresis = true;
    EXPECT_EQ(count_and_first(bounds, 0), (std::pair<std::size_t, std::string>{3, "min h >= 0"}));
    EXPECT_EQ(count_and_first(bounds, 2), (std::pair<std::size_t, std::string>{3, "min h >= 0"}));
    bounds.hysteresis = false;
    bounds.memory = MemoryBounds{};
    EXPECT_EQ(count_and_first(bounds, 0).second, "b >= T (M_g + K (P^2 + U P')) / 2");
    bounds.drag = 1e-9;
    EXPECT_EQ(count_and_first(bounds, 0),
              (std::pair<std::size_t, std::string>{2, "b >= T M / 2 + B_v T / period"}));
    Scheme scheme = direct_scheme();
    scheme.predict = 1;
    const std::vector<Inequality> lines = inequalities(DirectStructure{}, bounds, scheme, profile);
    ASSERT_EQ(lines.size(), 3U);
    EXPECT_EQ(lines[2].id, "velocity-prediction");
    EXPECT_EQ(lines[2].basis, Basis::None);
    EXPECT_EQ(lines[2].left, 0.0);
    EXPECT_EQ(lines[2].right, 1e-9);
}

/// Returns a soft spring with one slow branch of stiffness 4, for which the need of damping is known.
ForceModel relaxing_model() {
    MemoryParameters memory;
    memory.stiffness = {4.0};
    memory.time_constant_s = {1e3};
    return ForceModel{{1, {}, {}, {}, {0.5}, 0.0}, {{0.0}, {1.0}, {}, {}, {}}}.with_memory(memory);
}

TEST(MemoryLines, CountTheSlopeOfASuddenMotion) {
    const DeviceProfile profile = device(0.0, 1e-3);
    const Certificate certificate = certify(relaxing_model(), direct_scheme(), profile);
    ASSERT_EQ(certificate.inequalities.size(), 2U);
    EXPECT_NEAR(certificate.inequalities[0].right, 4.5 * profile.period_s / 2.0, 1e-12);
    EXPECT_NEAR(certificate.inequalities[1].right, 8.5 * 1e-3 / 2.0 + 0.5 * profile.force_step, 1e-12);
    EXPECT_TRUE(certificate.certified());
    const Certificate late = certify(relaxing_model(), direct_scheme(), device(2.0));
    EXPECT_NEAR(late.inequalities[0].right,
                profile.period_s * (4.5 / 2.0 + 2.0 * 4.5 + 3.0 * 4.0 * profile.period_s / 1e3), 1e-12);
}

TEST(MemoryLines, JitterCanBringOneMoreSampleIntoTheDelay) {
    DeviceProfile profile = device(2.0);
    profile.jitter_s = 1e-9;
    EXPECT_EQ(most_samples_in_delay(device(2.0)), 2.0);
    EXPECT_EQ(most_samples_in_delay(profile), 3.0);
    EXPECT_EQ(most_samples_in_delay(device(0.0)), 0.0);
}

// A handle that moves between two positions in every sample takes energy out at less than the required damping.
TEST(MemoryLines, AreTightForASlowBranch) {
    const DeviceProfile profile = device(0.0);
    const double need = certify(relaxing_model(), direct_scheme(), profile).inequalities[0].right;
    const auto energy = [&](double damping) {
        AnyStructure structure = make_structure(relaxing_model(), direct_scheme(), profile.period_s, 1e9);
        structure.reset(0.0);
        double sum = 0.0;
        double x = 0.0;
        for (int k = 0; k < 200; ++k) {
            const double d = (k % 2 == 0 ? 1.0 : -1.0) * 0.1;
            sum += structure.step(x).force * d + damping / profile.period_s * d * d;
            x += d;
        }
        return sum;
    };
    EXPECT_GE(energy(need), 0.0);
    EXPECT_LT(energy(0.99 * need), -1e-3);
}

TEST(MemoryLines, RefuseEverythingButDirectRendering) {
    const auto refusal = [](const Scheme& scheme) {
        return test::refusal([&] { (void)certify(relaxing_model(), scheme, device(0.0)); });
    };
    for (const StructureKind kind : {StructureKind::Massless, StructureKind::Implicit,
                                     StructureKind::Explicit, StructureKind::EnergyConsistent}) {
        Scheme scheme;
        scheme.structure = kind;
        EXPECT_NE(refusal(scheme).find("must be direct: only the direct structure"), std::string::npos);
    }
    Scheme predicted = direct_scheme();
    predicted.predict = 2;
    EXPECT_EQ(refusal(predicted), "predict is 2, must be 0 for a force with memory");
}

}  // namespace
}  // namespace palpate
