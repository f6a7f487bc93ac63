// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "palpate/fields/readable.hpp"
#include "palpate/rendering/admittance.hpp"
#include "palpate/rendering/any_structure.hpp"
#include "palpate/rendering/make_structure.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/rendering/structure.hpp"
#include "palpate/run/controller.hpp"
#include "palpate/simulation/hand.hpp"
#include "palpate/simulation/plant.hpp"
#include "palpate/simulation/simulated_device.hpp"
#include "palpate/simulation/simulated_display.hpp"

namespace palpate {

/// One tick of a simulated run, with the handle's motion at its start and end, and the applied force before it and at
/// its end.
struct SimulatedTick {
    std::size_t number = 0;
    Tick tick;
    Motion start;             ///< position and velocity of the handle at the start of the tick
    Motion end;               ///< position and velocity of the handle at the end of the tick
    double force = 0.0;       ///< force of the motor at the end of the tick [N or N*m]
    double mean_force = 0.0;  ///< mean force of the motor over the tick [N or N*m]
};

/// Runs a structure on a simulated device in simulated time. Calls `watch(SimulatedTick)` after every tick; the loop
/// ends when `watch` returns false. Returns the number of ticks.
template <Device D, class Watch>
std::size_t closed_loop(D& device, AnyStructure structure, const Guards& guards, std::size_t ticks,
                        Watch&& watch) {
    (void)device.open();
    Controller controller{device, std::move(structure), guards};
    (void)controller.start();
    SimulatedTick now{0, {}, {}, device.handle(), device.applied_force(), 0.0};
    for (bool continues = true; now.number < ticks && continues; ++now.number) {
        now.start = now.end;
        now.tick = controller.tick();
        now.end = device.handle();
        now.force = device.applied_force();
        now.mean_force = device.mean_applied_force();
        continues = watch(std::as_const(now));
    }
    return now.number;
}

/// Start position and velocity, integration steps and guards of a simulated run that counts energies.
struct ClosedLoopSettings {
    int substeps = usual_substeps;  ///< number of integration steps in each tick
    double start_position = 0.0;    ///< start position of the handle [m or rad]
    double start_velocity = 0.0;    ///< start velocity of handle and hand [m/s or rad/s]
    /// Guards of the rendering; unset: only the force limit of the device
    std::optional<Guards> guards{};
};

/// Result of a simulated run: energies, position and velocity of the handle at two times, and number of ticks.
struct ClosedLoopEnd {
    EnergyBalance energy;
    Motion at_first_force;  ///< motion of the handle at the end of the delay, rounded up to whole ticks
    Motion handle;          ///< position and velocity of the handle at the end of the run
    std::size_t ticks = 0;  ///< number of ticks of the run
};

/// Runs a structure on a simulated device with an energy account. Calls `watch(tick, handle, account)` after every
/// tick; the loop ends when `watch` returns false.
template <SimulatedHand H, class Watch>
[[nodiscard]] ClosedLoopEnd closed_loop(AnyStructure structure, const DeviceProfile& profile, H hand,
                                        std::size_t ticks, const ClosedLoopSettings& settings, Watch watch) {
    SimulatedHandle<H, Midpoint> device{profile, std::move(hand), settings.substeps, settings.start_position,
                                        settings.start_velocity};
    const auto delay = static_cast<std::size_t>(profile.late_samples());
    ClosedLoopEnd end;
    const Guards guards = settings.guards.value_or(Guards{.limit = {profile.force_limit}});
    end.ticks = closed_loop(device, std::move(structure), guards, ticks, [&](const SimulatedTick& now) {
        if (now.number == 0 || now.number == delay) {
            end.at_first_force = now.start;
        }
        return watch(now.tick, now.end, device.plant().account());
    });
    end.energy = device.plant().account();
    end.handle = device.handle();
    return end;
}

/// A simulated rendering, one row for each tick.
struct Trace {
    std::vector<double> time;      ///< simulated time [s]
    std::vector<double> position;  ///< position measured by the encoder [m or rad]
    std::vector<double> velocity;  ///< velocity from the differences of measured positions [m/s or rad/s]

    std::vector<double> handle_start;   ///< true handle position when the encoder is read [m or rad]
    std::vector<double> handle_middle;  ///< true handle position in the middle of the tick [m or rad]
    std::vector<double> handle_end;     ///< true handle position at the end of the tick [m or rad]

