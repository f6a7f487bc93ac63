// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "hands.hpp"
#include "held_maps.hpp"
#include "palpate/guard/guards.hpp"
#include "palpate/rendering/direct.hpp"
#include "palpate/rendering/make_structure.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/run/controller.hpp"
#include "palpate/simulation/faulty_device.hpp"
#include "palpate/simulation/plant.hpp"
#include "palpate/simulation/simulated_device.hpp"

namespace palpate::bench {

/// Map: speed of the handle in the last of three seconds, over the ratio of a wall's stiffness to its bound. A hand
/// without damping presses the wall. One line each: without a guard, with the energy account, with the limit-cycle
/// detector, and with both.
[[nodiscard]] inline FailureMap guard_map(int points) {
    constexpr std::size_t second = 1000;
    FailureMap map{"guard", "stiffness K / (2 b / T)", "RMS speed [rad/s]", {}};
    const DeviceProfile device;
    struct Guarding {
        const char* name;
        bool account;
        bool detector;
    };
    Scheme scheme;
    scheme.structure = StructureKind::Direct;
    for (const auto& [name, account, detector] : {Guarding{"no guard", false, false},
                                                  {"energy account", true, false},
                                                  {"limit-cycle detector", false, true},
                                                  {"both", true, true}}) {
        FailureLine line{name, logarithmic(0.5, 10.0, points), {}, {}};
        for (const double share : line.at) {
            const double stiffness = share * direct_limit(device);
            const ForceModel wall{NetworkParameters{1, {}, {}, {}, {stiffness}, 0.0},
                                  {{0.0}, {0.1}, Continuation::Linear, Continuation::Linear, std::nullopt}};
            GuardSettings settings;
            settings.energy_account = account;
            settings.limit_cycle_force = detector ? settings.limit_cycle_force : 0.0;
            settings.device_damping = device.viscous_damping;
            settings.encoder_step = device.encoder_step;
            double squares = 0.0;
            std::size_t tick = 0;
            const ClosedLoopSettings start{20, 0.0, 0.0, guards_of(settings, wall, scheme, device.period_s)};
            (void)closed_loop(
                Direct{*wall.network()}, device, PassiveHand{15.0, 0.0, 0.0, 0.1}, 3 * second, start,
                [&](const Tick& /*tick*/, const Motion& handle, const EnergyBalance& /*account*/) {
                    squares += tick++ >= 2 * second ? handle.velocity * handle.velocity : 0.0;
                    return true;
                });
            // A handle speed below one encoder step a second is drawn as one encoder step a second.
            line.measured.push_back(
                std::max(std::sqrt(squares / static_cast<double>(second)), device.encoder_step));
            line.theory.push_back(std::numeric_limits<double>::quiet_NaN());
        }
        map.lines.push_back(std::move(line));
    }
    return map;
}

/// Force change that one guard causes without a fault, and the effect of a fault without and with the guard.
struct GuardEffect {
    std::string guard;
    double cost = 0.0;  ///< RMS force change by the guard without fault, divided by the RMS force
    std::string wrong;  ///< name of the fault, and the quantity that measures its effect, with unit
    double without = 0.0;
    double with = 0.0;
};

/// Force and handle speed at each tick of a simulation with a guard.
struct GuardedRun {
    std::vector<double> force;
    std::vector<double> speed;
};

struct GuardedScene {
    ForceModel model;
    double start = 0.0;
    std::optional<Fault> fault = std::nullopt;
    std::size_t ticks = 3000;
};

[[nodiscard]] inline Scheme direct_scheme() {
    Scheme scheme;
    scheme.structure = StructureKind::Direct;
    return scheme;
}

template <SimulatedHand H>
[[nodiscard]] GuardedRun guarded_run(const GuardedScene& scene, const H& hand, const Guards& guards) {
    const DeviceProfile device;
    using Handle = SimulatedHandle<H, Midpoint>;
    std::vector<Fault> script;
    if (scene.fault) {
        script.push_back(*scene.fault);
    }
    Faulty<Handle> faulty{Handle{device, hand, 20, scene.start}, script, 0.3};
    (void)faulty.open();
    Controller controller{
        faulty, make_structure(scene.model, direct_scheme(), device.period_s, device.force_limit), guards};
    (void)controller.start();
    GuardedRun run;
    for (std::size_t k = 0; k < scene.ticks; ++k) {
        run.force.push_back(controller.tick().command.force);
        run.speed.push_back(faulty.device().handle_velocity());
    }
    return run;
}

[[nodiscard]] inline double root_mean_square(const std::vector<double>& values, std::size_t first = 0) {
    double squares = 0.0;
    for (std::size_t k = first; k < values.size(); ++k) {
        squares += values[k] * values[k];
    }
    return std::sqrt(squares / static_cast<double>(values.size() - first));
}

/// Returns a spring with a click, whose direct rendering on the default knob is certified.
[[nodiscard]] inline ForceModel certified_click() {
    return {NetworkParameters{1, {30.0}, {0.2}, {-0.3}, {20.0}, 0.0},
            {{0.0}, {0.5}, Continuation::Linear, Continuation::Linear, std::nullopt}};
}

[[nodiscard]] inline ForceModel wall_beyond(double times) {
    return {NetworkParameters{1, {}, {}, {}, {times * direct_limit(DeviceProfile{})}, 0.0},
            {{0.0}, {0.1}, Continuation::Linear, Continuation::Linear, std::nullopt}};
}

/// Measures every guard alone, with its default setting, on the default knob: a hand moves through a certified click,
/// then the fault occurs that the guard is for.
[[nodiscard]] inline std::vector<GuardEffect> guard_effects() {
    const DeviceProfile device;
    GuardSettings settings;
    settings.device_damping = device.viscous_damping;
    settings.encoder_step = device.encoder_step;
    const GuardedScene click{certified_click()};
    const GuardedScene oscillating{wall_beyond(5.0)};
    const GuardedScene pressed{certified_click(), 0.2, {}, 100};
    GuardedScene jumping{certified_click(), 0.2};
    jumping.fault = Fault{FaultKind::Jump, 1000, 1};
    GuardedScene frozen{certified_click(), 0.0};
    frozen.fault = Fault{FaultKind::Frozen, 500, 1500};
    const Hand sweeping;
    const PassiveHand pressing{15.0, 0.0, 0.0, 0.1};
    const auto of_model = [&](const ForceModel& model) {
        return guards_of(settings, model, direct_scheme(), device.period_s);
    };
    const auto largest = [](const GuardedRun& run) {
        return std::abs(*std::max_element(run.force.begin(), run.force.end(),
                                          [](double a, double b) { return std::abs(a) < std::abs(b); }));
    };
    const auto largest_change = [](const GuardedRun& run) {
        double change = std::abs(run.force.front());
        for (std::size_t k = 1; k < run.force.size(); ++k) {
            change = std::max(change, std::abs(run.force[k] - run.force[k - 1]));
        }
        return change;
    };
    const auto late_speed = [](const GuardedRun& run) { return root_mean_square(run.speed, 2000); };

    const std::vector<double> plain = guarded_run(click, sweeping, unguarded).force;
    std::vector<GuardEffect> effects;
    const auto add = [&](const char* name, auto set_guard, const GuardedScene& scene, const auto& hand,
                         const char* wrong, auto measure) {
        const auto only = [&](const ForceModel& model) {
            Guards guards = unguarded;
            set_guard(guards, of_model(model));
            return guards;
        };
        std::vector<double> changed = guarded_run(click, sweeping, only(click.model)).force;
        for (std::size_t k = 0; k < plain.size(); ++k) {
            changed[k] -= plain[k];
        }
        effects.push_back({name, root_mean_square(changed) / root_mean_square(plain), wrong,
                           measure(guarded_run(scene, hand, unguarded)),
                           measure(guarded_run(scene, hand, only(scene.model)))});
    };
    add(
        "force limit", [](Guards& guards, const Guards& all) { guards.limit = all.limit; }, oscillating,
        pressing, "a wall of 5 times its bound: largest command [N*m]", largest);
    add(
        "slew limit", [](Guards& guards, const Guards& all) { guards.slew = all.slew; }, pressed, sweeping,
        "an object that appears under the hand: largest change in a tick [N*m]", largest_change);
    add(
        "ramp at the start", [](Guards& guards, const Guards& all) { guards.ramp = all.ramp; }, pressed,
        sweeping, "the same", largest_change);
    add(
        "reading guard", [](Guards& guards, const Guards& all) { guards.reading = all.reading; }, jumping,
        sweeping, "an encoder that jumps by 0.3 rad once: command meanwhile [N*m]",
        [&](const GuardedRun& run) { return run.force[jumping.fault->exchange]; });
    add(
        "reading guard", [](Guards& guards, const Guards& all) { guards.reading = all.reading; }, frozen,
        sweeping, "an encoder that freezes during motion: impulse until it responds again [N*m*s]",
        [&](const GuardedRun& run) {
            double impulse = 0.0;
            for (std::size_t k = 501; k < 2000; ++k) {
                impulse += std::abs(run.force[k]) * device.period_s;
            }
            return impulse;
        });
    add(
        "energy account", [](Guards& guards, const Guards& all) { guards.account = all.account; },
        oscillating, pressing, "a wall of 5 times its bound: speed after 2 s [rad/s]", late_speed);
    add(
        "limit-cycle detector",
        [](Guards& guards, const Guards& all) { guards.limit_cycle = all.limit_cycle; }, oscillating,
        pressing, "the same", late_speed);
    add(
        "all of them", [](Guards& guards, const Guards& all) { guards = all; }, oscillating, pressing,
        "the same", late_speed);
    return effects;
}

}  // namespace palpate::bench
