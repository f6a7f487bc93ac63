// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "palpate/fields/readable.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/run/controller.hpp"
#include "palpate/simulation/simulated_device.hpp"

namespace palpate {

/// What a rendering did, tick by tick.
struct Trace {
    std::vector<double> time;                  ///< [s]
    std::vector<double> position;              ///< measured by the encoder
    std::vector<double> velocity;              ///< differenced by the device
    std::vector<double> handle_start;          ///< true position when the encoder was read
    std::vector<double> handle_middle;         ///< true position in the middle of the tick
    std::vector<double> handle_end;            ///< true position at the end of the tick that holds the force
    std::vector<double> environment_position;  ///< y
    std::vector<double> force;                 ///< commanded
    std::vector<double> applied;               ///< force of the device at the end of the tick
    std::vector<double> mean_applied;          ///< mean force over the tick, which a fractional delay divides
    std::vector<int> evaluations;
    std::vector<Status> status;
    std::vector<std::uint8_t> extrapolated;  ///< 1 where y lay outside the model's data
};

/// Largest trace that `simulate` makes: one hour at 1 kHz, about 270 MB.
inline constexpr std::size_t most_simulated_ticks = 3'600'000;

/// Ticks of a simulated time. Throws std::invalid_argument where that is not 1 to `most_simulated_ticks`.
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

/// Renders a model on a simulated device, hand included, in virtual time: the same controller tick as in
/// real time, as fast as it goes. `each(tick)` is called before every tick; an exception from it ends the work.
template <class Each>
[[nodiscard]] Trace simulate(const ForceModel& model, const Scheme& scheme, const DeviceProfile& profile,
                             const Hand& hand, std::size_t ticks, int substeps, double start_position,
                             Each&& each) {
    validate(scheme, model, profile.period_s);
    detail::require(
        ticks <= most_simulated_ticks,
        "ticks is " + std::to_string(ticks) + ", must be at most " + std::to_string(most_simulated_ticks));
    return with_structure(model, scheme, profile.period_s, profile.force_limit, [&](auto structure) {
        SimulatedDevice device{profile, hand, substeps, start_position};
        (void)device.open();
        Controller controller{device, std::move(structure), ForceLimit{profile.force_limit}};
        (void)controller.start();
        Trace trace;
        for (std::size_t k = 0; k < ticks; ++k) {
            each(k);
            const Motion start = device.handle();
            const double before = device.applied_force();
            const Tick tick = controller.tick();
            const Motion end = device.handle();
            const double late = profile.delay_fraction();
            trace.time.push_back(static_cast<double>(k) * profile.period_s);
            trace.position.push_back(tick.reading.position);
            trace.velocity.push_back(tick.reading.velocity);
            trace.handle_start.push_back(start.position);
            trace.handle_middle.push_back(0.5 * (start.position + end.position) +
                                          0.125 * profile.period_s * (start.velocity - end.velocity));
            trace.handle_end.push_back(end.position);
            trace.environment_position.push_back(tick.rendered.environment_position);
            trace.force.push_back(tick.command.force);
            trace.applied.push_back(device.applied_force());
            trace.mean_applied.push_back(late * before + (1.0 - late) * device.applied_force());
            trace.evaluations.push_back(tick.rendered.evaluations);
            trace.status.push_back(tick.status);
            trace.extrapolated.push_back(static_cast<std::uint8_t>(tick.rendered.extrapolated));
        }
        return trace;
    });
}

[[nodiscard]] inline Trace simulate(const ForceModel& model, const Scheme& scheme,
                                    const DeviceProfile& profile, const Hand& hand, std::size_t ticks,
                                    int substeps = 20, double start_position = 0.0) {
    return simulate(model, scheme, profile, hand, ticks, substeps, start_position, [](std::size_t) {});
}

/// A recorded motion moves the device: what force would have been rendered? `each(k)` is called before every sample;
/// an exception from it ends the work.
template <class Each>
[[nodiscard]] std::vector<Rendered> motion_driven(const ForceModel& model, const Scheme& scheme,
                                                  std::span<const double> position, double period_s,
                                                  Each&& each) {
    validate(scheme, model, period_s);
    return with_structure(model, scheme, period_s, std::numeric_limits<double>::infinity(),
                          [&](auto&& structure) {
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
                          });
}

[[nodiscard]] inline std::vector<Rendered> motion_driven(const ForceModel& model, const Scheme& scheme,
                                                         std::span<const double> position, double period_s) {
    return motion_driven(model, scheme, position, period_s, [](std::size_t) {});
}

/// A recorded force drives the environment (paper figures 12 and 14): what motion results? `each` as above.
template <class Each>
[[nodiscard]] std::vector<Rendered> force_driven(const ForceModel& model, const Scheme& scheme,
                                                 std::span<const double> force, double period_s,
                                                 double start_position, Each&& each) {
    return with_structure(
        model, scheme, period_s, std::numeric_limits<double>::infinity(),
        [&](auto&& structure) -> std::vector<Rendered> {
            if constexpr (requires { structure.drive(0.0); }) {
                std::vector<Rendered> rendered;
                rendered.reserve(force.size());
                structure.reset(start_position);
                for (const double f : force) {
                    each(rendered.size());
                    rendered.push_back(structure.drive(f));
                }
                return rendered;
            } else {
                throw std::invalid_argument(
                    "structure is " +
                    std::string(structure_names[static_cast<std::size_t>(scheme.structure)]) +
                    ", must be implicit or explicit: only an inertia turns force into motion");
            }
        });
}

[[nodiscard]] inline std::vector<Rendered> force_driven(const ForceModel& model, const Scheme& scheme,
                                                        std::span<const double> force, double period_s,
                                                        double start_position) {
    return force_driven(model, scheme, force, period_s, start_position, [](std::size_t) {});
}

}  // namespace palpate
