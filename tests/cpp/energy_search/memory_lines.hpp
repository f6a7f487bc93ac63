// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <optional>
#include <utility>

#include "../support.hpp"
#include "coupled_lines.hpp"
#include "held_lines.hpp"
#include "line.hpp"
#include "palpate/rendering/any_structure.hpp"
#include "palpate/rendering/make_structure.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/stability/certificate.hpp"

namespace palpate::energy_search {

/// Makes a scene of a directly rendered force with memory. With `encoder`, the trial compares the friction of the
/// device, otherwise its damping.
[[nodiscard]] inline std::optional<Trial> draw_memory(test::Random& random, double delay, bool encoder) {
    const auto side = [&] { return random() % 2 == 0 ? Continuation::Linear : Continuation::Free; };
    NetworkParameters rest = small_network(random);
    if (random() % 2 == 0) {
        // A small force at rest, so that the branches determine the damping
        for (double& weight : rest.weight) {
            weight *= 0.01;
        }
        rest.linear[0] *= 0.01;
        rest.bias *= 0.01;
    }
    const ForceModel model =
        ForceModel{rest, test::unit_domain(side(), side())}.with_memory(test::random_memory(random));
    CoupledScene scene;
    scene.scheme.structure = StructureKind::Direct;
    scene.device = random_device(random, delay);
    scene.object = "wavelets with memory";
    scene.slopes = force_bounds(model).slope;
    limit_by(random, scene.device, 5.0);
    if (encoder) {
        scene.device.encoder_step = std::exp(test::uniform(random, -8.0, -3.0));
    }
    const auto need = certified_need(
        scene.device, [&](const DeviceProfile& generous) { return certify(model, scene.scheme, generous); });
    if (!need || need->damping <= 0.0) {
        return std::nullopt;
    }
    const NetworkCurve& curve = model.network()->curve();
    const auto force = [&](double x) { return clipped(curve.at(x).value, scene.device); };
    const Least least = least_energy(-5.0, 6.0, force);
    const double count = scene.device.encoder_step;
    const double start = encoder ? count * std::round(least.place / count) : least.place;
    double held = 0.0;
    constexpr int parts = 1000;
    for (int k = 0; k < parts; ++k) {
        held +=
            force(least.place + (start - least.place) * (k + 0.5) / parts) * (start - least.place) / parts;
    }
    scene.places = {.start = start,
                    .held = held + 1e-6 * std::abs(held),
                    .low = -0.1,
                    .high = 1.1,
                    .finest = encoder ? 0.3 * count : 1e-3,
                    .widest = encoder ? 30.0 * count : 1.0,
                    .encoder_step = count,
                    .delay = scene.device.whole_delay_samples(),
                    .late = scene.device.delay_fraction()};
    AnyStructure structure =
        make_structure(model, scene.scheme, scene.device.period_s, scene.device.force_limit);
    return encoder ? friction_trial(random, std::move(structure), scene, *need)
                   : motion_trial(random, std::move(structure), scene, *need);
}

}  // namespace palpate::energy_search
