// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <limits>
#include <numbers>
#include <vector>

#include "palpate/device/device_profile.hpp"
#include "palpate/dynamics/coupling.hpp"
#include "palpate/model/bounds.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/stability/force_bounds.hpp"
#include "palpate/stability/inequality.hpp"

namespace palpate {

namespace detail {

/// The explicit structure at one frequency theta, without the slope of the model's force.
class ExplicitResponse {
  public:
    ExplicitResponse(double theta, Inertia inertia, VirtualCoupling coupling, double period_s,
                     int delay_samples) noexcept {
        const std::complex<double> z = std::polar(1.0, theta);
        const std::complex<double> back = std::conj(z);
        const double drag = period_s * inertia.damping / inertia.mass;
        free_ = inertia.mass / (period_s * period_s) * (z - (2.0 - drag) + (1.0 - drag) * back);
        spring_ = coupling.stiffness + coupling.damping / period_s * (1.0 - back);
        const double sine = std::sin(0.5 * theta);
        scale_ = period_s / (4.0 * sine * sine);
        late_ = (1.0 - back) * std::polar(1.0, -delay_samples * theta);
    }

    /// Returns the device damping that is needed at a slope of the model's force [N*s/m].
    [[nodiscard]] double need(double slope) const noexcept {
        const std::complex<double> environment = free_ + slope;
        return scale_ * (late_ * (spring_ * environment / (spring_ + environment))).real();
    }

