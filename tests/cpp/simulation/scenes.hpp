// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <ostream>
#include <utility>

#include "palpate/model/energy.hpp"
#include "palpate/rendering/compensated.hpp"
#include "palpate/rendering/make_structure.hpp"
#include "palpate/simulation/closed_loop.hpp"
#include "palpate/simulation/hand.hpp"
#include "palpate/stability/certificate.hpp"
#include "support.hpp"

namespace palpate::test {

/// Continues a simulation after each tick.
inline constexpr auto to_the_end = [](const Tick& /*tick*/, const Motion& /*handle*/,
                                      const EnergyBalance& /*account*/) { return true; };

/// A hand that takes hold of a resting handle some time after the start, so that the first forces of a device with
/// delay find the object at rest.
template <SimulatedHand H>
struct Later {
    H hand;
    double from = 0.0;  ///< time at which the hand takes hold of the handle [s]

    [[nodiscard]] Grip grip(double time, const Motion& handle) noexcept {
        return time < from ? Grip{1e9, 1e6, handle.position, 0.0, 0.0} : hand.grip(time, handle);
    }
};

/// A certified rendering: model, scheme, device profile and start position.
struct Scene {
    ForceModel model;
    Scheme scheme;
    DeviceProfile device;
    double start = 0.0;
    double steepest = 0.0;  ///< position at which the slope f' of the force is largest [m or rad]

