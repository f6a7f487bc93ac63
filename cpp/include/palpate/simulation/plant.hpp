// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "palpate/simulation/hand.hpp"

namespace palpate {

/// Inertia, damping and friction of a simulated handle.
struct Mechanics {
    double inertia = 0.0;   ///< inertia, > 0 [kg or kg*m^2]
    double damping = 0.0;   ///< viscous damping b [N*s/m or N*m*s/rad]
    double friction = 0.0;  ///< Coulomb friction f_c [N or N*m]
};

/// Base class of integrators of the handle's motion without a force transducer.
struct PlainPlant {
    /// Does nothing, because this integrator stores nothing between ticks.
    void start() noexcept {}
    /// Returns NaN, because this integrator has no force transducer.
    [[nodiscard]] static double measured(const Motion& /*handle*/) noexcept {
        return std::numeric_limits<double>::quiet_NaN();
    }
};

/// The semi-implicit Euler method, the usual integrator of a simulated handle. Coulomb friction can stop the handle,
/// but never reverses its velocity.
struct SemiImplicitEuler : PlainPlant {
    /// Moves the handle over `substeps` steps of duration `step`.
    void tick(const Mechanics& handle, const Grip& grip, double applied, double step, int substeps,
              Motion& motion) const noexcept {
        const double inertia = handle.inertia + grip.mass;
        const double friction = step / inertia * handle.friction;
        for (int k = 0; k < substeps; ++k) {
            const double driving = grip.force(motion) - handle.damping * motion.velocity - applied;
            const double free = motion.velocity + step / inertia * driving;
            motion.velocity = std::copysign(std::max(0.0, std::abs(free) - friction), free);
            motion.position += step * motion.velocity;
        }
    }
};

/// The semi-implicit Euler method with an object mounted on the handle, like a real object on a real device.
struct MountedObject {
    /// Function that returns the object's force at a position, positive out of the object; empty without an object. It
    /// must neither throw nor allocate.
    std::function<double(double)> force;
    bool transducer = true;  ///< true if the device measures the object's force

    void start() noexcept {}

    /// Moves the handle over `substeps` steps of duration `step`.
    void tick(const Mechanics& handle, const Grip& grip, double applied, double step, int substeps,
              Motion& motion) const noexcept {
        for (int k = 0; k < substeps; ++k) {
            const double mounted = force ? force(motion.position) : 0.0;
            SemiImplicitEuler{}.tick(handle, grip, applied + mounted, step, 1, motion);
        }
    }

    /// Returns the force that the transducer measures; NaN without a transducer.
    [[nodiscard]] double measured(const Motion& handle) const noexcept {
        return force && transducer ? force(handle.position) : PlainPlant::measured(handle);
    }
};

/// Energies since the simulated device was opened. The balance counts the work of the hand on the handle, which
/// includes the losses of the handle: hand = motor + dissipated + increase of the handle's kinetic energy.
struct EnergyBalance {
    double hand = 0.0;        ///< work of the hand on the handle [J]
    double motor = 0.0;       ///< work of the handle against the motor [J]
    double dissipated = 0.0;  ///< energy lost by damping and friction [J]
    /// Sum of the absolute work of hand and motor, for a bound of rounding errors [J]
    double throughput = 0.0;
    /// Smallest value of (work of the hand + 1e-12 `throughput`) since the device was opened [J]
    double least = 0.0;
};

/// The midpoint rule, an integrator with an exact energy account. For a handle and hand of total mass M, with the mean
/// velocity u of a substep of length h, the hand's spring K, all damping D and the device's force `applied`,
///
///     M (v_1 - v_0) / h = push + K (target - x_0 - h u / 2) - D u - f_c sgn u - applied,
///     v_1 = 2u - v_0,   x_1 = x_0 + h u,
///
/// force times distance is exactly the work, for every h. If friction is large enough to hold the handle when its
/// velocity would reverse, the handle stops and its kinetic energy is dissipated.
class Midpoint : public PlainPlant {
  public:
    /// Sets all energies of the account to 0.
    // NOLINTNEXTLINE(bugprone-derived-method-shadowing-base-method): never called through the base
    void start() noexcept { account_ = {}; }

    /// Moves the handle over `substeps` steps of duration `step` and updates the energy account.
    void tick(const Mechanics& handle, const Grip& grip, double applied, double step, int substeps,
              Motion& motion) noexcept {
        const double momentum = 2.0 * (handle.inertia + grip.mass) / step;
        const double half_spring = 0.5 * grip.stiffness * step;
        const double drag = half_spring + grip.damping + handle.damping;
        const double mobility = 1.0 / (momentum + drag);
        const double held_mass = 2.0 * grip.mass / step;
        for (int k = 0; k < substeps; ++k) {
            const double before = motion.velocity;
            const double pull = grip.push + grip.stiffness * (grip.target - motion.position);
            const double driving = momentum * before + pull - applied;
            const double friction = std::copysign(handle.friction, driving);
            // The change of the velocity is computed instead of the new velocity, to reduce rounding errors: the
            // momentum of a heavy hand is much larger than every force.
            const double change = std::abs(driving) > handle.friction
                                      ? mobility * (pull - applied - drag * before - friction)
                                      : -before;
            const double mean = before + change;
            const double moved = step * mean;
            const double hand = pull - (half_spring + grip.damping) * mean - held_mass * change;
            motion.velocity = mean + change;
            motion.position += moved;
            account_.hand += hand * moved;
            account_.motor += applied * moved;
            account_.dissipated += handle.damping * mean * moved + handle.friction * std::abs(moved);
            account_.throughput += (std::abs(hand) + std::abs(applied)) * std::abs(moved);
            if (handle.friction > 0.0 && motion.velocity * before < 0.0) {
                stop(handle, grip, applied, motion);
            }
            account_.least = std::min(account_.least, account_.hand + rounding * account_.throughput);
        }
    }

    /// Returns the energies since the device was opened.
    [[nodiscard]] const EnergyBalance& account() const noexcept { return account_; }

  private:
    /// The rounding errors of the energies are at most this factor times `throughput` [-]
    static constexpr double rounding = 1e-12;

    void stop(const Mechanics& handle, const Grip& grip, double applied, Motion& motion) noexcept {
        const double pull = grip.push + grip.stiffness * (grip.target - motion.position);
        if (std::abs(pull - applied) > handle.friction) {
            return;
        }
        const double squared = motion.velocity * motion.velocity;
        motion.velocity = 0.0;
        account_.hand += 0.5 * grip.mass * squared;
        account_.dissipated += 0.5 * (handle.inertia + grip.mass) * squared;
    }

    EnergyBalance account_;
};

}  // namespace palpate
