// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "../support.hpp"
#include "force_laws.hpp"
#include "held_scenes.hpp"
#include "line.hpp"
#include "palpate/rendering/any_structure.hpp"
#include "palpate/rendering/direct.hpp"
#include "palpate/rendering/make_structure.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/stability/certificate.hpp"

namespace palpate::energy_search {

/// Grid of positions of a search: a few positions with jumps between all of them, or many positions with short moves.
struct Fineness {
    int nodes = 24;
    int reach = 23;
};

/// Returns the number of earlier positions that a search must store for a delay in samples.
[[nodiscard]] inline int samples_of(double delay) {
    return static_cast<int>(std::ceil(delay));
}

[[nodiscard]] inline Fineness random_fineness(test::Random& random, int memory, Shapes shapes = Shapes::Any) {
    if (shapes == Shapes::Steep || random() % 2 == 0) {
        constexpr int fine[] = {400, 200, 100, 40};
        return {fine[std::min(memory, 3)], memory > 2 ? 2 : 3};
    }
    constexpr int coarse[] = {24, 20, 12, 7};
    return {coarse[std::min(memory, 3)], 23};
}

/// Returns a device without force limit, encoder steps or command steps. `delay` is in samples. A device without delay
/// may have jitter of its sample times.
[[nodiscard]] inline DeviceProfile random_device(test::Random& random, double delay) {
    DeviceProfile device;
    device.period_s = test::uniform(random, 3e-4, 2e-3);
    device.jitter_s =
        delay > 0.0 || random() % 2 == 0 ? 0.0 : device.period_s * test::uniform(random, 0.0, 0.5);
    device.delay_s = delay * device.period_s;
    device.encoder_step = 0.0;
    device.force_step = 0.0;
    device.force_limit = 1e9;
    return device;
}

/// Sets a force limit of the device in half of the scenes.
inline void limit_by(test::Random& random, DeviceProfile& device, double largest) {
    if (random() % 2 == 0 && largest > 0.0) {
        device.force_limit = largest * test::uniform(random, 0.2, 1.0);
    }
}

[[nodiscard]] inline double largest_of(const std::vector<double>& forces) {
    double most = 0.0;
    for (const double force : forces) {
        most = std::max(most, std::abs(force));
    }
    return most;
}

[[nodiscard]] inline Sent sent_on(const DeviceProfile& device) {
    Sent sent;
    sent.guards.limit.largest = device.force_limit;
    sent.force_step = device.force_step;
    return sent;
}

[[nodiscard]] inline double clipped(double force, const DeviceProfile& device) {
    return std::clamp(force, -device.force_limit, device.force_limit);
}

/// Returns a trial that searches for a motion that takes energy out. The force is held constant during each sample; the
/// positions lie on a grid.
[[nodiscard]] inline Trial trial_of(HeldScene scene, const Need& need, const DeviceProfile& device) {
    scene.need = {need.damping / device.longest_period_s(), need.friction, device.whole_delay_samples(),
                  device.delay_fraction()};
    auto shared = std::make_shared<const HeldScene>(std::move(scene));
    return {
        [shared](double damping, double friction) { return shared->search(damping, friction).violated(); },
        need};
}

/// Makes a static force of straight pieces, rendered directly or through a coupling without damper.
[[nodiscard]] inline std::optional<Trial> draw_static_pieces(test::Random& random, const Scheme& scheme,
                                                             double delay, Shapes shapes) {
    const Fineness fine = random_fineness(random, samples_of(delay), shapes);
    const double step = std::exp(test::uniform(random, -6.0, -2.0));
    const Pieces pieces{0.0, step,
                        random_forces(random, fine.nodes, step, random_slopes(random, shapes), shapes)};
    DeviceProfile device = random_device(random, delay);
    limit_by(random, device, largest_of(pieces.points()));
    const auto need = certified_need(
        device, [&](const DeviceProfile& generous) { return certify(bounds_of(pieces), scheme, generous); });
    if (!need || need->damping <= 0.0) {
        return std::nullopt;
    }
    HeldScene scene;
    scene.read = even_grid(0.0, step, fine.nodes, fine.reach);
    scene.table = table_of(Direct{PieceObject{pieces}}, scene.read, 0, sent_on(device));
    scene.held = held_energy(scene.read.grid, [&](double x) { return clipped(pieces.at(x).value, device); });
    return trial_of(std::move(scene), *need, device);
}

/// Returns one to three wavelets and a straight line over [0, 1].
[[nodiscard]] inline NetworkParameters small_network(test::Random& random) {
    return test::random_network(random, 1 + random() % 3);
}

/// Returns the position at which the absolute slope of `force` is largest.
template <class Force>
[[nodiscard]] double steepest_place(const Force& force) {
    double place = 0.0;
    double most = -1.0;
    for (int k = 0; k <= 1000; ++k) {
        const double x = k / 1000.0;
        const double slope = std::abs(force(x + 1e-5) - force(x - 1e-5));
        if (slope > most) {
            most = slope;
            place = x;
        }
    }
    return place;
}

/// Makes a scene of a wavelet network in position and a structure whose force depends only on the current position.
[[nodiscard]] inline std::optional<Trial> draw_static_network(test::Random& random, double delay,
                                                              bool coupled) {
    const Fineness fine = random_fineness(random, samples_of(delay));
    const ForceModel model{small_network(random), test::unit_domain()};
    const NetworkCurve& curve = model.network()->curve();
    const auto force = [&](double x) { return curve.at(x).value; };
    Scheme scheme;
    scheme.structure = StructureKind::Direct;
    if (coupled) {
        const double steepest = std::max(1.0, model.slope_bounds().largest());
        scheme.structure = StructureKind::Massless;
        scheme.coupling = {steepest * std::exp(test::uniform(random, 0.2, 2.0)), 0.0};
        scheme.compensated = random() % 2 == 0;
    }
    DeviceProfile device = random_device(random, delay);
    limit_by(random, device, curve.value_bounds().largest());
    const auto need = certified_need(
        device, [&](const DeviceProfile& generous) { return certify(model, scheme, generous); });
    if (!need || need->damping <= 0.0) {
        return std::nullopt;
    }
    const double width = std::exp(test::uniform(random, -5.0, 0.0));
    const double step = width / (fine.nodes - 1);
    const double place = steepest_place(force) - width * test::uniform(random, 0.3, 0.7);
    HeldScene scene;
    scene.read = even_grid(place, step, fine.nodes, fine.reach);
    AnyStructure structure = make_structure(model, scheme, device.period_s, device.force_limit);
    scene.table = table_of(structure, scene.read, 0, sent_on(device));
    // Behind a virtual coupling the force at handle position x is the force of the virtual object at its position y,
    // so the rendered force is again static.
    scene.held = held_energy(scene.read.grid, [&](double x) {
        if (coupled) {
            structure.reset(x);
        }
        return clipped(coupled ? structure.step(x).force : force(x), device);
    });
    return trial_of(std::move(scene), *need, device);
}

[[nodiscard]] inline std::optional<Trial> draw_direct(test::Random& random, double delay) {
    Scheme scheme;
    scheme.structure = StructureKind::Direct;
    return random() % 2 == 0 ? draw_static_pieces(random, scheme, delay, Shapes::Any)
                             : draw_static_network(random, delay, false);
}

[[nodiscard]] inline std::optional<Trial> draw_direct_steep(test::Random& random, double delay) {
    Scheme scheme;
    scheme.structure = StructureKind::Direct;
    return draw_static_pieces(random, scheme, delay, Shapes::Steep);
}

[[nodiscard]] inline std::optional<Trial> draw_spring_behind_coupling(test::Random& random, double delay) {
    return draw_static_network(random, delay, true);
}

/// Makes a mean force g and a hysteresis h of straight pieces; the play radius is a whole number of grid steps.
[[nodiscard]] inline std::optional<Trial> draw_hysteresis_pieces(test::Random& random, double delay) {
    const bool far = random() % 2 == 0;
    const int nodes = far ? (samples_of(delay) == 0   ? 60
                             : samples_of(delay) == 1 ? 40
                                                      : 24)
                          : (samples_of(delay) == 0   ? 20
                             : samples_of(delay) == 1 ? 14
                                                      : 8);
    const int reach = far ? (samples_of(delay) == 2 ? 2 : 3) : nodes - 1;
    const int radius = 1 + static_cast<int>(random() % 4);
    const double step = std::exp(test::uniform(random, -6.0, -2.0));
    std::vector<double> h = random_forces(random, nodes, step, random_slopes(random));
    const double least = *std::min_element(h.begin(), h.end());
    const double size = test::uniform(random, 0.0, 1.0);
    const bool even = random() % 2 == 0;
    for (double& value : h) {
        value = even ? size : size * (value - least);
    }
    const HysteresisPair<Pieces> pair{
        Pieces{0.0, step, random_forces(random, nodes, step, random_slopes(random))}, Pieces{0.0, step, h},
        radius * step};
    Scheme scheme;
    scheme.structure = StructureKind::Direct;
    DeviceProfile device = random_device(random, delay);
    limit_by(random, device, largest_of(pair.force().points()) + largest_of(h));
    const auto need = certified_need(
        device, [&](const DeviceProfile& generous) { return certify(bounds_of(pair), scheme, generous); });
    if (!need || need->damping <= 0.0) {
        return std::nullopt;
    }
    HeldScene scene;
    scene.read = even_grid(0.0, step, nodes, reach);
    scene.table = play_table_of(Direct{pair}, scene.read, radius, sent_on(device));
    scene.held =
        held_energy(scene.read.grid, [&](double x) { return clipped(pair.force().at(x).value, device); });
    return trial_of(std::move(scene), *need, device);
}

[[nodiscard]] inline ForceModel small_hysteresis(test::Random& random, double radius) {
    const NetworkParameters network = small_network(random);
    NetworkParameters h = network;
    h.linear = {0.0};
    h.bias = 0.0;
    for (double& weight : h.weight) {
        weight *= test::uniform(random, -0.5, 0.5);
    }
    HysteresisParameters hysteresis;
    hysteresis.weight = h.weight;
    hysteresis.bias = 0.01 - value_bounds(h, 0.0, 1.0, 1e-4).lower + test::uniform(random, 0.0, 0.2);
    return {network, hysteresis, test::unit_domain(), radius};
}

[[nodiscard]] inline std::optional<Trial> draw_hysteresis_network(test::Random& random, double delay) {
    const int nodes = samples_of(delay) == 0 ? 40 : samples_of(delay) == 1 ? 30 : 14;
    const int reach = samples_of(delay) == 0 ? 39 : samples_of(delay) == 1 ? 8 : 4;
    const int radius = 1 + static_cast<int>(random() % 6);
    const double width = std::exp(test::uniform(random, -4.0, -0.5));
    const double step = width / (nodes - 1);
    const ForceModel model = small_hysteresis(random, radius * step);
    const HysteresisNetwork& pair = *model.hysteresis();
    Scheme scheme;
    scheme.structure = StructureKind::Direct;
    DeviceProfile device = random_device(random, delay);
    limit_by(random, device, pair.force().value_bounds().largest());
    const auto need = certified_need(
        device, [&](const DeviceProfile& generous) { return certify(model, scheme, generous); });
    if (!need || need->damping <= 0.0) {
        return std::nullopt;
    }
    const auto stick = [&](double x) {
        const Curve g = pair.force().at(x);
        // The slope of this function is g' + h/r, for the mean force g, hysteresis h and play radius r.
        return g.value + pair.hysteresis_force().at(x).integral / pair.play_radius();
    };
    HeldScene scene;
    scene.read =
        even_grid(steepest_place(stick) - width * test::uniform(random, 0.3, 0.7), step, nodes, reach);
    scene.table = play_table_of(make_structure(model, scheme, device.period_s, device.force_limit),
                                scene.read, radius, sent_on(device));
    scene.held =
        held_energy(scene.read.grid, [&](double x) { return clipped(pair.force().at(x).value, device); });
    return trial_of(std::move(scene), *need, device);
}

[[nodiscard]] inline std::optional<Trial> draw_hysteresis(test::Random& random, double delay) {
    return random() % 3 != 0 ? draw_hysteresis_pieces(random, delay) : draw_hysteresis_network(random, delay);
}

/// Makes a force of position and velocity: a straight line in both quantities, or a few wavelets.
[[nodiscard]] inline std::optional<Trial> draw_velocity(test::Random& random, double delay) {
    const bool far = random() % 2 == 0;
    const int nodes = far ? 60 : (samples_of(delay) == 0 ? 16 : samples_of(delay) == 1 ? 9 : 6);
    const int reach = far ? (samples_of(delay) == 2 ? 1 : 2) : nodes - 1;
    DeviceProfile device = random_device(random, delay);
    const double width = std::exp(test::uniform(random, -4.0, 0.0));
    const double step = width / (nodes - 1);
    const double fastest = step * reach / device.period_s;
    NetworkParameters network = test::random_network(random, random() % 2 == 0 ? 0 : 1 + random() % 2, 2);
    for (std::size_t i = 0; i < network.weight.size(); ++i) {
        network.alpha[2 * i + 1] = std::exp(test::uniform(random, -1.0, 1.0)) / fastest;
        network.beta[2 * i + 1] = test::uniform(random, -1.0, 1.0) * fastest;
    }
    // The slope of the force over velocity has a size similar to the damping b that a spring requires.
    network.linear[1] = test::uniform(random, -1.0, 0.3) * 4.0 * device.period_s;
    const ForceModel model =
        ForceModel::of_velocity(network, {{0.0, -fastest}, {1.0, fastest}, {}, {}, std::nullopt});
    const VelocityNetwork& force = *model.velocity();
    const auto resting = [&](double x) { return force.force(x, 0.0); };
    limit_by(random, device, std::abs(resting(0.5)) + std::abs(resting(0.0)));
    Scheme scheme;
    scheme.structure = StructureKind::Direct;
    const auto need = certified_need(
        device, [&](const DeviceProfile& generous) { return certify(model, scheme, generous); });
    if (!need || need->damping <= 0.0) {
        return std::nullopt;
    }
    HeldScene scene;
    scene.read =
        even_grid(steepest_place(resting) - width * test::uniform(random, 0.3, 0.7), step, nodes, reach);
    scene.table = table_of(DirectVelocity{force, device.period_s}, scene.read, 1, sent_on(device));
    scene.held = held_energy(scene.read.grid, [&](double x) { return clipped(resting(x), device); });
    return trial_of(std::move(scene), *need, device);
}

/// Makes a scene of an encoder with steps: the handle may be anywhere within the current encoder step.
[[nodiscard]] inline std::optional<Trial> draw_encoder(test::Random& random, double delay, bool hysteresis) {
    const int counts = hysteresis               ? (samples_of(delay) == 0   ? 14
                                                   : samples_of(delay) == 1 ? 8
                                                                            : 4)
                       : samples_of(delay) == 0 ? 24
                       : samples_of(delay) == 1 ? 12
                                                : 6;
    const int within = samples_of(delay) == 0 ? 2 : 1;
    const double step = std::exp(test::uniform(random, -6.0, -2.0));
    DeviceProfile device = random_device(random, delay);
    device.encoder_step = step;
    HeldScene scene;
    scene.read = encoder_grid(0.0, step, counts, within);
    Scheme scheme;
    scheme.structure = StructureKind::Direct;
    double at_start = 0.0;
    const Pieces g{0.0, step, random_forces(random, counts, step, random_slopes(random))};
    std::optional<Need> need;
    if (hysteresis) {
        std::vector<double> h = random_forces(random, counts, step, random_slopes(random));
        const double least = *std::min_element(h.begin(), h.end());
        const bool even = random() % 2 == 0;
        for (double& value : h) {
            value = even ? 0.3 : 0.3 * (value - least);
        }
        const int radius = 1 + static_cast<int>(random() % 3);
        const HysteresisPair<Pieces> pair{g, Pieces{0.0, step, h}, radius * step};
        limit_by(random, device, largest_of(g.points()) + largest_of(h));
        const auto certified = [&](const DeviceProfile& generous) {
            return certify(bounds_of(pair), scheme, generous);
        };
        need = certified_need(device, certified);
        if (need && random() % 2 == 0) {
            need = need_at_less_friction(device, *need, certified).value_or(*need);
        }
        // The play operator follows the reading of the encoder and rests at the reported position; the handle is up to
        // half an encoder step away from this position.
        at_start = bounds_of(pair).hysteresis_per_play * step * step / 8.0;
        scene.table = play_table_of(Direct{pair}, scene.read, radius, sent_on(device));
    } else {
        limit_by(random, device, largest_of(g.points()));
        need = certified_need(
            device, [&](const DeviceProfile& generous) { return certify(bounds_of(g), scheme, generous); });
        scene.table = table_of(Direct{PieceObject{g}}, scene.read, 0, sent_on(device));
    }
    if (!need || need->friction <= 0.0) {
        return std::nullopt;
    }
    scene.held = held_energy(scene.read.grid, [&](double x) { return clipped(g.at(x).value, device); });
    for (double& energy : scene.held) {
        energy += at_start;
    }
    return trial_of(std::move(scene), *need, device);
}

/// Makes a scene of a device whose command has steps, with short moves around a position at which the rounded command
/// changes.
[[nodiscard]] inline std::optional<Trial> draw_force_step(test::Random& random, double delay) {
    const Fineness fine = random_fineness(random, samples_of(delay));
    const double step = std::exp(test::uniform(random, -6.0, -2.0));
    std::vector<double> forces = random_forces(random, fine.nodes, step, random_slopes(random));
    DeviceProfile device = random_device(random, delay);
    device.force_step = largest_of(forces) * std::exp(test::uniform(random, -3.0, 3.0));
    for (double& force : forces) {
        force += 0.5 * device.force_step;
    }
    const Pieces pieces{0.0, step, forces};
    limit_by(random, device, largest_of(forces));
    Scheme scheme;
    scheme.structure = StructureKind::Direct;
    const auto need = certified_need(
        device, [&](const DeviceProfile& generous) { return certify(bounds_of(pieces), scheme, generous); });
    if (!need || need->friction <= 0.0) {
        return std::nullopt;
    }
    HeldScene scene;
    scene.read = even_grid(0.0, step, fine.nodes, fine.reach);
    scene.table = table_of(Direct{PieceObject{pieces}}, scene.read, 0, sent_on(device));
    scene.held = held_energy(scene.read.grid, [&](double x) { return clipped(pieces.at(x).value, device); });
    return trial_of(std::move(scene), *need, device);
}

/// Makes a static force on a device with jitter of the sample times and a delay in seconds.
[[nodiscard]] inline std::optional<Trial> draw_jitter(test::Random& random, double delay, Shapes shapes) {
    DeviceProfile device = random_device(random, delay);
    device.jitter_s = device.period_s * test::uniform(random, 0.02, 0.6);
    const Clock clock{device.period_s, device.jitter_s, device.delay_s, 0.0};
    const bool far = shapes == Shapes::Steep || random() % 2 == 0;
    const int older = clock.older();
    const int points = far ? (older == 1   ? 150
                              : older == 2 ? 60
                                           : 30)
                           : (older == 1   ? 20
                              : older == 2 ? 8
                                           : 4);
    const double step = std::exp(test::uniform(random, -6.0, -2.0));
    const Pieces pieces{0.0, step,
                        random_forces(random, points, step, random_slopes(random, shapes), shapes)};
    limit_by(random, device, largest_of(pieces.points()));
    Scheme scheme;
    scheme.structure = StructureKind::Direct;
    const auto need = certified_need(
        device, [&](const DeviceProfile& generous) { return certify(bounds_of(pieces), scheme, generous); });
    if (!need || need->damping <= 0.0) {
        return std::nullopt;
    }
    auto shared = std::make_shared<HeldScene>();
    ReadGrid& read = shared->read;
    for (int i = 0; i < 2 * points; ++i) {
        read.grid.position.push_back(step * (i / 2));
        read.count.push_back(i / 2);
    }
    read.reading = read.of_count = read.grid.position;
    read.grid.reach = !far ? 2 * points - 1 : older > 2 ? 3 : 5;
    shared->table = table_of(Direct{PieceObject{pieces}}, read, 0, sent_on(device));
    shared->held = held_energy(read.grid, [&](double x) { return clipped(pieces.at(x).value, device); });
    return Trial{
        [shared, clock, b = need->damping](double damping, double /*friction*/) {
            Clock here = clock;
            here.damping = b * damping;
            return ValueIteration{shared->read.grid, shared->table, here}.run(shared->held).violated();
        },
        *need};
}

/// Makes a force at a position that is predicted from 1 to 3 samples; on a device with encoder steps, from 1 or 2
/// samples.
[[nodiscard]] inline std::optional<Trial> draw_prediction(test::Random& random, double delay, bool encoder,
                                                          Shapes shapes = Shapes::Any) {
    Scheme scheme;
    scheme.structure = StructureKind::Direct;
    scheme.predict = 1 + static_cast<int>(random() % (encoder ? 2 : delay > 0.0 ? 2 : 3));
    const int window = samples_of(delay) + scheme.predict;
    const double step = std::exp(test::uniform(random, -6.0, -2.0));
    DeviceProfile device = random_device(random, delay);
    HeldScene scene;
    int points = 0;
    if (encoder) {
        points = window == 1 ? 12 : window == 2 ? 6 : 4;
        device.encoder_step = step;
        scene.read = encoder_grid(0.0, step, points, window == 1 ? 1 : 0);
    } else {
        const bool far = shapes == Shapes::Steep || random() % 2 == 0;
        points = far ? (window == 1   ? 100
                        : window == 2 ? 60
                        : window == 3 ? 40
                                      : 24)
                     : (window == 1   ? 20
                        : window == 2 ? 12
                        : window == 3 ? 8
                                      : 5);
        scene.read = even_grid(0.0, step, points, !far ? points : window < 3 ? 3 : 2);
    }
    const Pieces pieces{0.0, step,
                        random_forces(random, points, step, random_slopes(random, shapes), shapes)};
    limit_by(random, device, largest_of(pieces.points()));
    const auto need = certified_need(
        device, [&](const DeviceProfile& generous) { return certify(bounds_of(pieces), scheme, generous); });
    if (!need || need->damping <= 0.0 || (encoder && need->friction <= 0.0)) {
        return std::nullopt;
    }
    scene.table = table_of(PredictedDirect{PieceObject{pieces}, scheme.predict}, scene.read, scheme.predict,
                           sent_on(device));
    scene.held = held_energy(scene.read.grid, [&](double x) { return clipped(pieces.at(x).value, device); });
    return trial_of(std::move(scene), *need, device);
}

}  // namespace palpate::energy_search
