// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <optional>
#include <ostream>
#include <utility>
#include <vector>

#include "../../tests/cpp/support.hpp"
#include "palpate/device/device_profile.hpp"
#include "palpate/guard/limits.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/rendering/make_structure.hpp"
#include "palpate/stability/certificate.hpp"
#include "palpate/stability/tangent_inequalities.hpp"

// Searches motions that take energy out of a tangent. Structure, force limit and certificate are those of the library;
// the energies are counted here: e = integral of F dx + b v^2 dt + f_c |dx| must stay above -(V_0 - min V).
namespace palpate::bench {

/// Returns the energy that a line gives to a handle that moves from `from` to `to`, -integral of c(line) dx, limited to
/// +-limit as by the controller [J].
[[nodiscard]] inline double line_work(const Command& line, double limit, double from, double to) {
    const auto primitive = [&](double x) {
        const double free = line.force + line.stiffness * (x - line.position);
        if (line.stiffness <= 0.0) {
            return std::clamp(free, -limit, limit) * x;
        }
        const double clipped = std::clamp(free, -limit, limit);
        // Inside the limits the integral is F^2 / 2 kappa, beyond them the limit times the path
        return clipped * clipped / (2.0 * line.stiffness) + (free - clipped) / line.stiffness * clipped;
    };
    return primitive(to) - primitive(from);
}

/// Lines at grid positions, and the costs of the device, for a search by value iteration.
struct LineGrid {
    std::vector<double> position;  ///< grid positions, evenly spaced [m or rad]
    std::vector<Command> line;     ///< line that is sent at each grid position
    std::vector<double> held;      ///< stored energy minus its minimum, at each grid position [J]
    double limit = std::numeric_limits<double>::infinity();  ///< force limit of the controller [N or N*m]
    int reach = 1;                                           ///< largest motion in a period [grid steps]
    int delay = 0;                                           ///< whole periods from a sample to its line
    double damping = 0.0;                                    ///< b / T [N/m or N*m/rad]
    double friction = 0.0;                                   ///< f_c [N or N*m]
    /// Work of a line over a motion; empty: `line_work`
    std::function<double(const Command&, double from, double to)> work = {};
};

/// Returns the largest energy that a hand takes out of a grid of lines by any sequence of motions, minus the energy that
/// the force stores [J]; > 0 is a violation. Starts at rest at every grid position. The state of the value iteration is
/// the position and the last `delay` positions.
[[nodiscard]] inline double most_taken(const LineGrid& grid, int sweeps = 300) {
    const int nodes = static_cast<int>(grid.position.size());
    const int moves = 2 * grid.reach + 1;
    int windows = 1;  // combinations of the last `delay` moves
    for (int k = 0; k < grid.delay; ++k) {
        windows *= moves;
    }
    // cost[sender][from][move]
    const auto cost = [&](int sender, int from, int move) {
        const int to = from + move - grid.reach;
        const double a = grid.position[static_cast<std::size_t>(from)];
        const double b = grid.position[static_cast<std::size_t>(to)];
        const Command& line = grid.line[static_cast<std::size_t>(sender)];
        const double work = grid.work ? grid.work(line, a, b) : line_work(line, grid.limit, a, b);
        return work + grid.damping * (b - a) * (b - a) + grid.friction * std::abs(b - a);
    };
    struct Move {
        double cost;
        std::size_t next;
    };
    const std::size_t states = static_cast<std::size_t>(nodes) * static_cast<std::size_t>(windows);
    std::vector<std::vector<Move>> graph(states);
    for (int node = 0; node < nodes; ++node) {
        for (int window = 0; window < windows; ++window) {
            int sender = node;
            int rest = window;
            bool exists = true;
            for (int k = 0; k < grid.delay; ++k) {
                sender -= rest % moves - grid.reach;  // the newest move is the lowest digit
                rest /= moves;
                exists = exists && sender >= 0 && sender < nodes;
            }
            for (int move = 0; exists && move < moves; ++move) {
                const int to = node + move - grid.reach;
                if (to >= 0 && to < nodes) {
                    const int after = grid.delay == 0 ? 0 : (window * moves + move) % windows;
                    graph[static_cast<std::size_t>(node * windows + window)].push_back(
                        {cost(sender, node, move), static_cast<std::size_t>(to * windows + after)});
                }
            }
        }
    }
    std::vector<double> value(states, 0.0);
    for (int sweep = 0; sweep < sweeps; ++sweep) {
        double change = 0.0;
        for (std::size_t k = 0; k < states; ++k) {
            const std::size_t state = sweep % 2 == 0 ? k : states - 1 - k;
            for (const Move& move : graph[state]) {
                const double lower = move.cost + value[move.next];
                if (lower < value[state]) {
                    change = std::max(change, value[state] - lower);
                    value[state] = lower;
                }
            }
        }
        if (change == 0.0) {
            break;
        }
    }
    int at_rest = 0;
    for (int k = 0; k < grid.delay; ++k) {
        at_rest = at_rest * moves + grid.reach;
    }
    double taken = -std::numeric_limits<double>::infinity();
    for (int node = 0; node < nodes; ++node) {
        const double most = -value[static_cast<std::size_t>(node * windows + at_rest)];
        taken = std::max(taken, most - grid.held[static_cast<std::size_t>(node)]);
    }
    return taken;
}

/// Returns the stored energy of a force, limited to +-limit, minus its minimum, at the grid positions [J].
template <class Force>
[[nodiscard]] std::vector<double> held_energy(const std::vector<double>& position, double limit,
                                              const Force& force) {
    constexpr int parts = 200;
    std::vector<double> energy{0.0};
    double least = 0.0;
    for (std::size_t k = 1; k < position.size(); ++k) {
        const double step = (position[k] - position[k - 1]) / parts;
        double sum = energy.back();
        for (int j = 0; j < parts; ++j) {
            sum += step * std::clamp(force(position[k - 1] + (j + 0.5) * step), -limit, limit);
            least = std::min(least, sum);
        }
        energy.push_back(sum);
    }
    for (double& each : energy) {
        each -= least;
    }
    return energy;
}

/// Model, device and line of one scene; damping and friction of the device are those that the certificate needs.
struct TangentScene {
    ForceModel model;
    Scheme scheme;
    DeviceProfile device;
    int lost = 0;  ///< commands that can be lost one after another

