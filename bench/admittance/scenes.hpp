// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>
#include <random>
#include <utility>

#include "palpate/rendering/admittance.hpp"
#include "palpate/rendering/energy_consistent.hpp"
#include "palpate/rendering/explicit.hpp"
#include "palpate/rendering/implicit.hpp"
#include "palpate/simulation/simulated_display.hpp"
#include "palpate/stability/admittance_inequalities.hpp"

// Random admittance displays with objects and hands, and the energy that the muscles take out of them.
namespace palpate::bench {

/// Spring with a wave: f = K y + A sin(y / w), with slopes from K - A / w to K + A / w.
struct WavySpring {
    using State = Stateless;
    double stiffness = 0.0;
    double amplitude = 0.0;
    double width = 1.0;

    [[nodiscard]] EnvironmentSample at(double y, const State& /*stateless*/) const noexcept {
        const double u = y / width;
        return {stiffness * y + amplitude * std::sin(u), stiffness + amplitude / width * std::cos(u),
                energy(y), false};
    }
    void advance(double /*y*/, State& /*stateless*/) const noexcept {}
    [[nodiscard]] State start(double /*y*/) const noexcept { return {}; }
    [[nodiscard]] double energy(double y) const noexcept {
        return 0.5 * stiffness * y * y + amplitude * width * (1.0 - std::cos(y / width));
    }
    [[nodiscard]] ForceBounds bounds() const noexcept {
        ForceBounds found;
        const double wave = std::abs(amplitude) / width;
        found.slope = {stiffness - wave, stiffness + wave};
        found.steepest = found.sliding = found.slope.largest();
        return found;
    }
    /// Returns the least stored energy, a lower bound: the spring stores nothing at 0, and the wave at least
    /// -|A w| (1 - cos) where A is negative.
    [[nodiscard]] double least_energy() const noexcept { return std::min(0.0, 2.0 * amplitude * width); }
};

/// A display, its object and its hand.
struct Scene {
    DeviceProfile device;
    WavySpring object;
    StructureKind structure = StructureKind::Implicit;
    Inertia inertia;
    Grip hand;
    double needed = 0.0;  ///< B_o of the certificate [N*s/m]
};

/// Returns a random scene whose object has the damping `share` times that of the certificate.
template <class Random>
[[nodiscard]] Scene random_scene(Random& random, double share) {
    const auto between = [&](double low, double high) {
        return std::uniform_real_distribution{low, high}(random);
    };
    const auto pick = [&](int count) { return std::uniform_int_distribution{0, count - 1}(random); };
    const auto log_between = [&](double low, double high) {
        return low * std::pow(high / low, between(0.0, 1.0));
    };
    Scene scene;
    DeviceProfile& device = scene.device;
    device.position_unit = "m";
    device.period_s = log_between(2e-4, 4e-3);
    device.delay_s = device.period_s * (pick(3) + (pick(3) == 0 ? between(0.0, 1.0) : 0.0));
    device.delay_s = std::min(device.delay_s, 2.0 * device.period_s);
    AdmittanceDisplay display;
    display.hand_stiffness = log_between(500.0, 3e4);
    const int order = pick(3);
    if (order > 0) {
        display.servo_bandwidth_hz = log_between(8.0, 0.1 / device.period_s);
        display.hand_damping = pick(2) == 0 ? 0.0 : log_between(1.0, 100.0);
    }
    if (order == 2) {
        display.servo_damping = between(0.5, 1.5);
        display.hand_mass = pick(2) == 0 ? 0.0 : between(0.0, 0.3);
        display.handle_mass = pick(2) == 0 ? 0.0 : between(0.0, 0.2);
    }
    if (pick(5) == 0) {
        display.feed_forward_s =
            between(0.2, 1.0) * Servo{display.servo_bandwidth_hz, display.servo_damping}.lag_s();
    }
    if (pick(5) == 0) {
        display.rate_limit = log_between(0.02, 0.5);
    }
    if (pick(5) == 0) {
        display.position_step = log_between(1e-6, 5e-5);
        device.force_step = log_between(1e-3, 0.1);
    }
    device.admittance = display;
    scene.structure = std::array{StructureKind::Implicit, StructureKind::Explicit,
                                 StructureKind::EnergyConsistent}[static_cast<std::size_t>(pick(3))];
    scene.object = {pick(3) == 0 ? 0.0 : log_between(100.0, 1e4), 0.0, log_between(2e-4, 5e-3)};
    scene.object.amplitude = pick(3) == 0 ? 0.0 : between(-1.0, 1.0) * 5e3 * scene.object.width;
    const double mass = log_between(0.2, 5.0);
    const ForceBounds bounds = scene.object.bounds();
    // The explicit structure is proved for a mass of at least B_o T only
    scene.inertia =
        admittance_object(scene.structure, bounds, {mass, 0.0}, device,
                          scene.structure == StructureKind::Explicit ? std::nullopt : std::optional{mass});
    scene.needed = scene.inertia.damping;
    scene.inertia.damping *= share;
    const auto part = [&](double most) {
        return most * (pick(2) == 0 ? static_cast<double>(pick(2)) : between(0.0, 1.0));
    };
    scene.hand = {.stiffness = pick(2) == 0 ? display.hand_stiffness : part(display.hand_stiffness),
                  .damping = part(display.hand_damping),
                  .mass = part(display.hand_mass)};
    return scene;
}

/// Returns the admittance of a scene's object.
[[nodiscard]] inline Admittance source_of(const Scene& scene) {
    const VirtualCoupling none{0.0, 0.0};
    const double T = scene.device.period_s;
    switch (scene.structure) {
        case StructureKind::Explicit:
            return {Explicit{scene.object, scene.inertia, none, T}, scene.device};
        case StructureKind::EnergyConsistent:
            return {EnergyConsistent{scene.object, scene.inertia, none, T, 1e-2 * scene.object.width},
                    scene.device};
        default:
            return {Implicit{scene.object, scene.inertia, none, T}, scene.device};
    }
}

/// Kind of the muscles' force: noise, a sine of one frequency, or a push followed by a force against the motion.
enum class Muscles : std::uint8_t { Noise, Sine, AgainstMotion };

/// Energy that the muscles took out of a scene, and the most that the certificate allows [J].
struct Taken {
    double energy = 0.0;
    double allowed = 0.0;

