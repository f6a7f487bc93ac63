// SPDX-License-Identifier: Apache-2.0
// Scenes with wheels (periodic forces), with the start ramp of the force, and with the limit-cycle detector.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "held_lines.hpp"

namespace palpate::energy_search {

/// Returns the mean of a force over one revolution that begins at position 0.
template <class Force>
[[nodiscard]] double mean_over(double turn, const Force& force) {
    constexpr int parts = 20000;
    double sum = 0.0;
    for (int k = 0; k < parts; ++k) {
        sum += force(turn * (k + 0.5) / parts);
    }
    return sum / parts;
}

/// Adds a constant to `force`, so that `mean_of` returns 0 for the result.
template <class MeanOf>
[[nodiscard]] std::vector<double> balanced(std::vector<double> force, const MeanOf& mean_of) {
    double low = -2.0 * largest_of(force);
    double high = -low;
    const auto shifted = [&](double by) {
        std::vector<double> result = force;
        for (double& value : result) {
            value += by;
        }
        return result;
    };
    for (int k = 0; k < 60; ++k) {
        const double middle = 0.5 * (low + high);
        (mean_of(shifted(middle)) < 0.0 ? low : high) = middle;
    }
    return shifted(0.5 * (low + high));
}

/// Returns the number of grid positions in one revolution of a wheel: many if the wheel rotates slowly, few if it may
/// jump.
[[nodiscard]] inline int wheel_nodes(double delay, bool slowly) {
    constexpr int slow[] = {3000, 1200, 600};
    constexpr int fast[] = {48, 24, 12};
    const int samples = std::min(samples_of(delay), 2);
    return slowly ? slow[samples] : fast[samples];
}

/// Makes a wheel whose force consists of straight pieces. Slow rotation in many short moves tests the mean force,
/// jumps test the damping.
[[nodiscard]] inline std::optional<Trial> draw_wheel(test::Random& random, double delay, bool slowly) {
    const int cells = 8 + static_cast<int>(random() % 9);
    const double turn = 1.0;
    const double size = std::exp(test::uniform(random, -1.0, 2.0));
    std::vector<double> forces = random_wheel(random, cells, size, 0.0);
    DeviceProfile device = random_device(random, delay);
    limit_by(random, device, largest_of(forces));
    const auto pieces = [&](const std::vector<double>& points) {
        return Pieces{0.0, turn / cells, points, true};
    };
    const auto mean_of = [&](const std::vector<double>& points) {
        const Pieces wheel = pieces(points);
        return mean_over(turn, [&](double x) { return clipped(wheel.at(x).value, device); });
    };
    if (slowly || random() % 2 == 0) {
        const double shift = test::uniform(random, -0.3, 0.3) * size;
        for (double& force : forces) {
            force += shift;
        }
    } else {
        forces = balanced(forces, mean_of);
    }
    const Pieces wheel = pieces(forces);
    const double mean = mean_of(forces);
    ForceBounds bounds = bounds_of(wheel);
    bounds.mean_force = std::abs(mean) * (1.0 + 1e-6) + 1e-9 * size;
    Scheme scheme;
    scheme.structure = StructureKind::Direct;
    const auto need = certified_need(
        device, [&](const DeviceProfile& generous) { return certify(bounds, scheme, generous); });
    if (!need) {
        return std::nullopt;
    }
    HeldScene scene;
    const int nodes = wheel_nodes(delay, slowly);
    scene.read = even_grid(0.0, turn / nodes, nodes, slowly ? 1 : nodes, true);
    scene.table = table_of(Direct{PieceObject{wheel}}, scene.read, 0, sent_on(device));
    scene.held =
        held_energy(scene.read.grid, [&](double x) { return clipped(wheel.at(x).value, device) - mean; });
    return trial_of(std::move(scene), *need, device);
}

/// Makes a wheel whose force is a network of a few wavelets, with the certificate that the C++ library computes.
[[nodiscard]] inline std::optional<Trial> draw_network_wheel(test::Random& random, double delay,
                                                             bool slowly) {
    const NetworkParameters network = small_network(random);
    Domain domain = test::unit_domain();
    domain.period = 1.0;
    const ForceModel model{network, domain};
    const NetworkCurve& curve = model.network()->curve();
    DeviceProfile device = random_device(random, delay);
    limit_by(random, device, curve.value_bounds().largest());
    Scheme scheme;
    scheme.structure = StructureKind::Direct;
    const auto need = certified_need(
        device, [&](const DeviceProfile& generous) { return certify(model, scheme, generous); });
    if (!need) {
        return std::nullopt;
    }
    const double mean = mean_over(1.0, [&](double x) { return clipped(curve.at(x).value, device); });
    HeldScene scene;
    const int nodes = wheel_nodes(delay, slowly);
    scene.read = even_grid(0.0, 1.0 / nodes, nodes, slowly ? 1 : nodes, true);
    scene.table = table_of(make_structure(model, scheme, device.period_s, device.force_limit), scene.read, 0,
                           sent_on(device));
    scene.held =
        held_energy(scene.read.grid, [&](double x) { return clipped(curve.at(x).value, device) - mean; });
    return trial_of(std::move(scene), *need, device);
}

/// Makes a wheel with hysteresis that rotates slowly. The hysteresis may exceed the mean of press and release force.
[[nodiscard]] inline std::optional<Trial> draw_hysteresis_wheel(test::Random& random, double delay) {
    const int nodes = 300;
    const int cells = 10;
    const int radius = 20 + static_cast<int>(random() % 80);
    const double size = std::exp(test::uniform(random, -1.0, 2.0));
    const Pieces g{0.0, 1.0 / cells,
                   random_wheel(random, cells, size, size * test::uniform(random, -0.5, 0.5)), true};
    std::vector<double> hysteresis;
    const double largest_hysteresis = size * test::uniform(random, 0.0, 0.4);
    for (int k = 0; k < cells; ++k) {
        hysteresis.push_back(largest_hysteresis * test::uniform(random, 0.5, 1.0));
    }
    const Pieces h{0.0, 1.0 / cells, hysteresis, true};
    const HysteresisPair<Pieces> pair{g, h, static_cast<double>(radius) / nodes};
    DeviceProfile device = random_device(random, delay);
    limit_by(random, device, largest_of(g.points()));
    const auto mean = [&](double s) {
        return mean_over(1.0, [&](double x) { return clipped(g.at(x).value + s * h.at(x).value, device); });
    };
    ForceBounds bounds = bounds_of(pair);
    bounds.mean_force = std::max({0.0, mean(-1.0), -mean(1.0)}) * (1.0 + 1e-6);
    if (bounds.mean_force <= 0.02 * size) {
        // The mean force of this wheel is too small to test on this grid of positions
        return std::nullopt;
    }
    Scheme scheme;
    scheme.structure = StructureKind::Direct;
    const auto need = certified_need(
        device, [&](const DeviceProfile& generous) { return certify(bounds, scheme, generous); });
    if (!need) {
        return std::nullopt;
    }
    HeldScene scene;
    scene.read = even_grid(0.0, 1.0 / nodes, nodes, 1, true);
    scene.table = play_table_of(Direct{pair}, scene.read, radius, sent_on(device));
    // The wheel stores so much energy that the hand can take out more than the stored energy only by a repeated motion.
    scene.held.assign(static_cast<std::size_t>(nodes), 10.0 * (size + largest_hysteresis));
    return trial_of(std::move(scene), *need, device);
}

/// Returns a limit-cycle detector that has detected `limit_cycles` limit cycles.
[[nodiscard]] inline LimitCycleDetector scaled_after_limit_cycles(int limit_cycles) {
    LimitCycleDetector detector{{1e-9, 1000, 0.0}};
    double side = 1.0;
    while (detector.limit_cycles() < static_cast<std::uint64_t>(limit_cycles)) {
        detector.watch(side, side);
        side = -side;
    }
    return detector;
}

/// Makes a force that the limit-cycle detector scales down at any time, more than once, and never increases again. The
/// force is that of a wheel or consists of straight pieces.
[[nodiscard]] inline std::optional<Trial> draw_softening(test::Random& random, double delay) {
    const bool wheel = random() % 2 == 0;
    const int nodes = wheel ? wheel_nodes(delay, true) / 2 : 40;
    const int cells = wheel ? 8 + static_cast<int>(random() % 9) : nodes - 1;
    const double step = wheel ? 1.0 / cells : 1.0 / nodes;
    DeviceProfile device = random_device(random, delay);
    std::vector<double> forces;
    if (wheel) {
        forces = random_wheel(random, cells, 1.0, 0.0);
        limit_by(random, device, largest_of(forces));
        forces = balanced(forces, [&](const std::vector<double>& points) {
            const Pieces trial{0.0, step, points, true};
            return mean_over(1.0, [&](double x) { return clipped(trial.at(x).value, device); });
        });
    } else {
        forces = random_forces(random, nodes, step, random_slopes(random));
        limit_by(random, device, largest_of(forces));
    }
    const Pieces pieces{0.0, step, forces, wheel};
    ForceBounds bounds = bounds_of(pieces);
    Scheme scheme;
    scheme.structure = StructureKind::Direct;
    const auto need = certified_need(
        device, [&](const DeviceProfile& generous) { return certify(bounds, scheme, generous); });
    if (!need || need->damping <= 0.0) {
        return std::nullopt;
    }
    struct ScaledLevels {
        HeldScene scene;
        std::vector<ForceTable> levels;
    };
    auto shared = std::make_shared<ScaledLevels>();
    HeldScene& scene = shared->scene;
    scene.read = even_grid(0.0, wheel ? 1.0 / nodes : step, nodes,
                           wheel                    ? 1
                           : samples_of(delay) == 0 ? nodes
                                                    : 3,
                           wheel);
    scene.held = held_energy(scene.read.grid, [&](double x) { return clipped(pieces.at(x).value, device); });
    scene.need = {need->damping / device.longest_period_s(), need->friction, device.whole_delay_samples(),
                  device.delay_fraction()};
    for (int limit_cycles = 0; limit_cycles < 4; ++limit_cycles) {
        Sent sent = sent_on(device);
        sent.guards.limit_cycle = scaled_after_limit_cycles(limit_cycles);
        shared->levels.push_back(table_of(Direct{PieceObject{pieces}}, scene.read, 0, sent));
    }
    return Trial{[shared](double damping, double friction) {
                     Cost cost = shared->scene.need;
                     cost.damping *= damping;
                     cost.friction *= friction;
                     ValueIteration search{shared->scene.read.grid, shared->levels.back(), cost};
                     const std::vector<ForceTable>& levels = shared->levels;
                     for (std::size_t level = levels.size(); level-- > 0;) {
                         if (cost.late > 0.0 && level + 1 < levels.size()) {
                             search.precede_once(levels[level + 1], levels[level]);
                         }
                         search.precede(levels[level]);
                         if (search.run(shared->scene.held).violated()) {
                             return true;
                         }
                     }
                     return false;
                 },
                 *need};
}

/// Makes a force that increases from zero over the first samples. The hand may take out, once, the largest energy that
/// the object can store.
[[nodiscard]] inline std::optional<Trial> draw_ramp(test::Random& random, double delay) {
    const Fineness fine = random_fineness(random, samples_of(delay));
    const double step = std::exp(test::uniform(random, -6.0, -2.0));
    const Pieces pieces{0.0, step, random_forces(random, fine.nodes, step, random_slopes(random))};
    DeviceProfile device = random_device(random, delay);
    limit_by(random, device, largest_of(pieces.points()));
    Scheme scheme;
    scheme.structure = StructureKind::Direct;
    const auto need = certified_need(
        device, [&](const DeviceProfile& generous) { return certify(bounds_of(pieces), scheme, generous); });
    if (!need || need->damping <= 0.0) {
        return std::nullopt;
    }
    struct Ramp {
        HeldScene scene;
        std::vector<ForceTable> rising;
    };
    auto shared = std::make_shared<Ramp>();
    HeldScene& scene = shared->scene;
    scene.read = even_grid(0.0, step, fine.nodes, fine.reach);
    scene.table = table_of(Direct{PieceObject{pieces}}, scene.read, 0, sent_on(device));
    const std::vector<double> held =
        held_energy(scene.read.grid, [&](double x) { return clipped(pieces.at(x).value, device); });
    scene.held.assign(held.size(), *std::max_element(held.begin(), held.end()));
    scene.need = {need->damping / device.longest_period_s(), need->friction, device.whole_delay_samples(),
                  device.delay_fraction()};
    const std::uint64_t ticks = 1 + random() % 30;
    for (std::uint64_t k = 0; k < ticks; ++k) {
        Sent sent = sent_on(device);
        sent.guards.ramp = {ticks, k};
        shared->rising.push_back(table_of(Direct{PieceObject{pieces}}, scene.read, 0, sent));
    }
    return Trial{[shared](double damping, double friction) {
                     Cost cost = shared->scene.need;
                     cost.damping *= damping;
                     cost.friction *= friction;
                     ValueIteration search{shared->scene.read.grid, shared->scene.table, cost};
                     if (search.run(shared->scene.held).violated()) {
                         return true;
                     }
                     const std::vector<ForceTable>& rising = shared->rising;
                     if (cost.late > 0.0) {
                         search.precede_once(shared->scene.table, rising.back());
                     }
                     for (std::size_t k = rising.size(); k-- > 0;) {
                         search.precede_once(rising[k], rising[k > 0 ? k - 1 : 0]);
                     }
                     return search.found(shared->scene.held).violated();
                 },
                 *need};
}

}  // namespace palpate::energy_search
