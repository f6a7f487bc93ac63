// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "palpate/dynamics/coupling.hpp"

namespace palpate {

/// The device damping, over the longest period, that every passive object behind a coupling needs, held for a
/// sample and n_d samples late: with beta = B_c / T, A = K_c / 2 + beta,
///
///     max over theta of sin^2((n_d + 1) theta / 2) (A^2 + K_c^2 / 4 cot^2(theta / 2)) / A.
///
/// Without delay that is A. Otherwise the expression is a trigonometric polynomial of degree N = n_d + 1: with
/// points h apart its maximum is at most 1 / (1 - (N h)^2 / 8) of the largest seen (Bernstein's inequality), so
/// that what is returned is never below the true maximum, and at most 2e-6 of it above.
[[nodiscard]] inline double coupling_need(VirtualCoupling coupling, double period_s,
                                          int delay_samples) noexcept {
    const double half = 0.5 * coupling.stiffness;
    const double corner = half + coupling.damping / period_s;
    if (delay_samples == 0 || !(corner > 0.0)) {
        return corner;
    }
    const int degree = delay_samples + 1;
    const int points = 1024 * degree;
    double largest = half * half * degree * degree;  // theta = 0
    for (int k = 1; k <= points; ++k) {
        const double half_angle = 0.5 * std::numbers::pi * k / points;
        const double sine = std::sin(degree * half_angle);
        const double cotangent = std::cos(half_angle) / std::sin(half_angle);
        largest = std::max(largest, sine * sine * (corner * corner + half * half * cotangent * cotangent));
    }
    const double spacing = std::numbers::pi / points * degree;
    return largest / corner / (1.0 - spacing * spacing / 8.0);
}

}  // namespace palpate
