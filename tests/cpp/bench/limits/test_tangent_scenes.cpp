// SPDX-License-Identifier: Apache-2.0
// Searches motions that take energy out of held lines: none with the certified damping and friction, and some for each
// rule that the proofs exclude.
#include "limits/tangent_scenes.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/stability/tangent_inequalities.hpp"

namespace palpate::bench {
namespace {

constexpr double rounding = 1e-7;

TangentScene scene_of(test::Random& random, double delay, bool simple, Takes takes) {
    std::optional<TangentScene> scene;
    while (!scene) {
        scene = random_tangent_scene(random, delay, simple, takes);
    }
    return *scene;
}

class TangentSearch : public testing::TestWithParam<Takes> {};

TEST_P(TangentSearch, TakesNoEnergyOutOfCertifiedScenes) {
    int found_below = 0;
    for (int k = 0; k < test::cases(3); ++k) {
        for (const double delay : {0.0, 0.4, 1.0, 2.0}) {
            for (const bool simple : {true, false}) {
                if (simple && delay == 0.4) {
                    continue;
                }
                test::Random random{static_cast<std::uint64_t>(1000 * k) +
                                    static_cast<std::uint64_t>(10 * delay)};
                const TangentScene scene = scene_of(random, delay, simple, GetParam());
                const auto search = [&](double share) {
                    test::Random same = random;
                    return simple ? search_by_value(scene, same, share, share)
                                  : search_by_motions(scene, same, share, share);
                };
                EXPECT_LE(search(1.0), rounding) << scene;
                found_below += search(0.5) > rounding ? 1 : 0;
            }
        }
    }
    EXPECT_GE(found_below, 2) << "the search must find energy below the certified values";
}

INSTANTIATE_TEST_SUITE_P(Controllers, TangentSearch, testing::Values(Takes::Lines, Takes::Springs),
                         [](const auto& kind) { return kind.param == Takes::Lines ? "lines" : "springs"; });

TEST(TangentScene, ASpringIsRoundedByItsCenter) {
    DeviceProfile device;
    device.force_step = 0.1;
    HeldLine& loop = device.held_line.emplace();
    loop.stiffness_step = 0.5;
    loop.position_step = 0.25;
    const Command line{1.0, 0.1, 2.1};  // the center of a spring of 2.0 is -0.4
    const Command held = as_taken(line, device);
    EXPECT_NEAR(held.force + held.stiffness * (0.1 - held.position), 1.0, 0.05);
    loop.largest_center = 1.0;
    const Command spring = as_taken(line, device);
    EXPECT_EQ(spring.force, 0.0);
    EXPECT_EQ(spring.position, -0.5);
    EXPECT_EQ(spring.stiffness, 2.0);
    EXPECT_EQ(as_taken({1.04, 0.1, 0.2}, device).force, 1.0) << "without stiffness it is a force";
}

/// A grid of lines with the force of a curve and chosen slopes.
template <class Force, class Slope>
LineGrid grid_of(double from, double step, int nodes, const Force& force, const Slope& slope,
                 double limit = 1e9) {
    LineGrid grid;
    grid.limit = limit;
    for (int k = 0; k < nodes; ++k) {
        const double x = from + k * step;
        grid.position.push_back(x);
        grid.line.push_back({force(x), x, slope(x)});
    }
    grid.held = held_energy(grid.position, limit, force);
    return grid;
}

/// A wall that rises smoothly from x = 0 to the slope 1 at x = 1.
double wall(double x) {
    return x < 0.0 ? 0.0 : x < 1.0 ? 0.5 * x * x : x - 0.5;
}
/// The slope of the rule steepest, for motions of w.
double steepest(double x, double w) {
    double most = 0.0;
    for (int k = -1000; k <= 1000; ++k) {
        if (k != 0) {
            const double d = w * k / 1000.0;
            double integral = 0.0;
            constexpr int parts = 100;
            for (int j = 0; j < parts; ++j) {
                integral += d / parts * wall(x + d * (j + 0.5) / parts);
            }
            most = std::max(most, 2.0 * (integral - wall(x) * d) / (d * d));
        }
    }
    return most;
}

TEST(TangentCounterexample, ALineOfTheRuleSteepestNeedsNoDampingWithoutDelay) {
    LineGrid grid = grid_of(-1.0, 0.05, 60, wall, [](double x) { return steepest(x, 0.2) + 1e-4; });
    grid.reach = 4;
    EXPECT_LE(most_taken(grid), 1e-6);
    grid.reach = 8;
    EXPECT_GT(most_taken(grid), 1e-3) << "twice the largest motion";
}

TEST(TangentCounterexample, ALineOfTheRuleSteepestGivesEnergyWithADelay) {
    LineGrid grid = grid_of(-1.0, 0.05, 60, wall, [](double x) { return steepest(x, 0.2) + 1e-4; });
    grid.reach = 4;
    grid.delay = 1;
    EXPECT_GT(most_taken(grid), 1e-3);
}

TEST(TangentCounterexample, AClampOfTheMotionNeedsTheDampingOfHoldForFastMotions) {
    // Each line is held beyond w, so a wall of slope 1 is crossed in 16 clamps
    static constexpr double w = 0.2;
    LineGrid grid = grid_of(
        -2.0, 0.2, 60, [](double x) { return std::max(0.0, x); },
        [](double x) { return x > -0.2 ? 1.0 : 0.0; });
    grid.work = [](const Command& line, double from, double to) {
        double work = 0.0;
        constexpr int parts = 200;
        for (int k = 0; k < parts; ++k) {
            const double x = from + (to - from) * (k + 0.5) / parts;
            work +=
                (to - from) / parts * (line.force + line.stiffness * std::clamp(x - line.position, -w, w));
        }
        return work;
    };
    grid.reach = 16;
    grid.damping = 0.7 * 0.5;
    EXPECT_GT(most_taken(grid), 1e-3);
    grid.reach = 1;
    grid.damping = 0.0;
    EXPECT_LE(most_taken(grid), 1e-6) << "the clamp is right up to w";
}

TEST(TangentCounterexample, ALimitInTheHostAloneGivesEnergy) {
    // The line has the limited force, but the slope of the unlimited one; the controller does not limit it
    const auto spring = [](double x) { return x; };
    LineGrid in_controller = grid_of(-2.0, 0.1, 40, spring, [](double) { return 1.0; }, 0.5);
    in_controller.reach = 3;
    in_controller.delay = 1;
    EXPECT_LE(most_taken(in_controller), 1e-6);
    LineGrid in_host = in_controller;
    in_host.limit = 1e9;
    for (Command& line : in_host.line) {
        line.force = std::clamp(line.force, -0.5, 0.5);
    }
    EXPECT_GT(most_taken(in_host), 1e-3);
    // The guard of the library moves the line along itself instead
    LineGrid by_guard = in_controller;
    for (Command& line : by_guard.line) {
        (void)ForceLimit{0.5}.apply(line);
        EXPECT_LE(std::abs(line.force), 0.5);
    }
    EXPECT_LE(most_taken(by_guard), 1e-6);
}

TEST(TangentCounterexample, AnUnlimitedLineOfTheRuleSteepestGivesEnergyIfTheControllerLimitsIt) {
    // Below the limit -1 the unlimited line stores energy that the limited one does not
    const auto force = [](double x) { return -1.6 + wall(x); };
    const auto slope = [](double x) { return steepest(x, 0.8) + 1e-4; };
    LineGrid grid = grid_of(-1.0, 0.1, 40, force, slope, 1.4);
    grid.reach = 8;
    EXPECT_GT(most_taken(grid), 1e-4);
    for (Command& line : grid.line) {
        line.force = std::clamp(line.force, -1.4, 1.4);
    }
    EXPECT_LE(most_taken(grid), 1e-6) << "the force is limited before it is sent";
}

TEST(TangentCounterexample, AFallingForceNeedsDampingWithADelay) {
    LineGrid grid = grid_of(-1.0, 0.05, 41, [](double x) { return -x; }, [](double) { return 0.0; });
    grid.reach = 4;
    grid.delay = 1;
    grid.damping = 0.3;
    EXPECT_GT(most_taken(grid), 1e-3);
    grid.damping = device_need(
        [] {
            DeviceProfile late;
            late.delay_s = late.period_s;
            return late;
        }(),
        {0.0, 1.0});
    EXPECT_LE(most_taken(grid), 1e-6);
    grid.damping = 0.0;
    grid.delay = 0;
    EXPECT_LE(most_taken(grid), 1e-6) << "without delay it needs none";
}

TEST(TangentCounterexample, TheRoundedCenterOfASpringNeedsFriction) {
    // The center of the force alternates about half a step, so it is rounded up at one reading and down at the next one
    static constexpr double step = 0.02;
    DeviceProfile device;
    device.held_line.emplace().largest_center = 1e6;
    device.held_line->position_step = step;
    const auto force = [](double x) { return x - 0.5 * step; };
    LineGrid grid = grid_of(-1.0, 0.1, 21, force, [](double) { return 1.0; });
    for (std::size_t k = 0; k < grid.line.size(); ++k) {
        grid.line[k].force += k % 2 == 0 ? 1e-6 : -1e-6;
        grid.line[k] = as_taken(grid.line[k], device);
    }
    grid.reach = 1;
    EXPECT_GT(most_taken(grid), 1e-3);
    grid.friction = 0.5 * step;
    EXPECT_LE(most_taken(grid), 1e-9) << "the slope times half a step of the center";
}

/// Returns the energy that a hand takes out of a hysteresis by motions to and fro without damping; `slope` replaces the
/// slope of the line if it is >= 0.
double taken_by_shaking(double slope) {
    NetworkParameters force;
    force.linear = {0.0};
    HysteresisParameters loss;
    loss.bias = 0.5;
    const ForceModel model{force, loss, test::unit_domain(), 0.1};
    Scheme scheme;
    scheme.structure = StructureKind::Tangent;
    scheme.line = HeldSlope{SlopeRule::Steepest, 1e9, 0.0, 0.05};
    AnyStructure structure = make_structure(model, scheme, 1e-3, 1e9);
    structure.reset(0.5);
    double x = 0.5;
    double energy = 0.0;
    for (int k = 0; k < 100; ++k) {
        const Rendered rendered = structure.step(x);
        const double to = k % 2 == 0 ? 0.54 : 0.5;
        energy += line_work({rendered.force, x, slope >= 0.0 ? slope : rendered.stiffness}, 1e9, x, to);
        x = to;
    }
    return -energy;
}

TEST(TangentCounterexample, TheSlopeOfTheSlidingBranchGivesTheEnergyOfAHysteresis) {
    EXPECT_LE(taken_by_shaking(-1.0), 1e-9);
    EXPECT_GT(taken_by_shaking(0.0), 0.1);
}

}  // namespace
}  // namespace palpate::bench
