// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "palpate/guard/stored_energy.hpp"
#include "palpate/status.hpp"

namespace palpate {

/// What an energy tank may count on.
struct TankSettings {
    StoredEnergySettings stored;  ///< the most the object can give
    double damping = 0.0;         ///< credited, of the device's b [N*s/m or N*m*s/rad]
    double friction = 0.0;        ///< credited, of the device's f_c [N or N*m]
    double period_s = 1e-3;
};

/// Store that every joule a rendering gives is paid from. What it has given since it was last full is
///
///     G_k = max(0, G_{k-1} - F u - b u^2 / T - f_c |u|),
///
/// F the force that acted, u the motion that the readings prove (`ReadMotion`), b and f_c what is credited of the
/// device's damping and friction. u is the motion of a handle that the encoder can have read like this. A certificate
/// holds for every motion, so for this one: without delay no stretch of it gives more than the object held at its start,
/// and G stays below the bound W of `StoredEnergy`. With full credit a certified rendering never drains the tank. With
/// delay this holds if the forces on their way at the start of the stretch add less than W leaves.
///
/// Where nothing is certified nine tenths are credited, because a steady limit cycle gives exactly what the device takes,
/// and W is that of the domain. Above W all forces fade, over a reserve of W / 4, those against the handle too: one that is held too long turns it round and
/// gives after all. What is given beyond the credited losses therefore ends with W and the reserve.
class EnergyTank {
  public:
    EnergyTank() = default;
    explicit EnergyTank(const TankSettings& settings) noexcept
        : settings_{settings}, stored_{settings.stored}, reserve_{0.25 * settings.stored.within} {}

    /// Where handle and object are now, and how far the handle moved while `applied` acted.
    void book(double applied, double moved) noexcept {
        const double lost =
            (settings_.damping * std::abs(moved) / settings_.period_s + settings_.friction) * std::abs(moved);
        given_ = std::max(0.0, given_ - applied * moved - lost);
        most_given_ = std::max(most_given_, given_);
    }
    void visit(double handle, double object) noexcept { stored_.visit(handle, object); }

    [[nodiscard]] Status apply(double& force) const noexcept {
        const double beyond = given_ - stored_.most();
        if (!(beyond > 0.0) || force == 0.0) {
            return Status::Ok;
        }
        force *= std::max(0.0, 1.0 - beyond / reserve_);
        return Status::Drained;
    }

    /// G now, and its largest [J]
    [[nodiscard]] double given() const noexcept { return given_; }
    [[nodiscard]] double most_given() const noexcept { return most_given_; }
    [[nodiscard]] const StoredEnergy& stored() const noexcept { return stored_; }

  private:
    TankSettings settings_;
    StoredEnergy stored_;
    double reserve_ = std::numeric_limits<double>::infinity();
    double given_ = 0.0;
    double most_given_ = 0.0;
};

}  // namespace palpate
