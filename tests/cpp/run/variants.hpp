// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "palpate/rendering/scheme.hpp"
#include "support.hpp"

namespace palpate::test {

/// A model with a scheme that renders it.
struct Variant {
    std::string name;
    ForceModel model;
    Scheme scheme;
};

/// Returns every structure with every kind of model that it can render, at a period of 1 ms.
inline std::vector<Variant> all_variants() {
    NetworkParameters network;
    network.alpha = {8.0, 20.0, 5.0};
    network.beta = {0.2, 0.3, 0.7};
    network.weight = {0.3, -0.05, 0.4};
    network.linear = {8.0};
    const Domain domain = unit_domain();
    const ForceModel position{network, domain};
    const ForceModel hysteresis{network, {{0.02, 0.01, -0.03}, 0.0, 0.2}, domain, 0.01};
    NetworkParameters with_velocity;
    with_velocity.dimension = 2;
    with_velocity.alpha = {8.0, 1.0, 5.0, 0.5};
    with_velocity.beta = {0.2, 0.0, 0.7, 0.5};
    with_velocity.weight = {0.3, 0.4};
    with_velocity.linear = {8.0, 0.05};
    std::vector<Variant> variants;
    const auto add = [&](std::string name, const ForceModel& model, const Scheme& scheme) {
        validate(scheme, model, 1e-3);
        variants.push_back({std::move(name), model, scheme});
    };
    for (std::size_t kind = 0; kind < structure_names.size(); ++kind) {
        Scheme scheme;
        scheme.structure = static_cast<StructureKind>(kind);
        const std::string name{structure_names[kind]};
        add(name + ", position", position, scheme);
        add(name + ", hysteresis", hysteresis, scheme);
        if (has_coupling(scheme.structure)) {
            scheme.compensated = true;
            scheme.coupling.stiffness = 500.0;
            add(name + ", compensated", position, scheme);
        }
        if (traits_of(scheme.structure).predicts) {
            scheme.predict = most_prediction_taps;
            add(name + ", predicted", position, scheme);
            add(name + ", predicted hysteresis", hysteresis, scheme);
        }
    }
    Scheme direct;
    direct.structure = StructureKind::Direct;
    add("direct, velocity",
        ForceModel::of_velocity(with_velocity, {{0.0, -2.0}, {1.0, 2.0}, {}, {}, std::nullopt}), direct);
    add("direct, memory",
        position.with_memory({.ratio = {1, {4.0}, {0.5}, {0.2}, {0.1}, 1.0},
                              .stiffness = {2.0, 5.0},
                              .time_constant_s = {0.05, 1.0}}),
        direct);
    return variants;
}

}  // namespace palpate::test