    [[nodiscard]] double ratio() const noexcept { return energy / allowed; }
};

/// Returns the largest frequency theta at which a scene needs nearly its object damping: the best frequency of a sine
/// that takes energy out.
[[nodiscard]] inline double critical_frequency(const Scene& scene) {
    const double T = scene.device.period_s;
    const AdmittanceNeed need{scene.device, step_slope(scene.structure, scene.object.bounds())};
    const double inertial = dissipating_inertia(scene.structure, {scene.inertia.mass, scene.needed}, T);
    constexpr int frequencies = 2000;
    double best = 1e-3;
    for (int k = 1; k <= frequencies; ++k) {
        const double theta = std::numbers::pi * k / frequencies;
        if (T * (need.at(theta) - inertial * (1.0 - std::cos(theta))) > 0.97 * scene.needed) {
            best = theta;
        }
    }
    return best;
}

/// Simulates a scene with random muscles and returns the energy that they took out. The object is at rest at 0.
template <class Random>
[[nodiscard]] Taken take(const Scene& scene, Muscles muscles, int samples, Random& random) {
    Admittance source = source_of(scene);
    SimulatedDisplay display{scene.device};
    std::normal_distribution<double> normal;
    const double size = 5.0 * std::pow(10.0, std::uniform_real_distribution{-1.0, 1.0}(random));
    const double theta =
        critical_frequency(scene) * (muscles == Muscles::Sine ? std::exp(0.2 * normal(random)) : 1.0);
    const double drag = scene.needed * std::pow(10.0, std::uniform_real_distribution{-1.5, 0.5}(random));
    double y = 0.0;
    double speed = 0.0;
    double noise = 0.0;
    double work = 0.0;
    Taken taken;
    taken.allowed = scene.object.energy(0.0) - scene.object.least_energy();
    double largest = 0.0;
    for (int k = 0; k < samples; ++k) {
        double push = 0.0;
        if (muscles == Muscles::Sine) {
            push = size * std::sin(theta * k);
        } else if (muscles == Muscles::Noise) {
            noise += theta * (size * normal(random) / std::sqrt(theta) - noise);
            push = noise;
        } else {
            push = k < 200 ? size : -drag * speed;
        }
        Grip grip = scene.hand;
        grip.push = push;
        const PositionCommand command = source.step(display.measured(display.force(grip)));
        const double next = command.object.environment_position;
        work += push * (next - y);
        largest = std::max(largest, std::abs(push * (next - y)));
        speed = (next - y) / scene.device.period_s;
        y = next;
        display.move(command.position);
        taken.energy = std::max(taken.energy, -work);
        if (!(std::abs(y) < 1e6)) {
            break;
        }
    }
    // Rounding of the sums; the object starts with no kinetic energy and the hand with no stored energy
    taken.allowed += 1e-9 * std::max(largest, 1e-12) * samples;
    return taken;
}

}  // namespace palpate::bench
