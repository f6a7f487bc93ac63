// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "palpate/simulation/hand.hpp"

namespace palpate {

/// What a handle is by itself.
struct Mechanics {
    double inertia = 0.0;   ///< [kg or kg*m^2], > 0
    double damping = 0.0;   ///< b [N*s/m or N*m*s/rad]
    double friction = 0.0;  ///< f_c [N or N*m]
};

/// What every way to move a handle shares where it has nothing to forget and no force transducer.
struct PlainPlant {
    void start() noexcept {}
    [[nodiscard]] static double measured(const Motion& /*handle*/) noexcept {
        return std::numeric_limits<double>::quiet_NaN();
    }
};

/// Semi-implicit Euler, the usual integrator of a simulated device. Coulomb friction takes away at most the
/// velocity there is: it can stop the handle but never turn it round.
struct SemiImplicitEuler : PlainPlant {
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

/// Semi-implicit Euler with a real object mounted on the handle.
struct MountedObject {
    /// Over position, positive out of the object; none: nothing is mounted. It must neither throw nor allocate.
    std::function<double(double)> force;
    bool transducer = true;  ///< whether the device measures that force

    void start() noexcept {}

    void tick(const Mechanics& handle, const Grip& grip, double applied, double step, int substeps,
              Motion& motion) const noexcept {
        for (int k = 0; k < substeps; ++k) {
            const double mounted = force ? force(motion.position) : 0.0;
            SemiImplicitEuler{}.tick(handle, grip, applied + mounted, step, 1, motion);
        }
    }

    [[nodiscard]] double measured(const Motion& handle) const noexcept {
        return force && transducer ? force(handle.position) : PlainPlant::measured(handle);
    }
};

/// Where energy went since the device was opened. The port is between hand and handle, so the handle's damping
/// and friction are inside: hand = motor + loss + what the handle's inertia holds more than at the start.
struct EnergyAccount {
    double hand = 0.0;        ///< work of the hand on the handle [J]
    double motor = 0.0;       ///< work of the handle against the motor, into the virtual object [J]
    double loss = 0.0;        ///< to damping and friction [J], >= 0
    double throughput = 0.0;  ///< of hand and motor, to and fro: what rounding is measured against [J]
    double least = 0.0;       ///< least of hand + 1e-12 throughput after any substep [J]
};

/// The midpoint rule, which books every joule: with u the mean velocity of a substep of length h,
///
///     M (v_1 - v_0) / h = push + K (target - x_0 - h u / 2) - D u - f_c sgn u - applied,
///     v_1 = 2u - v_0,   x_1 = x_0 + h u,
///
/// force times way is exactly the work, whatever h. Where friction holds a handle that would turn round, it
/// takes what speed is left.
class Midpoint : public PlainPlant {
  public:
    // NOLINTNEXTLINE(bugprone-derived-method-shadowing-base-method): known by its type, never through the base
    void start() noexcept { account_ = {}; }

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
            // Changes are computed, not new values: a heavy hand's momentum is far above every force.
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
            account_.loss += handle.damping * mean * moved + handle.friction * std::abs(moved);
            account_.throughput += (std::abs(hand) + std::abs(applied)) * std::abs(moved);
            if (handle.friction > 0.0 && motion.velocity * before < 0.0) {
                stop(handle, grip, applied, motion);
            }
            account_.least = std::min(account_.least, account_.hand + rounding * account_.throughput);
        }
    }

    [[nodiscard]] const EnergyAccount& account() const noexcept { return account_; }

  private:
    static constexpr double rounding = 1e-12;  ///< of the throughput

    void stop(const Mechanics& handle, const Grip& grip, double applied, Motion& motion) noexcept {
        const double pull = grip.push + grip.stiffness * (grip.target - motion.position);
        if (std::abs(pull - applied) > handle.friction) {
            return;
        }
        const double squared = motion.velocity * motion.velocity;
        motion.velocity = 0.0;
        account_.hand += 0.5 * grip.mass * squared;
        account_.loss += 0.5 * (handle.inertia + grip.mass) * squared;
    }

    EnergyAccount account_;
};

}  // namespace palpate
