// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>

#include "palpate/dynamics/coupling.hpp"
#include "palpate/model/environment.hpp"
#include "palpate/rendering/any_structure.hpp"
#include "palpate/rendering/structure.hpp"

namespace palpate {

/// Returns the slope of the model below which the explicit structure is stable while the device is held still, behind a
/// coupling, or driven by a force without a coupling (K_c = B_c = 0). For a model of slope K > 0 at an equilibrium, the
/// poles of the linearised step are inside the unit circle if B_o + B_c > 0 and
///
///     K + K_c < (4 m - 2 (B_o + B_c) T) / T^2.
[[nodiscard]] constexpr double explicit_slope_limit(const Inertia& inertia, const VirtualCoupling& coupling,
                                                    double period) noexcept {
    const double damping = inertia.damping + coupling.damping;
    return (4.0 * inertia.mass - 2.0 * damping * period) / (period * period) - coupling.stiffness;
}

/// Returns the mass m and the damping B_o = ratio m / T of an object that is stable for model slopes below `limit`: the
/// inverse of `explicit_slope_limit`.
[[nodiscard]] constexpr Inertia explicit_object(double limit, const VirtualCoupling& coupling, double ratio,
                                                double period) noexcept {
    const double mass = ((limit + coupling.stiffness) * period * period + 2.0 * coupling.damping * period) /
                        (4.0 - 2.0 * ratio);
    return {mass, ratio * mass / period};
}

/// Virtual object with mass m, m v' = F_c - f(y) - B_o v, with the paper's delayed integrator (figure 14). F_c is the
/// coupling's force and f the model's force. The forces on the object are one sample old, so no equation is solved. The
/// step is stable only for model slopes below `explicit_slope_limit`:
///
///     v_k = v_{k-1} + (T/m)(F_{k-1} - f(y_{k-1}) - B_o v_{k-1}),   y_k = y_{k-1} + T v_k,
///     F_k = K_c (x_k - y_k) + B_c (v_device - v_k).
template <Environment E>
class Explicit {
  public:
    Explicit(E environment, Inertia inertia, VirtualCoupling coupling, double period)
        : environment_{std::move(environment)}, inertia_{inertia}, coupling_{coupling}, period_{period} {
        reset(0.0);
    }

    /// Sets the virtual object at rest at a position.
    void reset(double position) noexcept {
        state_ = environment_.start(position);
        device_ = position;
        position_ = position;
        velocity_ = 0.0;
        force_ = environment_.at(position, state_).force;
    }

    /// Moves the object by one step and returns the coupling's force for the measured position of the device.
    [[nodiscard]] Rendered step(double device) noexcept {
        const ObjectStep next = moved_by(force_);
        const double force =
            coupling_.force(device - next.position, (device - device_) / period_ - next.velocity);
        const Rendered rendered = take(next, force);
        if (rendered.status == Status::Ok) {
            device_ = device;
            force_ = force;
        }
        return rendered;
    }

    /// Moves the virtual object by one step; the given force acts on it in place of the coupling's force.
    [[nodiscard]] Rendered drive(double force, const DriveLimits& limits = {}) noexcept {
        ObjectStep next = moved_by(force);
        // Friction reduces the speed at the end of the step, at most to zero
        const double speed =
            std::max(0.0, std::abs(next.velocity) - period_ / inertia_.mass * limits.friction);
        next.velocity = std::copysign(std::min(speed, limits.largest_step / period_), next.velocity);
        if (std::isfinite(next.position)) {
            next.position = position_ + period_ * next.velocity;
        }
        return take(next, force);
    }

  private:
    /// Velocity and position of the object at the end of a step.
    struct ObjectStep {
        double velocity;
        double position;
        bool extrapolated;  ///< true if the step starts outside the model's domain
    };

    /// Returns the step of the object under a force, without changing the state.
    [[nodiscard]] ObjectStep moved_by(double force) const noexcept {
        const EnvironmentSample sample = environment_.at(position_, state_);
        const double velocity =
            velocity_ + period_ / inertia_.mass * ((force - inertia_.damping * velocity_) - sample.force);
        return {velocity, position_ + period_ * velocity, sample.extrapolated};
    }

    /// Moves the object to the end of a step and returns the force, if position and force are finite.
    [[nodiscard]] Rendered take(const ObjectStep& next, double force) noexcept {
        if (!std::isfinite(next.position) || !std::isfinite(force)) {
            return detail::refused(position_);
        }
        velocity_ = next.velocity;
        position_ = next.position;
        environment_.advance(position_, state_);
        return {force, position_, 1, Status::Ok, next.extrapolated};
    }

    E environment_;
    // The state of the last step is stored between constants. Compilers store adjacent variables together, and the next
    // step would wait longer for such a store.
    double position_ = 0.0;  ///< y_{k-1}, last position of the object
    Inertia inertia_;
    double velocity_ = 0.0;  ///< v_{k-1}, last velocity of the object
    VirtualCoupling coupling_;
    double force_ = 0.0;  ///< F_{k-1}, last force of the coupling
    double period_;
    double device_ = 0.0;  ///< x_{k-1}, last position of the device
    typename E::State state_;
};

/// Builds the explicit structure.
struct ExplicitStructure {
    static constexpr StructureTraits traits{.name = "explicit", .coupling = true, .mass = true};

    /// Returns the slope limit: the explicit structure diverges with a model whose slope reaches this limit.
    [[nodiscard]] static double slope_limit(const StructureNumbers& numbers) noexcept {
        return explicit_slope_limit(numbers.inertia, numbers.coupling, numbers.period_s);
    }

    template <Environment E, class SolverOf>
    static AnyStructure build(E environment, const StructureNumbers& numbers, const SolverOf& /*solver_of*/) {
        return Explicit{std::move(environment), numbers.inertia, numbers.coupling, numbers.period_s};
    }
};

}  // namespace palpate
