// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

#include "palpate/device/device_profile.hpp"
#include "palpate/guard/stored_energy.hpp"
#include "palpate/status.hpp"

namespace palpate {

/// Numbers of a device and of an object from which an energy account is computed.
struct AccountSettings {
    StoredEnergySettings stored{};  ///< numbers of W, the upper bound of the stored energy
    /// true: E0 includes the energy of a start outside the domain
    bool includes_start_outside = false;
    double device_damping = 0.0;   ///< device damping b that the account counts [N*s/m or N*m*s/rad]
    double device_friction = 0.0;  ///< Coulomb friction f_c that the account counts [N or N*m]
    double encoder_step = 0.0;     ///< encoder step Delta [m or rad]
    double force_step = 0.0;       ///< step of the motor's force [N or N*m]
    /// Largest motion of the handle in one period [m or rad]
    double longest_step = std::numeric_limits<double>::infinity();
    int whole_delay = 0;          ///< n, the whole periods in the delay from a reading to its force
    double delay_fraction = 0.0;  ///< tau, the rest of the delay divided by period_s, 0 <= tau < 1
    double period_s = 1e-3;       ///< longest period T of the control loop [s]
};

/// Limits the energy that a hand can take out of a rendering to E0, for every motion of the handle and every object.
///
/// e is the energy that the hand has put in: the work against the motor plus the losses of the device. The account is a
/// lower bound of e + E0, computed from the readings y (changes u) and the forces F of the motor, with B = b / T:
///
///     acc += F u + B max(0, |u| - Delta)^2 + f_c nu - Delta/2 |change of F|,
///
/// where nu is the motion of the play operator with the radius Delta / 2 on y. If the force changes after the part tau
/// of a period, F is the mean of both forces, and acc decreases by tau (1 - tau) times the energy that their difference
/// can take. A force held for one period takes at most
///
///     r(F) = p^2 / 4B,  p = max(0, |F| - f_c),  or p D - B D^2 if the largest motion D in a period is below p / 2B.
///
/// A command is limited so that r of it and of all commands that still act fits in the account. Therefore e >= -E0 at
/// all times. The same inequality is a lower bound of the account itself, which the account uses. E0 is the bound W of
/// the stored energy inside the domain. The account never exceeds E0 + W, with W of all positions since the start, so old
/// losses do not pay for a later oscillation. Energy in a period without two valid readings does not count.
/// docs/certificate.md has the proof.
///
/// A certificate holds for every motion, so also for the one in which the hand takes r of each command that acts. The
/// account of a certified rendering without delay therefore never limits a force.
class EnergyAccount {
  public:
    EnergyAccount() = default;
    explicit EnergyAccount(const AccountSettings& settings) noexcept
        : settings_{settings},
          stored_{settings.stored},
          damping_{settings.device_damping / settings.period_s},
          free_force_{settings.device_friction - 0.5 * settings.force_step},
          left_{settings.stored.within} {}

    /// Updates the bound of the stored energy with the positions of handle and virtual object. The first positions can
    /// set E0.
    void visit(double handle, double object) noexcept {
        stored_.visit(handle, object);
        if (!std::exchange(is_placed_, true) && settings_.includes_start_outside) {
            left_ = stored_.most();
        }
    }

    /// Adds the energy of the last period, in which the reading changed by `moved` [m or rad] and at whose end the motor
    /// made the force `applied` [N or N*m]. `moved` is NaN for the first reading after readings were missing. While
    /// `applied` is not finite, only forces that take no energy are sent.
    void book(double applied, double moved) noexcept {
        if (!std::isfinite(applied * moved)) {
            interrupt();
        }
        if (!std::isfinite(applied) || is_unlimited()) {
            return;
        }
        const double step = settings_.encoder_step;
        if (!is_read_) {
            left_ -= 0.5 * settings_.device_friction * step;
        } else {
            const double tau = settings_.delay_fraction;
            const double mean = tau * applied_ + (1.0 - tau) * applied;
            const double read = std::max(0.0, std::abs(moved) - step);
            const double slack = std::clamp(slack_ - moved, -0.5 * step, 0.5 * step);
            const double changed = std::abs(applied - applied_);
            left_ += mean * moved + damping_ * read * read +
                     settings_.device_friction * std::abs(slack - slack_ + moved) -
                     0.5 * step * std::abs(mean - mean_) -
                     (tau > 0.0 ? tau * (1.0 - tau) * taken(changed, 2.0 * settings_.longest_step) : 0.0);
            slack_ = slack;
            mean_ = mean;
        }
        applied_ = applied;
        is_read_ = true;
        left_ = std::max(left_, pending() - 0.5 * step * std::abs(mean_) - step * settings_.device_friction);
        left_ = std::min(left_, stored_.within() + stored_.most());
    }

