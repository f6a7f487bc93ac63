// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate {

/// Numbers from which the upper bound of the energy that a rendering stores is computed.
struct StoredEnergySettings {
    /// Bound of the energy stored at rest inside the domain (`largest_stored_energy`) [J]
    double within = std::numeric_limits<double>::infinity();
    double lower = -std::numeric_limits<double>::infinity();  ///< lower end of the domain [m or rad]
    double upper = std::numeric_limits<double>::infinity();   ///< upper end of the domain [m or rad]
    double force_limit = 0.0;                                 ///< force limit F_max [N or N*m]
    double stiffness = 0.0;  ///< coupling stiffness K_c; 0: no coupling [N/m or N*m/rad]
    /// Stretch of the coupling up to which `within` includes its energy; at most F_max / K_c counts [m or rad]
    double included_stretch = std::numeric_limits<double>::infinity();
    double mass = 0.0;       ///< mass m of the virtual object [kg or kg*m^2]
    double period_s = 1e-3;  ///< period T [s]
};

/// Upper bound W of the stored energy of a rendering minus its smallest stored energy, for all positions since the
/// start,
///
///     W = W_domain + F_max (l_below + l_above) + P(e) - P(e_0) + m v^2 / 2,
///
/// where W_domain is the largest energy inside the domain, F_max the force limit, and v the largest speed of the
/// virtual object. The lengths l_below and l_above are the largest distances of handle or virtual object from the
/// domain, below and above it. Outside the domain the limited force stores at most the energy F_max for each unit of
/// length. P is the energy of the coupling at its largest stretch e: K_c e^2 / 2, and above F_max / K_c the energy F_max
/// for each unit of length, because its limited force is F_max. W_domain includes the energy up to the stretch e_0. An
/// object with mass follows the handle late, which can stretch its coupling more.
class StoredEnergy {
  public:
    StoredEnergy() = default;
    explicit StoredEnergy(const StoredEnergySettings& settings) noexcept
        : settings_{settings}, included_{coupling_energy(settings.included_stretch)} {}

    /// Updates the bound of the stored energy with the measured position of the handle and the position of the virtual
    /// object, once in each tick.
    void visit(double handle, double object) noexcept {
        if (!std::isfinite(handle) || !std::isfinite(object)) {
            return;
        }
        below_ = std::max(below_, settings_.lower - std::min(handle, object));
        above_ = std::max(above_, std::max(handle, object) - settings_.upper);
        stretched_ = std::max(stretched_, std::abs(handle - object));
        const double moved = std::isnan(last_) ? 0.0 : object - last_;
        fastest_ = std::max(fastest_, std::abs(moved) / settings_.period_s);
        last_ = object;
    }

    /// Returns W, the upper bound of the stored energy [J].
    [[nodiscard]] double most() const noexcept {
        return settings_.within + settings_.force_limit * (below_ + above_) +
               std::max(0.0, coupling_energy(stretched_) - included_) +
               0.5 * settings_.mass * fastest_ * fastest_;
    }
    /// Returns W_domain, the upper bound of the stored energy for positions inside the domain and speed zero [J].
    [[nodiscard]] double within() const noexcept { return settings_.within; }

  private:
    /// Returns the energy of the coupling at a stretch, which its limited force can give [J].
    [[nodiscard]] double coupling_energy(double stretch) const noexcept {
        if (settings_.stiffness <= 0.0) {
            return 0.0;
        }
        const double limited = settings_.force_limit / settings_.stiffness;
        const double rising = std::min(stretch, limited);
        const double beyond = std::isinf(stretch) ? 0.0 : stretch - rising;
        return 0.5 * settings_.stiffness * rising * rising + settings_.force_limit * beyond;
    }

    StoredEnergySettings settings_;
    double included_ = 0.0;  ///< energy of the coupling that `within` includes [J]
    double below_ = 0.0;
    double above_ = 0.0;
    double stretched_ = 0.0;  ///< largest stretch of the coupling [m or rad]
    double fastest_ = 0.0;
    double last_ = std::numeric_limits<double>::quiet_NaN();
};

}  // namespace palpate
