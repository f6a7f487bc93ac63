// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
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

inline constexpr int usual_substeps = 20;   ///< in one tick of 1 ms of a simulated device
inline constexpr int most_substeps = 1000;  ///< in one tick of a simulated device

/// A haptic device with a hand, one tick of virtual time for each exchange. It models inertia, viscous and Coulomb
/// friction, encoder, force step and limit, hold over the tick, and delay. `Plant` moves the handle: SemiImplicitEuler,
/// Midpoint for an energy account, or MountedObject for the measurement of a real object.
///
/// It does not model electrical dynamics of the motor, torque ripple, backlash, flexible parts, jitter of the sample
/// time, and noise of a force transducer.
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

    /// Replaces the plant, for example to mount an object.
    void mount(Plant plant) { plant_ = std::move(plant); }

    /// Sets the handle to its start position and velocity.
    Opened open() {
        handle_ = start_;
        plant_.start();
        applied_ = 0.0;
        tick_ = 0;
        pending_.fill(0.0);
        last_reading_ = encoded(handle_.position);
        return {};
    }

    /// Applies the command over one period (later by the delay) and samples the encoder at its end. With a fractional
    /// delay the force changes within the tick; the reading reports the later one.
    [[nodiscard]] Reading exchange(const Command& command) noexcept {
        pend(converted(command.force));
        const double late = profile_.delay_fraction();
        const int before = late > 0.0 ? std::max(1, static_cast<int>(std::lround(late * substeps_))) : 0;
        const Grip grip = hand_.grip(time(), handle_);
        if (before > 0) {
            move(grip, pending(tick_ + pending_.size() - 1), late, before);
        }
        move(grip, pending(tick_), 1.0 - late, std::max(1, substeps_ - before));
        ++tick_;
        const double measured = encoded(handle_.position);
        const double velocity = (measured - last_reading_) / profile_.period_s;
        last_reading_ = measured;
        return {measured, velocity, applied_, plant_.measured(handle_), time(), tick_, Status::Ok};
    }

    void close() noexcept { applied_ = 0.0; }

    [[nodiscard]] const DeviceProfile& profile() const noexcept { return profile_; }
    /// Returns the true motion of the handle, which a real host cannot measure.
    [[nodiscard]] const Motion& handle() const noexcept { return handle_; }
    [[nodiscard]] double handle_position() const noexcept { return handle_.position; }
    [[nodiscard]] double handle_velocity() const noexcept { return handle_.velocity; }
    [[nodiscard]] double applied_force() const noexcept { return applied_; }
    [[nodiscard]] const Plant& plant() const noexcept { return plant_; }

  private:
    [[nodiscard]] double time() const noexcept { return static_cast<double>(tick_) * profile_.period_s; }

    /// Returns the reading of the encoder [m or rad].
    [[nodiscard]] double encoded(double position) const noexcept {
        const double step = profile_.encoder_step;
        return step > 0.0 ? step * std::floor(position / step + 0.5) : position;
    }

    /// Returns the force of the motor for a command: zero if it is not finite, otherwise limited and rounded to the
    /// force step.
    [[nodiscard]] double converted(double force) const noexcept {
        if (!std::isfinite(force)) {
            return 0.0;
        }
        const double limited = std::clamp(force, -profile_.force_limit, profile_.force_limit);
        const double step = profile_.force_step;
        return step > 0.0 ? step * std::round(limited / step) : limited;
    }

    /// Stores the command of this tick until its delay is over.
    void pend(double force) noexcept {
        const auto delay = static_cast<std::size_t>(profile_.whole_delay_samples());
        pending_[(tick_ + delay) % pending_.size()] = force;
    }
    [[nodiscard]] double pending(std::uint64_t tick) const noexcept {
        return pending_[tick % pending_.size()];
    }

    /// Moves the handle against a force over a share of the tick.
    void move(const Grip& grip, double force, double share, int substeps) noexcept {
        applied_ = force;
        plant_.tick({profile_.inertia, profile_.viscous_damping, profile_.coulomb_friction}, grip, applied_,
                    share * profile_.period_s / substeps, substeps, handle_);
    }

    DeviceProfile profile_;
    H hand_;
    Plant plant_;
    int substeps_;
    Motion start_;
    Motion handle_;
    double applied_ = 0.0;
    double last_reading_ = 0.0;
    std::uint64_t tick_ = 0;
    std::array<double, longest_delay_samples + 2> pending_{};  ///< pending forces, by tick
};

/// Simulated device with a sweeping hand, for demonstrations, tests and examples.
using SimulatedDevice = SimulatedHandle<Hand, SemiImplicitEuler>;

/// Simulated device with a real object, from which recordings are made.
using SimulatedRig = SimulatedHandle<Hand, MountedObject>;

static_assert(Device<SimulatedDevice>);
static_assert(Device<SimulatedRig>);

/// Returns the substeps of a tick that keep the inner step of the simulation independent of the rate.
[[nodiscard]] inline int simulated_substeps(double period_s) noexcept {
    return std::max(1, static_cast<int>(std::lround(usual_substeps * (period_s / 1e-3))));
}

}  // namespace palpate
