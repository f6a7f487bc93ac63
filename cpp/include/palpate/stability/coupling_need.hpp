// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "palpate/dynamics/coupling.hpp"

namespace palpate {

namespace detail {

/// Largest value over theta = 2 phi of a trigonometric polynomial of a degree N that is never negative, from the
/// values at points h apart: at most 1 / (1 - (N h)^2 / 8) of the largest of them (Bernstein's inequality). The
/// result is never below the true maximum, and at most 2e-6 of it above.
template <class Polynomial>
[[nodiscard]] double most_over_frequencies(int degree, Polynomial polynomial) noexcept {
    const int points = 1024 * degree;
    double largest = 0.0;
    for (int k = 0; k <= points; ++k) {
        largest = std::max(largest, polynomial(0.5 * std::numbers::pi * k / points));
    }
    const double spacing = std::numbers::pi / points * degree;
    return largest / (1.0 - spacing * spacing / 8.0);
}

/// sin((n + 1) phi) / sin(phi), the size of 1 + z^-1 + ... + z^-n.
[[nodiscard]] inline double sum_of_delays(int whole, double phi) noexcept {
    return phi > 0.0 ? std::sin((whole + 1) * phi) / std::sin(phi) : whole + 1.0;
}

/// The largest need of every delay up to n + tau samples, where need(n, phi) is that of n whole samples at one
/// frequency. In the first part of a sample, tau of it, the force is that of n + 1 samples of delay: at each frequency
/// its need is (1 - tau) need(n) + tau need(n + 1).
template <class Need>
[[nodiscard]] double need_up_to(int whole, double fraction, Need need) noexcept {
    double largest = 0.0;
    for (int n = 1; n <= whole; ++n) {
        largest = std::max(largest, most_over_frequencies(n + 1, [&](double phi) { return need(n, phi); }));
    }
    if (fraction > 0.0) {
        largest = std::max(largest, most_over_frequencies(whole + 2, [&](double phi) {
                               return (1.0 - fraction) * need(whole, phi) + fraction * need(whole + 1, phi);
                           }));
    }
    return largest;
}

}  // namespace detail

/// The device damping, over the longest period, that a coupling needs if it is held for a sample and n + tau samples
/// late, whatever object stands behind it whose force falls with a slope of at most s. With beta = B_c / T,
/// H_n = K_c (1 + z^-1 + ... + z^-n) + beta (1 - z^-(n+1)),
///
///     s / 2 + max over theta of |H_n - s|^2 / (2 (K_c + 2 beta - s)),   s <= K_c + beta.
///
/// Without delay that is K_c / 2 + beta for each s. A force limit on the coupling itself leaves it as it is if s = 0.
/// Infinite where nothing is proved.
[[nodiscard]] inline double coupling_need(VirtualCoupling coupling, double period_s, int whole,
                                          double fraction = 0.0, double falling = 0.0) noexcept {
    const double stiffness = coupling.stiffness;
    const double damping = coupling.damping / period_s;
    const double held = 0.5 * stiffness + damping;
    if (!(held > 0.0)) {
        return 0.0;
    }
    if (!(falling <= stiffness + damping)) {
        return std::numeric_limits<double>::infinity();
    }
    return std::max(held, detail::need_up_to(whole, fraction, [&](int n, double phi) {
                        const double sine = std::sin(phi);
                        const double real = stiffness + 2.0 * damping * sine * sine;
                        const double imaginary = damping * std::sin(2.0 * phi);
                        const double sum = detail::sum_of_delays(n, phi);
                        const double square =
                            sum * sum * (real * real + imaginary * imaginary) -
                            2.0 * falling * sum * (real * std::cos(n * phi) + imaginary * std::sin(n * phi)) +
                            falling * falling;
                        return 0.5 * falling + 0.5 * square / (2.0 * held - falling);
                    }));
}

}  // namespace palpate
