// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>

#include "palpate/device/device.hpp"
#include "palpate/device/device_profile.hpp"
#include "palpate/simulation/hand.hpp"
#include "palpate/simulation/plant.hpp"

namespace palpate {

inline constexpr int usual_substeps = 20;   ///< default number of integration steps in a tick of 1 ms
inline constexpr int most_substeps = 1000;  ///< largest allowed number of integration steps in one tick

/// A simulated haptic device with a hand. Each exchange simulates one tick. The simulation includes inertia, viscous
/// and Coulomb friction, encoder step, force step, force limit, a force that is held for one tick, and delay. The
/// integrator `Plant` moves the handle: SemiImplicitEuler, Midpoint for an energy account, or MountedObject with an
/// object on the handle. With `held_line` in its profile the device holds lines: it rounds their stiffness and position,
/// and its controller applies
/// them with the period, delay and encoder step of `HeldLine`, within the force limit.
///
/// The simulation does not include electrical dynamics of the motor, torque ripple, backlash, flexible parts, jitter of
/// the sample time, or noise of a force transducer.
template <SimulatedHand H, class Plant>
class SimulatedHandle {
  public:
    explicit SimulatedHandle(DeviceProfile profile, H hand = {}, int substeps = usual_substeps,
                             double start = 0.0, double start_velocity = 0.0)
        : profile_{std::move(profile)}, hand_{hand}, substeps_{substeps}, start_{start, start_velocity} {
        validate(profile_);
        if (substeps < 1 || substeps > most_substeps) {
            throw std::invalid_argument("substeps is " + std::to_string(substeps) + ", must be 1 to " +
                                        std::to_string(most_substeps));
        }
    }

    /// Replaces the integrator of the handle, for example to mount an object on the handle.
    void mount(Plant plant) { plant_ = std::move(plant); }

    /// Opens the simulated device: sets the handle to its start position and start velocity.
    Opened open() {
        handle_ = start_;
        plant_.start();
        applied_ = mean_applied_ = 0.0;
        tick_ = 0;
        pending_.fill({});
        read_.fill(encoded(handle_.position, inner_step()));
        last_reading_ = encoded(handle_.position, profile_.encoder_step);
        return {};
    }

    /// Simulates one period: applies the commanded force, later by the delay, and reads the encoder at the end of the
    /// period. If the delay is not a whole number of periods, the force changes within the period, and the reading
    /// reports the force at the end.
    [[nodiscard]] Reading exchange(const Command& command) noexcept {
        pend(converted(command));
        const double late = profile_.delay_fraction();
        const int before = late > 0.0 ? std::max(1, static_cast<int>(std::lround(late * substeps_))) : 0;
        const Grip grip = hand_.grip(time(), handle_);
        mean_applied_ = 0.0;
        if (before > 0) {
            move(grip, pending(tick_ + pending_.size() - 1), late, before);
        }
        move(grip, pending(tick_), 1.0 - late, std::max(1, substeps_ - before));
        ++tick_;
        const double measured = encoded(handle_.position, profile_.encoder_step);
        const double velocity = (measured - last_reading_) / profile_.period_s;
        last_reading_ = measured;
        return {measured, velocity, applied_,   plant_.measured(handle_),
                time(),   tick_,    Status::Ok, profile_.delay_s};
    }

    ZeroForce close() noexcept {
        applied_ = mean_applied_ = 0.0;
        return ZeroForce::Confirmed;
    }

    [[nodiscard]] const DeviceProfile& profile() const noexcept { return profile_; }
    /// Returns the true position and velocity of the handle, which the encoder reports only in steps.
    [[nodiscard]] const Motion& handle() const noexcept { return handle_; }
    [[nodiscard]] double handle_position() const noexcept { return handle_.position; }
    [[nodiscard]] double handle_velocity() const noexcept { return handle_.velocity; }
    [[nodiscard]] double applied_force() const noexcept { return applied_; }
    /// Returns the mean force of the motor over the last period [N or N*m].
    [[nodiscard]] double mean_applied_force() const noexcept { return mean_applied_; }
    [[nodiscard]] const Plant& plant() const noexcept { return plant_; }

  private:
    [[nodiscard]] double time() const noexcept { return static_cast<double>(tick_) * profile_.period_s; }

    /// Returns the position that an encoder of this step reports for a true position [m or rad].
    [[nodiscard]] static double encoded(double position, double step) noexcept {
        return step > 0.0 ? step * std::floor(position / step + 0.5) : position;
    }

