// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "palpate/guard/stored_energy.hpp"
#include "palpate/status.hpp"

namespace palpate {

/// Energy and losses that an energy tank may use.
struct TankSettings {
    StoredEnergySettings stored;     ///< bounds of the object's energy
    double device_damping = 0.0;     ///< credited b of the device [N*s/m or N*m*s/rad]
    double device_friction = 0.0;    ///< credited f_c of the device [N or N*m]
    double uncredited_motion = 0.0;  ///< part of each motion without credit [m or rad]
    double period_s = 1e-3;          ///< sample time [s]
};

/// Limits the energy that a rendering may give. The energy that it has given since the tank was last full is
///
///     G_k = max(0, G_{k-1} - F u - b d^2 / T - f_c d),   d = max(0, |u| - unsure),
///
/// where F is the force that acted, u the motion that was read, and b and f_c the credited damping and friction of the
/// device. If G exceeds W, the bound of the stored energy, all forces decrease over a reserve of W / 4. This includes
/// forces against the handle, because a force that is held too long reverses the handle and then gives energy. The
/// energy given beyond the credited losses is at most W plus the reserve.
///
/// In a certified run u is the motion that the readings prove (`ReadMotion`), and everything is credited. u is the
/// motion of a handle that the encoder can have read in this way. The certificate holds for every motion, so also for
/// this one: without delay no interval of it gives more than was stored at its start, which is at most W. The tank then
/// never acts. With delay this holds if the forces that are pending at the start of the interval add less than W
/// leaves.
///
/// In an uncertified run u is the change of the reading, and nine tenths of the energy that the device certainly
/// dissipated are credited, because a steady limit cycle gives exactly the energy that the device dissipates. A slow
/// motion then gets no credit for its single counts. A force that is below its friction because of the encoder's errors
/// is not treated as passive.
class EnergyTank {
  public:
    EnergyTank() = default;
    explicit EnergyTank(const TankSettings& settings) noexcept
        : settings_{settings}, stored_{settings.stored}, reserve_{0.25 * settings.stored.within} {}

    /// Adds the work of `applied` over the motion `moved` of the handle.
    void book(double applied, double moved) noexcept {
        const double credited = std::max(0.0, std::abs(moved) - settings_.uncredited_motion);
        const double dissipated =
            credited * (settings_.device_damping * credited / settings_.period_s + settings_.device_friction);
        given_ = std::max(0.0, given_ - applied * moved - dissipated);
        most_given_ = std::max(most_given_, given_);
    }
    /// Updates the stored energy with the positions of handle and object.
    void visit(double handle, double object) noexcept { stored_.visit(handle, object); }

    /// Scales the force down if the energy is used up.
    [[nodiscard]] Status apply(double& force) const noexcept {
        const double excess = given_ - stored_.most();
        if (!(excess > 0.0) || force == 0.0) {
            return Status::Ok;
        }
        force *= std::max(0.0, 1.0 - excess / reserve_);
        return Status::EnergyLimited;
    }

    /// Return G now, and its largest value so far [J].
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
