// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "palpate/stability/held_force.hpp"
#include "palpate/stability/proved_maximum.hpp"

namespace palpate {

namespace detail {

/// Cubic bounds of the energy between a force and a raised line through its value at 0, in units of C w^3. C is the
/// curvature, w the largest motion; positions are divided by w. |f - f(0) - f'(0) y| <= y^2 / 2. So the force is above
/// the line of slope f'(0) + lift by at most E(y), with lift in units of C w:
///
///     E(y) = max(0, y^2 / 2 - lift y) for y > 0,   E(y) = y^2 / 2 + lift |y| for y < 0.
///
/// E >= 0 also bounds the difference after both have been limited to the same range, because a limit does not increase a
/// difference and does not change its sign. Without the maximum with 0 this would be false.
class RaisedEnergy {
  public:
    explicit RaisedEnergy(double lift) noexcept : lift_{lift} {}

    /// Returns the integral of E from 0 to y, which never falls.
    [[nodiscard]] double up_to(double y) const noexcept {
        if (y > 2.0 * lift_) {
            return (y / 6.0 - 0.5 * lift_) * y * y + 2.0 / 3.0 * lift_ * lift_ * lift_;
        }
        return y > 0.0 ? 0.0 : (y / 6.0 - 0.5 * lift_) * y * y;
    }

    /// Returns an upper bound of a = max of (integral of E from U to U + u, minus gamma U^2) / u^2 over |U| <= t, 0 < u
    /// <= 1. `gamma` must be > 0 if t > 0.
    [[nodiscard]] double most(double t, double gamma, double slack) const {
        // For a given ratio U / u the value rises with u, so the maximum has u = 1 or |U| = t
        double largest = proved_maximum(-t, t, slack, [&](double low, double high) {
            const double nearest = std::clamp(0.0, low, high);
            return up_to(high + 1.0) - up_to(low) - gamma * nearest * nearest;
        });
        for (const double U : {-t, t}) {
            if (t > 0.0) {
                largest = std::max(largest, proved_maximum(0.0, 1.0, slack, [&](double low, double high) {
                                       const double energy = up_to(U + high) - up_to(U) - gamma * t * t;
                                       return energy > 0.0 ? energy / (low * low) : energy / (high * high);
                                   }));
            }
        }
        return largest;
    }

  private:
    double lift_;
};

}  // namespace detail

/// Returns c, the device damping divided by the period, b / T, that a line of slope max(f', 0) + lift needs, in units of
/// C w: curvature C = max|f''|, largest motion w in a period. The line acts `late` periods after its sample;
/// `lag_squared` is Lambda^2 of `lag_squared_of`. For any gamma
///
///     c = a + gamma Lambda^2,
///
/// with a of `RaisedEnergy::most`. The maxima are proved by intervals; every gamma gives a proof. docs/certificate.md has
/// the proof. `lift` is in units of C w.
[[nodiscard]] inline double raised_need(double late, double lag_squared, double lift) {
    constexpr double rough = 1e-3;
    constexpr double fine = 1e-6;
    const detail::RaisedEnergy energy{lift};
    if (!(late > 0.0)) {
        return energy.most(0.0, 0.0, fine);
    }
    const double highest = (1.0 + late) * (0.5 * (1.0 + late) + lift) / lag_squared;
    const double gamma = detail::minimum_between(0.0, highest, [&](double at) {
                             return energy.most(late, at, rough) + at * lag_squared;
                         }).at;
    return (energy.most(late, gamma, fine) + gamma * lag_squared) * (1.0 + 1e-12);
}

}  // namespace palpate
