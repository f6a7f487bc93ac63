// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "method.hpp"
#include "palpate/simulation/closed_loop.hpp"
#include "palpate/simulation/force_error.hpp"
#include "scene.hpp"

namespace palpate::rivals {

/// A hand of the bench: a spring to a moving target and a mass; or a hand so firm that it prescribes every step of the
/// handle.
struct TrialHand {
    Hand spring{};
    double mass = 0.0;
    std::shared_ptr<const std::vector<double>> steps{};  ///< prescribed steps, repeated [m or rad]
    double firmness = 0.0;                               ///< damping of a prescribing hand
    double period_s = 1e-3;                              ///< duration of a prescribed step

    [[nodiscard]] Grip grip(double time, const Motion& handle) const noexcept {
        if (!steps) {
            Grip grip = spring.grip(time, handle);
            grip.mass = mass;
            return grip;
        }
        constexpr std::size_t rests = 4;  // ticks at rest, until the first force acts
        const auto tick = static_cast<std::size_t>(time / period_s + 1e-6);
        const double step = tick < rests ? 0.0 : (*steps)[(tick - rests) % steps->size()];
        return {0.0, firmness, 0.0, firmness * step / period_s, 0.0};
    }
};

/// A hand, its start and the duration of its motion.
struct Trial {
    TrialHand hand;
    double start = 0.0;
    double start_velocity = 0.0;
    double seconds = 1.0;
};

/// Returns the press: the hand moves from below the object to its end and back, twice in a second.
[[nodiscard]] inline Trial press(const Scene& scene) {
    const Device& device = scene.device;
    const double firm = 10.0;  // stiffness of a pressing hand over that of a resting hand [-]
    Hand spring{firm * device.hand_stiffness, firm * device.hand_damping, -0.1 * device.travel,
                0.98 * device.travel, 2.0};
    return {{spring, device.hand_mass}, spring.lower, 0.0, 1.0};
}

/// Returns the position of the steepest slope in a direction within the travel; in the middle, if several are as steep.
[[nodiscard]] inline double steepest_position(const Object& object, double direction) {
    constexpr int parts = 1000;
    double steepest = -std::numeric_limits<double>::infinity();
    for (int k = 0; k < parts; ++k) {
        steepest = std::max(steepest, direction * object.force.at(object.travel * (k + 0.5) / parts).slope);
    }
    double first = object.travel;
    double last = 0.0;
    for (int k = 0; k < parts; ++k) {
        const double x = object.travel * (k + 0.5) / parts;
        if (direction * object.force.at(x).slope >= steepest - 0.01 * std::abs(steepest)) {
            first = std::min(first, x);
            last = x - first < 0.3 * object.travel ? x : last;  // of a periodic object the first place
        }
    }
    return 0.5 * (first + last);
}

/// Returns the hands of a scene: press, rest with tremor, tap, and prescribed motions that search for energy.
[[nodiscard]] inline std::vector<Trial> trials_of(const Scene& scene, Draw draw) {
    const Device& device = scene.device;
    const double T = scene.period();
    std::vector<Trial> all{press(scene)};
    const double stop = steepest_position(scene.object, 1.0);
    const double fall = steepest_position(scene.object, -1.0);
    for (const double place : {stop, fall}) {
        const double tremor_hz = 8.0 + 4.0 * draw.share();
        const double target = place + scene.object.force.at(place).value / device.hand_stiffness;
        const Hand spring{device.hand_stiffness, 0.1 * device.hand_damping, target - 0.01 * device.travel,
                          target + 0.01 * device.travel, tremor_hz};
        all.push_back({{spring, device.hand_mass}, place, 0.0, 1.0});
    }
    const double above = std::max(-0.2 * device.travel, stop - 0.3 * device.travel);
    const Hand loose{0.1 * device.hand_stiffness, 0.0, stop, stop, 1.0};
    all.push_back({{loose, device.hand_mass}, above, device.speed, 0.5});

    constexpr double ticks = 800.0;  // duration of a prescribed motion
    const double firmness = 1e6 * device.profile.viscous_damping;
    const auto prescribe = [&](std::vector<double> steps, double centre, double reach) {
        double largest = 0.0;
        double lowest = 0.0;
        double highest = 0.0;
        double sum = 0.0;
        for (const double step : steps) {
            largest = std::max(largest, std::abs(step));
            sum += step;
            lowest = std::min(lowest, sum);
            highest = std::max(highest, sum);
        }
        const double scale = std::min(reach / (highest - lowest), device.speed * T / largest);
        for (double& step : steps) {
            step *= scale;
        }
        const double start = centre - 0.5 * scale * (lowest + highest);
        all.push_back({{{}, 0.0, std::make_shared<const std::vector<double>>(std::move(steps)), firmness, T},
                       start,
                       0.0,
                       ticks * T});
    };
    for (const double centre : {stop, fall}) {
        for (const double reach : {0.5, 0.02}) {
            for (const int pace : {1, 2, 3, 6, 20, 60}) {
                std::vector<double> steps;
                for (int k = 0; k < 2 * pace; ++k) {
                    const double angle = std::numbers::pi / pace;
                    steps.push_back(std::cos(angle * k) - std::cos(angle * (k + 1)));
                }
                prescribe(std::move(steps), centre, reach * device.travel);
            }
        }
    }
    for (int k = 0; k < 8; ++k) {
        std::vector<double> steps(4 + static_cast<std::size_t>(20.0 * draw.share()));
        double mean = 0.0;
        for (double& step : steps) {
            step = 2.0 * draw.share() - 1.0;
            mean += step / static_cast<double>(steps.size());
        }
        for (double& step : steps) {
            step -= mean;
        }
        const double centre = k % 2 == 0 ? stop : device.travel * draw.share();
        prescribe(std::move(steps), centre, device.travel * std::pow(10.0, -2.5 * draw.share()));
    }
    return all;
}

/// Returns the largest energy that a hand has obtained at some time: work of the motor on handle and hand, minus the
/// losses in the device and the energy that the object stored when the first force acted. Ends when it exceeds `enough`
/// [J]. `period_s` is the period of the host.
[[nodiscard]] inline double energy_given(const Rendering& rendering, const Trial& trial, double period_s,
                                         double enough) {
    const double lowest = rendering.object.lowest_energy();
    const auto ticks = static_cast<std::size_t>(trial.seconds / rendering.device.period_s);
    const double slice_s = (trial.hand.steps ? 0.5 : 0.125) * period_s;
    const int substeps = std::max(1, static_cast<int>(std::lround(rendering.device.period_s / slice_s)));
    SimulatedHandle<TrialHand, Midpoint> device{rendering.device, trial.hand, substeps, trial.start,
                                                trial.start_velocity};
    double stored = 0.0;
    double most = 0.0;
    bool acts = false;
    (void)closed_loop(
        device, rendering.structure, Guards{.limit = {1e9}}, ticks, [&](const SimulatedTick& now) {
            if (!acts) {
                stored = rendering.object.force.at(now.start.position).integral - lowest;
                acts = now.force != 0.0;
            }
            const palpate::EnergyBalance& account = device.plant().account();
            const double given = -(account.motor + account.dissipated) - stored - 1e-9 * account.throughput;
            most = std::isfinite(now.end.position) ? std::max(most, given)
                                                   : std::numeric_limits<double>::infinity();
            return most <= enough;
        });
    return most;
}

/// Returns the largest energy that a hand of `trials` has obtained [J].
[[nodiscard]] inline double worst_energy(const Rendering& rendering, std::span<const Trial> trials,
                                         double period_s) {
    double most = 0.0;
    for (const Trial& trial : trials) {
        most = std::max(most, energy_given(rendering, trial, period_s, std::numeric_limits<double>::max()));
    }
    return most;
}

/// The press of a hand: positions of the handle, forces, and the held force of the object at the same readings.
struct Press {
    std::vector<double> start, middle, end;  ///< handle in each tick [m or rad]
    std::vector<double> force;               ///< of the motor in each tick [N or N*m]
    std::vector<double> readings;            ///< positions at which the structure was called [m or rad]
    double acts =
        0.0;  ///< share of ticks whose force differs from the held force by more than 1 % of the range [-]
    double changed = 0.0;  ///< RMS difference from the held force over the RMS of the held force [-]
};

/// Presses a rendering and compares its commands with the held force of the object in `wanted`.
[[nodiscard]] inline Press pressed(const Rendering& rendering, const Scene& wanted) {
    const Trial trial = press(wanted);
    const double period = rendering.device.period_s;
    const Interval forces = wanted.object.forces();
    const double near = 0.01 * (forces.upper - forces.lower);
    AnyStructure reference = wanted.object.held(period);
    Press result;
    double difference = 0.0;
    double held = 0.0;
    const int substeps = std::max(1, static_cast<int>(std::lround(8.0 * period / wanted.period())));
    SimulatedHandle<TrialHand, SemiImplicitEuler> device{rendering.device, trial.hand, substeps, trial.start};
    (void)closed_loop(device, rendering.structure, Guards{.limit = {1e9}},
                      static_cast<std::size_t>(trial.seconds / period), [&](const SimulatedTick& now) {
                          const double x = now.tick.reading.position;
                          if (now.number == 0) {
                              reference.reset(x);
                          }
                          const double wanted_force = reference.step(x).force;
                          const double error = now.tick.command.force - wanted_force;
                          difference += error * error;
                          held += wanted_force * wanted_force;
                          result.acts += std::abs(error) > near ? 1.0 : 0.0;
                          result.readings.push_back(x);
                          result.start.push_back(now.start.position);
                          result.middle.push_back(0.5 * (now.start.position + now.end.position) +
                                                  0.125 * period * (now.start.velocity - now.end.velocity));
                          result.end.push_back(now.end.position);
                          result.force.push_back(now.force);
                          return std::isfinite(now.end.position) && std::abs(now.end.position) < 1e3;
                      });
    result.acts /= static_cast<double>(result.readings.size());
    result.changed = held > 0.0 ? std::sqrt(difference / held) : 0.0;
    return result;
}

/// Returns the force error of a press over the object's force range: RMS of the tick means below 50 Hz.
[[nodiscard]] inline double force_error_of(const Press& press, const Scene& wanted, double period_s) {
    const ForceError error = force_error({press.start, press.middle, press.end, press.force, press.force},
                                         period_s, [&](std::span<const double> motion, double step_s) {
                                             AnyStructure exact = wanted.object.held(step_s);
                                             exact.reset(motion.front());
                                             std::vector<double> force;
                                             for (const double x : motion) {
                                                 force.push_back(exact.step(x).force);
                                             }
                                             return force;
                                         });
    const Interval forces = wanted.object.forces();
    return error.band / (forces.upper - forces.lower);
}

/// Largest change of the held force in the press (RMS) at which an object counts as rendered [-].
inline constexpr double most_changed = 0.25;

/// Searches the largest factor of the object's force, from `softest` to `stiffest`, at which no hand obtains more than the
/// budget. A method that accepts every object must also render it (`most_changed`). Returns 0 if there is none.
[[nodiscard]] inline double largest_stable_factor(const Method& method, const Scene& scene,
                                                  std::span<const Trial> trials, double softest,
                                                  double stiffest) {
    std::size_t last = 0;  // the hand that obtained energy last is tried first
    const bool bounded = std::isfinite(method.bound(scene));
    const auto stable = [&](double factor) {
        const Scene now = scene.scaled(factor);
        const Rendering rendering = method.make(now);
        if (!bounded && !(pressed(rendering, now).changed <= most_changed)) {
            return false;
        }
        for (std::size_t k = 0; k < trials.size(); ++k) {
            const std::size_t each = (last + k) % trials.size();
            if (energy_given(rendering, trials[each], scene.period(), now.budget) > now.budget) {
                last = each;
                return false;
            }
        }
        return true;
    };
    constexpr double coarse = 8.0;
    constexpr double fine = 1.03;
    double low = stiffest;
    while (!stable(low)) {
        low /= coarse;
        if (low < softest) {
            return 0.0;
        }
    }
    double high = std::min(stiffest, coarse * low);
    while (high > fine * low) {
        const double middle = std::sqrt(low * high);
        (stable(middle) ? low : high) = middle;
    }
    return low;
}

/// Returns the steepest rise of the mean force over a hundredth of the travel during a slow press [N/m or N*m/rad].
/// Force that a method sends only in some ticks counts with its mean.
[[nodiscard]] inline double rendered_stiffness(Rendering rendering, const Scene& scene) {
    constexpr int parts = 100;
    constexpr int ticks = 80;  // for each part
    double steepest = 0.0;
    double before = 0.0;
    rendering.structure.reset(0.0);
    for (int k = 0; k < parts; ++k) {
        double mean = 0.0;
        for (int j = 1; j <= ticks; ++j) {
            mean +=
                rendering.structure.step(scene.object.travel * (k + static_cast<double>(j) / ticks) / parts)
                    .force /
                ticks;
        }
        steepest = k > 0 ? std::max(steepest, (mean - before) * parts / scene.object.travel) : 0.0;
        before = mean;
    }
    return steepest;
}

/// Returns the time of a tick of the host during the press, the least of several runs [s].
[[nodiscard]] inline double seconds_per_tick(const Rendering& rendering, const Scene& scene,
                                             const std::vector<double>& readings) {
    constexpr int runs = 5;
    double least = std::numeric_limits<double>::infinity();
    for (int run = 0; run < runs; ++run) {
        AnyStructure structure = rendering.structure;
        structure.reset(readings.front());
        volatile double used = 0.0;
        const auto before = std::chrono::steady_clock::now();
        for (const double x : readings) {
            used = structure.step(x).force;
        }
        (void)used;
        least =
            std::min(least, std::chrono::duration<double>(std::chrono::steady_clock::now() - before).count());
    }
    return least / static_cast<double>(readings.size()) * scene.period() / rendering.device.period_s;
}

}  // namespace palpate::rivals
