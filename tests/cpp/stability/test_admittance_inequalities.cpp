// SPDX-License-Identifier: Apache-2.0
#include "palpate/stability/admittance_inequalities.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <random>

#include <gtest/gtest.h>

#include "admittance/displays.hpp"
#include "admittance/scenes.hpp"
#include "palpate/stability/certificate.hpp"
#include "palpate/stability/certificate_check.hpp"
#include "palpate/stability/explicit_inequalities.hpp"
#include "support.hpp"

namespace palpate::admittance_tests {
namespace {

DeviceProfile display(double period_s, double delay, std::optional<double> bandwidth_hz,
                      std::optional<double> damping, double stiffness, double hand_damping) {
    DeviceProfile device;
    device.position_unit = "m";
    device.period_s = period_s;
    device.delay_s = delay * period_s;
    device.admittance = AdmittanceDisplay{.hand_stiffness = stiffness,
                                          .hand_damping = hand_damping,
                                          .servo_bandwidth_hz = bandwidth_hz,
                                          .servo_damping = damping};
    return device;
}

ForceBounds slopes(double lower, double upper) {
    ForceBounds bounds;
    bounds.slope = {lower, upper};
    bounds.steepest = bounds.sliding = bounds.slope.largest();
    return bounds;
}

Scheme scheme_of(StructureKind structure, Inertia object) {
    Scheme scheme;
    scheme.structure = structure;
    scheme.coupling = {0.0, 0.0};
    scheme.inertia = object;
    return scheme;
}

// The closed form k_h (t_d + lag) + s T / 2, and k_h (t_d + T / 2) without lag; it neglects w T^2 / 12 of the lag.
TEST(AdmittanceInequalities, NeededDampingIsTheClosedFormForSlowMotion) {
    constexpr double k = 5e3, s = 3e3, T = 1e-3;
    const double w = 2.0 * std::numbers::pi * 20.0;
    const Inertia heavy{10.0, 0.0};
    for (const double delay : {0.0, 1.0, 2.0}) {
        const auto needed = [&](std::optional<double> bandwidth, std::optional<double> damping) {
            return needed_object_damping(StructureKind::Implicit, slopes(-s, s), heavy,
                                         display(T, delay, bandwidth, damping, k, 0.0));
        };
        EXPECT_NEAR(needed({}, {}), k * (delay + 0.5) * T + 0.5 * s * T, 1e-4);
        EXPECT_NEAR(needed(20.0, {}), k * (delay * T + 1.0 / w) + 0.5 * s * T, k * w * T * T / 12.0 * 1.01);
        EXPECT_NEAR(needed(20.0, 0.8), k * (delay * T + 1.6 / w) + 0.5 * s * T, k * w * T * T / 12.0 * 1.01);
    }
}

// Golden values, computed once from the sums of 20 000 samples of the step response, at 4096 frequencies.
TEST(AdmittanceInequalities, NeededDampingOfPedalsAndRobots) {
    const auto near = [](double mass, DeviceProfile device, double lower, double upper, double implicit,
                         double explicit_need, double with_feed_forward) {
        const ForceBounds bounds = slopes(lower, upper);
        const Inertia object{mass, 0.0};
        EXPECT_NEAR(needed_object_damping(StructureKind::Implicit, bounds, object, device), implicit,
                    5e-3 * implicit);
        EXPECT_NEAR(needed_object_damping(StructureKind::Explicit, bounds, object, device), explicit_need,
                    5e-3 * explicit_need);
        device.admittance->feed_forward_s = servo_of(*device.admittance).lag_s();
        EXPECT_NEAR(needed_object_damping(StructureKind::Implicit, bounds, object, device), with_feed_forward,
                    3e-2 * with_feed_forward);
    };
    near(2.0, display(1e-3, 1, 20.0, {}, 5e3, 50.0), 0.0, 5e3, 44.8, 47.3, 5.1);
    near(2.0, display(1e-3, 1, 20.0, 0.8, 5e3, 50.0), -3e3, 9e3, 70.2, 73.2, 22.5);
    near(5.0, display(4e-3, 1, 10.0, 0.8, 5e3, 50.0), 0.0, 5e3, 147.0, 157.0, 53.0);
    near(2.0, display(2.5e-4, 1, 60.0, 0.8, 3e4, 50.0), -3e3, 9e3, 135.0, 136.0, 36.0);
    near(5.0, display(2.5e-4, 1, 60.0, 0.8, 3e4, 50.0), -3e3, 9e3, 135.0, 136.0, 15.0);
}

// An independent sum of the step response, sample by sample.
TEST(AdmittanceInequalities, NeedIsTheSumOverTheStepResponse) {
    DeviceProfile device = display(1e-3, 1.4, 30.0, 0.4, 4e3, 30.0);
    device.admittance->hand_mass = 0.2;
    device.admittance->feed_forward_s = 3e-3;
    const AdmittanceNeed need{device, 100.0};
    const double w = 2.0 * std::numbers::pi * 30.0, damped = w * std::sqrt(1.0 - 0.16);
    const auto response = [&](double t, int derivative) {  // of 1 - sigma, derivatives by differences
        const auto value = [&](double at) {
            return at <= 0.0 ? 1.0
                             : std::exp(-0.4 * w * at) *
                                   (std::cos(damped * at) + 0.4 * w / damped * std::sin(damped * at));
        };
        constexpr double h = 1e-6;
        return derivative == 0   ? value(t)
               : derivative == 1 ? (value(t + h) - value(t - h)) / (2.0 * h)
                                 : (value(t + h) - 2.0 * value(t) + value(t - h)) / (h * h);
    };
    for (const double theta : {0.0, 0.1, 1.0, 2.0, 3.14159}) {
        double sums[3] = {0.5, 0.0, 0.0};
        for (int j = 1; j < 2000; ++j) {
            for (int d = 0; d < 3; ++d) {
                const auto sample = [&](int at) {
                    return at <= 0 ? (d == 0 ? 1.0 : 0.0) : response(1e-3 * at - 1.4e-3, d);
                };
                // The command is ahead by 3 periods of the last step
                const double ahead = sample(j) + 3.0 * (sample(j) - sample(j - 1));
                sums[d] += ahead * std::cos(theta * j);
            }
        }
        const double expected = 100.0 + 4e3 * std::max(0.0, sums[0]) + 30.0 * std::max(0.0, sums[1]) +
                                0.2 * std::max(0.0, sums[2]);
        EXPECT_NEAR(need.at(theta), expected, 1e-3 * expected) << theta;
    }
}

TEST(AdmittanceInequalities, LargestNeedIsAboveEverySampleAndNearTheLargest) {
    std::mt19937_64 random{7};
    for (int k = 0; k < test::cases(50, 200); ++k) {
        const bench::Scene scene = bench::random_scene(random, 1.0);
        const AdmittanceNeed need{scene.device, step_slope(scene.structure, scene.object.bounds())};
        const double T = scene.device.period_s;
        const double inertial = dissipating_inertia(scene.structure, scene.inertia, T);
        double sampled = 0.0;
        for (int j = 0; j <= 20'000; ++j) {
            const double theta = std::numbers::pi * j / 20'000;
            sampled = std::max(sampled, need.at(theta) - inertial * (1.0 - std::cos(theta)));
        }
        const double proved = need.largest(inertial);
        EXPECT_GE(proved, sampled * (1.0 - 1e-12));
        EXPECT_LE(proved, sampled * (1.0 + 1e-4) + 1e-5 * scene.device.admittance->hand_stiffness);
    }
}

TEST(AdmittanceInequalities, MusclesTakeNoEnergyOutOfACertifiedDisplay) {
    std::mt19937_64 random{11};
    for (int k = 0; k < test::cases(25, 100); ++k) {
        const bench::Scene scene = bench::random_scene(random, 1.0);
        for (const auto muscles :
             {bench::Muscles::Noise, bench::Muscles::Sine, bench::Muscles::AgainstMotion}) {
            const bench::Taken taken = bench::take(scene, muscles, 2000, random);
            EXPECT_LE(taken.energy, taken.allowed) << "scene " << k;
        }
    }
}

TEST(AdmittanceInequalities, MusclesTakeEnergyOutWithNineTenthsOfTheDamping) {
    std::mt19937_64 random{13};
    int taken_out = 0;
    for (int k = 0; k < 100; ++k) {
        const bench::Scene scene = bench::random_scene(random, 0.9);
        const bench::Taken taken = bench::take(scene, bench::Muscles::Sine, 4000, random);
        taken_out += taken.energy > taken.allowed ? 1 : 0;
    }
    EXPECT_GE(taken_out, 3);
}

TEST(AdmittanceInequalities, ClutchComesToRestWithTheCertifiedDampingAndOscillatesWithLess) {
    EXPECT_LT(bench::clutch_oscillation(1.0), 1e-6);
    EXPECT_GT(bench::clutch_oscillation(0.8), 1e-3);
}

TEST(AdmittanceInequalities, ImplicitStepGivesNoEnergyToAMassBetweenTwoStops) {
    const auto implicit = [](bench::TwoStops object) {
        return Implicit{object, {1.0, 0.0}, {0.0, 0.0}, 1.0};
    };
    const auto explicit_step = [](bench::TwoStops object) {
        return Explicit{object, {1.0, 0.0}, {0.0, 0.0}, 1.0};
    };
    for (const double step : {0.1, 0.5, 1.0, 3.5}) {
        EXPECT_LE(bench::energy_gain(step, 20, implicit), 1.0 + 1e-9);
        EXPECT_GT(bench::energy_gain(step, 20, explicit_step), 1.1);
    }
}

TEST(AdmittanceInequalities, ChosenObjectIsCertifiedAndLessDampingIsNot) {
    std::mt19937_64 random{5};
    for (int k = 0; k < test::cases(8, 30); ++k) {
        const bench::Scene scene = bench::random_scene(random, 1.0);
        const ForceBounds bounds = scene.object.bounds();
        for (const StructureKind kind :
             {StructureKind::Implicit, StructureKind::Explicit, StructureKind::EnergyConsistent}) {
            Inertia object = admittance_object(kind, bounds, {0.0, 0.0}, scene.device);
            EXPECT_TRUE(certify(bounds, scheme_of(kind, object), scene.device).certified());
            object.damping *= 0.999;
            EXPECT_EQ(certify(bounds, scheme_of(kind, object), scene.device).verdict, Verdict::Refused);
        }
    }
}

TEST(AdmittanceInequalities, StiffestHandIsTheLimitOfTheCertificate) {
    DeviceProfile device = display(2.5e-4, 1, 60.0, 0.8, 3e4, 50.0);
    const ForceBounds bounds = slopes(-3e3, 9e3);
    const Scheme scheme = scheme_of(StructureKind::Implicit, {2.0, 60.0});
    EXPECT_EQ(certify(bounds, scheme, device).verdict, Verdict::Refused);
    const double stiffest = stiffest_hand(bounds, scheme, device);
    device.admittance->hand_stiffness = stiffest;
    EXPECT_TRUE(certify(bounds, scheme, device).certified());
    device.admittance->hand_stiffness = 1.001 * stiffest;
    EXPECT_FALSE(certify(bounds, scheme, device).certified());
    EXPECT_EQ(stiffest_hand(bounds, scheme_of(StructureKind::Implicit, {2.0, 0.0}), device), 0.0);
}

TEST(AdmittanceInequalities, CasesWithoutProofAreRefused) {
    const DeviceProfile device = display(1e-3, 1, 20.0, {}, 5e3, 50.0);
    const ForceBounds bounds = slopes(0.0, 5e3);
    const Scheme scheme = scheme_of(StructureKind::Implicit, {2.0, 100.0});
    const auto refused = [](const ForceBounds& force, const Scheme& with, const DeviceProfile& on) {
        return certify(force, with, on).verdict == Verdict::Refused;
    };
    EXPECT_FALSE(refused(bounds, scheme, device));
    DeviceProfile late = device;
    late.jitter_s = 1e-5;
    EXPECT_TRUE(refused(bounds, scheme, late));
    Scheme coupled = scheme;
    coupled.coupling = {100.0, 0.0};
    EXPECT_TRUE(refused(bounds, coupled, device));
    EXPECT_TRUE(refused(bounds, scheme_of(StructureKind::Direct, {2.0, 100.0}), device));
    ForceBounds turning = bounds;
    turning.mean_force = 0.1;
    EXPECT_TRUE(refused(turning, scheme, device));
    ForceBounds inexact = bounds;
    inexact.force_error = 1e-6;
    EXPECT_TRUE(refused(inexact, scheme, device));
    // Enough damping, but the load line has several solutions
    const DeviceProfile free = display(1e-3, 1, {}, {}, 0.0, 0.0);
    const ForceBounds falling = slopes(-4e6, 0.0);
    EXPECT_TRUE(refused(falling, scheme_of(StructureKind::Implicit, {1e-9, 2400.0}), free));
    EXPECT_FALSE(refused(falling, scheme_of(StructureKind::Implicit, {2.0, 2400.0}), free));
    DeviceProfile applies_force = device;
    applies_force.admittance.reset();
    applies_force.viscous_damping = 1e3;
    EXPECT_TRUE(refused(bounds, scheme, applies_force));
    DeviceProfile endless = device;
    endless.admittance->servo_damping = 1e-9;
    EXPECT_TRUE(refused(bounds, scheme, endless));
    DeviceProfile wrong = device;
    wrong.admittance->hand_stiffness = std::numeric_limits<double>::quiet_NaN();
    EXPECT_TRUE(refused(bounds, scheme, wrong));
}

TEST(AdmittanceInequalities, CertificateIsForOneHandAndServo) {
    const DeviceProfile device = display(1e-3, 1, 20.0, {}, 5e3, 50.0);
    DeviceProfile stiffer = device;
    stiffer.admittance->hand_stiffness = 6e3;
    EXPECT_EQ(device_difference(device, device), "");
    EXPECT_NE(device_difference(device, stiffer), "");
    stiffer.admittance.reset();
    EXPECT_NE(device_difference(device, stiffer), "");
    EXPECT_NE(device_difference(stiffer, device), "");
}

}  // namespace
}  // namespace palpate::admittance_tests