    [[nodiscard]] AnyStructure structure() const {
        return make_structure(model, scheme, device.period_s, device.force_limit);
    }
};

/// Returns the right side of a line of a certificate, which does not depend on damping and friction.
[[nodiscard]] inline std::optional<double> needed(const std::vector<Inequality>& lines, const char* id) {
    for (const Inequality& line : lines) {
        if (line.id == id) {
            return line.right;
        }
    }
    return std::nullopt;
}

/// Controller of the scenes: it takes a line as position, force and stiffness, or as a spring about a center.
enum class Takes { Lines, Springs };

/// Makes a random scene with a delay of `delay` whole periods. `simple` leaves out the controller's own errors, rounding,
/// encoder steps, jitter and lost commands. Returns nothing for a line that no damping certifies.
[[nodiscard]] inline std::optional<TangentScene> random_tangent_scene(test::Random& random, double delay,
                                                                      bool simple,
                                                                      Takes takes = Takes::Lines) {
    NetworkParameters network = test::random_network(random, 1 + random() % 3);
    TangentScene scene{ForceModel{network, test::unit_domain()}, {}, {}, 0};
    DeviceProfile& device = scene.device;
    const double largest = value_bounds(network, 0.0, 1.0).largest();
    const auto some = [&](double low, double high) {
        return std::exp(test::uniform(random, std::log(low), std::log(high)));
    };
    device.period_s = 1e-3;
    device.delay_s = delay * device.period_s;
    device.encoder_step = 0.0;
    device.force_limit = largest * (random() % 2 == 0 ? test::uniform(random, 0.2, 1.0) : 10.0);
    HeldLine& loop = device.held_line.emplace();
    loop.period_s = simple ? 1e-9 : device.period_s / static_cast<double>(5 + random() % 16);
    device.delay_s = simple ? device.delay_s : loop.period_s * std::round(device.delay_s / loop.period_s);
    loop.delay_s = simple ? 0.0 : loop.period_s * static_cast<double>(random() % 3);
    double motion = some(0.02, 0.3);
    if (!simple) {
        scene.lost = static_cast<int>(random() % 2);
        const auto late = static_cast<double>(random() % 4);
        device.jitter_s = late * loop.period_s;
        device.encoder_step = random() % 2 == 0 ? 0.0 : motion / some(9.0, 50.0);
        loop.encoder_step = random() % 2 == 0 ? 0.0 : motion / some(5.0, 50.0);
        loop.stiffness_step = random() % 2 == 0 ? 0.0 : some(0.01, 1.0);
        loop.position_step = random() % 2 == 0 ? 0.0 : some(1e-4, 1e-2);
        device.force_step = random() % 2 == 0 ? 0.0 : largest * some(1e-4, 1e-2);
    }
    ForceBounds bounds = force_bounds(scene.model, 0.0, device.force_limit);
    bounds.bend = bend_bounds(scene.model);
    DeviceProfile longest = device;
    longest.jitter_s += scene.lost * device.period_s;
    longest.viscous_damping = longest.coulomb_friction = 1e6;
    scene.scheme.structure = StructureKind::Tangent;
    constexpr unsigned constant = 2;
    if (takes == Takes::Springs) {
        loop.largest_center = longest.held_line->largest_center = 1e6;
    }
    // Each rule occurs in scenes in which the plan would choose another one
    switch (takes == Takes::Springs ? constant : delay == 0.0 ? 0 : 1 + random() % 4) {
        case 0:
            scene.scheme.line = HeldSlope{SlopeRule::Steepest,
                                          bounds.rising() * (random() % 3 == 0 ? 0.5 : 1.0), 0.0, motion};
            break;
        case 1:
            scene.scheme.line = HeldSlope{SlopeRule::Raised, 0.0, 0.0, std::nullopt};
            break;
        case constant:
            scene.scheme.line = detail::best_constant(bounds, longest);
            break;
        case 3:
            scene.scheme.line = HeldSlope{SlopeRule::Raised, 0.0, 0.0, motion};
            break;
        default:
            scene.scheme.line = detail::best_raised(bounds, longest, motion);
    }
    const std::vector<Inequality> lines = inequalities_of(bounds, scene.scheme, longest);
    const auto b = needed(lines, "damping-line");
    const auto friction = needed(lines, "friction-line");
    if (!b || !friction || !std::isfinite(*b) || !std::isfinite(*friction)) {
        return std::nullopt;
    }
    device.viscous_damping = *b;
    device.coulomb_friction = *friction;
    return scene;
}

/// Searches a simple scene by value iteration on a grid. Returns the energy taken out beyond the stored one, divided by
/// the largest force times the largest motion.
[[nodiscard]] inline double search_by_value(const TangentScene& scene, test::Random& random, double damping,
                                            double friction) {
    const double motion =
        scene.scheme.line->motion.value_or(std::exp(test::uniform(random, std::log(0.02), std::log(0.5))));
    LineGrid grid;
    grid.delay = scene.device.whole_delay_samples();
    grid.reach = grid.delay == 0 ? 8 : grid.delay == 1 ? 4 : 2;
    const int most_nodes = grid.delay == 0 ? 240 : grid.delay == 1 ? 90 : 60;
    const double step = motion / grid.reach * (1.0 - 1e-9);
    const int nodes = std::min(most_nodes, static_cast<int>(1.2 / step) + 2 * grid.reach);
    const double from = test::uniform(random, -0.2, std::max(-0.1, 1.1 - nodes * step));
    AnyStructure structure = scene.structure();
    const ForceLimit limit{scene.device.force_limit};
    grid.limit = scene.device.force_limit;
    double largest = 0.0;
    for (int k = 0; k < nodes; ++k) {
        grid.position.push_back(from + k * step);
        const Rendered rendered = structure.step(grid.position.back());
        Command line{rendered.force, rendered.environment_position, rendered.stiffness};
        (void)limit.apply(line);
        largest = std::max(largest, std::abs(line.force));
        grid.line.push_back(line);
    }
    const NetworkCurve& curve = scene.model.network()->curve();
    grid.held = held_energy(grid.position, grid.limit, [&](double x) { return curve.at(x).value; });
    grid.damping = damping * scene.device.viscous_damping / scene.device.period_s;
    grid.friction = friction * scene.device.coulomb_friction;
    return most_taken(grid) / (largest * motion + 1e-300);
}

/// Returns a command as the controller takes it: rounded, with a spring about the position without force if it takes
/// springs.
[[nodiscard]] inline Command as_taken(const Command& line, const DeviceProfile& device) {
    const HeldLine& loop = *device.held_line;
    const auto steps_of = [](double x, double step) { return step > 0.0 ? step * std::round(x / step) : x; };
    const double stiffness = steps_of(line.stiffness, loop.stiffness_step);
    if (loop.largest_center && stiffness > 0.0) {
        return {0.0, steps_of(line.position - line.force / stiffness, loop.position_step), stiffness};
    }
    const double position = steps_of(line.position, loop.position_step);
    return {steps_of(line.force + stiffness * (position - line.position), device.force_step), position,
            stiffness};
}

/// A motion that repeats: in each period the handle moves at one or two constant speeds.
struct RepeatedMotion {
    std::vector<double> moved;  ///< motion in each period, divided by the largest one [-]
    std::vector<int> late;      ///< lateness of each sample [periods of the controller]
    std::vector<bool> lost;     ///< true: the command of this period does not arrive
    double start = 0.0;         ///< start position [m or rad]
    double shake = 0.0;  ///< motion to and fro between two samples of the controller, divided by the largest
};

/// Moves a handle through a repeated motion and returns the energy taken out beyond the stored one [J].
[[nodiscard]] inline double taken_by(const TangentScene& scene, AnyStructure structure,
                                     const RepeatedMotion& motion, double largest_motion, double damping,
                                     double friction) {
    constexpr int cycles = 25;
    const DeviceProfile& device = scene.device;
    const HeldLine& loop = *device.held_line;
    const int inner = static_cast<int>(std::lround(device.period_s / loop.period_s));
    const int inner_late = static_cast<int>(std::lround(loop.delay_s / loop.period_s));
    const int delay = static_cast<int>(std::lround(device.delay_s / loop.period_s));
    const auto steps_of = [](double x, double step) { return step > 0.0 ? step * std::round(x / step) : x; };
    const int periods = cycles * static_cast<int>(motion.moved.size());
    const auto at = [&](const auto& values, int k) {
        return values[static_cast<std::size_t>(k) % values.size()];
    };
    // True positions at the samples of the controller; the handle rests for the longest delay before it moves
    const int rest = delay + inner_late + inner + 1;
    std::vector<double> x(static_cast<std::size_t>(rest), motion.start);
    double base = motion.start;
    for (int k = 0; k < periods; ++k) {
        const double per_step = at(motion.moved, k) * largest_motion / inner;
        const double shake =
            std::min(motion.shake, 1.0 - std::abs(at(motion.moved, k))) * largest_motion / inner;
        for (int j = 1; j <= inner; ++j) {
            base += per_step;
            x.push_back(base + (j % 2 == 0 || j == inner ? 0.0 : shake));
        }
    }
    struct Sent {
        int acts;
        Command line;
    };
    std::vector<Sent> sent;
    const ForceLimit limit{device.force_limit};
    structure.reset(steps_of(motion.start, device.encoder_step));
    for (int k = 0; k <= periods; ++k) {
        const int sample = rest - 1 + k * inner + (k == 0 ? 0 : at(motion.late, k));
        if (sample >= static_cast<int>(x.size())) {
            break;
        }
        const Rendered rendered =
            structure.step(steps_of(x[static_cast<std::size_t>(sample)], device.encoder_step));
        Command line{rendered.force, rendered.environment_position, rendered.stiffness};
        (void)limit.apply(line);
        if (k == 0 || !at(motion.lost, k)) {
            sent.push_back({k == 0 ? 0 : sample + delay, as_taken(line, device)});
        }
    }
    const NetworkCurve& curve = scene.model.network()->curve();
    double energy = 0.0;
    double least = 0.0;
    std::size_t active = 0;
    for (int i = rest - 1; i + 1 < static_cast<int>(x.size()); ++i) {
        while (active + 1 < sent.size() && sent[active + 1].acts <= i) {
            ++active;
        }
        const Command& line = sent[active].line;
        const double read = steps_of(x[static_cast<std::size_t>(i - inner_late)], loop.encoder_step);
        const double force = std::clamp(line.force + line.stiffness * (read - line.position),
                                        -device.force_limit, device.force_limit);
        const double d = x[static_cast<std::size_t>(i + 1)] - x[static_cast<std::size_t>(i)];
        energy += force * d + damping * device.viscous_damping / loop.period_s * d * d +
                  friction * device.coulomb_friction * std::abs(d);
        least = std::min(least, energy);
    }
    // The minimum of the stored energy is at most that on the path
    std::vector<double> path = x;
    std::sort(path.begin(), path.end());
    const double low = std::min(path.front(), -0.5);
    const double high = std::max(path.back(), 1.5);
    std::vector<double> places;
    for (int k = 0; k <= 40; ++k) {
        places.push_back(low + (high - low) * k / 40);
    }
    places.push_back(motion.start);
    std::sort(places.begin(), places.end());
    const std::vector<double> held =
        held_energy(places, device.force_limit, [&](double y) { return curve.at(y).value; });
    const auto index = std::lower_bound(places.begin(), places.end(), motion.start) - places.begin();
    return -least - held[static_cast<std::size_t>(index)];
}

/// Searches a scene with the whole chain of errors: improves random repeated motions step by step. Returns the energy
/// taken out beyond the stored one, divided by the largest force times the largest motion.
[[nodiscard]] inline double search_by_motions(const TangentScene& scene, test::Random& random, double damping,
                                              double friction, int improvements = 40) {
    double largest_motion =
        scene.scheme.line->motion.value_or(std::exp(test::uniform(random, std::log(0.02), std::log(0.5))));
    // The slopes of the rule steepest hold for motions of w between two commands that arrive
    if (scene.scheme.line->rule == SlopeRule::Steepest) {
        const DeviceProfile& device = scene.device;
        largest_motion *= device.period_s / (device.longest_period_s() + scene.lost * device.period_s);
    }
    const HeldLine& loop = *scene.device.held_line;
    const int late = static_cast<int>(std::lround(scene.device.jitter_s / loop.period_s));
    const AnyStructure structure = scene.structure();
    const auto any = [&](RepeatedMotion& motion, std::size_t k) {
        motion.moved[k] =
            random() % 3 == 0 ? test::uniform(random, -1.0, 1.0) : (random() % 2 == 0 ? 1.0 : -1.0);
        motion.late[k] = static_cast<int>(random() % static_cast<unsigned>(late + 1));
        // After a lost command the next one arrives
        const bool lost = scene.lost > 0 && k % 2 == 1 && random() % 2 == 0;
        motion.lost[k] = lost;
    };
    double most = -std::numeric_limits<double>::infinity();
    RepeatedMotion best;
    for (int k = 0; k < improvements; ++k) {
        RepeatedMotion motion = best;
        if (k < improvements / 3) {
            const std::size_t periods = 2 * (1 + random() % 4);
            motion.moved.assign(periods, 0.0);
            motion.late.assign(periods, 0);
            motion.lost.assign(periods, false);
            for (std::size_t j = 0; j < periods; ++j) {
                any(motion, j);
            }
            motion.start = test::uniform(random, 0.0, 1.0);
            motion.shake = random() % 3 == 0 ? test::uniform(random, -1.0, 1.0) : 0.0;
        } else if (random() % 4 == 0) {
            motion.start += largest_motion * test::uniform(random, -0.5, 0.5);
        } else {
            any(motion, random() % motion.moved.size());
        }
        if (random() % 2 == 0) {  // a motion that returns
            double sum = 0.0;
            for (const double moved : motion.moved) {
                sum += moved;
            }
            for (double& moved : motion.moved) {
                moved = std::clamp(moved - sum / static_cast<double>(motion.moved.size()), -1.0, 1.0);
            }
        }
        const double taken = taken_by(scene, structure, motion, largest_motion, damping, friction);
        if (taken > most) {
            most = taken;
            best = motion;
        }
    }
    const double largest =
        std::min(scene.device.force_limit, value_bounds(scene.model.parameters(), 0.0, 1.0).largest());
    return most / (largest * largest_motion + 1e-300);
}

inline std::ostream& operator<<(std::ostream& out, const TangentScene& scene) {
    return out << (scene.device.held_line->largest_center ? "springs, " : "")
               << name_of(scene.scheme.line->rule) << ", slope " << scene.scheme.line->slope << ", lift "
               << scene.scheme.line->lift << ", motion " << scene.scheme.line->motion.value_or(0.0)
               << ", delay " << scene.device.delay_s << " s, b " << scene.device.viscous_damping << ", f_c "
               << scene.device.coulomb_friction << ", lost " << scene.lost;
}

}  // namespace palpate::bench
