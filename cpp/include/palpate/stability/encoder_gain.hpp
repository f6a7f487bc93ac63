// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <limits>

#include "palpate/dynamics/coupling.hpp"
#include "palpate/rendering/inertia.hpp"
#include "palpate/stability/force_bounds.hpp"

namespace palpate {

/// gamma: largest error of the force of a massless object behind a coupling, over the error of the reading that
/// causes it.
[[nodiscard]] inline double massless_gain(const ForceBounds& bounds, VirtualCoupling coupling,
                                          double period_s) noexcept {
    const double falling = bounds.falling();
    if (falling >= coupling.stiffness) {
        return std::numeric_limits<double>::infinity();
    }
    const double beta = coupling.damping / period_s;
    const double p = coupling.stiffness + beta;
    const double carried = std::max(1.0, falling / (coupling.stiffness - falling));
    double gain = 0.0;
    for (const double slope : {-falling, bounds.rising()}) {
        gain = std::max(gain, std::abs(slope) * (p + beta * carried) / (p + slope));
    }
    return gain;
}

/// The same of a spring of stiffness K with mass behind a coupling, backward Euler, no force limit: the sum of |g|, g
/// the impulse response of C A / (C + A),
///
///     C = K_c + beta (1 - z^-1),   A = (m/T^2) (1 - z^-1)^2 + (B_o/T) (1 - z^-1) + K.
///
/// With the poles r_1, r_2, |r_2| <= |r_1| = rho, and u = g_N - r_1 g_{N-1}, N >= 3, the terms after g_N add at most
/// (rho |g_N| + |u| |r_2| / (1 - |r_2|)) / (1 - rho), because g_{k+1} = r_1 g_k + r_2^{k+1-N} u. The sum ends when
/// that is 1 % of it, and contains it. Infinite if a pole does not lie inside the unit circle.
[[nodiscard]] inline double implicit_gain(double stiffness, Inertia inertia, VirtualCoupling coupling,
                                          double period_s) noexcept {
    constexpr double tail_share = 0.01;
    constexpr std::size_t most_terms = 10'000'000;
    const double mass = inertia.mass / (period_s * period_s);
    const double drag = inertia.damping / period_s;
    const double beta = coupling.damping / period_s;
    const std::array<double, 2> c{coupling.stiffness + beta, -beta};
    const std::array<double, 3> a{mass + drag + stiffness, -2.0 * mass - drag, mass};
    const std::array<double, 4> numerator{c[0] * a[0], c[0] * a[1] + c[1] * a[0], c[0] * a[2] + c[1] * a[1],
                                          c[1] * a[2]};
    const double leading = c[0] + a[0];
    const double first = (c[1] + a[1]) / leading;
    const double second = a[2] / leading;
    const std::complex<double> half_difference =
        std::sqrt(std::complex<double>{0.25 * first * first - second});
    std::complex<double> far =
        -0.5 * first - half_difference;  // first <= 0: no cancellation in the other one
    std::complex<double> near = -0.5 * first + half_difference;
    if (std::abs(near) > std::abs(far)) {
        std::swap(near, far);
    }
    const double rho = std::abs(far);
    if (!(leading > 0.0 && rho < 1.0)) {
        return std::numeric_limits<double>::infinity();
    }
    double sum = 0.0;
    double last = 0.0;
    double before = 0.0;
    for (std::size_t k = 0; k < most_terms; ++k) {
        const double now = (k < 4 ? numerator[k] / leading : 0.0) - first * last - second * before;
        sum += std::abs(now);
        if (k >= 3) {
            const double u = std::abs(now - far * last);
            const double tail =
                (rho * std::abs(now) + u * std::abs(near) / (1.0 - std::abs(near))) / (1.0 - rho);
            if (tail <= tail_share * sum) {
                return (sum + tail) * (1.0 + 1e-12);
            }
        }
        before = last;
        last = now;
    }
    return std::numeric_limits<double>::infinity();
}

}  // namespace palpate