    /// `held`: stored energy at the start minus the least stored energy; `largest`: largest absolute stored energy |V|
    /// [J].
    double held = 0.0;
    double largest = 0.0;
};

/// Returns a random force model of position, with or without hysteresis.
inline ForceModel random_model(Random& random, bool hysteresis) {
    NetworkParameters network = random_network(random, random() % 7);
    if (random() % 2 == 0) {  // a force that rises at every position
        network.linear[0] -= slope_bounds(network, 0.0, 1.0).lower;
    }
    const auto side = [&] { return random() % 2 == 0 ? Continuation::Linear : Continuation::Free; };
    const Domain domain = unit_domain(side(), side());
    if (!hysteresis) {
        return {network, domain};
    }
    HysteresisParameters hysteresis_part;
    NetworkParameters h = network;
    h.linear = {0.0};
    h.bias = 0.0;
    for (double& weight : h.weight) {
        weight *= uniform(random, -0.3, 0.3);
    }
    hysteresis_part.weight = h.weight;
    hysteresis_part.bias = 0.01 - value_bounds(h, 0.0, 1.0, 1e-4).lower + uniform(random, 0.0, 0.1);
    return {network, hysteresis_part, domain, uniform(random, 0.005, 0.05)};
}

/// Returns the position at which the slope of the force is largest.
inline double steepest_place(const ForceModel& model) {
    double place = 0.0;
    double most = -1e300;
    for (int k = 0; k <= 400; ++k) {
        const double x = k / 400.0;
        const double slope = model.velocity() != nullptr     ? model.velocity()->force(x + 1e-4, 0.0) -
                                                                   model.velocity()->force(x - 1e-4, 0.0)
                             : model.hysteresis() != nullptr ? model.hysteresis()->sliding(x, 0.0).slope
                                                             : model.network()->at(x, {}).slope;
        if (slope > most) {
            most = slope;
            place = x;
        }
    }
    return place;
}

/// Returns the energy V that the virtual object of a structure stores at rest [J].
inline double energy_at(const ForceModel& model, const Scheme& scheme, double x) {
    if (scheme.compensated) {
        return Compensated{*model.network(), scheme.coupling.stiffness}.at(x, {}).energy;
    }
    return model.hysteresis() != nullptr ? model.hysteresis()->force().at(x).integral
                                         : model.network()->at(x, {}).energy;
}

/// Returns the device with `factor` times the damping and friction that the certificate requires; nothing if no damping
/// and friction are sufficient.
inline std::optional<DeviceProfile> device_at_its_bound(const ForceModel& model, const Scheme& scheme,
                                                        DeviceProfile device, double factor) {
    constexpr double placeholder_damping = 12345.0;
    constexpr double any_friction = 54321.0;
    device.viscous_damping = placeholder_damping;
    device.coulomb_friction = any_friction;
    const Certificate generous = certify(model, scheme, device);
    if (!generous.certified()) {
        return std::nullopt;
    }
    device.viscous_damping = device.coulomb_friction = 0.0;
    for (const Inequality& line : generous.inequalities) {
        if (line.left == placeholder_damping) {
            device.viscous_damping = std::max(device.viscous_damping, line.right * factor);
        } else if (line.left == any_friction) {
            device.coulomb_friction = std::max(device.coulomb_friction, line.right * factor);
        }
    }
    return device;
}

/// Returns a random certified scene, whose device has `factor` times the required damping and friction.
inline Scene random_certified_scene(Random& random, double factor) {
    for (;;) {
        constexpr std::array kinds{StructureKind::Direct, StructureKind::Massless, StructureKind::Implicit,
                                   StructureKind::EnergyConsistent};
        const ForceModel model = random_model(random, random() % 3 == 0);
        const double scale = std::max(1.0, model.slope_bounds().largest());
        Scheme scheme;
        scheme.structure = kinds[random() % kinds.size()];
        scheme.coupling = {scale * std::exp(uniform(random, -1.5, 1.5)), 0.0};
        if (random() % 3 != 0) {
            scheme.coupling.damping = scheme.coupling.stiffness * 1e-3 * uniform(random, 0.0, 2.0);
        }
        scheme.inertia = {std::exp(uniform(random, -10.0, -5.0)), uniform(random, 0.0, 0.1)};
        scheme.compensated = scheme.structure == StructureKind::Massless && model.hysteresis() == nullptr &&
                             model.network()->curve().slopes_everywhere().upper <=
                                 compensated_share * scheme.coupling.stiffness &&
                             random() % 2 == 0;
        if (scheme.structure == StructureKind::Direct && random() % 2 == 0) {
            scheme.predict = 1 << random() % 4;
        }
        DeviceProfile device;
        device.period_s = uniform(random, 3e-4, 2e-3);
        device.inertia = std::exp(uniform(random, -10.0, -5.0));
        device.delay_s = static_cast<double>(random() % 3) * device.period_s;
        device.force_limit = 1e9;
        const bool steps = random() % 2 == 0 && !has_mass(scheme.structure);
        device.encoder_step = steps ? std::exp(uniform(random, -11.0, -5.0)) : 0.0;
        device.force_step = random() % 3 == 0 ? uniform(random, 0.0, 0.02) : 0.0;
        const std::optional<DeviceProfile> enough = device_at_its_bound(model, scheme, device, factor);
        if (!enough) {
            continue;
        }
        double start = uniform(random, -0.1, 1.1);
        if (steps) {
            start = device.encoder_step * std::floor(start / device.encoder_step);
        }
        const EnergyRange range = energy_range(model);
        return {model,
                scheme,
                *enough,
                start,
                steepest_place(model),
                energy_at(model, scheme, start) - range.least,
                std::max(std::abs(range.least), std::abs(range.largest))};
    }
}

/// Returns a scene with this model, rendered directly on a random device without damping and friction.
inline Scene random_direct_scene(Random& random, ForceModel model) {
    Scene scene{std::move(model), {}, {}};
    scene.scheme.structure = StructureKind::Direct;
    DeviceProfile& device = scene.device;
    device.period_s = uniform(random, 3e-4, 2e-3);
    device.inertia = std::exp(uniform(random, -10.0, -5.0));
    device.delay_s = static_cast<double>(random() % 3) * device.period_s;
    device.encoder_step = random() % 2 == 0 ? 0.0 : std::exp(uniform(random, -11.0, -6.0));
    device.force_limit = 1e9;
    device.viscous_damping = device.coulomb_friction = 0.0;
    scene.steepest = steepest_place(scene.model);
    scene.start = std::max(device.encoder_step, 1e-3) * std::round(uniform(random, 0.0, 100.0));
    return scene;
}

/// Returns a scene with a random network of position and velocity.
inline Scene random_scene_of_velocity(Random& random) {
    NetworkParameters network = random_network(random, random() % 7, 2);
    const double fastest = uniform(random, 0.2, 5.0);
    for (std::size_t i = 0; i < network.weight.size(); ++i) {
        network.alpha[2 * i + 1] = std::exp(uniform(random, -1.0, 2.0)) / fastest;
        network.beta[2 * i + 1] = uniform(random, -1.0, 1.0) * fastest;
    }
    network.linear[1] = uniform(random, -0.2, 0.2);  // damping of the object, positive or negative
    const double slowest = random() % 4 == 0 ? uniform(random, 0.0, 0.1) : -fastest;
    return random_direct_scene(
        random, ForceModel::of_velocity(network, {{0.0, slowest}, {1.0, fastest}, {}, {}, std::nullopt}));
}

/// Returns a scene with a random force of position with memory.
inline Scene random_scene_of_memory(Random& random) {
    return random_direct_scene(random, random_model(random, false).with_memory(random_memory(random)));
}

/// Runs a scene in a closed control loop and computes the energy account of hand, device and object.
template <SimulatedHand H, class Watch>
ClosedLoopEnd run(const Scene& scene, H hand, std::size_t ticks, int substeps, Watch watch) {
    const double from = (scene.device.late_samples() + 2) * scene.device.period_s;
    const ClosedLoopSettings settings{substeps, scene.start, 0.0, Guards{.limit = {1e9}}};
    return closed_loop(
        make_structure(scene.model, scene.scheme, scene.device.period_s, scene.device.force_limit),
        scene.device, Later<H>{hand, from}, ticks, settings, watch);
}

inline std::ostream& operator<<(std::ostream& out, const Scene& scene) {
    return out << name_of(scene.scheme.structure) << " predict " << scene.scheme.predict
               << (scene.model.hysteresis() != nullptr ? " hysteresis" : "")
               << (scene.scheme.compensated ? " compensated" : "")
               << ", K_c = " << scene.scheme.coupling.stiffness << ", B_c = " << scene.scheme.coupling.damping
               << ", m = " << scene.scheme.inertia.mass << ", B_o = " << scene.scheme.inertia.damping
               << ", T = " << scene.device.period_s << ", J = " << scene.device.inertia
               << ", b = " << scene.device.viscous_damping << ", f_c = " << scene.device.coulomb_friction
               << ", encoder step " << scene.device.encoder_step << ", force step " << scene.device.force_step
               << ", delay " << scene.device.late_samples() << ", start " << scene.start;
}

}  // namespace palpate::test