  private:
    std::complex<double> free_;    ///< E at slope 0
    std::complex<double> spring_;  ///< C
    std::complex<double> late_;    ///< (1 - e^{-j theta}) z^{-n_d}
    double scale_ = 0.0;           ///< T / (2 (1 - cos theta))
};

}  // namespace detail

/// Returns the device damping that the explicit structure needs to be passive at the frequency theta [N*s/m],
/// linearised at the slope K of the model's force:
///
///     T / (2 (1 - cos theta)) Re{(1 - e^{-j theta}) z^{-n_d} H},   z = e^{j theta},   H = C E / (C + E).
///
/// n_d is the delay in samples. The virtual object is E = (m/T^2) (z^2 - (2 - T B_o/m) z + 1 - T B_o/m) / z + K, and
/// the virtual coupling is C = K_c + B_c (1 - z^{-1}) / T.
[[nodiscard]] inline double explicit_need_at(double theta, double slope, Inertia inertia,
                                             VirtualCoupling coupling, double period_s,
                                             int delay_samples) noexcept {
    return detail::ExplicitResponse{theta, inertia, coupling, period_s, delay_samples}.need(slope);
}

/// Returns the largest device damping that the linearised explicit structure needs over all frequencies and all slopes
/// in `slopes` [N*s/m]. It is the largest of many samples, refined by smaller steps around the largest sample of each
/// slope and around the largest of all, so the error of the result has no proved bound.
[[nodiscard]] inline double explicit_need(Interval slopes, Inertia inertia, VirtualCoupling coupling,
                                          double period_s, int delay_samples) {
    constexpr int frequencies = 512;
    constexpr int slope_steps = 32;
    // Number of refinements around the largest needed damping; each one halves the distance between the tried
    // frequencies, and between the tried slopes
    constexpr int halvings = 20;
    // Number of steps of each size, because the largest need can depend on frequency and slope together
    constexpr int repeats = 4;
    constexpr double lowest = 1e-4;  // lowest tried frequency, as angular frequency times the period T [rad]
    const double log_range = std::log(std::numbers::pi / lowest);
    const auto response = [&](double along) noexcept {
        return detail::ExplicitResponse{lowest * std::exp(log_range * along), inertia, coupling, period_s,
                                        delay_samples};
    };
    std::vector<detail::ExplicitResponse> responses;
    responses.reserve(frequencies + 1);
    for (int k = 0; k <= frequencies; ++k) {
        responses.push_back(response(static_cast<double>(k) / frequencies));
    }
    double best = -std::numeric_limits<double>::infinity();
    double best_along = 0.0;
    double best_slope = slopes.lower;
    const auto try_response = [&](double along, double slope,
                                  const detail::ExplicitResponse& at_frequency) noexcept {
        const double value = at_frequency.need(slope);
        if (value > best) {
            best = value;
            best_along = along;
            best_slope = slope;
        }
        return value;
    };
    const auto try_sample = [&](double along, double slope) noexcept {
        along = std::clamp(along, 0.0, 1.0);
        return try_response(along, std::clamp(slope, slopes.lower, slopes.upper), response(along));
    };
    const double across = slopes.upper - slopes.lower;
    for (int i = 0; i <= slope_steps; ++i) {
        // The largest need at this slope is refined first, because a narrow maximum between two frequencies can be the
        // largest of all
        const double slope = std::min(slopes.lower + across * i / slope_steps, slopes.upper);
        double largest = -std::numeric_limits<double>::infinity();
        double at = 0.0;
        const auto keep = [&](double along, double value) noexcept {
            if (value > largest) {
                largest = value;
                at = along;
            }
        };
        for (std::size_t k = 0; k < responses.size(); ++k) {
            const double along = static_cast<double>(k) / frequencies;
            keep(along, try_response(along, slope, responses[k]));
        }
        for (int halving = 0; halving < halvings; ++halving) {
            const double step = std::ldexp(1.0, -1 - halving) / frequencies;
            const double middle = at;
            keep(middle - step, try_sample(middle - step, slope));
            keep(middle + step, try_sample(middle + step, slope));
        }
    }
    for (int step = 0; step < repeats * halvings; ++step) {
        const double share = std::ldexp(1.0, -1 - step / repeats);
        const double along = best_along;
        const double slope = best_slope;
        for (const double i : {-1.0, 0.0, 1.0}) {
            for (const double k : {-1.0, 0.0, 1.0}) {
                try_sample(along + k * share / frequencies, slope + i * share * across / slope_steps);
            }
        }
    }
    return best;
}

/// Returns the inequalities of the explicit structure: a virtual object with mass behind a virtual coupling, moved by
/// forces that are one sample old (paper figure 14). They prove nothing about the nonlinear system. They state the
/// slopes for which the linearised object is stable while the device does not move, and the device damping for which
/// the linearised rendering is passive.
[[nodiscard]] inline std::vector<Inequality> inequalities(ExplicitStructure, const ForceBounds& bounds,
                                                          const Scheme& scheme, const DeviceProfile& device) {
    const Inertia inertia = scheme.inertia;
    const VirtualCoupling coupling = scheme.coupling;
    const double T = device.period_s;
    const double damping = inertia.damping + coupling.damping;
    const char* const poles = "poles of the linearised step; docs/certificate.md";
    const Interval slopes{bounds.slope.lower, bounds.slope.upper};
    return {
        {"explicit-slope", "slope small enough for the explicit integration",
         "(4 m - 2 (B_o + B_c) T) / T^2 > K + K_c", explicit_slope_limit(inertia, {0.0, coupling.damping}, T),
         slopes.upper + coupling.stiffness, Basis::Linear, poles, true},
        {"explicit-damping", "damping small enough for the explicit integration", "2 m > (B_o + B_c) T",
         2.0 * inertia.mass, damping * T, Basis::Linear, poles, true},
        {"explicit-damping-positive", "positive damping of object and coupling", "B_o + B_c > 0", damping,
         0.0, Basis::Linear, poles, true},
        {"explicit-falling-slope", "slope of a falling force behind the coupling", "K_c > s_",
         coupling.stiffness, bounds.falling(), Basis::Linear, poles, true},
        {"explicit-port-damping", "viscous damping for the linearised rendering",
         "b >= max T Re{(1 - 1/z) H} / (2 - 2 cos theta)", device.viscous_damping,
         device.longest_period_s() / T * explicit_need(slopes, inertia, coupling, T, device.late_samples()),
         Basis::Linear, "Colgate and Schenkel 1997, linearised; docs/certificate.md"}};
}

}  // namespace palpate