    /// States that the last period has no valid reading: its energy does not count.
    void interrupt() noexcept {
        if (std::exchange(is_read_, false)) {
            left_ -= 0.5 * settings_.encoder_step * std::abs(mean_);
            slack_ = mean_ = 0.0;
        }
    }

    /// Limits a force to the largest one whose energy fits in the account; returns `EnergyLimited` if it was changed.
    [[nodiscard]] Status apply(double& force) const noexcept {
        const double largest = largest_force();
        if (std::abs(force) <= largest) {
            return Status::Ok;
        }
        force = std::copysign(largest, force);
        return Status::EnergyLimited;
    }

    /// Stores the force that was sent to the device, once in each tick.
    void sent(double force) noexcept { sent_[commands_++ % sent_.size()] = force; }

    /// Returns r(F), the largest energy that a command takes in one period [J].
    [[nodiscard]] double most_taken(double force) const noexcept {
        return force == 0.0 ? 0.0 : taken(std::abs(force) - free_force_, settings_.longest_step);
    }

    /// Returns the energy that the hand can certainly still take out before it has taken E0, less the energy that
    /// commands can take which still act [J].
    [[nodiscard]] double left() const noexcept {
        return left_ - 0.5 * settings_.encoder_step * std::abs(mean_) - pending();
    }
    [[nodiscard]] const StoredEnergy& stored() const noexcept { return stored_; }

  private:
    [[nodiscard]] bool is_unlimited() const noexcept { return std::isinf(stored_.within()); }

    /// Returns the largest force whose r fits in the account [N or N*m]; infinite without a bound of the stored energy.
    [[nodiscard]] double largest_force() const noexcept {
        if (is_unlimited()) {
            return std::numeric_limits<double>::infinity();
        }
        const double energy = is_read_ ? std::max(0.0, left()) : 0.0;
        const double longest = settings_.longest_step;
        // The first case also holds for an infinite motion without damping, whose product is not a number
        const double above = !(energy > damping_ * longest * longest) ? 2.0 * std::sqrt(damping_ * energy)
                                                                      : energy / longest + damping_ * longest;
        return std::max(0.0, free_force_ + above);
    }

    /// Returns the largest energy that a force `above` the friction takes in one period, in which the handle moves by at
    /// most `longest` [J].
    [[nodiscard]] double taken(double above, double longest) const noexcept {
        if (!(above > 0.0)) {
            return 0.0;
        }
        return !(above > 2.0 * damping_ * longest) ? above * above / (4.0 * damping_)
                                                   : (above - damping_ * longest) * longest;
    }
    [[nodiscard]] double command(std::uint64_t number) const noexcept { return sent_[number % sent_.size()]; }

    /// Returns the largest energy that the commands sent so far still take after this reading [J].
    [[nodiscard]] double pending() const noexcept {
        const auto whole = static_cast<std::uint64_t>(settings_.whole_delay);
        const double tau = settings_.delay_fraction;
        double energy = tau > 0.0 ? tau * most_taken(command(commands_ - whole - 1)) : 0.0;
        for (std::uint64_t k = 1; k <= whole; ++k) {
            energy += most_taken(command(commands_ - k));
        }
        return energy;
    }

    AccountSettings settings_;
    StoredEnergy stored_;
    double damping_ = 0.0;     ///< B, damping divided by the period [N/m]
    double free_force_ = 0.0;  ///< largest commanded force that takes no energy [N or N*m]
    /// At most e + E0 + mean_ eps - f_c |pi - x|, with the error eps of the reading and the play operator pi [J]
    double left_ = std::numeric_limits<double>::infinity();
    bool is_placed_ = false;
    bool is_read_ = false;
    double slack_ = 0.0;    ///< position of the play operator minus the reading [m or rad]
    double applied_ = 0.0;  ///< force at the end of the last period [N or N*m]
    double mean_ = 0.0;     ///< mean force of the last period [N or N*m]
    std::uint64_t commands_ = 0;
    /// Last commands; the size is a power of two, so that numbers wrap around [N or N*m]
    std::array<double, std::bit_ceil(std::size_t{longest_delay_samples} + 2)> sent_{};
};

}  // namespace palpate
