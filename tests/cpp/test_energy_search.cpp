// SPDX-License-Identifier: Apache-2.0
// A search for motions that take energy out of certified scenes. Its account, its motions and the stored energy are
// written apart from the core's: sum F d + (b/T) d^2 + f_c |d| >= -(S_0 - S_min) for every motion of every length.
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
        const std::size_t scenes = scenes_of_each_line(10);
        std::size_t failures = 0;
        for (std::size_t index = 0; index < scenes; ++index) {
            failures += line.fails(scene_of(line, index), 0.95) ? 1 : 0;
        }
        EXPECT_GE(2 * failures, scenes) << line.name << ", delay " << line.delay;
    }
}

/// A spring of stiffness 1 on a line of nodes of distance 1, as the value iteration sees it.
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

}  // namespace
}  // namespace palpate::energy_search