    [[nodiscard]] double inner_step() const noexcept {
        return profile_.held_line ? profile_.held_line->encoder_step : 0.0;
    }
    /// Returns a force limited to the force limit.
    [[nodiscard]] double limited(double force) const noexcept {
        return std::clamp(force, -profile_.force_limit, profile_.force_limit);
    }
    [[nodiscard]] static double rounded(double value, double step) noexcept {
        return step > 0.0 ? step * std::round(value / step) : value;
    }

    /// Returns the command that the device executes: zero force if the command is not finite, otherwise the line rounded
    /// to the steps of the device. The stiffness is 0 if the device holds no line.
    [[nodiscard]] Command converted(const Command& command) const noexcept {
        if (!std::isfinite(command.force + command.position + command.stiffness)) {
            return {};
        }
        if (!profile_.held_line) {
            return {rounded(limited(command.force), profile_.force_step), 0.0, 0.0};
        }
        const HeldLine& loop = *profile_.held_line;
        const double stiffness = rounded(command.stiffness, loop.stiffness_step);
        if (loop.largest_center && stiffness > 0.0) {
            const double center = rounded(command.position - command.force / stiffness, loop.position_step);
            return {0.0, std::clamp(center, -*loop.largest_center, *loop.largest_center), stiffness};
        }
        const double position = rounded(command.position, loop.position_step);
        // The force is that of the line at the rounded position, so rounding the position does not move the line
        return {rounded(command.force + stiffness * (position - command.position), profile_.force_step),
                position, stiffness};
    }

    /// Stores the command of this tick until the device's delay has passed and the motor applies it.
    void pend(const Command& command) noexcept {
        const auto delay = static_cast<std::size_t>(profile_.whole_delay_samples());
        pending_[(tick_ + delay) % pending_.size()] = command;
    }
    [[nodiscard]] const Command& pending(std::uint64_t tick) const noexcept {
        return pending_[tick % pending_.size()];
    }

    /// Integrates the motion of the handle over the time `share` times the period, with one command. A line is applied in
    /// the periods of the controller, with the force for the position that it read one delay earlier.
    void move(const Grip& grip, const Command& command, double share, int substeps) noexcept {
        const double duration = share * profile_.period_s;
        if (!profile_.held_line) {
            integrate(grip, command.force, duration, substeps);
            mean_applied_ += share * applied_;
            return;
        }
        const HeldLine& loop = *profile_.held_line;
        const int periods = std::max(1, static_cast<int>(std::lround(duration / loop.period_s)));
        const auto late = static_cast<std::uint64_t>(std::lround(loop.delay_s / loop.period_s));
        for (int k = 0; k < periods; ++k) {
            read_[reads_ % read_.size()] = encoded(handle_.position, loop.encoder_step);
            const double position = read_[(reads_++ - late) % read_.size()];
            integrate(grip, limited(command.force + command.stiffness * (position - command.position)),
                      duration / periods, std::max(1, substeps / periods));
            mean_applied_ += share * applied_ / periods;
        }
    }
    void integrate(const Grip& grip, double force, double duration, int substeps) noexcept {
        applied_ = force;
        plant_.tick({profile_.inertia, profile_.viscous_damping, profile_.coulomb_friction}, grip, applied_,
                    duration / substeps, substeps, handle_);
    }

    DeviceProfile profile_;
    H hand_;
    Plant plant_;
    int substeps_;
    Motion start_;
    Motion handle_;
    double applied_ = 0.0;
    double mean_applied_ = 0.0;
    double last_reading_ = 0.0;
    std::uint64_t tick_ = 0;
    /// Commands of the last ticks that the motor does not yet apply, because of the delay
    std::array<Command, longest_delay_samples + 2> pending_{};
    std::uint64_t reads_ = 0;  ///< samples of the controller that holds a line
    /// Last positions that this controller read; the size is a power of two, so that numbers wrap around
    std::array<double, std::bit_ceil(std::size_t{longest_delay_samples} + 2)> read_{};
};

/// Simulated device whose hand moves the handle back and forth, for demonstrations, tests and examples.
using SimulatedDevice = SimulatedHandle<Hand, SemiImplicitEuler>;

/// Simulated device with an object mounted on its handle, which makes recordings like those of a real object.
using SimulatedRig = SimulatedHandle<Hand, MountedObject>;

static_assert(Device<SimulatedDevice>);
static_assert(Device<SimulatedRig>);

/// Returns the number of integration steps in one tick of a period [s], so that each step is about 1/20 ms for every
/// rate.
[[nodiscard]] inline int simulated_substeps(double period_s) noexcept {
    return std::max(1, static_cast<int>(std::lround(usual_substeps * (period_s / 1e-3))));
}

}  // namespace palpate
