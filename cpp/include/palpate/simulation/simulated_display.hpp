// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "palpate/device/device.hpp"
#include "palpate/device/device_profile.hpp"
#include "palpate/dynamics/servo.hpp"
#include "palpate/rendering/admittance.hpp"
#include "palpate/simulation/hand.hpp"
#include "palpate/status.hpp"

namespace palpate {

/// A simulated admittance display with a hand. The position servo follows the commands after the delay and is moved by no
/// force; the sensor measures the force of the hand on the handle, in steps. The motion between two samples is exact.
///
/// The simulation does not include noise of the sensor, flexible parts, backlash or jitter of the sample time.
class SimulatedDisplay {
  public:
    explicit SimulatedDisplay(DeviceProfile device, double start = 0.0)
        : device_{std::move(device)}, servo_{servo_of(device_.admittance.value_or(AdmittanceDisplay{}))} {
        validate(device_);
        const double late = device_.delay_fraction();
        before_ = servo_.transition(late * device_.period_s);
        after_ = servo_.transition((1.0 - late) * device_.period_s);
        pending_.fill(start);
        command_ = start;
    }

    /// Returns position and velocity of the handle at the sample.
    [[nodiscard]] Motion handle() const noexcept {
        return {command_ + deviation_.position, deviation_.velocity};
    }

    /// Returns the force that the hand puts on the handle at the sample, without steps of the sensor [N or N*m]. The
    /// mass of the handle counts as mass of the hand, because it is on the hand's side of the sensor.
    [[nodiscard]] double force(const Grip& grip) const noexcept {
        const double handle_mass = device_.admittance ? device_.admittance->handle_mass : 0.0;
        const double acceleration = servo_.has_lag() ? servo_.acceleration(deviation_) : 0.0;
        return grip.force(handle()) - (grip.mass + handle_mass) * acceleration;
    }
    /// Returns the force that the sensor reports for a force [N or N*m].
    [[nodiscard]] double measured(double force) const noexcept {
        const double step = device_.force_step;
        return step > 0.0 ? step * std::floor(force / step + 0.5) : force;
    }

    /// Simulates one period after the command `position` was sent.
    void move(double position) noexcept {
        const std::size_t size = pending_.size();
        const auto delay = static_cast<std::size_t>(device_.whole_delay_samples());
        pending_[(tick_ + delay) % size] = position;
        if (device_.delay_fraction() > 0.0) {
            deviation_ = passed(before_, deviation_);
        }
        const double next = pending_[tick_ % size];
        deviation_ = servo_.moved(deviation_, command_ - next);
        command_ = next;
        deviation_ = passed(after_, deviation_);
        ++tick_;
    }

  private:
    [[nodiscard]] static ServoDeviation passed(const std::array<double, 4>& transition,
                                               const ServoDeviation& now) noexcept {
        return {transition[0] * now.position + transition[1] * now.velocity,
                transition[2] * now.position + transition[3] * now.velocity};
    }

    DeviceProfile device_;
    Servo servo_;
    std::array<double, 4> before_{};  ///< of the part of a period before a command arrives
    std::array<double, 4> after_{};   ///< of the part of a period after a command arrived
    /// Commands that were sent and have not arrived yet, because of the delay
    std::array<double, longest_delay_samples + 2> pending_{};
    ServoDeviation deviation_;
    double command_ = 0.0;
    std::uint64_t tick_ = 0;
};

/// A simulated admittance display with a hand, as a device. A command with a stiffness moves the servo to its position;
/// without a stiffness, or with a number that is not finite, the servo holds its last command. The sensor measures forces
/// up to the force limit of the profile.
template <SimulatedHand H>
class SimulatedPedal {
  public:
    explicit SimulatedPedal(DeviceProfile profile, H hand = {}, double start = 0.0)
        : profile_{std::move(profile)}, hand_{hand}, start_{start}, display_{profile_, start} {}

    /// Opens the simulated device: sets handle and command to the start position.
    Opened open() {
        display_ = SimulatedDisplay{profile_, start_};
        command_ = start_;
        tick_ = 0;
        return {};
    }

    /// Simulates one period, and reads handle and sensor at its end.
    [[nodiscard]] Reading exchange(const Command& command) noexcept {
        if (command.stiffness != 0.0 && std::isfinite(command.position)) {
            command_ = command.position;
        }
        display_.move(command_);
        const double time = static_cast<double>(++tick_) * profile_.period_s;
        const Motion handle = display_.handle();
        const double force = std::clamp(display_.measured(display_.force(hand_.grip(time, handle))),
                                        -profile_.force_limit, profile_.force_limit);
        return {handle.position, handle.velocity, force, force, time, tick_, Status::Ok, profile_.delay_s};
    }

    ZeroForce close() noexcept { return ZeroForce::Held; }

  private:
    DeviceProfile profile_;
    H hand_;
    double start_;
    SimulatedDisplay display_;
    double command_ = 0.0;
    std::uint64_t tick_ = 0;
};

static_assert(Device<SimulatedPedal<Hand>>);

}  // namespace palpate
