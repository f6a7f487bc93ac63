// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include "palpate/device/device.hpp"
#include "palpate/guard/guards.hpp"
#include "palpate/rendering/any_structure.hpp"
#include "palpate/rendering/structure.hpp"
#include "palpate/run/controller.hpp"
#include "value_iteration.hpp"

namespace palpate::energy_search {

/// A device that reads given positions, one after the other.
struct ScriptedDevice {
    const double* next;
    std::uint64_t sequence = 0;

    [[nodiscard]] Opened open() { return {}; }
    [[nodiscard]] Reading exchange(const Command& /*command*/) noexcept {
        Reading reading;
        reading.position = *next++;
        reading.sequence = ++sequence;
        return reading;
    }
    void close() noexcept {}
};

/// The guards and the rounding of the command that change the force of a structure before the device applies the force.
struct Sent {
    Guards guards;
    double force_step = 0.0;  ///< step of the command; the force is rounded to the nearest step [N or N*m]

    /// Returns the force that the device receives after a start at rest at `first[0]` and ticks at the positions
    /// first[0] to first[count - 1].
    [[nodiscard]] double force(const AnyStructure& structure, const double* first, int count) const {
        std::vector<double> read(first, first + count);
        // The controller reads one more position at the end of the last tick
        read.push_back(read.back());
        ScriptedDevice device{read.data()};
        Controller controller{device, structure, guards};
        (void)controller.start();
        double sent = 0.0;
        for (int k = 0; k < count; ++k) {
            sent = controller.tick().command.force;
        }
        return force_step > 0.0 ? force_step * std::round(sent / force_step) : sent;
    }
};

/// A grid of handle positions with the reading of the encoder at each grid position.
struct ReadGrid {
    Grid grid;
    std::vector<double> reading;
    std::vector<int> count;  ///< index of the encoder reading at each grid position
    std::vector<double> of_count;
};

/// Returns a grid of equal steps whose positions are read exactly. For a wheel the number of grid positions must be a
/// multiple of 2 reach + 1, unless one move can reach all positions.
[[nodiscard]] inline ReadGrid even_grid(double from, double step, int nodes, int reach,
                                        bool repeats = false) {
    ReadGrid result;
    for (int i = 0; i < nodes; ++i) {
        result.grid.position.push_back(from + step * i);
        result.count.push_back(i);
    }
    result.grid.reach = repeats ? std::min(reach, (nodes - 1) / 2) : std::min(reach, nodes - 1);
    result.grid.turn = repeats ? step * nodes : 0.0;
    result.reading = result.of_count = result.grid.position;
    return result;
}

/// Returns positions within the encoder steps: both borders of each step, where either reading is possible, and
/// `within` positions between the borders.
[[nodiscard]] inline ReadGrid encoder_grid(double from, double count_step, int counts, int within) {
    ReadGrid result;
    for (int c = 0; c < counts; ++c) {
        result.of_count.push_back(from + count_step * c);
        for (int k = 0; k <= within + 1; ++k) {
            const double part = static_cast<double>(k) / (within + 1) - 0.5;
            result.grid.position.push_back(from + count_step * (c + part));
            result.reading.push_back(result.of_count.back());
            result.count.push_back(c);
        }
    }
    result.grid.reach = result.grid.nodes() - 1;
    return result;
}

/// Returns the forces of a structure without play operator for every possible sequence of stored positions. Each
/// sequence starts at rest.
[[nodiscard]] inline ForceTable table_of(const AnyStructure& structure, const ReadGrid& read, int memory,
                                         const Sent& sent) {
    const Windows windows{read.grid, memory};
    ForceTable table;
    table.memory = memory;
    table.of.assign(windows.count(), 0.0);
    std::vector<double> position(static_cast<std::size_t>(memory) + 1);
    for (std::size_t window = 0; window < windows.count(); ++window) {
        const Windows::Nodes w = windows.nodes_of(window);
        if (!windows.exists(w)) {
            continue;
        }
        double turned = 0.0;  // consecutive positions of the window are at most `reach` grid steps apart
        for (int k = 0; k <= memory; ++k) {
            const int moved = k == 0 ? 0 : w.node[k] - w.node[k - 1];
            if (read.grid.repeats()) {
                turned += moved > read.grid.reach    ? -read.grid.turn
                          : moved < -read.grid.reach ? read.grid.turn
                                                     : 0.0;
            }
            position[static_cast<std::size_t>(memory - k)] =
                read.reading[static_cast<std::size_t>(w.node[k])] + turned;
        }
        table.of[window] = sent.force(structure, position.data(), memory + 1);
    }
    return table;
}

/// Returns the forces of a structure whose play operator has a radius of `radius` encoder steps. The play operator
/// rests only at reported positions.
[[nodiscard]] inline ForceTable play_table_of(const AnyStructure& structure, const ReadGrid& read, int radius,
                                              const Sent& sent) {
    const int nodes = read.grid.nodes();
    const int counts = static_cast<int>(read.of_count.size());
    ForceTable table;
    table.plays = counts;
    table.of.assign(static_cast<std::size_t>(counts * nodes), std::numeric_limits<double>::quiet_NaN());
    table.next_play.assign(table.of.size(), 0);
    table.rest_play = read.count;
    for (int play = 0; play < counts; ++play) {
        for (int i = 0; i < nodes; ++i) {
            const auto node = static_cast<std::size_t>(i);
            const auto entry = static_cast<std::size_t>(play * nodes + i);
            int away = read.count[node] - play;
            double turned = 0.0;
            if (read.grid.repeats()) {
                const int turns = away > counts / 2 ? -1 : away < -counts / 2 ? 1 : 0;
                away += turns * counts;
                turned = turns * read.grid.turn;
            }
            if (std::abs(away) <= radius) {
                const double path[] = {read.of_count[static_cast<std::size_t>(play)],
                                       read.reading[node] + turned};
                table.of[entry] = sent.force(structure, path, 2);
            }
            const int shift = std::max(0, away - radius) + std::min(0, away + radius);
            table.next_play[entry] = (play + shift + counts) % counts;
        }
    }
    return table;
}

/// Returns the stored energy S minus its least value S_min at the grid positions. S is the integral of a static force
/// from the first grid position to the last.
template <class Force>
[[nodiscard]] std::vector<double> held_energy(const Grid& grid, const Force& at) {
    constexpr int parts = 64;
    std::vector<double> energy{0.0};
    double least = 0.0;
    double before = at(grid.position.front());
    for (std::size_t i = 1; i < grid.position.size(); ++i) {
        const double from = grid.position[i - 1];
        const double step = (grid.position[i] - from) / parts;
        double sum = energy.back();
        for (int k = 1; k <= parts && step > 0.0; ++k) {
            const double after = at(from + step * k);
            sum += 0.5 * (before + after) * step;
            before = after;
            least = std::min(least, sum);
        }
        energy.push_back(sum);
    }
    for (double& value : energy) {
        value -= least;
    }
    return energy;
}

/// A force that is held during each sample, on a grid of positions, and the least damping and friction that its
/// certificate requires.
struct HeldScene {
    ReadGrid read;
    ForceTable table;
    std::vector<double> held;
    Cost need;

    [[nodiscard]] Finding search(double damping_factor, double friction_factor, int sweeps = 2000) const {
        Cost cost = need;
        cost.damping *= damping_factor;
        cost.friction *= friction_factor;
        return ValueIteration{read.grid, table, cost}.run(held, sweeps);
    }
};

/// Returns the largest factor of the need within [low, high] at which a motion takes energy out; 0 if there is no such
/// factor.
template <class Violated>
[[nodiscard]] double largest_violating(const Violated& violated, double low, double high, double resolution) {
    if (!violated(low)) {
        return 0.0;
    }
    if (violated(high)) {
        return high;
    }
    while (high - low > resolution) {
        const double middle = 0.5 * (low + high);
        (violated(middle) ? low : high) = middle;
    }
    return low;
}

}  // namespace palpate::energy_search
