// SPDX-License-Identifier: Apache-2.0
// Tests that certified scenes satisfy their certificates, with weak to stiff hands and hands that try to take energy
// out, on devices with exactly the required damping and friction.
#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "limits/hands.hpp"
#include "simulation/scenes.hpp"

namespace palpate {
namespace {

using test::Scene;
using test::to_the_end;

constexpr std::size_t ticks = 400;
constexpr int substeps = 8;

/// Returns the energy that the hand took out in excess of the stored energy, divided by the rounding error of the
/// account. A value above 1 violates the certificate.
double generated(const Scene& scene, const ClosedLoopEnd& end) {
    const double rounding = 1e-13 * scene.largest + 1e-15;
    return -(end.energy.least + scene.held) / rounding;
}

template <class Check>
void check_with_random_hand(test::Random& random, const Scene& scene, Check check) {
    const double scale = std::max(1.0, scene.model.slope_bounds().largest());
    const double log_scale = test::uniform(random, -3.0, 3.0);
    const double stiffness = scale * std::exp(log_scale);
    switch (random() % 4) {
        case 0:
            check(PassiveHand{random() % 4 == 0 ? 0.0 : stiffness,
                              1e-3 * stiffness * test::uniform(random, 0.0, 1.0),
                              random() % 2 == 0 ? 0.0 : std::exp(test::uniform(random, -8.0, 2.0)),
                              test::uniform(random, -0.1, 1.1)},
                  "passive");
            break;
        case 1:
            check(ShakingHand{stiffness, scene.steepest, std::exp(test::uniform(random, -6.0, -1.0)),
                              random() % 2 == 0 ? 1.0 : test::uniform(random, 0.05, 1.0),
                              scene.device.period_s},
                  "shaking");
            break;
        case 2:
            check(GreedyHand{std::exp(test::uniform(random, -3.0, 4.0)), scene.steepest,
                             std::exp(test::uniform(random, -6.0, -1.0)), test::uniform(random, 0.05, 5.0)},
                  "greedy");
            break;
        default:
            check(Hand{stiffness, 1e-3 * stiffness, test::uniform(random, -0.1, 0.5),
                       test::uniform(random, 0.5, 1.1), test::uniform(random, 0.5, 20.0)},
                  "sweeping");
    }
}

// At every substep: energy put in by the hand + stored energy S(0) - S_min at the start + kinetic energy m v(0)^2 / 2
// at the start >= -(rounding error).
TEST(CertifiedScenes, NeverGiveMoreEnergyThanTheObjectStored) {
    test::Random random{20};
    std::map<std::string, int> tried;
    for (int k = 0; k < test::cases(300); ++k) {
        const Scene scene = test::random_certified_scene(random, 1.0 + 1e-9);
        check_with_random_hand(random, scene, [&](auto hand, const char* name) {
            const ClosedLoopEnd end = test::run(scene, hand, ticks, substeps, to_the_end);
            EXPECT_LE(generated(scene, end), 1.0)
                << "scene " << k << ", " << name << " hand; " << scene << "; least " << end.energy.least
                << ", held " << scene.held << ", throughput " << end.energy.throughput;
        });
        ++tried[std::string(name_of(scene.scheme.structure)) +
                (scene.model.hysteresis() != nullptr ? " hysteresis" : "") +
                (scene.scheme.predict > 0 ? " predict" : "") + " delay " +
                std::to_string(scene.device.late_samples())];
    }
    for (const auto& [what, count] : tried) {
        RecordProperty(what, count);
    }
    EXPECT_GE(tried.size(), 21U) << "structures, kinds of model and delays that were met";
}

// With a passive hand no oscillation grows: the kinetic energy never exceeds the energy stored at the start.
TEST(CertifiedScenes, DoNotOscillateWithPassiveHands) {
    test::Random random{21};
    for (int k = 0; k < test::cases(100); ++k) {
        const Scene scene = test::random_certified_scene(random, 1.0 + 1e-9);
        const double scale = std::max(1.0, scene.model.slope_bounds().largest());
        const PassiveHand hand{random() % 4 == 0 ? 0.0 : scale * std::exp(test::uniform(random, -4.0, 4.0)),
                               0.0, random() % 2 == 0 ? 0.0 : std::exp(test::uniform(random, -8.0, 2.0)),
                               test::uniform(random, -0.1, 1.1)};
        const double inertia = scene.device.inertia + hand.mass;
        const auto moving = [&](const Motion& handle) {
            const double stretch = handle.position - hand.rest;
            return 0.5 * (inertia * handle.velocity * handle.velocity + hand.stiffness * stretch * stretch);
        };
        const double first = scene.held + moving({scene.start, 0.0});
        double most = 0.0;
        (void)test::run(scene, hand, ticks, substeps,
                        [&](const Tick& /*tick*/, const Motion& handle, const EnergyBalance& /*account*/) {
                            most = std::max(most, moving(handle));
                            return true;
                        });
        EXPECT_LE(most, first * (1.0 + 1e-9) + 1e-13 * scene.largest + 1e-15)
            << "scene " << k << "; " << scene;
    }
}

/// Returns the energy of the object at rest at position x minus its energy at the lower edge of the domain [J].
double resting_energy(const VelocityNetwork& force, double x) {
    constexpr int cells = 200;  // number of cells for the integral of the force over the position
    const double step = (x - force.lower()) / cells;
    double sum = 0.0;
    for (int k = 0; k < cells; ++k) {
        const double from = force.lower() + step * k;
        sum += force.force(from, 0.0) + 4.0 * force.force(from + 0.5 * step, 0.0) +
               force.force(from + step, 0.0);
    }
    return sum * step / 6.0;
}

// Models with velocity require the damping b >= T M/2 + t_d L + B_v and the friction f_c >= L_x Delta/2 + B_v Delta/T.
// Here t_d is the delay, Delta the encoder step, M, L and L_x are largest slopes over position, and B_v is the largest
// slope over velocity.
TEST(CertifiedScenes, NeverGiveEnergyWithForcesOfVelocity) {
    // Tolerance of the energy [J]; the objects store some tenths of a joule
    constexpr double quadrature = 1e-6;
    test::Random random{22};
    for (int k = 0; k < test::cases(200); ++k) {
        Scene scene = test::random_scene_of_velocity(random);
        const VelocityNetwork& force = *scene.model.velocity();
        const auto enough = test::device_at_its_bound(scene.model, scene.scheme, scene.device, 1.0 + 1e-9);
        ASSERT_TRUE(enough.has_value());
        scene.device = *enough;
        const EnergyRange range = energy_range(force, 1e9);
        scene.held = resting_energy(force, scene.start) - range.least + quadrature;
        scene.largest = std::max(std::abs(range.least), std::abs(range.largest));
        check_with_random_hand(random, scene, [&](auto hand, const char* name) {
            const ClosedLoopEnd end = test::run(scene, hand, ticks, substeps, to_the_end);
            EXPECT_LE(generated(scene, end), 1.0) << "scene " << k << ", " << name << " hand; " << scene
                                                  << "; generated " << -(end.energy.least + scene.held);
        });
    }
}

}  // namespace
}  // namespace palpate
