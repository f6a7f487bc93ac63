// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <concepts>
#include <limits>
#include <utility>

#include "palpate/device/device_profile.hpp"
#include "palpate/dynamics/servo.hpp"
#include "palpate/rendering/any_structure.hpp"
#include "palpate/rendering/structure.hpp"

namespace palpate {

/// Position command of an admittance display, and the step of the virtual object that it comes from.
struct PositionCommand {
    double position = 0.0;  ///< command of the position servo [m or rad]
    Rendered object;        ///< step of the virtual object
};

/// A class that computes a position command from the measured force of the hand, once a tick. It is the opposite of
/// `Structure`, which computes a force from a position.
template <class A>
concept PositionSource = requires(A& source, double number) {
    { source.reset(number) } noexcept;
    { source.step(number) } noexcept -> std::same_as<PositionCommand>;
};

/// Returns the position servo of an admittance display.
[[nodiscard]] inline Servo servo_of(const AdmittanceDisplay& display) noexcept {
    return Servo{display.servo_bandwidth_hz, display.servo_damping};
}

/// Returns the time by which the handle follows the virtual object in slow motion [s]: delay and lag of the servo, less
/// the feed-forward. A hand feels the slope f' of the object times this time as damping, in addition to B_o.
[[nodiscard]] inline double display_lag_s(const DeviceProfile& device) noexcept {
    const AdmittanceDisplay display = device.admittance.value_or(AdmittanceDisplay{});
    return device.delay_s + servo_of(display).lag_s() - display.feed_forward_s;
}

/// Returns the Coulomb friction of the virtual object that makes the steps of command and force sensor harmless [N or
/// N*m]. A command that is wrong by half a step D changes the force of a hand in the stated range by at most
///
///     (k_h |p|_1 + b_h |p'|_1 + m_h |p''|_1) D / 2,
///
/// with the impulse response p of the servo; the sensor adds half its step. Friction of this size takes more energy
/// than these errors can give.
[[nodiscard]] inline double virtual_friction(const DeviceProfile& device) noexcept {
    const AdmittanceDisplay display = device.admittance.value_or(AdmittanceDisplay{});
    const auto [position, velocity, acceleration] = servo_of(display).impulse_norms();
    const double stiffness = display.hand_stiffness * position + display.hand_damping * velocity +
                             (display.hand_mass + display.handle_mass) * acceleration;
    return 0.5 * (stiffness * display.position_step + device.force_step);
}

/// Renders a model on an admittance display. The measured force F of the hand moves the virtual object
/// m y'' + B_o y' + f(y) = F by one step of the implicit, explicit or energy-consistent structure, without a coupling.
/// The command is y, plus `feed_forward_s` times its velocity, rounded to the position step of the display. The rate
/// limit and the virtual friction act inside the step of the object, where they cannot generate energy.
///
/// If the force is not finite, the command holds its last value.
class Admittance {
  public:
    Admittance(AnyStructure object, const DeviceProfile& device)
        : object_{std::move(object)},
          limits_{device.admittance && device.admittance->rate_limit
                      ? *device.admittance->rate_limit * device.period_s
                      : std::numeric_limits<double>::infinity(),
                  virtual_friction(device)},
          ahead_{device.admittance ? device.admittance->feed_forward_s / device.period_s : 0.0},
          step_{device.admittance ? device.admittance->position_step : 0.0} {
        reset(0.0);
    }

    /// Sets the virtual object at rest at a position.
    void reset(double position) noexcept {
        object_.reset(position);
        position_ = position;
        command_ = rounded(position);
    }

    /// Moves the virtual object by one step with the measured force and returns the position command.
    [[nodiscard]] PositionCommand step(double force) noexcept {
        const Rendered moved = object_.drive(force, limits_);
        if (moved.status == Status::NonFinite || !std::isfinite(moved.environment_position)) {
            return {command_, detail::refused(position_)};
        }
        const double before = std::exchange(position_, moved.environment_position);
        command_ = rounded(position_ + ahead_ * (position_ - before));
        return {command_, moved};
    }

  private:
    [[nodiscard]] double rounded(double position) const noexcept {
        return step_ > 0.0 ? step_ * std::floor(position / step_ + 0.5) : position;
    }

    AnyStructure object_;
    DriveLimits limits_;
    double ahead_;           ///< feed-forward time [periods]
    double step_;            ///< position step [m or rad]; 0: none
    double position_ = 0.0;  ///< y, position of the virtual object
    double command_ = 0.0;   ///< last command
};

static_assert(PositionSource<Admittance>);

}  // namespace palpate
