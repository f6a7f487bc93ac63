// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <utility>

#include "palpate/device/device.hpp"
#include "palpate/device/device_profile.hpp"
#include "palpate/device/hand.hpp"

namespace palpate {

/// A real object that is mounted on a simulated device: what a recording is made of.
struct SimulatedObject {
    std::function<double(double)>
        force;               ///< over position, positive out of the object; none: nothing is mounted
    bool transducer = true;  ///< whether the device measures that force
};

/// A haptic device with a hand on it, one tick of virtual time an exchange: inertia, viscous and Coulomb
/// friction, encoder, force step and limit, hold over the tick, whole samples of delay, and a mounted object.
///
/// It does not model: motor electrical dynamics, torque ripple, backlash, flexible parts, jitter of the
/// sample time, the noise of a force transducer.
class SimulatedDevice {
  public:
    explicit SimulatedDevice(DeviceProfile profile, Hand hand = {}, int substeps = 20, double start = 0.0)
        : profile_{std::move(profile)}, hand_{hand}, substeps_{substeps}, start_{start} {
        validate(profile_);
    }

    /// Mounts a real object; its function is called at every substep and must neither throw nor allocate.
    void mount(SimulatedObject object) { object_ = std::move(object); }

    /// Puts the handle at rest at its start position.
    Opened open() {
        position_ = start_;
        velocity_ = 0.0;
        applied_ = 0.0;
        tick_ = 0;
        mounted_force_ = object_.force ? object_.force(position_) : 0.0;
        pending_.fill(0.0);
        last_reading_ = encoded(position_);
        return {};
    }

    /// Applies the command over one period (later by the delay) and samples the encoder at its end.
    [[nodiscard]] Reading exchange(const Command& command) noexcept {
        applied_ = delayed(converted(command.force));
        const double target = hand_.target(time());
        const double step = profile_.period_s / substeps_;
        for (int k = 0; k < substeps_; ++k) {
            substep(target, step);
        }
        ++tick_;
        const double measured = encoded(position_);
        const double velocity = (measured - last_reading_) / profile_.period_s;
        last_reading_ = measured;
        const double transducer =
            object_.transducer && object_.force ? mounted_force_ : std::numeric_limits<double>::quiet_NaN();
        return {measured, velocity, applied_, transducer, time(), tick_, Status::Ok};
    }

    void close() noexcept { applied_ = 0.0; }

    [[nodiscard]] const DeviceProfile& profile() const noexcept { return profile_; }
    /// The handle's true position, which no real host knows.
    [[nodiscard]] double handle_position() const noexcept { return position_; }
    [[nodiscard]] double handle_velocity() const noexcept { return velocity_; }
    [[nodiscard]] double applied_force() const noexcept { return applied_; }

  private:
    [[nodiscard]] double time() const noexcept { return static_cast<double>(tick_) * profile_.period_s; }

    /// Semi-implicit Euler. Coulomb friction takes away at most the velocity there is: it can stop the handle
    /// but never turn it round.
    void substep(double target, double step) noexcept {
        const double driving = hand_.force(target, position_, velocity_) -
                               profile_.viscous_damping * velocity_ - applied_ - mounted_force_;
        const double free = velocity_ + step / profile_.inertia * driving;
        const double friction = step / profile_.inertia * profile_.coulomb_friction;
        velocity_ = std::copysign(std::max(0.0, std::abs(free) - friction), free);
        position_ += step * velocity_;
        mounted_force_ = object_.force ? object_.force(position_) : 0.0;
    }

    [[nodiscard]] double encoded(double position) const noexcept {
        const double step = profile_.encoder_step;
        return step > 0.0 ? step * std::floor(position / step + 0.5) : position;
    }

    /// What the motor makes of a command: nothing of a number that is none, the limit, the force step.
    [[nodiscard]] double converted(double force) const noexcept {
        if (!std::isfinite(force)) {
            return 0.0;
        }
        const double limited = std::clamp(force, -profile_.force_limit, profile_.force_limit);
        const double step = profile_.force_step;
        return step > 0.0 ? step * std::round(limited / step) : limited;
    }

    [[nodiscard]] double delayed(double force) noexcept {
        const auto delay = static_cast<std::size_t>(profile_.delay_samples);
        pending_[(tick_ + delay) % pending_.size()] = force;
        return pending_[tick_ % pending_.size()];
    }

    DeviceProfile profile_;
    Hand hand_;
    int substeps_;
    double start_;
    SimulatedObject object_;
    double mounted_force_ = 0.0;  ///< of the object, where the handle is
    double position_ = 0.0;
    double velocity_ = 0.0;
    double applied_ = 0.0;
    double last_reading_ = 0.0;
    std::uint64_t tick_ = 0;
    std::array<double, longest_delay_samples + 1> pending_{};  ///< forces on their way, by tick
};

static_assert(Device<SimulatedDevice>);

/// Substeps of a tick that keep the inner step of the simulation at 1/20 ms, whatever the rate.
[[nodiscard]] inline int simulated_substeps(double period_s) noexcept {
    return std::max(1, static_cast<int>(std::lround(20e3 * period_s)));
}

}  // namespace palpate
