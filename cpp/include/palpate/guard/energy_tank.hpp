// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "palpate/guard/stored_energy.hpp"
#include "palpate/status.hpp"

namespace palpate {

/// Settings of an energy tank: bounds of the stored energy, and losses of the device that the tank counts.
struct TankSettings {
    StoredEnergySettings stored;   ///< numbers from which the upper bound of the stored energy is computed
    double device_damping = 0.0;   ///< device damping b whose losses the tank counts [N*s/m or N*m*s/rad]
    double device_friction = 0.0;  ///< Coulomb friction f_c that the tank counts [N or N*m]
    /// Length by which each motion is shortened before friction losses are counted [m or rad]
    double uncredited_motion = 0.0;
    double period_s = 1e-3;  ///< period T of the control loop [s]
};

/// Limits the energy that a rendering gives to the handle. The energy given since the last tick with G = 0, less the
/// losses in the device, is
///
///     G_k = max(0, G_{k-1} - F u - b d^2 / T - f_c d),   d = max(0, |u| - unsure),
///
/// where F is the force that acted, u the measured motion of the handle, `unsure` the part of u without counted losses,
/// b the counted device damping and f_c the counted friction. W is the bound of the stored energy (`StoredEnergy`). If
/// G exceeds W, the tank reduces all forces, to zero at G = W + W / 4 (W of the domain). This includes forces against
/// the motion of the handle, because a force that is held too long reverses the handle and then gives energy. Except
/// for the work of forces that were already sent, the given energy minus the counted losses is at most W plus this
/// reserve of W / 4.
///
/// In a run with a certificate, u is the motion that the encoder readings prove (`ReadMotion`), and the tank counts all
/// damping and friction of the device. A handle with the motion u can have caused the same readings. The certificate
/// holds for every motion, so also for u: without delay the rendering gives in no time interval more energy than it
/// stored at the start of the interval, which is at most W. The tank then never reduces a force. With delay this is
/// also true, if the forces computed before the interval but applied within it give less energy than W minus the energy
/// stored at the start.
///
/// In a run without a certificate, u is the change of the measured position, and the tank counts nine tenths of the
/// energy that the device certainly dissipated. With all of it the tank would not stop a steady limit cycle, which
/// gives exactly the energy that the device dissipates. A slow motion has no counted losses while the position changes
/// by single encoder steps. Force errors from encoder steps are not treated as passive, even if they are smaller than
/// the friction of the device.
class EnergyTank {
  public:
    EnergyTank() = default;
    explicit EnergyTank(const TankSettings& settings) noexcept
        : settings_{settings}, stored_{settings.stored}, reserve_{0.25 * settings.stored.within} {}

    /// Adds the energy that the force `applied` gave during the motion `moved` of the handle, and subtracts the counted
    /// losses.
    void book(double applied, double moved) noexcept {
        const double credited = std::max(0.0, std::abs(moved) - settings_.uncredited_motion);
        const double dissipated =
            credited * (settings_.device_damping * credited / settings_.period_s + settings_.device_friction);
        given_ = std::max(0.0, given_ - applied * moved - dissipated);
        most_given_ = std::max(most_given_, given_);
    }
    /// Updates the bound of the stored energy with the positions of handle and virtual object.
    void visit(double handle, double object) noexcept { stored_.visit(handle, object); }

    /// Reduces the force if the rendering has given more energy than the upper bound of the stored energy.
    [[nodiscard]] Status apply(double& force) const noexcept {
        const double excess = given_ - stored_.most();
        if (!(excess > 0.0) || force == 0.0) {
            return Status::Ok;
        }
        force *= std::max(0.0, 1.0 - excess / reserve_);
        return Status::EnergyLimited;
    }

    /// Return the energy G that the rendering had given at the last tick, and the largest G of the run [J].
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
