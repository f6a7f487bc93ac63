// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>
#include <vector>

#include "palpate/device/device_profile.hpp"
#include "palpate/guard/limits.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/rendering/make_structure.hpp"
#include "palpate/stability/certificate.hpp"
#include "palpate/stability/limited_mean.hpp"
#include "tangent_scenes.hpp"

// Searches motions that take energy out of the compensation of a motor's cogging, -s f, rendered directly.
namespace palpate::bench {

/// Cogging of a motor, a device too weak to cancel all of it, and the largest scale that is certified.
struct CoggingScene {
    NetworkParameters cogging;  ///< harmonics of the period 1
    DeviceProfile device;
    double scale = 0.0;  ///< largest certified share of the cogging that is cancelled [-]

    /// Returns the force -share f, whose mean is zero under the force limit.
    [[nodiscard]] ForceModel compensation(double share) const {
        NetworkParameters network = cogging;
        for (double& weight : network.weight) {
            weight *= -share;
        }
        Domain domain = test::unit_domain();
        domain.period = 1.0;
        network.bias = passive_shift(ForceModel{network, domain}, device.force_limit);
        return ForceModel{network, domain};
    }
    [[nodiscard]] bool is_certified(double share) const {
        Scheme direct;
        direct.structure = StructureKind::Direct;
        return certify(compensation(share), direct, device).certified();
    }
};

/// Makes a random scene with a delay of whole periods. The search has no errors of readings and forces, so that the
/// damping alone limits the scale.
[[nodiscard]] inline CoggingScene random_cogging_scene(test::Random& random, int delay) {
    CoggingScene scene;
    scene.cogging.harmonics = 1 + random() % 3;
    double size = 0.0;
    for (std::size_t k = 0; k < scene.cogging.harmonics; ++k) {
        const double order = 2.0 * std::numbers::pi * static_cast<double>(1 + random() % 12);
        scene.cogging.alpha.push_back(order);
        scene.cogging.beta.push_back(test::uniform(random, 0.0, 1.0));
        scene.cogging.weight.push_back(test::uniform(random, 0.1, 1.0));
        size += scene.cogging.weight.back();
    }
    DeviceProfile& device = scene.device;
    device.delay_s = delay * device.period_s;
    device.encoder_step = 0.0;
    device.coulomb_friction = 1e-9;
    device.force_limit = size * (random() % 2 == 0 ? test::uniform(random, 0.3, 1.0) : 10.0);
    device.viscous_damping = 1e6;
    Scheme direct;
    direct.structure = StructureKind::Direct;
    const Certificate whole = certify(scene.compensation(1.0), direct, device);
    double needed_damping = 0.0;
    for (const Inequality& line : whole.inequalities) {
        needed_damping = line.left == device.viscous_damping ? line.right : needed_damping;
    }
    device.viscous_damping = needed_damping * test::uniform(random, 0.1, 0.9);
    double high = 1.0;
    for (int k = 0; k < 24; ++k) {
        const double middle = 0.5 * (scene.scale + high);
        (scene.is_certified(middle) ? scene.scale : high) = middle;
    }
    return scene;
}

/// Searches a scene with this share of the cogging by value iteration on a grid of motions. Returns the energy taken out
/// beyond the stored one, divided by the largest force times the period of the cogging.
[[nodiscard]] inline double search_compensation(const CoggingScene& scene, test::Random& random,
                                                double share) {
    const ForceModel model = scene.compensation(share);
    const NetworkCurve& curve = model.network()->curve();
    const double highest = *std::max_element(scene.cogging.alpha.begin(), scene.cogging.alpha.end());
    LineGrid grid;
    grid.delay = scene.device.whole_delay_samples();
    grid.reach = grid.delay == 0 ? 8 : grid.delay == 1 ? 4 : 2;
    const int nodes = grid.delay == 0 ? 160 : grid.delay == 1 ? 70 : 40;
    // Half of the grids are fine and lie around the steepest place
    const bool fine = random() % 2 == 0;
    const double width = fine ? test::uniform(random, 0.5, 2.5) / highest : test::uniform(random, 0.1, 1.5);
    double middle = test::uniform(random, 0.0, 1.0);
    for (int k = 0; fine && k < 2000; ++k) {
        const double x = k / 2000.0;
        middle = std::abs(curve.at(x).slope) > std::abs(curve.at(middle).slope) ? x : middle;
    }
    Scheme direct;
    direct.structure = StructureKind::Direct;
    AnyStructure structure = make_structure(model, direct, scene.device.period_s, scene.device.force_limit);
    const ForceLimit limit{scene.device.force_limit};
    for (int k = 0; k < nodes; ++k) {
        const double x = middle + width * (static_cast<double>(k) / (nodes - 1) - 0.5);
        Command held{structure.step(x).force, x, 0.0};
        (void)limit.apply(held.force);
        grid.position.push_back(x);
        grid.line.push_back(held);
    }
    grid.limit = scene.device.force_limit;
    grid.held = held_energy(grid.position, grid.limit, [&](double x) { return curve.at(x).value; });
    grid.damping = scene.device.viscous_damping / scene.device.period_s;
    grid.friction = scene.device.coulomb_friction;
    return most_taken(grid) / curve.value_bounds().largest();
}

}  // namespace palpate::bench
