// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

#include "palpate/dynamics/coupling.hpp"
#include "palpate/model/bounds.hpp"
#include "palpate/rendering/inertia.hpp"

namespace palpate {

/// The device damping that the explicit structure needs for a passive port, linearised where the slope is K:
///
///     T / (2 (1 - cos theta)) Re{(1 - e^{-j theta}) z^{-n_d} H},   z = e^{j theta},   H = C E / (C + E),
///     E = (m/T^2) (z^2 - (2 - T B_o/m) z + 1 - T B_o/m) / z + K,   C = K_c + B_c (1 - z^{-1}) / T.
[[nodiscard]] inline double explicit_need_at(double theta, double slope, Inertia inertia,
                                             VirtualCoupling coupling, double period_s,
                                             int delay_samples) noexcept {
    const std::complex<double> z = std::polar(1.0, theta);
    const std::complex<double> back = std::conj(z);
    const double drag = period_s * inertia.damping / inertia.mass;
    const std::complex<double> environment =
        inertia.mass / (period_s * period_s) * (z - (2.0 - drag) + (1.0 - drag) * back) + slope;
    const std::complex<double> spring = coupling.stiffness + coupling.damping / period_s * (1.0 - back);
    const std::complex<double> felt = spring * environment / (spring + environment);
    const double sine = std::sin(0.5 * theta);
    return period_s / (4.0 * sine * sine) *
           ((1.0 - back) * std::polar(1.0, -delay_samples * theta) * felt).real();
}

/// The largest need over all frequencies and all slopes of an interval, by sampling and refinement of the best
/// sample: a number of the linearised system, without a bound of its own error.
[[nodiscard]] inline double explicit_need(Interval slopes, Inertia inertia, VirtualCoupling coupling,
                                          double period_s, int delay_samples) noexcept {
    constexpr int frequencies = 512;
    constexpr int slope_steps = 32;
    constexpr int halvings = 20;     // of the grid's step, in the end
    constexpr double lowest = 1e-4;  // [rad a sample]
    const double octaves = std::log(std::numbers::pi / lowest);
    const auto need = [&](double along, double slope) noexcept {
        return explicit_need_at(lowest * std::exp(octaves * along), slope, inertia, coupling, period_s,
                                delay_samples);
    };
    double best = -std::numeric_limits<double>::infinity();
    double best_along = 0.0;
    double best_slope = slopes.lower;
    const auto look = [&](double along, double slope) noexcept {
        along = std::clamp(along, 0.0, 1.0);
        slope = std::clamp(slope, slopes.lower, slopes.upper);
        if (const double here = need(along, slope); here > best) {
            best = here;
            best_along = along;
            best_slope = slope;
        }
    };
    const double across = slopes.upper - slopes.lower;
    for (int i = 0; i <= slope_steps; ++i) {
        for (int k = 0; k <= frequencies; ++k) {
            look(static_cast<double>(k) / frequencies, slopes.lower + across * i / slope_steps);
        }
    }
    for (int halving = 0; halving < halvings; ++halving) {
        const double share = std::ldexp(1.0, -halving);
        const double along = best_along;
        const double slope = best_slope;
        for (const double i : {-1.0, 0.0, 1.0}) {
            for (const double k : {-1.0, 0.0, 1.0}) {
                look(along + k * share / frequencies, slope + i * share * across / slope_steps);
            }
        }
    }
    return best;
}

}  // namespace palpate
