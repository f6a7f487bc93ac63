// SPDX-License-Identifier: Apache-2.0
// Searches motions that take energy out of certified scenes. The energy account, the motions and the stored energy are
// computed independently of the library. Condition for every motion of every length: sum F d + (b/T) d^2 + f_c |d| >=
// -(S_0 - S_min), with force F, displacement d and stored energy S.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "energy_search/all_lines.hpp"
#include "energy_search/spec_lines.hpp"

namespace palpate::energy_search {
namespace {

std::size_t scenes_of_each_line(int quick) {
    return static_cast<std::size_t>(test::cases(quick));
}

TEST(EnergySearch, TakesNoEnergyOutOfCertifiedScenes) {
    for (const Line& line : all_lines()) {
        for (std::size_t index = 0; index < scenes_of_each_line(1); ++index) {
            const Trial trial = scene_of(line, index);
            EXPECT_FALSE(line.fails(trial, 1.0 + 1e-9))
                << line.name << ", delay " << line.delay << ", scene " << index
                << ": a motion takes energy out at b = " << trial.need.damping
                << ", f_c = " << trial.need.friction;
        }
    }
}

TEST(EnergySearch, FindsFailuresAt95PercentOfTightBounds) {
    for (const Line& line : all_lines()) {
        if (!line.tight) {
            continue;
        }
        const std::size_t scenes = scenes_of_each_line(4);
        std::size_t failures = 0;
        for (std::size_t index = 0; index < scenes; ++index) {
            failures += line.fails(scene_of(line, index), 0.95) ? 1 : 0;
        }
        EXPECT_GE(2 * failures, scenes) << line.name << ", delay " << line.delay;
    }
}

TEST(EnergySearch, AnExportedModelNeedsFrictionForItsRounding) {
    const auto found = [](bool with_rounding) {
        std::size_t number = 0;
        for (std::size_t index = 0; index < scenes_of_each_line(40); ++index) {
            test::Random random{index};
            std::optional<Trial> trial;
            while (!trial) {
                trial = draw_exported(random, 0.0, index % 4 == 0, with_rounding);
            }
            number += trial->finds_energy(1.0 + 1e-9, 1.0 + 1e-9) ? 1 : 0;
        }
        return number;
    };
    EXPECT_GE(5 * found(false), scenes_of_each_line(40));
    EXPECT_EQ(found(true), 0U);
}

/// Returns the damping that a spring of stiffness 1 needs, found by value iteration on grid positions of distance 1.
double spring_need(int nodes, int reach, int delay, double late) {
    HeldScene scene;
    scene.read = even_grid(0.0, 1.0, nodes, reach);
    std::vector<double> forces;
    for (int i = 0; i < nodes; ++i) {
        forces.push_back(i - nodes / 2);
    }
    const Pieces spring{0.0, 1.0, forces};
    scene.table = table_of(Direct{PieceObject{spring}}, scene.read, 0, Sent{.guards = {.limit = {1e9}}});
    scene.held = held_energy(scene.read.grid, [&](double x) { return spring.at(x).value; });
    scene.need = {1.0, 0.0, delay, late};
    return largest_violating([&](double b) { return scene.search(b, 1.0).violated(); }, 0.1, 4.0, 1e-4);
}

TEST(EnergySearch, FindsTheKnownNeedOfAHeldSpring) {
    EXPECT_NEAR(spring_need(8, 7, 0, 0.0), 0.5, 2e-4);
    EXPECT_NEAR(spring_need(400, 3, 1, 0.0), 1.5, 0.01);
    EXPECT_NEAR(spring_need(200, 3, 2, 0.0), 2.5, 0.03);
}

TEST(EnergySearch, FindsTheKnownNeedOfASpringAtAFractionalDelay) {
    for (const double late : {0.25, 0.5, 0.75}) {
        const double exact = 0.5 * (0.5 + late + std::sqrt(0.25 + 2.0 * late));
        EXPECT_NEAR(spring_need(200, 4, 0, late), exact, 0.01 * exact) << "late by " << late;
        EXPECT_NEAR(late_need(1.0, 0.0, 0, late), exact, 1e-3 * exact);
    }
}

// The inequality b >= T M / 2 + t_d L does not hold if the delay t_d is not a whole number of samples.
TEST(EnergySearch, FindsEnergyIfAFractionalDelayIsCountedAsItsShareOfASample) {
    EXPECT_GT(spring_need(200, 4, 0, 0.25), 0.5 + 0.25 + 0.03);
}

/// Returns true if a full revolution of a wheel without friction takes energy out; `command(f(x))` is the force sent
/// for the model force f(x).
template <class Command>
bool wheel_gives_energy(const std::vector<double>& forces, const Command& command) {
    const Pieces wheel{0.0, 1.0 / static_cast<double>(forces.size()), forces, true};
    HeldScene scene;
    scene.read = even_grid(0.0, 1.0 / 3000, 3000, 1, true);
    scene.table.of.clear();
    for (const double x : scene.read.grid.position) {
        scene.table.of.push_back(command(wheel.at(x).value));
    }
    scene.held = held_energy(scene.read.grid, [&](double x) { return command(wheel.at(x).value); });
    scene.need = {0.5 * bounds_of(wheel).rising(), 0.0, 0, 0.0};
    return scene.search(1.0 + 1e-9, 1.0).violated();
}

// The force has a peak of 8 N m, the device makes at most 5 N m: the mean of the model force is 0, the mean of the
// clipped force is not 0.
TEST(EnergySearch, FindsTheActiveModelThatAForceLimitMakes) {
    std::vector<double> forces(10, -8.0 / 9.0);
    forces[3] = 8.0;
    const auto clip = [](double force) { return std::clamp(force, -5.0, 5.0); };
    EXPECT_FALSE(wheel_gives_energy(forces, [](double force) { return force; }));
    EXPECT_TRUE(wheel_gives_energy(forces, clip));
    const auto mean = [&](const std::vector<double>& points) {
        const Pieces wheel{0.0, 0.1, points, true};
        return mean_over(1.0, [&](double x) { return clip(wheel.at(x).value); });
    };
    forces = balanced(forces, mean);
    EXPECT_FALSE(wheel_gives_energy(forces, clip));
    EXPECT_FALSE(wheel_gives_energy(forces, [&](double force) { return 0.7 * clip(force); }));
    EXPECT_TRUE(wheel_gives_energy(forces, [&](double force) { return clip(0.7 * force); }))
        << "scaling before the limit";
}

/// Returns the device damping below which a motion takes energy out of a mass of 0.05 kg behind a coupling of 90 N/m;
/// the force limit of the device is 5 N.
double thrown_mass_need(double limit_inside) {
    constexpr double period = 1e-3;
    AnyStructure structure{
        Implicit{test::Spring{0.0}, {0.05, 0.0}, {90.0, 0.0}, period, LoadLineSolver{}, limit_inside}};
    const Places places{.low = -0.5, .high = 0.5, .finest = 1e-3, .widest = 2.0};
    test::Random random{1};
    MotionSearch search{structure, places, 5.0};
    return period * search.most(
                        random, 24, 150, [](const Account& account) { return account.damping(0.0, 0.0); },
                        [](const Account& account) { return account.gain(45.0, 0.0, 0.0); });
}

TEST(EnergySearch, FindsTheEnergyOfAMassThrownBeyondTheForceLimit) {
    constexpr double enough = 90.0 * 1e-3 / 2.0;
    EXPECT_GT(thrown_mass_need(1e9), 1.2 * enough) << "limit outside the step";
    EXPECT_LE(thrown_mass_need(5.0), enough * (1.0 + 1e-9)) << "limit inside the step";
}

}  // namespace
}  // namespace palpate::energy_search
