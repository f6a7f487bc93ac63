// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <numbers>
#include <optional>

namespace palpate {

/// Motion of a position servo relative to its command: position minus command, and velocity.
struct ServoDeviation {
    double position = 0.0;  ///< position minus command [m or rad]
    double velocity = 0.0;  ///< velocity [m/s or rad/s]
};

/// A position servo that no force of the hand moves, as a linear lag between command c and position x:
///
///     second order:  x'' = w^2 (c - x) - 2 zeta w x',      first order:  x' = w (c - x),      no lag:  x = c.
///
/// w is 2 pi times the bandwidth, zeta the damping ratio. The step response sigma(t) is 1 minus the deviation after a
/// step of the command at t = 0, and is 0 for t <= 0: a sensor that is read when the command changes reads the motion
/// before the change.
class Servo {
  public:
    /// Makes a servo without lag if `bandwidth_hz` is empty, and one of first order if `damping_ratio` is empty.
    explicit Servo(std::optional<double> bandwidth_hz = std::nullopt,
                   std::optional<double> damping_ratio = std::nullopt) noexcept
        : has_lag_{bandwidth_hz.has_value()},
          second_order_{has_lag_ && damping_ratio.has_value()},
          frequency_{2.0 * std::numbers::pi * bandwidth_hz.value_or(0.0)},
          damping_ratio_{damping_ratio.value_or(0.0)} {}

    [[nodiscard]] bool has_lag() const noexcept { return has_lag_; }

    /// Returns the integral of 1 - sigma over time: the delay of slow motion by the servo [s].
    [[nodiscard]] double lag_s() const noexcept {
        return has_lag_ ? (second_order_ ? 2.0 * damping_ratio_ : 1.0) / frequency_ : 0.0;
    }

    /// Returns the deviation immediately after the command moved by -`distance` from the position of a servo whose
    /// deviation was `before`.
    [[nodiscard]] ServoDeviation moved(const ServoDeviation& before, double distance) const noexcept {
        ServoDeviation now{before.position + distance, before.velocity};
        if (!has_lag_) {
            now = {0.0, 0.0};
        } else if (!second_order_) {
            now.velocity = -frequency_ * now.position;
        }
        return now;
    }

    /// Returns the matrix, row by row, that maps the deviation at a time to the deviation after `time_s` with an
    /// unchanged command.
    [[nodiscard]] std::array<double, 4> transition(double time_s) const noexcept {
        if (!has_lag_) {
            return {0.0, 0.0, 0.0, 0.0};
        }
        if (!second_order_) {
            const double decay = std::exp(-frequency_ * time_s);
            return {decay, 0.0, 0.0, decay};
        }
        const double s = damping_ratio_ * frequency_;
        const double squared = frequency_ * frequency_ - s * s;
        const double angle = std::sqrt(std::abs(squared)) * time_s;
        double even = 1.0;    // e^(-s t) times cos or cosh
        double odd = time_s;  // e^(-s t) times sin or sinh, divided by the frequency
        if (squared >= 0.0) {
            const double decay = std::exp(-s * time_s);
            even = decay * std::cos(angle);
            odd = decay * time_s * (angle > 1e-4 ? std::sin(angle) / angle : 1.0 - angle * angle / 6.0);
        } else {  // the exponents are joined, because the hyperbolic functions overflow
            const double slow = std::exp(angle - s * time_s);
            const double fast = std::exp(-angle - s * time_s);
            even = 0.5 * (slow + fast);
            odd = time_s * (angle > 1e-4 ? 0.5 * (slow - fast) / angle
                                         : std::exp(-s * time_s) * (1.0 + angle * angle / 6.0));
        }
        return {even + s * odd, odd, -frequency_ * frequency_ * odd, even - s * odd};
    }

    /// Returns the acceleration of the servo [m/s^2 or rad/s^2].
    [[nodiscard]] double acceleration(const ServoDeviation& now) const noexcept {
        return second_order_ ? -frequency_ * (frequency_ * now.position + 2.0 * damping_ratio_ * now.velocity)
                             : -frequency_ * now.velocity;
    }

    /// Returns bounds of the integral over time of |p|, |p'| and |p''|, where p is the response of the position to an
    /// impulse of the command [1, 1/s, 1/s^2]. They bound position, velocity and acceleration of the servo divided by
    /// the largest command. With the overshoot o = exp(-pi zeta / sqrt(1 - zeta^2)) of a servo of second order, the
    /// step response has the total variation (1 + o) / (1 - o), p at most 2 w / (1 - o), and p'' follows from the
    /// equation of the servo.
    [[nodiscard]] std::array<double, 3> impulse_norms() const noexcept {
        if (!has_lag_) {
            return {1.0, 0.0, 0.0};
        }
        if (!second_order_) {
            return {1.0, 2.0 * frequency_, 2.0 * frequency_ * frequency_};
        }
        const double zeta = damping_ratio_;
        const double overshoot =
            zeta < 1.0 ? std::exp(-std::numbers::pi * zeta / std::sqrt(1.0 - zeta * zeta)) : 0.0;
        const double position = (1.0 + overshoot) / (1.0 - overshoot);
        const double velocity = 2.0 * frequency_ / (1.0 - overshoot);
        return {position, velocity, frequency_ * (frequency_ * (1.0 + position) + 2.0 * zeta * velocity)};
    }

  private:
    bool has_lag_;
    bool second_order_;
    double frequency_;  ///< w [rad/s]
    double damping_ratio_;
};

}  // namespace palpate
