// SPDX-License-Identifier: Apache-2.0
// Tests the comparison of methods: curves, scenes, the energy account of the hands, and the claims of methods with a
// proof.
#include "rivals/trial.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "rivals/methods/energy_account.cpp"
#include "rivals/methods/hold.cpp"
#include "rivals/methods/tangent.cpp"
#include "rivals/published.hpp"
#include "support.hpp"

namespace palpate::rivals {
namespace {

TableCurve random_curve(unsigned seed) {
    std::mt19937 random{seed};
    std::uniform_real_distribution<double> step{-1.0, 1.0};
    std::vector<double> values{0.0};
    for (int k = 0; k < 100; ++k) {
        values.push_back(values.back() + step(random));
    }
    return {-1.0, 2.0, values};
}

/// Returns the scene of a device and a shape without encoder steps and friction, at this delay.
Scene smooth_scene(std::size_t device, std::size_t shape, int delay) {
    Device smooth = devices()[device];
    smooth.profile.encoder_step = 1e-12;
    smooth.profile.coulomb_friction = 1e-12;
    Draw draw{1};
    return scene_of(smooth, shapes.at(shape), delay, draw);
}

TEST(Rivals, CurveIsTheDerivativeOfItsIntegrals) {
    const TableCurve curve = random_curve(1).scaled(2.0);
    for (const double cell : {-5.3, 23.4, 60.6, 99.5, 110.2}) {
        const double x = curve.position(0) + cell * curve.step();
        const double h = 1e-5;
        const Curve before = curve.at(x - h);
        const Curve after = curve.at(x + h);
        EXPECT_NEAR((after.value - before.value) / (2.0 * h), curve.at(x).slope, 1e-6);
        EXPECT_NEAR((after.integral - before.integral) / (2.0 * h), curve.at(x).value, 1e-6);
        EXPECT_NEAR((after.double_integral - before.double_integral) / (2.0 * h), curve.at(x).integral, 1e-6);
    }
}

TEST(Rivals, SlopeLimitedCurveIsTheNearestOne) {
    for (int seed = 0; seed < test::cases(20); ++seed) {
        const TableCurve curve = random_curve(static_cast<unsigned>(seed));
        const double steepest = 0.3 / curve.step();
        const TableCurve limited = curve.slope_limited(0.0, 1.0, steepest);
        double error = 0.0;
        double least = 0.0;  // half the largest excess of a secant over the limit
        for (std::size_t k = 0; k + 1 < curve.size(); ++k) {
            EXPECT_LE(std::abs(limited.at(limited.position(k) + 0.5 * curve.step()).slope),
                      steepest * (1.0 + 1e-9));
        }
        for (std::size_t j = 33; j <= 66; ++j) {  // the positions from 0 to 1
            const double x = curve.position(j);
            error = std::max(error, std::abs(limited.at(x).value - curve.at(x).value));
            for (std::size_t k = 33; k <= 66; ++k) {
                const double y = curve.position(k);
                const double excess =
                    std::abs(curve.at(x).value - curve.at(y).value) - steepest * std::abs(x - y);
                least = std::max(least, 0.5 * excess);
            }
        }
        EXPECT_NEAR(error, least, 1e-9);
    }
}

TEST(Rivals, MajorantPotentialLiesAboveTheCurve) {
    for (int seed = 0; seed < test::cases(20); ++seed) {
        const TableCurve curve = random_curve(static_cast<unsigned>(seed));
        const double reach = 7.0 * curve.step();
        const TableCurve slopes = curve.majorant_slopes(reach, 0.0);
        for (std::size_t k = 10; k + 10 < curve.size(); ++k) {
            const double x = curve.position(k);
            const Curve here = curve.at(x);
            for (double d = -reach; d <= reach; d += curve.step()) {
                const double above = here.integral + here.value * d + 0.5 * slopes.at(x).value * d * d;
                EXPECT_GE(above, curve.at(x + d).integral - 1e-9);
            }
        }
    }
}

TEST(Rivals, HandsObtainEnergyFromAHeldWallAboveItsBoundOnly) {
    for (int delay = 0; delay <= 2; ++delay) {
        const Scene scene = smooth_scene(0, 0, delay);
        const std::vector<Trial> trials = trials_of(scene, Draw{2});
        for (const double share : {0.99, 1.2}) {
            const Scene now = scene.scaled(share * Hold::bound(scene));
            const double energy = worst_energy(Hold::make(now), trials, now.period());
            if (share < 1.0) {
                EXPECT_LE(energy, 1e-3 * now.budget) << "delay " << delay;
            } else {
                EXPECT_GT(energy, now.budget) << "delay " << delay;
            }
        }
    }
}

TEST(Rivals, EnergyAccountGivesAtMostItsBudget) {
    int number = 0;
    for (const Device& device : devices()) {
        for (const Shape& shape : shapes) {
            for (int delay = 0; delay <= 2; ++delay, ++number) {
                if (!test::is_sampled(number, 5)) {
                    continue;
                }
                Draw draw{static_cast<std::uint64_t>(number)};
                const Scene scene = scene_of(device, shape, delay, draw).scaled(number % 2 == 0 ? 1.0 : 64.0);
                const std::vector<Trial> trials = trials_of(scene, draw);
                EXPECT_LE(worst_energy(AccountMethod::make(scene), trials, scene.period()),
                          scene.budget * (1.0 + 1e-6))
                    << device.name << ", " << shape.name << ", delay " << delay;
            }
        }
    }
}

TEST(Rivals, TangentIsStableFarAboveTheBoundOfAHeldForce) {
    for (std::size_t shape = 0; shape < shapes.size(); ++shape) {
        Draw draw{shape};
        const Scene scene = scene_of(devices()[3], shapes.at(shape), 0, draw);
        const double bound = Tangent::bound(scene);
        EXPECT_GT(bound, 3.0 * Hold::bound(scene));
        const Scene now = scene.scaled(bound);
        EXPECT_LE(worst_energy(Tangent::make(now), trials_of(now, draw), now.period()), 1e-6 * now.budget)
            << shapes.at(shape).name;
    }
}

TEST(Rivals, PublishedLimitsAreFoundWithinFivePercent) {
    const std::vector<PublishedLimit> limits = published_limits();
    EXPECT_GE(limits.size(), 9U);
    for (const PublishedLimit& each : limits) {
        EXPECT_NEAR(each.found / each.published, 1.0, 0.05) << each.limit;
    }
}

TEST(Rivals, SceneDependsOnTheDrawAlone) {
    const auto made = [](std::uint64_t seed, int delay) {
        Draw draw{seed};
        return scene_of(devices()[2], shapes[1], delay, draw);
    };
    EXPECT_EQ(made(5, 0).object.bounds().slope.upper, made(5, 2).object.bounds().slope.upper);
    EXPECT_NE(made(5, 0).object.bounds().slope.upper, made(6, 0).object.bounds().slope.upper);
}

}  // namespace
}  // namespace palpate::rivals
