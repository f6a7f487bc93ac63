// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <utility>

#include "palpate/device/device.hpp"
#include "palpate/guard/guards.hpp"
#include "palpate/realtime/nonblocking.hpp"
#include "palpate/rendering/admittance.hpp"
#include "palpate/run/controller.hpp"
#include "palpate/status.hpp"

namespace palpate {

/// Runs the ticks of the control loop of an admittance display: check the reading, move the virtual object by the
/// measured force, exchange position command and next reading with the device. The force is that of the transducer; of a
/// device without a transducer it is the force of the motor, and the inertia of the motor is then part of the handle.
///
/// After an invalid reading a tick repeats the last position command, because a handle that is released moves. A force
/// at the end of the sensor's range ends the run: the object would follow a smaller force than that of the hand. Apart
/// from the device's `exchange`, a tick does not allocate, lock, throw, log or make a system call.
template <Device D>
class AdmittanceController {
  public:
    /// Of the guards, the check of the readings and the sums of energy are used. `largest_force` is the range of the
    /// force sensor [N or N*m]; `stiffness` is that of the position servo, which a motor controller needs in each
    /// command [N/m or N*m/rad].
    AdmittanceController(D& device, Admittance source, Guards guards, double largest_force, double stiffness)
        : device_{device},
          source_{std::move(source)},
          guards_{guards},
          largest_force_{largest_force},
          stiffness_{stiffness} {}

    /// Takes the first sample without moving the handle.
    [[nodiscard]] Status start() noexcept {
        reading_ = device_.exchange({});
        return reading_.status;
    }

    /// Computes the position command for the last reading, sends it and takes the next reading. The first valid reading
    /// sets the virtual object at rest at the position of the handle.
    [[nodiscard]] Tick tick() noexcept PALPATE_NONBLOCKING {
        const double force = std::isnan(reading_.measured) ? reading_.applied : reading_.measured;
        Tick tick{reading_, {}, held_, status_of(force)};
        tick.rendered.environment_position = held_.position;
        if (sends_force(tick.status)) {
            if (!std::exchange(is_placed_, true)) {
                source_.reset(reading_.position);
            }
            const double moved = guards_.motion.to(reading_.position);
            if (std::isfinite(moved)) {
                guards_.observer.book(force, moved);
            }
            const PositionCommand next = source_.step(force);
            tick.rendered = next.object;
            guards_.account.visit(reading_.position, next.object.environment_position);
            tick.status = next.object.status == Status::Ok ? tick.status : next.object.status;
            held_ = {0.0, next.position, stiffness_};
            tick.command = held_;
        } else {
            guards_.motion.interrupt();
        }
        reading_ = device_.exchange(tick.command);
        return tick;
    }

    /// Repeats the last position command and closes the device. Returns what is known about its force.
    ZeroForce stop() noexcept {
        (void)device_.exchange(held_);
        return closed(device_);
    }

    /// Returns true if the device's clock sets the rate of the control loop.
    [[nodiscard]] bool paced_by_device() const noexcept { return sets_pace(device_); }
    [[nodiscard]] const ReadingGuard& reading_guard() const noexcept { return guards_.reading; }
    [[nodiscard]] const Guards& guards() const noexcept { return guards_; }

  private:
    [[nodiscard]] Status status_of(double force) noexcept {
        const Status status = guards_.reading.check(reading_);
        if (!sends_force(status)) {
            return status;
        }
        if (!std::isfinite(force)) {
            return Status::NonFinite;
        }
        return std::abs(force) >= largest_force_ ? Status::Saturated : status;
    }

    D& device_;
    Admittance source_;
    Guards guards_;
    double largest_force_;
    double stiffness_;
    Reading reading_;
    Command held_;            ///< last position command; before the first one, no position
    bool is_placed_ = false;  ///< true after the virtual object was placed at the handle
};

}  // namespace palpate
