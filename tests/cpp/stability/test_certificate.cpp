// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/stability/certificate.hpp"
#include "palpate/stability/coupled_inequalities.hpp"
#include "palpate/stability/coupling_need.hpp"
#include "palpate/stability/direct_inequalities.hpp"
#include "palpate/stability/explicit_inequalities.hpp"
#include "palpate/stability/renderable_slopes.hpp"
#include "slopes.hpp"
#include "support.hpp"

namespace palpate {
namespace {

using test::slopes;

/// Returns a device without encoder steps and command steps.
DeviceProfile smooth(double viscous_damping, int delay_samples = 0) {
    DeviceProfile device;
    device.viscous_damping = viscous_damping;
    device.encoder_step = 0.0;
    device.delay_s = delay_samples * device.period_s;
    return device;
}

Scheme scheme_of(StructureKind structure, VirtualCoupling coupling = {}, Inertia inertia = {}) {
    Scheme scheme;
    scheme.structure = structure;
    scheme.coupling = coupling;
    scheme.inertia = inertia;
    return scheme;
}

constexpr std::array<StructureKind, 3> coupled{StructureKind::Massless, StructureKind::Implicit,
                                               StructureKind::EnergyConsistent};

TEST(Certificate, DirectNeedsHalfAPeriodOfTheSlopeAndTheDelayInFull) {
    // A slope of 62 N*m/rad at a period of 1 ms needs a damping of 0.031 N*m*s/rad, and 0.062 more for each sample of
    // delay. Falling slopes of -15 N*m/rad need no additional damping.
    EXPECT_TRUE(certify(slopes(-15.0, 62.0), scheme_of(StructureKind::Direct), smooth(0.031)).certified());
    EXPECT_FALSE(certify(slopes(-15.0, 62.0), scheme_of(StructureKind::Direct), smooth(0.0309)).certified());
    EXPECT_TRUE(
        certify(slopes(-15.0, 62.0), scheme_of(StructureKind::Direct), smooth(0.0931, 1)).certified());
    EXPECT_FALSE(
        certify(slopes(-15.0, 62.0), scheme_of(StructureKind::Direct), smooth(0.0929, 1)).certified());
}

/// Returns the device damping, divided by T M, that direct rendering with a prediction needs; T is the period, M = 62
/// N*m/rad the steepest slope.
double predicted_share(double falling, int predict, double delay_samples = 0.0) {
    Scheme scheme = scheme_of(StructureKind::Direct);
    scheme.predict = predict;
    DeviceProfile device = smooth(1.0);
    device.delay_s = delay_samples * device.period_s;
    return inequalities_of(slopes(-62.0 * falling, 62.0), scheme, device)[0].right / 0.062;
}

TEST(Certificate, PredictionFromMoreSamplesNeedsLessDamping) {
    for (const auto& [predict, share, linear] :
         {std::tuple{1, 1.00, 1.0}, {2, 0.77, 0.75}, {4, 0.66, 0.625}, {8, 0.60, 0.5625}}) {
        EXPECT_NEAR(predicted_share(1.0, predict), share, 0.005) << predict;
        EXPECT_GE(predicted_share(1.0, predict), linear) << "a spring needs that much";
        EXPECT_LE(predicted_share(1.0, predict), 1.06 * linear) << predict;
    }
    for (const double falling : {0.0, 1.0, 3.0}) {
        for (int predict = 1; predict <= most_prediction_taps; ++predict) {
            EXPECT_LE(predicted_share(falling, predict), 1.0 + 1e-12) << predict << ": R(1/2), s <= 3 M";
            EXPECT_GT(predicted_share(falling, predict), 0.5) << predict << ": more than without";
        }
    }
}

TEST(Certificate, PredictionOfALateForceCanNeedLessDampingThanNoPrediction) {
    // With the prediction filter Q = z^-1 - z^-2 / 2 a spring of stiffness K needs a damping of 1.25 T K instead of
    // 1.5 T K.
    EXPECT_NEAR(predicted_share(0.0, 1, 1.0), 1.299, 0.001);
    EXPECT_NEAR(predicted_share(1.0, 1, 1.0), 1.414, 0.001);
    EXPECT_NEAR(predicted_share(0.0, 1, 2.0), 2.000, 0.001);
    // The damping that a delay of a fraction of a sample requires lies between the dampings that the next smaller and
    // the next larger whole delay require.
    for (const int predict : {1, 4}) {
        double before = predicted_share(0.0, predict, 1.0);
        for (const double delay : {1.02, 1.25, 1.5, 1.75, 1.98, 2.0}) {
            const double now = predicted_share(0.0, predict, delay);
            EXPECT_GE(now, before * (1.0 - 1e-6)) << predict << " " << delay;
            before = now;
        }
    }
}

TEST(Certificate, JitterOfALateDeviceRaisesTheNeedOfAPredictionContinuously) {
    const SlopeRange slope{62.0, 80.0};
    for (const double delay : {0.3e-3, 1.0e-3, 1.3e-3, 2.0e-3}) {
        for (const int predict : {1, 4}) {
            DeviceProfile device = smooth(10.0);
            device.delay_s = delay;
            const double steady = device.period_s * predicted_need(device, predict, slope);
            double before = steady;
            for (const double jitter : {1e-12, 1e-6, 1e-5, 1e-4, 3e-4}) {
                device.jitter_s = jitter;
                const double now = device.longest_period_s() * predicted_need(device, predict, slope);
                const double most = device.longest_period_s() * (device_need(device, slope) + 0.5 * 80.0);
                EXPECT_LE(now, most) << delay << " " << predict << " " << jitter;
                EXPECT_GE(now, before * (1.0 - 2e-4)) << delay << " " << predict << " " << jitter;
                before = now;
            }
            device.jitter_s = 1e-12;
            EXPECT_NEAR(device.longest_period_s() * predicted_need(device, predict, slope), steady,
                        1e-3 * steady);
        }
    }
}

TEST(Certificate, PredictionRaisesTheErrorOfTheEncoder) {
    // Prediction from m samples increases the required friction: it is the slope times half an encoder step times (m +
    // 3) / (m + 1), which is 2 at m = 1 and 7/5 at m = 4.
    Scheme scheme = scheme_of(StructureKind::Direct);
    DeviceProfile device = smooth(10.0);
    device.encoder_step = 1e-3;
    device.force_step = 2e-3;
    for (const auto& [predict, gain] : {std::pair{1, 2.0}, {4, 1.4}, {16, 19.0 / 17.0}}) {
        scheme.predict = predict;
        device.coulomb_friction = gain * 62.0 * 0.5e-3 + 1e-3;
        EXPECT_TRUE(certify(slopes(-15.0, 62.0), scheme, device).certified()) << predict;
        device.coulomb_friction *= 0.999;
        EXPECT_FALSE(certify(slopes(-15.0, 62.0), scheme, device).certified()) << predict;
    }
}

TEST(Certificate, PredictionWithHysteresisNeedsHalfOfTheSteepestSlopeMore) {
    ForceBounds play = slopes(-15.0, 62.0);
    play.hysteresis = true;
    play.hysteresis_force = {0.0, 0.1};
    play.sliding = 22.0;
    play.hysteresis_per_play = 40.0;
    Scheme scheme = scheme_of(StructureKind::Direct);
    scheme.predict = 1;
    EXPECT_TRUE(certify(play, scheme, smooth(0.06201)).certified()) << "T (M_h + L_h) / 2";
    EXPECT_FALSE(certify(play, scheme, smooth(0.06199)).certified());
    scheme.predict = 16;
    EXPECT_FALSE(certify(play, scheme, smooth(0.06199)).certified()) << "the same for every m";
    // The play operator has the position error of one reading; the predicted position x_hat has an error of (m + 3) /
    // (m + 1) readings for m samples.
    scheme.predict = 1;
    DeviceProfile device = smooth(1.0);
    device.encoder_step = 1e-3;
    device.coulomb_friction = (2.0 * 22.0 + 3.0 * 40.0) * 0.5e-3;
    EXPECT_TRUE(certify(play, scheme, device).certified());
    device.coulomb_friction *= 0.999;
    EXPECT_FALSE(certify(play, scheme, device).certified());
}

TEST(Certificate, PredictionOfAForceOfVelocityIsRefused) {
    ForceBounds moving = slopes(0.0, 10.0);
    moving.drag = 0.01;
    Scheme scheme = scheme_of(StructureKind::Direct);
    EXPECT_TRUE(certify(moving, scheme, smooth(1.0)).certified());
    scheme.predict = 1;
    const Certificate refused = certify(moving, scheme, smooth(1.0));
    EXPECT_EQ(refused.verdict, Verdict::Refused);
    EXPECT_EQ(refused.reason.rfind("no bound is known", 0), 0U) << refused.reason;
}

TEST(Certificate, AFallingForceNeedsDampingOnlyWithDelay) {
    EXPECT_TRUE(certify(slopes(-62.0, 0.0), scheme_of(StructureKind::Direct), smooth(0.0)).certified());
    // With one sample of delay a falling slope needs a damping of half a period times this slope.
    EXPECT_TRUE(certify(slopes(-62.0, 0.0), scheme_of(StructureKind::Direct), smooth(0.0311, 1)).certified());
    EXPECT_FALSE(
        certify(slopes(-62.0, 0.0), scheme_of(StructureKind::Direct), smooth(0.0309, 1)).certified());
}

TEST(Certificate, FrictionMustExceedHalfAStepOfEncoderAndForce) {
    DeviceProfile device = smooth(1.0);
    device.encoder_step = 1e-3;
    device.force_step = 2e-3;
    device.coulomb_friction = 62.0 * 0.5e-3 + 1e-3;
    EXPECT_TRUE(certify(slopes(-15.0, 62.0), scheme_of(StructureKind::Direct), device).certified());
    device.coulomb_friction *= 0.999;
    EXPECT_FALSE(certify(slopes(-15.0, 62.0), scheme_of(StructureKind::Direct), device).certified());
}

TEST(Certificate, BehindACouplingTheNeedIsThatOfTheCoupling) {
    for (const StructureKind structure : coupled) {
        const Scheme scheme = scheme_of(structure, {100.0, 0.02}, {0.001, 0.0});
        for (const double steepest : {1.0, 1e6}) {
            EXPECT_TRUE(certify(slopes(0.0, steepest), scheme, smooth(0.07)).certified());
            EXPECT_FALSE(certify(slopes(0.0, steepest), scheme, smooth(0.0699)).certified());
        }
    }
}

TEST(Certificate, MasslessWithoutDampingIsAStaticForceOfTheSeriesSlope) {
    // Slope of model and coupling in series: K_c f' / (K_c + f') = 100 * 300 / 400 = 75.
    const Scheme scheme = scheme_of(StructureKind::Massless, {100.0, 0.0});
    EXPECT_TRUE(certify(slopes(0.0, 300.0), scheme, smooth(0.0376)).certified());
    EXPECT_FALSE(certify(slopes(0.0, 300.0), scheme, smooth(0.0374)).certified());
    // In series with the coupling a falling slope of -50 becomes steeper: -100. With a sample of delay this slope
    // needs a damping of half a period times the slope.
    EXPECT_TRUE(certify(slopes(-50.0, 0.0), scheme, smooth(0.0501, 1)).certified());
    EXPECT_FALSE(certify(slopes(-50.0, 0.0), scheme, smooth(0.0499, 1)).certified());
    EXPECT_FALSE(certify(slopes(-100.0, 0.0), scheme, smooth(10.0)).certified());
}

TEST(Certificate, CompensationCancelsTheCoupling) {
    // With coupling damping B_c = 0 the compensated massless structure gives the same force as direct rendering. Its
    // inequalities are therefore those of direct rendering, after one more: the load line has a unique solution.
    Scheme scheme = scheme_of(StructureKind::Massless, {100.0, 0.0});
    scheme.compensated = true;
    DeviceProfile device = smooth(0.06, 1);
    device.encoder_step = 1e-4;
    const Certificate compensated = certify(slopes(-15.0, 62.0), scheme, device);
    const Certificate direct = certify(slopes(-15.0, 62.0), scheme_of(StructureKind::Direct), device);
    ASSERT_EQ(compensated.inequalities.size(), direct.inequalities.size() + 1);
    for (std::size_t k = 0; k < direct.inequalities.size(); ++k) {
        EXPECT_NEAR(compensated.inequalities[k + 1].right, direct.inequalities[k].right, 1e-12);
    }
    EXPECT_EQ(certify(slopes(0.0, 100.0), scheme, smooth(10.0)).verdict, Verdict::Refused) << "f' = K_c";
}

TEST(Certificate, CouplingAndDampingLimitTheFallingSlope) {
    // Massless structure: the absolute value s_ of the steepest falling slope must be less than K_c + B_c / T = 120.
    const Scheme massless = scheme_of(StructureKind::Massless, {100.0, 0.02});
    EXPECT_TRUE(certify(slopes(-119.9, 5.0), massless, smooth(1.0)).certified());
    EXPECT_FALSE(certify(slopes(-120.1, 5.0), massless, smooth(1.0)).certified());
    // With object mass and a force limit the steepest falling slope s_ must be at most 2 B_o / T = 400, for any
    // coupling and mass. The energy-consistent structure is certified for any slope.
    for (const double mass : {0.01, 1.0}) {
        const Scheme implicit = scheme_of(StructureKind::Implicit, {100.0, 0.02}, {mass, 0.2});
        EXPECT_TRUE(certify(slopes(-399.9, 5.0), implicit, smooth(1.0)).certified());
        const Certificate refused = certify(slopes(-400.1, 5.0), implicit, smooth(1.0));
        EXPECT_EQ(refused.verdict, Verdict::Refused);
        EXPECT_EQ(refused.reason,
                  "no bound is known: slope of a falling force with object mass and force limit: "
                  "proved only for s_ <= 2 B_o / T = 400, but the value is 400.1; use the energy-consistent "
                  "structure");
    }
    const Scheme consistent = scheme_of(StructureKind::EnergyConsistent, {100.0, 0.02}, {0.01, 0.2});
    EXPECT_TRUE(certify(slopes(-5000.0, 5.0), consistent, smooth(1.0)).certified());
}

// Required: "Falling slopes with mass and limit fail", for s = 0.31 K_c, m = 7 K_c T^2, B_o = 0. The
// test ForceLimit.DoesNotKeepAFallingForceWithMassFromGivingEnergy contains a motion that takes energy out.
TEST(Certificate, RefusesAFallingObjectThatGivesEnergyAtAForceLimit) {
    const Scheme scheme = scheme_of(StructureKind::Implicit, {100.0, 0.0}, {7.0 * 100.0 * 1e-6, 0.0});
    EXPECT_EQ(certify(slopes(-31.0, 0.0), scheme, smooth(1.0)).verdict, Verdict::Refused);
    EXPECT_TRUE(certify(slopes(0.0, 31.0), scheme, smooth(1.0)).certified());
}

TEST(Certificate, WithoutAForceLimitTheCouplingLimitsTheFallingSlopeOfAMass) {
    DeviceProfile device = smooth(0.07);
    device.force_limit = std::numeric_limits<double>::infinity();
    const Scheme implicit = scheme_of(StructureKind::Implicit, {100.0, 0.02}, {0.01, 0.2});
    EXPECT_TRUE(certify(slopes(-519.9, 5.0), implicit, device).certified());
    EXPECT_FALSE(certify(slopes(-520.1, 5.0), implicit, device).certified());
}

TEST(Certificate, RefusesAStepWithoutACertainSolution) {
    // While the coupling force is at the force limit, the object moves independently of the handle. With falling slope
    // s_, m/T^2 + B_o/T > s_ gives exactly one solution; 2 m/T^2 + B_o/T > s_/2 gives at least one solution.
    const Scheme implicit = scheme_of(StructureKind::Implicit, {1e4, 0.0}, {1e-4, 0.2});
    EXPECT_TRUE(certify(slopes(-299.0, 5.0), implicit, smooth(10.0)).certified());
    EXPECT_FALSE(certify(slopes(-301.0, 5.0), implicit, smooth(10.0)).certified());
    const Scheme consistent = scheme_of(StructureKind::EnergyConsistent, {1e4, 0.0}, {1e-4, 0.2});
    EXPECT_TRUE(certify(slopes(-799.0, 5.0), consistent, smooth(10.0)).certified());
    EXPECT_FALSE(certify(slopes(-801.0, 5.0), consistent, smooth(10.0)).certified());
}

TEST(Certificate, ReportsCasesWithoutAKnownBound) {
    DeviceProfile stepped = smooth(1.0);
    stepped.encoder_step = 1e-5;
    stepped.coulomb_friction = 1.0;
    const auto unknown = [](const Certificate& certificate) {
        EXPECT_EQ(certificate.verdict, Verdict::Refused);
        EXPECT_EQ(certificate.reason.rfind("no bound is known", 0), 0U) << certificate.reason;
    };
    for (const StructureKind structure : {StructureKind::Implicit, StructureKind::EnergyConsistent}) {
        unknown(certify(slopes(0.0, 10.0), scheme_of(structure), stepped));
    }
    const Scheme massless = scheme_of(StructureKind::Massless, {100.0, 0.02});
    EXPECT_TRUE(certify(slopes(-99.0, 10.0), massless, stepped).certified());
    unknown(certify(slopes(-100.0, 10.0), massless, stepped));
    EXPECT_TRUE(certify(slopes(-1.0, 10.0), massless, smooth(10.0, 1)).certified());
    ForceBounds play = slopes(0.0, 10.0);
    play.hysteresis = true;
    play.hysteresis_force = {0.0, 1.0};
    unknown(certify(play, massless, stepped));
    EXPECT_TRUE(certify(play, massless, smooth(1.0)).certified());
}

TEST(Certificate, TheGainOfTheEncoderIsTheLargestOfBothEnds) {
    // Ratio of the force change to the position change by an encoder step, for K_c = 100, B_c / T = 20, load line slope
    // p = 120: 300 (120 + 20) / 420 = 100 at the force slope 300; 80 (120 + 80) / 40 = 400 at -80.
    EXPECT_NEAR(massless_gain(slopes(0.0, 300.0), {100.0, 0.02}, 1e-3), 100.0, 1e-9);
    EXPECT_NEAR(massless_gain(slopes(-80.0, 300.0), {100.0, 0.02}, 1e-3), 400.0, 1e-9);
}

/// Returns the least B at one frequency for which this form is never negative, with a the motion in the first part of a
/// sample, tau of it:
///
///     A |u|^2 - Re[(H_n (d - a)* + H_{n+1} a*) u] + B (|a|^2 / tau + |d - a|^2 / (1 - tau)).
double need_at(double theta, VirtualCoupling coupling, int whole, double fraction) {
    const std::complex<double> late = std::polar(1.0, -theta);
    const double damping = coupling.damping / 1e-3;
    const auto side = [&](int n) {
        std::complex<double> sum = damping * (1.0 - std::pow(late, n + 1));
        for (int j = 0; j <= n; ++j) {
            sum += coupling.stiffness * std::pow(late, j);
        }
        return std::norm(sum);
    };
    return ((1.0 - fraction) * side(whole) + fraction * side(whole + 1)) /
           (4.0 * (0.5 * coupling.stiffness + damping));
}

TEST(Certificate, DelayedNeedAgreesWithAFineScanAndIsNeverBelow) {
    for (const VirtualCoupling coupling : {VirtualCoupling{100.0, 0.02}, {100.0, 0.0}, {1.0, 1.0}}) {
        for (const int delay : {0, 1, 2, 5}) {
            for (const double fraction : {0.0, 0.4}) {
                double largest = 0.0;
                for (int k = 0; k <= 20'003; ++k) {
                    for (int n = 0; n <= delay; ++n) {
                        const double rest = n == delay ? fraction : 0.0;
                        largest = std::max({largest, need_at(std::numbers::pi * k / 20'003, coupling, n, 0.0),
                                            need_at(std::numbers::pi * k / 20'003, coupling, n, rest)});
                    }
                }
                const double need = coupling_need(coupling, 1e-3, delay, fraction);
                EXPECT_GE(need, largest * (1.0 - 1e-12));
                EXPECT_LE(need, largest * (1.0 + 4e-6));
            }
        }
    }
}

// Required damping B of a force with the falling slope s behind a coupling: with B >= s/2 + |H - s|^2 / (4 (A - s/2))
// the form A |u|^2 - Re(H u d*) - (s/2) |d - u|^2 + B |d|^2 is never negative.
TEST(Certificate, NeedOfAFallingForceMakesEveryFormNonNegative) {
    test::Random random{17};
    for (int draw = 0; draw < test::cases(300); ++draw) {
        const VirtualCoupling coupling{100.0, test::uniform(random, 0.0, 0.2)};
        const double damping = coupling.damping / 1e-3;
        const double falling = test::uniform(random, 0.0, 0.99) * (100.0 + damping);
        const int whole = static_cast<int>(random() % 4);
        const double need = coupling_need(coupling, 1e-3, whole, 0.0, falling);
        double least = 1e300;
        double size = 0.0;
        for (int k = 0; k <= 2000; ++k) {
            const std::complex<double> late = std::polar(1.0, -std::numbers::pi * k / 2000);
            std::complex<double> side = damping * (1.0 - std::pow(late, whole + 1));
            for (int j = 0; j <= whole; ++j) {
                side += 100.0 * std::pow(late, j);
            }
            const double first = 50.0 + damping - 0.5 * falling;
            const double determinant = first * (need - 0.5 * falling) - 0.25 * std::norm(side - falling);
            least = std::min(least, determinant);
            size = std::max(size, std::abs(first * need));
        }
        EXPECT_GE(least, -1e-12 * size);
        EXPECT_LE(least, 1e-4 * size + (whole == 0 ? 1e300 : 0.0)) << "the need is not too large";
    }
}

TEST(Certificate, StiffestCouplingIsJustCertified) {
    for (const bool mass : {false, true}) {
        for (const double delay_s : {0.0, 0.4e-3, 1e-3, 2.3e-3}) {
            DeviceProfile device = smooth(0.1);
            device.delay_s = delay_s;
            const double stiffness = stiffest_coupling(0.01, mass ? 0.0 : 5.0, device, 0.9);
            ASSERT_GT(stiffness, 1.0);
            device.viscous_damping = 0.09;
            const auto certified = [&](double K) {
                return certify(slopes(mass ? 0.0 : -5.0, 30.0),
                               scheme_of(mass ? StructureKind::Implicit : StructureKind::Massless, {K, 0.01},
                                         {0.001, 0.0}),
                               device)
                    .certified();
            };
            EXPECT_TRUE(certified((1.0 - 1e-9) * stiffness)) << delay_s;
            EXPECT_FALSE(certified(1.001 * stiffness)) << delay_s;
        }
    }
    EXPECT_EQ(stiffest_coupling(1.0, 0.0, smooth(0.1), 0.9), 0.0) << "its damping alone is too much";
}

TEST(ExplicitScheme, IsStableWithTheStiffestCouplingAndThenTheLeastDamping) {
    const auto holds = [](const ForceBounds& bounds, Scheme scheme, VirtualCoupling coupling,
                          const DeviceProfile& device) {
        scheme.coupling = coupling;
        return all_hold(inequalities_of(bounds, scheme, device));
    };
    test::Random random{23};
    int stable = 0;
    for (int draw = 0; draw < test::cases(20); ++draw) {
        const ForceBounds bounds =
            slopes(-test::uniform(random, 0.0, 5.0), std::exp(test::uniform(random, 0.0, 5.0)));
        const DeviceProfile device = smooth(std::exp(test::uniform(random, -4.0, 0.0)));
        const Scheme chosen = explicit_scheme(bounds, device, {});
        if (!holds(bounds, chosen, chosen.coupling, device)) {
            continue;  // `explicit_scheme` found no scheme that satisfies all inequalities
        }
        ++stable;
        EXPECT_LE(chosen.coupling.stiffness, 0.9 * stiffest_coupling(0.0, 0.0, device));
        SchemeChoices given;
        given.coupling_stiffness = chosen.coupling.stiffness;
        given.mass = chosen.inertia.mass;
        const Scheme again = explicit_scheme(bounds, device, given);
        EXPECT_EQ(again.coupling.stiffness, chosen.coupling.stiffness);
        EXPECT_EQ(again.inertia.mass, chosen.inertia.mass);
        EXPECT_TRUE(holds(bounds, again, again.coupling, device));
        EXPECT_LE(again.inertia.damping, chosen.inertia.damping * (1.0 + 1e-12));
        given.object_damping = 0.9 * again.inertia.damping;
        EXPECT_EQ(explicit_scheme(bounds, device, given).inertia.damping, *given.object_damping);
    }
    EXPECT_GT(stable, 5);
}

// Encoder steps Delta require the friction f_c >= ||g||_1 Delta / 2, where ||g||_1 is the sum of the absolute impulse
// response g. For 300 objects the bound is 1.000 to 1.009 times the computed sum.
TEST(Certificate, GainOfAMassIsTheSumOfTheImpulseResponse) {
    test::Random random{19};
    for (int draw = 0; draw < test::cases(300); ++draw) {
        const double T = test::uniform(random, 3e-4, 2e-3);
        const double stiffness = std::exp(test::uniform(random, 0.0, 7.0));
        const VirtualCoupling coupling{std::exp(test::uniform(random, 2.0, 6.0)),
                                       random() % 3 == 0 ? 0.0 : test::uniform(random, 0.0, 0.2)};
        const Inertia inertia{std::exp(test::uniform(random, -10.0, -4.0)),
                              random() % 3 == 0 ? 0.0 : test::uniform(random, 0.0, 0.1)};
        Implicit structure{test::Spring{stiffness}, inertia, coupling, T};
        structure.reset(0.0);
        double sum = 0.0;
        double recent = 0.0;
        for (int k = 0; k < 200'000; ++k) {
            const double force = std::abs(structure.step(k == 0 ? 1.0 : 0.0).force);
            sum += force;
            recent = std::max(0.99 * recent, force);
            if (k > 100 && recent < 1e-10 * sum) {
                break;
            }
        }
        const double gain = implicit_gain(stiffness, inertia, coupling, T);
        EXPECT_GE(gain, sum * (1.0 - 1e-6)) << draw;
        EXPECT_LE(gain, sum * 1.0101) << draw;
    }
}

TEST(Certificate, EncoderStepsOnASpringWithMassNeedFrictionIfThereIsNoForceLimit) {
    DeviceProfile device = smooth(1.0);
    device.encoder_step = 1e-4;
    const Scheme scheme = scheme_of(StructureKind::Implicit, {100.0, 0.02}, {0.001, 0.05});
    device.coulomb_friction = 1.0;
    EXPECT_FALSE(certify(slopes(30.0, 30.0), scheme, device).certified());
    device.force_limit = std::numeric_limits<double>::infinity();
    device.coulomb_friction = 0.5e-4 * implicit_gain(30.0, scheme.inertia, scheme.coupling, 1e-3);
    EXPECT_TRUE(certify(slopes(30.0, 30.0), scheme, device).certified());
    device.coulomb_friction *= 0.999;
    EXPECT_FALSE(certify(slopes(30.0, 30.0), scheme, device).certified());
    device.coulomb_friction = 1.0;
    EXPECT_FALSE(certify(slopes(29.9, 30.0), scheme, device).certified()) << "not linear";
}

TEST(Certificate, WithoutDelayTheNeedIsTheHeldCoupling) {
    EXPECT_DOUBLE_EQ(1e-3 * coupling_need({100.0, 0.02}, 1e-3, 0), 0.07);
}

TEST(Certificate, ExplicitNeedAgreesWithTheReference) {
    const auto need = [](double slope) {
        return explicit_need({slope, slope}, {0.001, 0.5}, {100.0, 0.02}, 1e-3, 0);
    };
    EXPECT_NEAR(need(2.0), 0.0734, 5e-5);
    EXPECT_NEAR(need(1000.0), 0.0753, 5e-5);
    EXPECT_NEAR(need(2800.0), 0.2333, 5e-5);
    EXPECT_GE(explicit_need({2.0, 2800.0}, {0.001, 0.5}, {100.0, 0.02}, 1e-3, 0), need(2800.0));
}

TEST(Certificate, TheExplicitStructureIsAtMostStable) {
    const Scheme scheme = scheme_of(StructureKind::Explicit, {100.0, 0.02}, {0.001, 0.5});
    // Explicit structure: force slope plus coupling stiffness must be less than (4 m - 2 (B_o + B_c) T) / T^2 = 2960;
    // the coupling stiffness is 100.
    const Certificate below = certify(slopes(2.0, 2800.0), scheme, smooth(0.24));
    EXPECT_EQ(below.verdict, Verdict::StableLocally) << below.reason;
    for (const Inequality& line : below.inequalities) {
        EXPECT_EQ(line.basis, Basis::Linear);
    }
    EXPECT_EQ(certify(slopes(2.0, 2800.0), scheme, smooth(0.23)).verdict, Verdict::Refused);
    EXPECT_EQ(certify(slopes(2.0, 2861.0), scheme, smooth(100.0)).verdict, Verdict::Refused);
    EXPECT_EQ(certify(slopes(-101.0, 2.0), scheme, smooth(100.0)).verdict, Verdict::Refused);
    EXPECT_EQ(certify(slopes(2.0, 3.0), scheme_of(StructureKind::Explicit, {100.0, 0.02}, {1e-4, 0.5}),
                      smooth(100.0))
                  .verdict,
              Verdict::Refused)
        << "B_o T > 2 m";
}

TEST(Certificate, ComparisonSceneIsCertifiedForNoCoupledStructure) {
    // Slopes from -15.2 to 62 N*m/rad on the default device: damping b = 0.06, friction f_c = 0, 65536 encoder counts
    // per revolution.
    const ForceBounds scene = slopes(-15.2, 62.0);
    for (const StructureKind structure : {StructureKind::Massless, StructureKind::Implicit,
                                          StructureKind::EnergyConsistent, StructureKind::Explicit}) {
        EXPECT_EQ(certify(scene, scheme_of(structure, {100.0, 0.02}), {}).verdict, Verdict::Refused);
        EXPECT_EQ(certify(scene, scheme_of(structure, {100.0, 0.02}), smooth(0.06)).verdict,
                  Verdict::Refused);
    }
    Scheme compensated = scheme_of(StructureKind::Massless, {100.0, 0.005});
    compensated.compensated = true;
    EXPECT_EQ(certify(scene, compensated, {}).verdict, Verdict::Refused) << "f_c = 0";
    EXPECT_TRUE(certify(scene, compensated, smooth(0.06)).certified());
}

TEST(Certificate, IncludesTheWholeDragOfVelocity) {
    ForceBounds bounds = slopes(-30.0, 20.0);
    bounds.drag = 0.04;
    const DeviceProfile device = smooth(0.05);
    EXPECT_TRUE(velocity_inequalities(bounds, device)[0].holds());
    bounds.drag = 0.0401;
    EXPECT_FALSE(velocity_inequalities(bounds, device)[0].holds());
    bounds.drag = 0.04;
    DeviceProfile stepped = device;
    stepped.encoder_step = 1e-4;
    stepped.coulomb_friction = 30.0 * 0.5e-4 + 0.04 * 1e-4 / 1e-3;
    EXPECT_TRUE(velocity_inequalities(bounds, stepped)[1].holds());
    stepped.coulomb_friction *= 0.999;
    EXPECT_FALSE(velocity_inequalities(bounds, stepped)[1].holds());
}

TEST(Certificate, HysteresisIncludesStickingAndRequiresANonNegativeSign) {
    ForceBounds bounds = slopes(-10.0, 60.0);
    bounds.hysteresis = true;
    bounds.sliding = 20.0;
    bounds.hysteresis_force = {0.0, 1.0};
    bounds.hysteresis_per_play = 40.0;
    EXPECT_TRUE(certify(bounds, scheme_of(StructureKind::Direct), smooth(0.03)).certified());
    EXPECT_FALSE(certify(bounds, scheme_of(StructureKind::Direct), smooth(0.0299)).certified());
    DeviceProfile stepped = smooth(0.03);
    stepped.encoder_step = 1e-3;
    stepped.coulomb_friction = (20.0 + 2.0 * 40.0) * 0.5e-3;
    EXPECT_TRUE(certify(bounds, scheme_of(StructureKind::Direct), stepped).certified());
    stepped.coulomb_friction *= 0.999;
    EXPECT_FALSE(certify(bounds, scheme_of(StructureKind::Direct), stepped).certified());
    bounds.hysteresis_force.lower = -1e-9;
    for (const StructureKind structure :
         {StructureKind::Direct, StructureKind::Massless, StructureKind::Implicit}) {
        const Certificate refused = certify(bounds, scheme_of(structure), smooth(10.0));
        EXPECT_NE(refused.reason.find("min h >= 0"), std::string::npos) << refused.reason;
    }
}

TEST(Certificate, RefusesNumbersThatAreNotFinite) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const double infinite = std::numeric_limits<double>::infinity();
    for (const double wrong : {nan, infinite}) {
        for (const StructureKind structure :
             {StructureKind::Direct, StructureKind::Massless, StructureKind::Explicit}) {
            ForceBounds bounds = slopes(0.0, 10.0);
            bounds.slope.upper = wrong;
            bounds.steepest = wrong;
            Scheme scheme = scheme_of(structure, {100.0, structure == StructureKind::Massless ? 0.0 : 0.02});
            const Certificate refused = certify(bounds, scheme, smooth(10.0));
            EXPECT_EQ(refused.verdict, Verdict::Refused);
            EXPECT_EQ(refused.fingerprint, fingerprint_of(refused));
        }
    }
}

TEST(Certificate, LongestPeriodIsJustCertified) {
    for (const Scheme& scheme :
         {scheme_of(StructureKind::Direct), scheme_of(StructureKind::Massless, {20.0, 0.01}),
          scheme_of(StructureKind::Implicit, {20.0, 0.01}, {0.001, 0.02})}) {
        for (const int delay : {0, 2}) {
            const double lowest = delay > 0 && scheme.structure != StructureKind::Direct ? 0.0 : -5.0;
            DeviceProfile device = smooth(0.2, delay);
            const Certificate certificate = certify(slopes(lowest, 30.0), scheme, device);
            ASSERT_TRUE(certificate.certified()) << certificate.reason;
            device.jitter_s = 0.9999 * certificate.longest_period_s - device.period_s;
            EXPECT_TRUE(certify(slopes(lowest, 30.0), scheme, device).certified());
            device.jitter_s = 1.0001 * certificate.longest_period_s - device.period_s;
            EXPECT_FALSE(certify(slopes(lowest, 30.0), scheme, device).certified());
        }
    }
}

TEST(ForceBounds, HoldEverySlopeOfEveryPathContinuationIncluded) {
    test::Random random{7};
    for (int draw = 0; draw < test::cases(20); ++draw) {
        const NetworkParameters network = test::random_network(random, 1 + draw % 8);
        const Domain domain = test::unit_domain(draw % 2 == 0 ? Continuation::Free : Continuation::Linear,
                                                draw % 3 == 0 ? Continuation::Free : Continuation::Linear);
        const ForceModel single{network, domain};
        const ForceBounds bounds = force_bounds(single);
        for (int k = 0; k < 2000; ++k) {
            const double slope = single.network()->at(test::uniform(random, -1.0, 2.0), {}).slope;
            ASSERT_GE(slope, bounds.slope.lower);
            ASSERT_LE(slope, bounds.slope.upper);
        }
        NetworkParameters half = network;
        HysteresisParameters hysteresis{half.weight, test::uniform(random, 0.0, 0.1), 3.0};
        const double radius = test::uniform(random, 0.005, 0.05);
        const ForceModel pair{network, hysteresis, domain, radius};
        const ForceBounds both = force_bounds(pair);
        auto state = pair.hysteresis()->start(0.5);
        for (int k = 0; k < 2000; ++k) {
            const double x = test::uniform(random, -1.0, 2.0);
            pair.hysteresis()->advance(x, state);
            const double near = x + test::uniform(random, -1.0, 1.0) * radius;
            const double slope = pair.hysteresis()->at(near, state).slope;
            ASSERT_GE(slope, both.slope.lower);
            ASSERT_LE(slope, both.slope.upper);
            ASSERT_GE(pair.hysteresis()->hysteresis_force().at(x).value, both.hysteresis_force.lower);
            ASSERT_LE(pair.hysteresis()->hysteresis_force().at(x).value, both.hysteresis_force.upper);
        }
    }
}

TEST(ForceBounds, HoldEverySlopeOfAForceOfVelocityContinuationIncluded) {
    test::Random random{8};
    for (int draw = 0; draw < test::cases(20); ++draw) {
        const NetworkParameters network = test::random_network(random, draw % 8, 2);
        const double slowest = draw % 3 == 0 ? 0.2 : -1.0;  // data without rest
        const ForceModel model =
            ForceModel::of_velocity(network, {{0.0, slowest}, {1.0, 1.0}, {}, {}, std::nullopt});
        const ForceBounds bounds = force_bounds(model);
        const VelocityNetwork& f = *model.velocity();
        const double rounding = 1e-11;
        for (int k = 0; k < 2000; ++k) {
            const double x = test::uniform(random, -1.0, 2.0);
            const double moved = x + 1e-3 * test::uniform(random, 0.0, 1.0);
            const double v = test::uniform(random, -3.0, 3.0);
            const double at_rest = f.force(moved, 0.0) - f.force(x, 0.0);
            ASSERT_GE(at_rest, bounds.slope.lower * (moved - x) - rounding);
            ASSERT_LE(at_rest, bounds.slope.upper * (moved - x) + rounding);
            ASSERT_LE(std::abs(f.force(moved, v) - f.force(x, v)), bounds.sliding * (moved - x) + rounding);
            ASSERT_LE(std::abs(f.force(x, v) - f.force(x, 0.0)), bounds.drag * std::abs(v) + rounding);
        }
    }
}

// The certificate is refused if no bound of the required damping is known: force of velocity behind a coupling.
TEST(Certificate, OfAForceOfVelocityIsRefusedBehindACoupling) {
    ForceBounds bounds = slopes(0.0, 1.0);
    for (const StructureKind kind : {StructureKind::Massless, StructureKind::Implicit,
                                     StructureKind::EnergyConsistent, StructureKind::Explicit}) {
        bounds.drag = 0.0;
        EXPECT_NE(certify(bounds, scheme_of(kind, {100.0, 0.02}, {0.001, 0.5}), smooth(10.0)).verdict,
                  Verdict::Refused);
        bounds.drag = 1e-3;
        const Certificate refused =
            certify(bounds, scheme_of(kind, {100.0, 0.02}, {0.001, 0.5}), smooth(10.0));
        EXPECT_EQ(refused.verdict, Verdict::Refused);
        EXPECT_NE(refused.reason.find("no bound is known"), std::string::npos) << refused.reason;
    }
    EXPECT_TRUE(certify(bounds, scheme_of(StructureKind::Direct), smooth(10.0)).certified());
    bounds.drag = 10.0;
    EXPECT_FALSE(certify(bounds, scheme_of(StructureKind::Direct), smooth(10.0)).certified());
}

TEST(ForceBounds, MeanForceOfAPeriodicModelNeedsFriction) {
    Domain turn{{0.0}, {1.0}, Continuation::Linear, Continuation::Linear, 1.0};
    NetworkParameters cogging;
    cogging.alpha = {12.0, 12.0};
    cogging.beta = {0.3, 0.7};
    cogging.weight = {0.1, -0.1};
    const ForceModel balanced{cogging, turn};
    cogging.bias = 0.02;
    const ForceModel motor{cogging, turn};
    EXPECT_NEAR(force_bounds(balanced).mean_force, 0.0, 1e-9);
    EXPECT_NEAR(force_bounds(motor).mean_force, 0.02, 1e-9);
    DeviceProfile device = smooth(10.0);
    device.coulomb_friction = 0.01;
    EXPECT_FALSE(certify(motor, scheme_of(StructureKind::Direct), device).certified());
    device.coulomb_friction = 0.0201;
    EXPECT_TRUE(certify(motor, scheme_of(StructureKind::Direct), device).certified());
}

TEST(ForceBounds, AMassBehindACouplingUsesTheMeanOfTheUnlimitedForce) {
    // Force of a narrow peak plus a constant: its mean is 0, but the mean of the limited force is not 0.
    NetworkParameters peak;
    peak.alpha = {12.0};
    peak.beta = {0.5};
    peak.weight = {1.0};
    const Domain turn{{0.0}, {1.0}, Continuation::Linear, Continuation::Linear, 1.0};
    peak.bias = passive_shift(ForceModel{peak, turn}, std::numeric_limits<double>::infinity());
    const ForceModel model{peak, turn};
    DeviceProfile device = smooth(10.0);
    device.force_limit = 0.3;
    const auto mean = [&](StructureKind kind) {
        return rendered_bounds(model, scheme_of(kind), device).mean_force;
    };
    EXPECT_GT(mean(StructureKind::Direct), 1e-3);
    EXPECT_EQ(mean(StructureKind::Massless), mean(StructureKind::Direct));
    EXPECT_EQ(mean(StructureKind::Implicit), 0.0);
    // Hysteresis dissipates at least the energy that a non-zero mean force gives, except in the energy-consistent
    // structure.
    peak.bias += 0.01;
    const ForceModel pair{peak, {{0.0}, 0.0, 0.05}, turn, 0.01};
    const auto of_pair = [&](StructureKind kind) {
        return rendered_bounds(pair, scheme_of(kind), smooth(10.0)).mean_force;
    };
    EXPECT_EQ(of_pair(StructureKind::Implicit), 0.0);
    EXPECT_NEAR(of_pair(StructureKind::EnergyConsistent), 0.01, 1e-9);
}

/// Returns the certificate of a force behind a coupling on a device with different numbers.
Certificate some_certificate(StructureKind kind) {
    DeviceProfile device = smooth(1.0, 1);
    device.jitter_s = 1e-5;
    device.renderer = "device";
    ForceBounds bounds = slopes(-3.0, 20.0);
    bounds.hysteresis = true;
    bounds.hysteresis_force = {0.1, 0.2};
    bounds.hysteresis_per_play = 4.0;
    Certificate certificate = certify(bounds, scheme_of(kind, {100.0, 0.02}, {0.001, 0.02}), device);
    certificate.model = "model";
    return certificate;
}

TEST(Fingerprint, OfACertificateChangesWithEveryStoredField) {
    const Certificate certificate = some_certificate(StructureKind::EnergyConsistent);
    const std::string before = fingerprint_of(certificate);
    EXPECT_EQ(before.size(), 16U);
    EXPECT_EQ(before.find_first_not_of("0123456789abcdef"), std::string::npos);
    const auto changed = [&](auto change) {
        Certificate other = certificate;
        change(other);
        return fingerprint_of(other) != before;
    };
    EXPECT_FALSE(changed([](Certificate&) {}));
    EXPECT_TRUE(changed([](Certificate& c) { c.model = "x"; }));
    EXPECT_TRUE(changed([](Certificate& c) { c.verdict = Verdict::StableLocally; }));
    EXPECT_TRUE(changed([](Certificate& c) { c.longest_period_s *= 2.0; }));
    EXPECT_TRUE(changed([](Certificate& c) { c.scheme.structure = StructureKind::Implicit; }));
    EXPECT_TRUE(changed([](Certificate& c) { c.scheme.coupling.stiffness += 1.0; }));
    EXPECT_TRUE(changed([](Certificate& c) { c.scheme.inertia.mass += 1.0; }));
    EXPECT_TRUE(changed([](Certificate& c) { c.scheme.compensated = true; }));
    EXPECT_TRUE(changed([](Certificate& c) { c.device.delay_s += 1e-5; }));
    EXPECT_TRUE(changed([](Certificate& c) { c.device.id = "x"; }));
    EXPECT_TRUE(changed([](Certificate& c) { c.device.renderer.reset(); }));
    EXPECT_TRUE(changed([](Certificate& c) { c.device.on_device = OnDevice{}; }));
    EXPECT_TRUE(changed([](Certificate& c) { c.bounds.slope.lower -= 1.0; }));
    EXPECT_TRUE(changed([](Certificate& c) { c.bounds.hysteresis_force.upper += 1.0; }));
    EXPECT_TRUE(changed([](Certificate& c) { c.inequalities[1].left += 1.0; }));
    EXPECT_TRUE(changed([](Certificate& c) { c.inequalities[1].right += 1.0; }));
    EXPECT_TRUE(changed([](Certificate& c) { c.inequalities[1].id = "x"; }));
    EXPECT_TRUE(changed([](Certificate& c) { c.inequalities.pop_back(); }));
    EXPECT_FALSE(changed([](Certificate& c) { c.fingerprint = "x"; }));
    EXPECT_FALSE(changed([](Certificate& c) { c.reason = "x"; }));
    EXPECT_FALSE(changed([](Certificate& c) { c.inequalities[0].name = "x"; }));
    EXPECT_FALSE(changed([](Certificate& c) { c.inequalities[0].basis = Basis::Linear; }));
    EXPECT_FALSE(changed([](Certificate& c) { c.bounds.hysteresis = false; }));
}

TEST(Fingerprint, OfACertificateIgnoresNumbersThatItsStructureDoesNotUse) {
    for (const StructureKind kind :
         {StructureKind::Direct, StructureKind::Massless, StructureKind::Implicit}) {
        const Certificate certificate = some_certificate(kind);
        Certificate other = certificate;
        other.scheme.coupling.stiffness += 1.0;
        EXPECT_EQ(fingerprint_of(other) == fingerprint_of(certificate), kind == StructureKind::Direct);
        other = certificate;
        other.scheme.inertia.damping += 1.0;
        EXPECT_EQ(fingerprint_of(other) == fingerprint_of(certificate), kind != StructureKind::Implicit);
    }
}

TEST(Fingerprint, ChecksumOfADeviceChangesWithItsNumbersAndNames) {
    const DeviceProfile device = smooth(0.1);
    const std::uint32_t before = checksum(device);
    EXPECT_EQ(checksum(device), before);
    const auto changed = [&](auto change) {
        DeviceProfile other = device;
        change(other);
        return checksum(other) != before;
    };
    EXPECT_TRUE(changed([](DeviceProfile& d) { d.id = "x"; }));
    EXPECT_TRUE(changed([](DeviceProfile& d) { d.position_unit = "m"; }));
    EXPECT_TRUE(changed([](DeviceProfile& d) { d.jitter_s = 1e-9; }));
    EXPECT_TRUE(changed([](DeviceProfile& d) { d.viscous_damping = std::nextafter(0.1, 1.0); }));
    EXPECT_TRUE(changed([](DeviceProfile& d) { d.renderer = "device"; }));
    EXPECT_TRUE(changed([](DeviceProfile& d) { d.on_device = OnDevice{}; }));
}

/// Returns the longest period up to 100 times the longest period of the device for which a certificate holds, by
/// bisection.
double bisected_period(const ForceBounds& bounds, const Scheme& scheme, DeviceProfile device) {
    const double T = device.longest_period_s();
    const auto holds = [&](double factor) {
        DeviceProfile later = device;
        later.jitter_s = factor * T - device.period_s;
        return all_hold(inequalities_of(bounds, scheme, later));
    };
    if (holds(100.0)) {
        return 100.0 * T;
    }
    double low = 1.0;
    double high = 100.0;
    for (int k = 0; k < 50; ++k) {
        const double middle = 0.5 * (low + high);
        (holds(middle) ? low : high) = middle;
    }
    return low * T;
}

TEST(Certificate, LongestPeriodIsThatOfABisection) {
    for (const StructureKind kind : {StructureKind::Direct, StructureKind::Massless, StructureKind::Implicit,
                                     StructureKind::EnergyConsistent, StructureKind::Explicit}) {
        for (const double delay : {0.0, 0.4, 1.0}) {
            for (const auto& [b, jitter] : {std::pair{0.25, 0.0}, {0.6, 1e-4}, {5.0, 0.0}}) {
                const ForceBounds bounds =
                    slopes(delay > 0.0 && kind != StructureKind::Direct ? 0.0 : -6.0, 30.0);
                const Scheme scheme = scheme_of(kind, {20.0, 0.01}, {0.001, 0.02});
                DeviceProfile device = smooth(b);
                device.delay_s = delay * device.period_s;
                device.jitter_s = jitter;
                const Certificate certificate = certify(bounds, scheme, device);
                ASSERT_NE(certificate.verdict, Verdict::Refused) << certificate.reason;
                const double expected = bisected_period(bounds, scheme, device);
                EXPECT_NEAR(certificate.longest_period_s, expected, 1e-8 * expected)
                    << name_of(kind) << " " << delay << " " << b;
            }
        }
    }
}

// With a delay of 1.9 samples, a small jitter already raises the need of a falling force by 17 %.
TEST(Certificate, LongestPeriodEndsWhereTheNeedJumps) {
    const ForceBounds bounds = slopes(-60.0, 30.0);
    const Scheme scheme = scheme_of(StructureKind::Direct);
    for (const double delay : {0.9, 1.9}) {
        for (const double reserve : {1.01, 1.2, 1.3}) {
            DeviceProfile device = smooth(1.0);
            device.delay_s = delay * device.period_s;
            device.viscous_damping = reserve * inequalities_of(bounds, scheme, device)[0].right;
            const double expected = bisected_period(bounds, scheme, device);
            EXPECT_NEAR(certify(bounds, scheme, device).longest_period_s, expected, 1e-8 * expected)
                << delay << " " << reserve;
        }
    }
}

TEST(Certificate, LongestPeriodIsAtMostAHundredTimesThePeriod) {
    DeviceProfile device = smooth(0.03);
    device.jitter_s = 0.5e-3;
    // T M / 2 = b at the period 2 b / M
    for (const double rising : {0.0, 0.3, 0.41, 10.0, 40.0}) {
        const Certificate certificate =
            certify(slopes(0.0, rising), scheme_of(StructureKind::Direct), device);
        const double expected = rising > 0.0 ? std::min(0.06 / rising, 0.15) : 0.15;
        EXPECT_NEAR(certificate.longest_period_s, expected, 1e-11 * expected) << rising;
        EXPECT_LE(certificate.longest_period_s, expected * (1.0 + 1e-14)) << rising;
        EXPECT_TRUE(certificate.certified());
    }
    const Certificate refused = certify(slopes(0.0, 41.0), scheme_of(StructureKind::Direct), device);
    EXPECT_EQ(refused.longest_period_s, 0.0);
    // At the very limit the period itself is the longest one.
    DeviceProfile exact = smooth(0.03125);
    exact.period_s = 1.0 / 1024.0;
    const Certificate tight = certify(slopes(0.0, 64.0), scheme_of(StructureKind::Direct), exact);
    EXPECT_TRUE(tight.certified());
    EXPECT_NEAR(tight.longest_period_s, exact.period_s, 1e-12);
}

Inequality simple_line(const char* name, double left, double right, Basis basis = Basis::Proved) {
    Inequality line{"id", name, "a >= b", left, right, basis, "advice"};
    return line;
}

TEST(Certificate, TightestLineHasTheSmallestReserve) {
    EXPECT_EQ(detail::tightest({}), nullptr);
    const std::vector<Inequality> zero{simple_line("a", 0.0, -1.0)};
    EXPECT_EQ(detail::tightest(zero), nullptr);
    const std::vector<Inequality> lines{simple_line("a", 1.0, 0.5), simple_line("b", 10.0, 8.0),
                                        simple_line("c", 0.0, 0.0), simple_line("d", 4.0, 3.0),
                                        simple_line("e", 5.0, 4.0)};
    EXPECT_EQ(detail::tightest(lines)->name, "b");
}

TEST(Certificate, ReasonIsTheFirstLineThatFailsOrTheSmallestReserve) {
    const std::vector<Inequality> good{simple_line("a", 1.0, 0.5), simple_line("b", 10.0, 8.0)};
    EXPECT_EQ(detail::reason(good, Verdict::Certified),
              "every inequality is proved and holds; smallest reserve: b, 20 %");
    EXPECT_EQ(detail::reason(good, Verdict::StableLocally),
              "the linearised system is stable; energy is not accounted for; smallest reserve: b, 20 %");
    EXPECT_EQ(detail::reason({}, Verdict::Certified), "every inequality is proved and holds");
    const std::vector<Inequality> bad{simple_line("a", 1.0, 0.5), simple_line("b", 1.0, 3.0),
                                      simple_line("c", 0.0, 2.0, Basis::None)};
    EXPECT_EQ(detail::reason(bad, Verdict::Refused), "b: a >= b needs 3, there is 1, short by 2");
    EXPECT_EQ(detail::reason({bad[2], bad[1]}, Verdict::Refused),
              "no bound is known: c: a >= b, but the value is 2; advice");
}

TEST(Certificate, HoldsTheNumbersForWhichItWasComputed) {
    DeviceProfile device = smooth(1.0);
    device.on_device = OnDevice{};
    const Scheme scheme = scheme_of(StructureKind::Massless, {100.0, 0.02});
    const Certificate certificate = certify_rendered(slopes(-1.0, 20.0), scheme, device);
    EXPECT_EQ(certificate.scheme.coupling.stiffness, 100.0);
    EXPECT_EQ(certificate.device, certified_part(device, false));
    EXPECT_FALSE(certificate.device.on_device.has_value());
    EXPECT_EQ(certificate.bounds.slope.upper, 20.0);
    EXPECT_EQ(certificate.inequalities.size(), inequalities_of(slopes(-1.0, 20.0), scheme, device).size());
    EXPECT_EQ(certificate.fingerprint, fingerprint_of(certificate));
    EXPECT_EQ(certificate.model, "");
    EXPECT_TRUE(certificate.certified());
    EXPECT_FALSE(Certificate{}.certified());
    ForceBounds infinite = slopes(0.0, 1.0);
    infinite.mean_force = std::numeric_limits<double>::infinity();
    const Certificate refused = certify_rendered(infinite, scheme, device);
    EXPECT_EQ(refused.reason, "a bound of the model is not a finite number");
    EXPECT_EQ(refused.verdict, Verdict::Refused);
    infinite.mean_force = 0.0;
    infinite.drag = std::numeric_limits<double>::infinity();
    EXPECT_EQ(certify_rendered(infinite, scheme, device).verdict, Verdict::Refused);
}

TEST(Certificate, OfAnotherProgramNeedsFrictionForItsForceErrors) {
    DeviceProfile device = smooth(1.0);
    device.encoder_step = 0x1p-10;
    device.coulomb_friction = 20.0 * 0x1p-11 + 0x1p-20;
    for (const Scheme& scheme :
         {scheme_of(StructureKind::Direct), scheme_of(StructureKind::Massless, {1e6, 0.0}),
          scheme_of(StructureKind::Massless, {100.0, 0.02})}) {
        Certificate certificate = certify_rendered(slopes(0.0, 20.0), scheme, device);
        ASSERT_TRUE(certificate.certified()) << certificate.reason;
        certificate.model = "a model";
        certificate.fingerprint = "stored";
        const double needed = certificate.inequalities.back().right;
        const double reserve = certificate.inequalities.back().margin();
        const Certificate at_the_bound = with_force_error(certificate, reserve);
        EXPECT_TRUE(at_the_bound.certified()) << at_the_bound.reason;
        EXPECT_DOUBLE_EQ(at_the_bound.inequalities.back().right, needed + reserve);
        EXPECT_EQ(at_the_bound.model, "a model");
        EXPECT_EQ(at_the_bound.fingerprint, "stored");
        const Certificate beyond = with_force_error(certificate, reserve * (1.0 + 1e-9) + 1e-17);
        EXPECT_EQ(beyond.verdict, Verdict::Refused);
        EXPECT_NE(beyond.reason.find(" + epsilon"), std::string::npos) << beyond.reason;
        EXPECT_EQ(with_force_error(certificate, std::numeric_limits<double>::infinity()).verdict,
                  Verdict::Refused);
        EXPECT_EQ(with_force_error(certificate, 0.0).inequalities.back().formula,
                  certificate.inequalities.back().formula);
    }
}

TEST(Certificate, OfAModelChecksItsNumbersAndNamesTheModel) {
    const ForceModel model{NetworkParameters{1, {}, {}, {}, {20.0}, 0.0}, test::unit_domain()};
    const Certificate certificate = certify(model, scheme_of(StructureKind::Direct), smooth(1.0));
    EXPECT_EQ(certificate.model, fingerprint(model));
    EXPECT_EQ(certificate.fingerprint, fingerprint_of(certificate));
    DeviceProfile device = smooth(1.0);
    device.period_s = 0.0;
    EXPECT_THROW((void)certify(model, scheme_of(StructureKind::Direct), device), std::invalid_argument);
    Scheme scheme = scheme_of(StructureKind::Massless);
    scheme.predict = 2;
    EXPECT_THROW((void)certify(model, scheme, smooth(1.0)), std::invalid_argument);
    // Compensation of the model's slope 20 by a coupling of 100: 100 * 20 / 80
    scheme = scheme_of(StructureKind::Massless, {100.0, 0.02});
    scheme.compensated = true;
    EXPECT_NEAR(rendered_bounds(model, scheme, smooth(1.0)).slope.upper, 25.0, 0.01);
    EXPECT_NEAR(certify(model, scheme, smooth(1.0)).bounds.slope.upper, 25.0, 0.01);
    scheme.compensated = false;
    EXPECT_NEAR(rendered_bounds(model, scheme, smooth(1.0)).slope.upper, 20.0, 0.01);
    EXPECT_EQ(rendered_bounds(model, scheme_of(StructureKind::EnergyConsistent), smooth(1.0)).mean_force,
              0.0);
}

TEST(Certificate, VelocityIsRefusedWhereNoProofExists) {
    ForceBounds bounds = slopes(0.0, 10.0);
    bounds.drag = 0.5;
    const std::vector<Inequality> lines =
        inequalities_of(bounds, scheme_of(StructureKind::Massless), smooth(1.0));
    EXPECT_EQ(lines.back().id, "velocity-coupling");
    EXPECT_EQ(lines.back().left, 0.0);
    EXPECT_EQ(lines.back().right, 0.5);
    EXPECT_EQ(lines.back().basis, Basis::None);
    EXPECT_FALSE(lines.back().holds());
    bounds.drag = 0.0;
    EXPECT_NE(inequalities_of(bounds, scheme_of(StructureKind::Massless), smooth(1.0)).back().id,
              "velocity-coupling");
}

TEST(Fingerprint, ChangesWithEveryNumber) {
    test::Random random{3};
    const NetworkParameters network = test::random_network(random, 3);
    const std::string before = fingerprint(ForceModel{network, test::unit_domain()});
    EXPECT_EQ(fingerprint(ForceModel{network, test::unit_domain()}), before);
    const auto changed = [&](auto change) {
        NetworkParameters other = network;
        Domain domain = test::unit_domain();
        change(other, domain);
        return fingerprint(ForceModel{other, domain});
    };
    const auto last_bit = [](double& number) {
        number = std::nextafter(number, std::numeric_limits<double>::infinity());
    };
    EXPECT_NE(changed([&](auto& n, auto&) { last_bit(n.alpha[1]); }), before);
    EXPECT_NE(changed([&](auto& n, auto&) { last_bit(n.beta[2]); }), before);
    EXPECT_NE(changed([&](auto& n, auto&) { last_bit(n.weight[0]); }), before);
    EXPECT_NE(changed([&](auto& n, auto&) { last_bit(n.linear[0]); }), before);
    EXPECT_NE(changed([&](auto& n, auto&) { last_bit(n.bias); }), before);
    EXPECT_NE(changed([&](auto&, auto& d) { last_bit(d.upper[0]); }), before);
    EXPECT_NE(changed([&](auto&, auto& d) { d.below = Continuation::Free; }), before);
    EXPECT_NE(changed([&](auto& n, auto&) {
                  std::swap(n.alpha, n.beta);
                  for (double& a : n.alpha) {
                      a = std::abs(a) + 1;
                  }
              }),
              before);
}

}  // namespace
}  // namespace palpate
