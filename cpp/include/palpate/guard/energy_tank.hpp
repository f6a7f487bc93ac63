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
    double unsure = 0.0;          ///< length of each motion for which nothing is credited [m or rad]
    double period_s = 1e-3;
};

/// Store that every joule a rendering gives is paid from. What it has given since it was last full is
///
///     G_k = max(0, G_{k-1} - F u - b d^2 / T - f_c d),   d = max(0, |u| - unsure),
///
/// F the force that acted, u the motion that was read, b and f_c what is credited of the device's damping and friction.
/// Above W, the bound of what is stored, all forces fade over a reserve of W / 4, those against the handle too: one that
/// is held too long turns it round and gives after all. What is given beyond the credited losses ends with W and the
/// reserve.
///
/// In a certified run u is the motion that the readings prove (`ReadMotion`), and everything is credited. u is the motion
/// of a handle that the encoder can have read like this. The certificate holds for every motion, so for this one: without
/// delay no stretch of it gives more than was stored at its start, which is at most W. The tank never acts. With delay
/// this holds if the forces on their way at the start of the stretch add less than W leaves.
///
/// Where nothing is certified u is the change of the reading, and nine tenths of what the device certainly took are
/// credited: a steady limit cycle gives exactly what the device takes. A slow motion then earns nothing for its single
/// counts, and a force that falls short of its friction for the encoder's errors is not mistaken for a passive one.
class EnergyTank {
  public:
    EnergyTank() = default;
    explicit EnergyTank(const TankSettings& settings) noexcept
        : settings_{settings}, stored_{settings.stored}, reserve_{0.25 * settings.stored.within} {}

    /// Where handle and object are now, and how far the handle moved while `applied` acted.
    void book(double applied, double moved) noexcept {
        const double surely = std::max(0.0, std::abs(moved) - settings_.unsure);
        const double lost = surely * (settings_.damping * surely / settings_.period_s + settings_.friction);
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
