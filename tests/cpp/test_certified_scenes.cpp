// SPDX-License-Identifier: Apache-2.0
// Whether certified scenes keep what their certificates say: hands from limp to stiff and hands that are after
// energy, on devices with exactly the damping and friction that was asked for.
#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

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
        RecordProperty(what, count);
    }
    EXPECT_GE(tried.size(), 15U) << "structures, kinds of model and delays that were met";
}

// "No growing oscillation follows for passive hands only": what moves is never more than what was stored at first.
TEST(CertifiedScenes, DoNotSwingUpWithPassiveHands) {
    test::Random random{21};
    for (int k = 0; k < test::cases(300); ++k) {
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
                        [&](const Tick& /*tick*/, const Motion& handle, const EnergyAccount& /*account*/) {
                            most = std::max(most, moving(handle));
                            return true;
                        });
        EXPECT_LE(most, first * (1.0 + 1e-9) + 1e-13 * scene.largest + 1e-15)
            << "scene " << k << "; " << scene;
    }
}

/// A force of position and of the handle's velocity, a backward difference: f(x) + d v / (1 + |v| / u).
class ThickeningFluid {
  public:
    ThickeningFluid(WaveletNetwork force, double damping, double speed, double period_s)
        : force_{std::move(force)}, damping_{damping}, speed_{speed}, period_s_{period_s} {}

    void reset(double position) noexcept { last_ = position; }

    [[nodiscard]] Rendered step(double position) noexcept {
        const double velocity = (position - last_) / period_s_;
        last_ = position;
        const double drag = damping_ * velocity / (1.0 + std::abs(velocity) / speed_);
        return {force_.at(position, {}).force + drag, position, 1, Status::Ok, false};
    }

  private:
    WaveletNetwork force_;
    double damping_;
    double speed_;
    double period_s_;
    double last_ = 0.0;
};

// spec section 7, velocity models: b >= T M/2 + t_d L + B_v, f_c >= L_x Delta/2 + B_v Delta/T
TEST(CertifiedScenes, KeepTheirEnergyWithForcesOfVelocity) {
    test::Random random{22};
    for (int k = 0; k < test::cases(200); ++k) {
        Scene scene{test::random_model(random, false), {}, {}};
        scene.device.period_s = test::uniform(random, 3e-4, 2e-3);
        scene.device.inertia = std::exp(test::uniform(random, -10.0, -5.0));
        scene.device.delay_samples = static_cast<int>(random() % 3);
        scene.device.encoder_step = random() % 2 == 0 ? 0.0 : std::exp(test::uniform(random, -11.0, -6.0));
        scene.device.force_limit = 1e9;
        const ForceBounds bounds = force_bounds(scene.model);
        const double damping = test::uniform(random, -0.2, 0.2);  // either sign: the bound takes its size
        const std::vector<Inequality> lines = velocity_inequalities(
            {bounds.rising(), bounds.steepest, std::abs(damping), bounds.steepest}, scene.device);
        scene.device.viscous_damping = lines[0].right * (1.0 + 1e-9);
        scene.device.coulomb_friction = lines[1].right * (1.0 + 1e-9);
        scene.steepest = test::steepest_place(scene.model);
        scene.start =
            std::max(scene.device.encoder_step, 1e-3) * std::round(test::uniform(random, 0.0, 100.0));
        const EnergyRange range = energy_range(scene.model);
        scene.held = test::energy_at(scene.model, scene.scheme, scene.start) - range.least;
        scene.largest = std::max(std::abs(range.least), std::abs(range.largest));
        with_a_random_hand(random, scene, [&](auto hand, const char* name) {
            const double from = (scene.device.delay_samples + 2) * scene.device.period_s;
            const ThickeningFluid fluid{*scene.model.network(), damping, 1.0, scene.device.period_s};
            const ClosedLoopEnd end =
                closed_loop(fluid, scene.device, test::Later<decltype(hand)>{hand, from}, ticks,
                            {substeps, scene.start, 0.0, Guards{.limit = {1e9}}}, to_the_end);
            EXPECT_LE(generated(scene, end), 1.0) << "scene " << k << ", " << name << " hand; " << scene
                                                  << "; damping of the object " << damping;
        });
    }
}

}  // namespace
}  // namespace palpate
