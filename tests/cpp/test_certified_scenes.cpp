// SPDX-License-Identifier: Apache-2.0
// Whether certified scenes keep what their certificates say: hands from limp to stiff and hands that are after
// energy, on devices with exactly the damping and friction that was asked for.
#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include <gtest/gtest.h>

#include "scenes.hpp"

namespace palpate {
namespace {

using test::Scene;

constexpr std::size_t ticks = 400;
constexpr int substeps = 8;

constexpr auto to_the_end = [](const Tick& /*tick*/, const Motion& /*handle*/,
                               const EnergyAccount& /*account*/) { return true; };

/// What the hand got out beyond what the object held, over what may be rounding; above 1 is a generator.
double generated(const Scene& scene, const ClosedLoopEnd& end) {
    const double rounding = 1e-13 * scene.largest + 1e-15;
    return -(end.energy.least + scene.held) / rounding;
}

template <class Check>
void with_a_random_hand(test::Random& random, const Scene& scene, Check check) {
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

// spec section 7, "energy account": E_port(t) + S(0) - S_min + m v(0)^2 / 2 >= -rounding at every substep
TEST(CertifiedScenes, NeverGiveMoreThanTheObjectHeld) {
    test::Random random{20};
    std::map<std::string, int> tried;
    for (int k = 0; k < test::cases(1000); ++k) {
        const Scene scene = test::random_certified_scene(random, 1.0 + 1e-9);
        with_a_random_hand(random, scene, [&](auto hand, const char* name) {
            const ClosedLoopEnd end = test::run(scene, hand, ticks, substeps, to_the_end);
            EXPECT_LE(generated(scene, end), 1.0)
                << "scene " << k << ", " << name << " hand; " << scene << "; least " << end.energy.least
                << ", held " << scene.held << ", throughput " << end.energy.throughput;
        });
        ++tried[std::string(name_of(scene.scheme.structure)) +
                (scene.model.hysteresis() != nullptr ? " hysteresis" : "") + " delay " +
                std::to_string(scene.device.delay_samples)];
    }
    for (const auto& [what, count] : tried) {
        std::printf("  %s: %d\n", what.c_str(), count);
    }
}

}  // namespace
}  // namespace palpate
