// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/stability/certificate.hpp"
#include "palpate/stability/renderable_slopes.hpp"

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
        return with_structure(relaxing_model(), direct_scheme(), profile.period_s, 1e9, [&](auto structure) {
            structure.reset(0.0);
            double sum = 0.0;
            double x = 0.0;
            for (int k = 0; k < 200; ++k) {
                const double d = (k % 2 == 0 ? 1.0 : -1.0) * 0.1;
                sum += structure.step(x).force * d + damping / profile.period_s * d * d;
                x += d;
            }
            return sum;
        });
    };
    EXPECT_GE(energy(need), 0.0);
    EXPECT_LT(energy(0.99 * need), -1e-3);
}

TEST(MemoryLines, RefuseEverythingButDirectRendering) {
    const auto refusal = [](const Scheme& scheme) -> std::string {
        try {
            (void)certify(relaxing_model(), scheme, device(0.0));
        } catch (const std::invalid_argument& error) {
            return error.what();
        }
        return "";
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
