// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate {

/// Numbers that bound the energy that a rendering stores.
struct StoredEnergySettings {
    /// Largest energy of the object within its domain, and of its coupling at the force limit [J]
    double within = std::numeric_limits<double>::infinity();
    double lower = -std::numeric_limits<double>::infinity();  ///< lower end of the domain [m or rad]
    double upper = std::numeric_limits<double>::infinity();   ///< upper end of the domain [m or rad]
    double force_limit = 0.0;                                 ///< F_max [N or N*m]
    double stiffness = 0.0;                                   ///< K_c; 0: no coupling [N/m or N*m/rad]
    double mass = 0.0;                                        ///< m of the object [kg or kg*m^2]
    double period_s = 1e-3;                                   ///< period T [s]
};

/// Upper bound of the energy that a rendering has stored so far above its least,
///
///     W <= W_domain + F_max (l_below + l_above + l_stretch) + m v^2 / 2,
///
/// with the largest distances of the handle or the object beyond either end of the domain, the largest stretch of the
/// coupling beyond F_max / K_c, and the object's largest speed. Outside the domain the limited force stores at most
/// F_max per length; so does the coupling, whose limited force is F_max there.
class StoredEnergy {
  public:
    StoredEnergy() = default;
    explicit StoredEnergy(const StoredEnergySettings& settings) noexcept
        : settings_{settings},
          stretch_{settings.stiffness > 0.0 ? settings.force_limit / settings.stiffness
                                            : std::numeric_limits<double>::infinity()} {}

    /// Updates the bound with the read position of the handle and the position of the object, once a tick.
    void visit(double handle, double object) noexcept {
        if (!std::isfinite(handle) || !std::isfinite(object)) {
            return;
        }
        below_ = std::max(below_, settings_.lower - std::min(handle, object));
        above_ = std::max(above_, std::max(handle, object) - settings_.upper);
        stretched_ = std::max(stretched_, std::abs(handle - object) - stretch_);
        const double moved = std::isnan(last_) ? 0.0 : object - last_;
        fastest_ = std::max(fastest_, std::abs(moved) / settings_.period_s);
        last_ = object;
    }

    /// Returns W [J].
    [[nodiscard]] double most() const noexcept {
        return settings_.within + settings_.force_limit * (below_ + above_ + stretched_) +
               0.5 * settings_.mass * fastest_ * fastest_;
    }
    /// Returns the part within the domain, at rest [J].
    [[nodiscard]] double within() const noexcept { return settings_.within; }

  private:
    StoredEnergySettings settings_;
    double stretch_ = std::numeric_limits<double>::infinity();  ///< stretch at the force limit [m or rad]
    double below_ = 0.0;
    double above_ = 0.0;
    double stretched_ = 0.0;
    double fastest_ = 0.0;
    double last_ = std::numeric_limits<double>::quiet_NaN();
};

}  // namespace palpate
