// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "palpate/failure/held_maps.hpp"
#include "palpate/guard/guards.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/run/controller.hpp"
#include "palpate/simulation/faulty_device.hpp"
#include "palpate/simulation/hand.hpp"
#include "palpate/simulation/plant.hpp"
#include "palpate/simulation/simulated_device.hpp"

namespace palpate {

/// What one guard costs where nothing is wrong, and what it makes of what is.
struct GuardEffect {
    std::string guard;
    double cost = 0.0;  ///< RMS change of the force of a certified click, over the force's RMS [-]
    std::string wrong;  ///< what is wrong, and what of it is measured, with its unit
    double without = 0.0;
    double with = 0.0;
};

namespace detail {

/// What a scene of the guards did, tick by tick.
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
    return with_structure(scene.model, direct_scheme(), device.period_s, device.force_limit,
                          [&](auto structure) {
                              std::vector<Fault> script;
                              if (scene.fault) {
                                  script.push_back(*scene.fault);
                              }
                              Faulty<Handle> faulty{Handle{device, hand, 20, scene.start}, script, 0.3};
                              (void)faulty.open();
                              Controller controller{faulty, std::move(structure), guards};
                              (void)controller.start();
                              GuardedRun run;
                              for (std::size_t k = 0; k < scene.ticks; ++k) {
                                  run.force.push_back(controller.tick().command.force);
                                  run.speed.push_back(faulty.device().handle_velocity());
                              }
                              return run;
                          });
}

[[nodiscard]] inline double root_mean_square(const std::vector<double>& values, std::size_t first = 0) {
    double squares = 0.0;
    for (std::size_t k = first; k < values.size(); ++k) {
        squares += values[k] * values[k];
    }
    return std::sqrt(squares / static_cast<double>(values.size() - first));
}

/// A spring with a click, well within what the default knob can render.
[[nodiscard]] inline ForceModel certified_click() {
    return {NetworkParameters{1, {30.0}, {0.2}, {-0.3}, {20.0}, 0.0},
            {{0.0}, {0.5}, Continuation::Linear, Continuation::Linear, std::nullopt}};
}

[[nodiscard]] inline ForceModel wall_beyond(double times) {
    return {NetworkParameters{1, {}, {}, {}, {times * direct_limit(DeviceProfile{})}, 0.0},
            {{0.0}, {0.1}, Continuation::Linear, Continuation::Linear, std::nullopt}};
}

}  // namespace detail

/// Every guard by itself, with its default setting, on the default knob: a certified click that a hand sweeps
/// through, and what the guard is there for.
[[nodiscard]] inline std::vector<GuardEffect> guard_effects() {
    const DeviceProfile device;
    GuardSettings settings;
    settings.device_damping = device.viscous_damping;
    settings.encoder_step = device.encoder_step;
    const detail::GuardedScene click{detail::certified_click()};
    const detail::GuardedScene buzz{detail::wall_beyond(5.0)};
    const detail::GuardedScene pressed{detail::certified_click(), 0.2, {}, 100};
    detail::GuardedScene jumping{detail::certified_click(), 0.2};
    jumping.fault = Fault{FaultKind::Jump, 1000, 1};
    detail::GuardedScene frozen{detail::certified_click(), 0.0};
    frozen.fault = Fault{FaultKind::Frozen, 500, 1500};
    const Hand sweeping;
    const PassiveHand pressing{15.0, 0.0, 0.0, 0.1};
    const auto of_model = [&](const ForceModel& model) {
        return guards_of(settings, model, detail::direct_scheme(), device.period_s);
    };
    const auto largest = [](const detail::GuardedRun& run) {
        return std::abs(*std::max_element(run.force.begin(), run.force.end(),
                                          [](double a, double b) { return std::abs(a) < std::abs(b); }));
    };
    const auto largest_change = [](const detail::GuardedRun& run) {
        double change = std::abs(run.force.front());
        for (std::size_t k = 1; k < run.force.size(); ++k) {
            change = std::max(change, std::abs(run.force[k] - run.force[k - 1]));
        }
        return change;
    };
    const auto speed_left = [](const detail::GuardedRun& run) {
        return detail::root_mean_square(run.speed, 2000);
    };

    const std::vector<double> plain = detail::guarded_run(click, sweeping, unguarded).force;
    std::vector<GuardEffect> effects;
    const auto add = [&](const char* name, auto take, const detail::GuardedScene& scene, const auto& hand,
                         const char* wrong, auto measure) {
        const auto only = [&](const ForceModel& model) {
            Guards guards = unguarded;
            take(guards, of_model(model));
            return guards;
        };
        std::vector<double> changed = detail::guarded_run(click, sweeping, only(click.model)).force;
        for (std::size_t k = 0; k < plain.size(); ++k) {
            changed[k] -= plain[k];
        }
        effects.push_back({name, detail::root_mean_square(changed) / detail::root_mean_square(plain), wrong,
                           measure(detail::guarded_run(scene, hand, unguarded)),
                           measure(detail::guarded_run(scene, hand, only(scene.model)))});
    };
    add(
        "force limit", [](Guards& guards, const Guards& all) { guards.limit = all.limit; }, buzz, pressing,
        "a wall of 5 times its bound: largest command [N*m]", largest);
    add(
        "slew limit", [](Guards& guards, const Guards& all) { guards.slew = all.slew; }, pressed, sweeping,
        "an object that is put under the hand: largest change in a tick [N*m]", largest_change);
    add(
        "ramp at the start", [](Guards& guards, const Guards& all) { guards.ramp = all.ramp; }, pressed,
        sweeping, "the same", largest_change);
    add(
        "reading guard", [](Guards& guards, const Guards& all) { guards.reading = all.reading; }, jumping,
        sweeping, "an encoder that jumps by 0.3 rad once: command meanwhile [N*m]",
        [&](const detail::GuardedRun& run) { return run.force[jumping.fault->exchange]; });
    add(
        "reading guard", [](Guards& guards, const Guards& all) { guards.reading = all.reading; }, frozen,
        sweeping, "an encoder that dies in full motion: impulse until it is back [N*m*s]",
        [&](const detail::GuardedRun& run) {
            double impulse = 0.0;
            for (std::size_t k = 501; k < 2000; ++k) {
                impulse += std::abs(run.force[k]) * device.period_s;
            }
            return impulse;
        });
    add(
        "energy tank", [](Guards& guards, const Guards& all) { guards.tank = all.tank; }, buzz, pressing,
        "a wall of 5 times its bound: speed left after 2 s [rad/s]", speed_left);
    add(
        "limit-cycle detector", [](Guards& guards, const Guards& all) { guards.buzz = all.buzz; }, buzz,
        pressing, "the same", speed_left);
    add(
        "all of them", [](Guards& guards, const Guards& all) { guards = all; }, buzz, pressing, "the same",
        speed_left);
    return effects;
}

}  // namespace palpate
