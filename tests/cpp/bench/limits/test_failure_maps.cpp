// SPDX-License-Identifier: Apache-2.0
// Tests measured failure limits against theory: every failure is on the unsafe side of the proved bound, and an exact
// bound is reached.
#include "limits/failure_maps.hpp"
#include "limits/hands.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "simulation/scenes.hpp"
#include "support.hpp"

namespace palpate::bench {
namespace {

/// Returns the least and largest ratio of the measured limit to the theoretical limit over the given lines of a map. A
/// point at which no tried value failed has the ratio `none`.
Interval ratios(const FailureMap& map, std::size_t first, std::size_t last, double none = 1.0) {
    Interval found{1e300, -1e300};
    for (std::size_t line = first; line <= last; ++line) {
        for (std::size_t k = 0; k < map.lines[line].at.size(); ++k) {
            const double measured = map.lines[line].measured[k];
            const double ratio = std::isnan(measured) ? none : measured / map.lines[line].theory[k];
            found = {std::min(found.lower, ratio), std::max(found.upper, ratio)};
        }
    }
    return found;
}

void expect_between(const Interval& found, double least, double most) {
    EXPECT_GE(found.lower, least);
    EXPECT_LE(found.upper, most);
}

// An explicit virtual object f = K x with mass m and damping B_o, rendered without coupling at the period T, is stable
// only for 0 < K < (4m - 2 B_o T)/T^2 and B_o T < 2m.
TEST(FailureMaps, ExplicitBoundIsExactOverTwoDecadesOfMassAndDamping) {
    expect_between(ratios(explicit_map(test::cases(5)), 0, 2), 0.99, 1.01);
}

// The certificate requires the device damping b >= T M / 2 + t_d L (period T, steepest rising slope M, delay t_d,
// largest absolute slope L). With less damping a spring oscillates.
TEST(FailureMaps, SpringJustAboveItsBoundOscillatesWithAHeavyHand) {
    expect_between(ratios(damping_map(test::cases(1) > 1 ? 3 : 1), 0, 2), 1.0, 1.02);
}

// Compares a spring with the bound for every force whose slope lies between 0 and the stiffness of the spring: they
// agree within 4 %.
TEST(FailureMaps, PredictionFailsJustAboveItsBoundForEveryNumberOfSamplesAndDelay) {
    const FailureMap map = prediction_map(test::cases(2));
    expect_between(ratios(map, 0, 2), 1.0, 1.04);
    EXPECT_LE(ratios(map, 0, 0).lower, 1.001);
    for (std::size_t delay = 0; delay <= 2; ++delay) {
        EXPECT_EQ(map.lines[delay].at.front(), 1.0);
        EXPECT_EQ(map.lines[delay].at.back(), most_prediction_taps);
    }
}

TEST(FailureMaps, EncoderBoundOfAbbottAndOkamuraIsExact) {
    expect_between(ratios(encoder_map(test::cases(7)), 0, 1), 1.0, 1.01);
}

TEST(FailureMaps, SlopeOfAHysteresisIncludesSticking) {
    expect_between(ratios(play_map(test::cases(2, 4)), 0, 2), 1.0, 1.01);
}

// The largest coupling stiffness that a device damping allows is exact: with a stiffer coupling some passive virtual
// object gives energy.
TEST(FailureMaps, CouplingBoundsAreExactWithAndWithoutDelay) {
    const FailureMap map = coupling_map(1);
    expect_between(ratios(map, 0, 0), 1.0, 1.002);
    expect_between(ratios(map, 1, 1), 1.0, 1.01);
    expect_between(ratios(map, 2, 2), 1.0, 1.06);
}

// The bound of one branch counts its stiffness in full. A branch that relaxes within some samples has a margin.
TEST(FailureMaps, MemoryBoundHoldsAndIsExactForSlowBranchesWithoutDelay) {
    const FailureMap map = memory_map(test::cases(2));
    EXPECT_GE(ratios(map, 0, 2).lower, 1.0);
    EXPECT_LE(map.lines[0].measured.back() / map.lines[0].theory.back(), 1.01);
}

TEST(FailureMaps, FallingForcesDoNotFailBelowTheirBound) {
    EXPECT_GE(ratios(falling_map(test::cases(3)), 0, 1, 10.0).lower, 1.0);
}

// An object mass of 0.05 behind a coupling of stiffness 90 gives 1.99 J to the hand if the force limit 5 acts after the
// time step, and no energy if the time step includes the force limit.
TEST(FailureMaps, ForceLimitOutsideTheStepMakesAMassActiveAndInsideItDoesNot) {
    const FailureMap map = limit_map(6);
    EXPECT_LT(map.lines[0].measured.back(), -1.9);
    for (std::size_t k = 0; k < map.lines[0].at.size(); ++k) {
        EXPECT_GT(map.lines[1].measured[k], 0.0);
        EXPECT_GT(map.lines[2].measured[k], 0.0);
    }
}

// The load line with slope p crosses the model once if p + min f' > 0 (model slope f'). Fixed-point iteration converges
// to the crossing if p exceeds the largest absolute slope L.
TEST(FailureMaps, SolversFailAtTheTheoreticalBound) {
    expect_between(ratios(solver_map(3), 0, 2), 0.999, 1.001);
}

TEST(FailureMaps, BoundsAreExactForEverySampleTime) {
    expect_between(ratios(period_map(test::cases(1) > 1 ? 3 : 2), 0, 4), 0.999, 1.02);
}

// The pole (B_c/T - K/2)/(K_c + B_c/T + K/2) of the energy-consistent time step approaches -1 as the stiffness K of the
// object increases (coupling K_c and B_c, period T).
TEST(FailureMaps, EnergyConsistentStepOscillatesAndTheSwitchedOneDoesNot) {
    const FailureMap map = pole_map(7);
    for (std::size_t k = 0; k < map.lines[0].at.size(); ++k) {
        EXPECT_NEAR(map.lines[0].measured[k], map.lines[0].theory[k], 1e-6);
        EXPECT_NEAR(map.lines[2].measured[k], map.lines[2].theory[k], 1e-6);
        EXPECT_GE(map.lines[1].measured[k], 0.0);
    }
    EXPECT_LT(map.lines[0].measured.back(), -0.99);
}

TEST(FailureMaps, GuardsStopTheLimitCycleOfATooStiffWall) {
    const FailureMap map = guard_map(8);
    for (std::size_t k = 0; k < map.lines[0].at.size(); ++k) {
        const double without = map.lines[0].measured[k];
        const double share = map.lines[0].at[k];
        for (std::size_t guarded = 1; guarded < map.lines.size(); ++guarded) {
            if (share < 1.0) {
                EXPECT_EQ(map.lines[guarded].measured[k], without) << "a guard acts where nothing is wrong";
            } else if (share > 1.5) {
                EXPECT_LT(map.lines[guarded].measured[k], 0.05 * without)
                    << map.lines[guarded].name << " " << share;
            }
        }
    }
}

/// Returns the map of hands, computed once for all tests.
const FailureMap& hands() {
    static const FailureMap map = hand_map(3);
    return map;
}

// The device damping that the certificate requires is valid for every passive hand. A heavy hand needs all of this
// damping, a light hand almost all.
TEST(FailureMaps, BoundSlackIsSmallForALightHandAndLargeForADampingHand) {
    const FailureMap& map = hands();
    for (std::size_t delay = 0; delay <= 2; ++delay) {
        const FailureLine& line = map.lines[delay];
        EXPECT_GE(line.measured.front(), 1.04 * line.theory.front()) << line.name;
        expect_between(ratios(map, delay, delay), 1.0, 1.12);
        EXPECT_LE(line.measured.back(), 1.001 * line.theory.back()) << line.name;
    }
    expect_between(ratios(map, 3, 3), 2.0, 2.3);
}

// A heavy hand oscillates slowly, so the delay of the force matters little: the damping that the hand needs is far
// below the bound.
TEST(FailureMaps, HeavyHandAllows18TimesTheStiffnessWithAPrediction) {
    const FailureMap& map = hands();
    const FailureLine& plain = map.lines[0];
    const FailureLine& predicted = map.lines[4];
    EXPECT_EQ(predicted.name, "delay 0, predict 4");
    EXPECT_GE(predicted.measured[1], 2.0 * plain.measured[1]) << "1e-3 kg*m^2";
    EXPECT_NEAR(predicted.measured[2] / plain.measured[2], 18.3, 0.5) << "0.1 kg*m^2";
}

// Encoder steps Delta require the Coulomb friction f_c >= gamma Delta/2 of a massless structure with the gain gamma.
// Without coupling damping gamma is the slope L' of model and coupling in series.
TEST(FailureMaps, EncoderBoundOfACouplingIsExactWithoutADamperAndSufficientWithOne) {
    const FailureMap map = coupled_encoder_map(test::cases(3));
    expect_between(ratios(map, 0, 0, 10.0), 1.0, 1.01);
    EXPECT_GE(ratios(map, 1, 2, 10.0).lower, 1.0);
}

TEST(FailureMaps, PrintNullForABoundWithoutTheory) {
    const nlohmann::ordered_json printed = nlohmann::ordered_json::parse(as_json(pole_map(2)).dump());
    EXPECT_EQ(printed["name"], "pole");
    EXPECT_EQ(printed["lines"][0]["at"], (nlohmann::ordered_json{1.0, 1e5}));
    EXPECT_TRUE(printed["lines"][0]["theory"][0].is_number());
    EXPECT_EQ(printed["lines"][1]["theory"], (nlohmann::ordered_json{nullptr, nullptr}));
}

TEST(FailureMaps, ArePublishedInTheirOrder) {
    std::ifstream file{PALPATE_SOURCE_DIR "/docs/figures/failure-maps.json"};
    const nlohmann::ordered_json published = nlohmann::ordered_json::parse(file);
    ASSERT_EQ(published["maps"].size(), failure_maps.size());
    for (std::size_t k = 0; k < failure_maps.size(); ++k) {
        EXPECT_EQ(published["maps"][k]["name"], failure_maps[k].name);
    }
}

TEST(Guards, ChangeForcesByAtMostTwoPercentAndHalveFaults) {
    for (const GuardEffect& effect : guard_effects()) {
        EXPECT_LE(effect.cost, 0.02) << effect.guard;
        EXPECT_LE(effect.with, 0.5 * effect.without) << effect.guard << ": " << effect.wrong;
    }
}

/// Returns true if a closed motion of a hand, with or without sliding of the play operator, takes more energy out of a
/// model than the model stored.
bool generates(const ForceModel& model, const DeviceProfile& device) {
    constexpr std::size_t ticks = 3000;
    Scheme scheme;
    scheme.structure = StructureKind::Direct;
    const HysteresisNetwork& both = *model.hysteresis();
    const double radius = both.play_radius();
    const auto sticking_slope = [&](double x) {
        return both.force().at(x).slope + both.hysteresis_force().at(x).value / radius;
    };
    double start = 0.0;
    for (double x = 0.0; x <= 1.0; x += 0.01) {
        start = sticking_slope(x) > sticking_slope(start) ? x : start;
    }
    const double held = test::energy_at(model, scheme, start) - energy_range(model).least;
    for (const double share : {0.1, 0.5, 1.0, 3.0, 10.0}) {
        for (const int pace : {1, 3, 10}) {
            const PacingHand hand{share * radius, pace, 1e6, device.period_s, device.late_samples() + 2};
            const ClosedLoopEnd end =
                closed_loop(make_structure(model, scheme, device.period_s, device.force_limit), device, hand,
                            ticks, {2, start, 0.0, unguarded},
                            [](const Tick&, const Motion&, const EnergyBalance&) { return true; });
            if (end.energy.motor + end.energy.dissipated < -held - 1e-9 * end.energy.throughput) {
                return true;
            }
        }
    }
    return false;
}

// The damping that hysteresis requires in direct rendering follows from M_h = max(0, max(g' + |h'| + h/r)), for the
// mean force g, hysteresis h and play radius r. Without the term h/r hysteresis gives energy.
TEST(Hysteresis, GeneratesEnergyOnlyIfStickingIsIgnored) {
    test::Random random{5};
    int without = 0;
    const int tried = test::cases(12);
    for (int k = 0; k < tried; ++k) {
        const ForceModel model = test::random_model(random, true).with_play_radius(0.003);
        Scheme scheme;
        scheme.structure = StructureKind::Direct;
        DeviceProfile device = smooth_knob();
        device.delay_s = (k % 3) * device.period_s;
        device.force_limit = 1e9;
        const auto enough = test::device_at_its_bound(model, scheme, device, 1.0 + 1e-9);
        ASSERT_TRUE(enough);
        EXPECT_FALSE(generates(model, *enough)) << "model " << k;
        const ForceBounds bounds = force_bounds(model);
        device.viscous_damping = device.period_s * (0.5 + device.late_samples()) * bounds.sliding;
        without += generates(model, device) ? 1 : 0;
    }
    EXPECT_GE(without, tried / 2) << "of " << tried;
}

}  // namespace
}  // namespace palpate::bench