    std::vector<double> environment_position;  ///< y, position of the virtual object [m or rad]
    std::vector<double> force;                 ///< force sent to the device [N or N*m]
    std::vector<double> applied;               ///< applied force at the end of the tick [N or N*m]
    std::vector<double> mean_applied;          ///< mean of the applied force during the tick [N or N*m]
    std::vector<int> evaluations;              ///< number of evaluations of the model in the tick
    std::vector<Status> status;
    std::vector<std::uint8_t> extrapolated;  ///< 1 if the model was evaluated outside its domain
};

/// Largest number of ticks that `simulate` accepts: one hour at 1 kHz, which needs more than 300 MB of memory.
inline constexpr std::size_t most_simulated_ticks = 3'600'000;

/// Returns the number of ticks in a simulated time. Throws std::invalid_argument if the number is not 1 to
/// `most_simulated_ticks`.
[[nodiscard]] inline std::size_t simulated_ticks(double duration_s, double period_s) {
    const double ticks = std::round(duration_s / period_s);
    detail::require(duration_s > 0.0 && ticks >= 1.0, "duration_s is " + readable(duration_s) +
                                                          ", must be at least one period, " +
                                                          readable(period_s) + " s");
    detail::require(ticks <= static_cast<double>(most_simulated_ticks),
                    "duration_s is " + readable(duration_s) + ", which is " + readable(ticks) +
                        " periods of " + readable(period_s) + " s: must be at most " +
                        std::to_string(most_simulated_ticks) + " periods");
    return static_cast<std::size_t>(ticks);
}

/// Renders a model on a simulated admittance display with a hand, in simulated time. Calls `each(number)` after every
/// tick; an exception of `each` ends the simulation. In a row of the trace, `force` is the sensor's force at the start
/// of the tick, which moves the object; `applied` is the hand's force at the end of the tick.
template <class Each>
[[nodiscard]] Trace simulate_display(const ForceModel& model, const Scheme& scheme,
                                     const DeviceProfile& device, const Hand& hand, std::size_t ticks,
                                     double start_position, Each&& each) {
    validate(scheme, model);
    detail::require(is_uncoupled(scheme), "structure is " + std::string(name_of(scheme.structure)) +
                                              " with a coupling or without mass: an admittance display "
                                              "renders an object with mass and coupling_stiffness 0");
    Admittance source{make_structure(model, scheme, device.period_s, std::numeric_limits<double>::infinity()),
                      device};
    source.reset(start_position);
    SimulatedDisplay display{device, start_position};
    Trace trace;
    Motion start = display.handle();
    double force = display.force(hand.grip(0.0, start));
    for (std::size_t k = 0; k < ticks; ++k) {
        each(k);
        const PositionCommand command = source.step(display.measured(force));
        display.move(command.position);
        const double time = static_cast<double>(k + 1) * device.period_s;
        const Motion end = display.handle();
        const double next = display.force(hand.grip(time, end));
        trace.time.push_back(time);
        trace.position.push_back(end.position);
        trace.velocity.push_back(end.velocity);
        trace.handle_start.push_back(start.position);
        trace.handle_middle.push_back(0.5 * (start.position + end.position) +
                                      0.125 * device.period_s * (start.velocity - end.velocity));
        trace.handle_end.push_back(end.position);
        trace.environment_position.push_back(command.object.environment_position);
        trace.force.push_back(display.measured(force));
        trace.applied.push_back(next);
        trace.mean_applied.push_back(0.5 * (force + next));
        trace.evaluations.push_back(command.object.evaluations);
        trace.status.push_back(command.object.status);
        trace.extrapolated.push_back(static_cast<std::uint8_t>(command.object.extrapolated));
        start = end;
        force = next;
    }
    return trace;
}

/// Renders a model on a simulated device with a hand, in simulated time, limited by `guards`; on an admittance display
/// the guards have no effect. Calls `each(number)` after
/// every tick; an exception of `each` ends the simulation.
template <class Each>
[[nodiscard]] Trace simulate(const ForceModel& model, const Scheme& scheme, const DeviceProfile& profile,
                             const Hand& hand, const Guards& guards, std::size_t ticks, int substeps,
                             double start_position, Each&& each) {
    detail::require(
        ticks <= most_simulated_ticks,
        "ticks is " + std::to_string(ticks) + ", must be at most " + std::to_string(most_simulated_ticks));
    if (profile.admittance) {
        return simulate_display(model, scheme, profile, hand, ticks, start_position, each);
    }
    validate(scheme, model, profile.period_s);
    Trace trace;
    const auto add = [&](const SimulatedTick& now) {
        each(now.number);
        trace.time.push_back(static_cast<double>(now.number) * profile.period_s);
        trace.position.push_back(now.tick.reading.position);
        trace.velocity.push_back(now.tick.reading.velocity);
        trace.handle_start.push_back(now.start.position);
        trace.handle_middle.push_back(0.5 * (now.start.position + now.end.position) +
                                      0.125 * profile.period_s * (now.start.velocity - now.end.velocity));
        trace.handle_end.push_back(now.end.position);
        trace.environment_position.push_back(now.tick.rendered.environment_position);
        trace.force.push_back(now.tick.command.force);
        trace.applied.push_back(now.force);
        trace.mean_applied.push_back(now.mean_force);
        trace.evaluations.push_back(now.tick.rendered.evaluations);
        trace.status.push_back(now.tick.status);
        trace.extrapolated.push_back(static_cast<std::uint8_t>(now.tick.rendered.extrapolated));
        return true;
    };
    SimulatedDevice device{profile, hand, substeps, start_position};
    (void)closed_loop(device, make_structure(model, scheme, profile.period_s, profile.force_limit), guards,
                      ticks, add);
    return trace;
}

/// Renders a model on a simulated device, with its force limit only, and returns the trace.
[[nodiscard]] inline Trace simulate(const ForceModel& model, const Scheme& scheme,
                                    const DeviceProfile& profile, const Hand& hand, std::size_t ticks,
                                    int substeps = usual_substeps, double start_position = 0.0) {
    return simulate(model, scheme, profile, hand, Guards{.limit = {profile.force_limit}}, ticks, substeps,
                    start_position, [](std::size_t) {});
}

/// Returns the force that a scheme renders while the device follows a recorded motion. Calls `each(k)` before every
/// sample; an exception of `each` ends the simulation.
template <class Each>
[[nodiscard]] std::vector<Rendered> motion_driven(const ForceModel& model, const Scheme& scheme,
                                                  std::span<const double> position, double period_s,
                                                  Each&& each) {
    validate(scheme, model, period_s);
    AnyStructure structure = make_structure(model, scheme, period_s, std::numeric_limits<double>::infinity());
    std::vector<Rendered> rendered;
    rendered.reserve(position.size());
    if (!position.empty()) {
        structure.reset(position.front());
    }
    for (const double x : position) {
        each(rendered.size());
        rendered.push_back(structure.step(x));
    }
    return rendered;
}

[[nodiscard]] inline std::vector<Rendered> motion_driven(const ForceModel& model, const Scheme& scheme,
                                                         std::span<const double> position, double period_s) {
    return motion_driven(model, scheme, position, period_s, [](std::size_t) {});
}

/// Returns the motion of the virtual object, without device and coupling, when a recorded force drives it (paper
/// figures 12 and 14). Calls `each(k)` before every sample.
template <class Each>
[[nodiscard]] std::vector<Rendered> force_driven(const ForceModel& model, const Scheme& scheme,
                                                 std::span<const double> force, double period_s,
                                                 double start_position, Each&& each) {
    AnyStructure structure = make_structure(model, scheme, period_s, std::numeric_limits<double>::infinity());
    if (!has_mass(scheme.structure)) {
        std::string right;
        for (const StructureTraits& traits : structure_traits) {
            right += traits.mass ? (right.empty() ? "" : " or ") + std::string(traits.name) : "";
        }
        throw std::invalid_argument("structure is " + std::string(name_of(scheme.structure)) + ", must be " +
                                    right + ": a force can move only an object with mass");
    }
    std::vector<Rendered> rendered;
    rendered.reserve(force.size());
    structure.reset(start_position);
    for (const double f : force) {
        each(rendered.size());
        rendered.push_back(structure.drive(f));
    }
    return rendered;
}

[[nodiscard]] inline std::vector<Rendered> force_driven(const ForceModel& model, const Scheme& scheme,
                                                        std::span<const double> force, double period_s,
                                                        double start_position) {
    return force_driven(model, scheme, force, period_s, start_position, [](std::size_t) {});
}

}  // namespace palpate
