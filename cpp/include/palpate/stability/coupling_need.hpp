// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <limits>
#include <numbers>
#include <utility>

#include "palpate/dynamics/coupling.hpp"
#include "palpate/stability/force_bounds.hpp"

// Device damping and Coulomb friction that a virtual coupling needs, because its force is held for a sample, is
// delayed, and is computed from encoder steps.
namespace palpate {

namespace detail {

/// Returns the larger one of `least` and the maximum over all frequencies theta = 2 phi of a non-negative trigonometric
/// polynomial of degree N. By Bernstein's inequality the maximum is at most 1 / (1 - (N h)^2 / 8) times the largest of
/// the values at frequencies with the spacing h. The result is at least the true value, and exceeds it by at most a
/// share of 2e-6. A few frequencies show whether the maximum can exceed `least`.
template <class Polynomial>
[[nodiscard]] double largest_over_frequencies(int degree, double least, Polynomial polynomial) noexcept {
    const auto most = [&](int of_degree) {
        const int points = of_degree * degree;
        double largest = 0.0;
        for (int k = 0; k <= points; ++k) {
            largest = std::max(largest, polynomial(0.5 * std::numbers::pi * k / points));
        }
        const double spacing = std::numbers::pi / of_degree;
        return largest / (1.0 - spacing * spacing / 8.0);
    };
    return most(32) <= least ? least : std::max(least, most(1024));
}

/// Returns the larger one of `largest` and the damping needed by any delay up to n + tau samples (n = `whole`, tau =
/// `fraction`). need(n, phi) is the damping needed by n whole samples of delay at the frequency 2 phi. During the first
/// part tau of a sample, the applied force has a delay of n + 1 samples, afterwards of n samples. At each frequency the
/// needed damping is therefore (1 - tau) need(n) + tau need(n + 1).
template <class Need>
[[nodiscard]] double need_up_to(int whole, double fraction, double largest, Need need) noexcept {
    if (fraction > 0.0) {
        largest = largest_over_frequencies(whole + 2, largest, [&](double phi) {
            return (1.0 - fraction) * need(whole, phi) + fraction * need(whole + 1, phi);
        });
    }
    for (int n = whole; n > 0; --n) {
        largest = largest_over_frequencies(n + 1, largest, [&](double phi) { return need(n, phi); });
    }
    return largest;
}

}  // namespace detail

/// Returns the device damping divided by the longest period that a virtual coupling needs, if its force is held for a
/// sample and delayed by n + tau samples [N/m]. The result is proved for any virtual object whose force falls with a
/// slope of at most s. With beta = B_c / T and H_n = K_c (1 + z^-1 + ... + z^-n) + beta (1 - z^-(n+1)), the result is
///
///     s / 2 + max over theta of |H_n - s|^2 / (2 (K_c + 2 beta - s)),   s <= K_c + beta.
///
/// Without delay this is K_c / 2 + beta for each s. If s = 0, a limit of the coupling's force does not change the
/// result. Returns infinity if s > K_c + beta, because then there is no proof.
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
    return detail::need_up_to(whole, fraction, held, [&](int n, double phi) {
        // |1 + z^-1 + ... + z^-n| is sin((n + 1) phi) / sin(phi)
        const double sine = std::sin(phi);
        const double cosine = std::cos(phi);
        const double sine_n = std::sin(n * phi);
        const double cosine_n = std::cos(n * phi);
        const double sum = phi > 0.0 ? sine_n * cosine / sine + cosine_n : n + 1.0;
        const double real = stiffness + 2.0 * damping * sine * sine;
        const double imaginary = 2.0 * damping * sine * cosine;
        const double square = sum * sum * (real * real + imaginary * imaginary) -
                              2.0 * falling * sum * (real * cosine_n + imaginary * sine_n) +
                              falling * falling;
        return 0.5 * falling + 0.5 * square / (2.0 * held - falling);
    });
}

/// Returns gamma: the largest error of the rendered force divided by the position error of the encoder that causes it
/// [N/m], for a massless virtual object behind a virtual coupling. Returns infinity if the force falls at least as
/// steeply as K_c.
[[nodiscard]] inline double massless_gain(const ForceBounds& bounds, VirtualCoupling coupling,
                                          double period_s) noexcept {
    const double falling = bounds.falling();
    if (falling >= coupling.stiffness) {
        return std::numeric_limits<double>::infinity();
    }
    const double beta = coupling.damping / period_s;
    const double p = coupling.load_line_slope(period_s);
    const double amplification = std::max(1.0, falling / (coupling.stiffness - falling));
    double gain = 0.0;
    for (const double slope : {-falling, bounds.rising()}) {
        gain = std::max(gain, std::abs(slope) * (p + beta * amplification) / (p + slope));
    }
    return gain;
}

/// Returns gamma, the largest error of the rendered force divided by the position error of the encoder [N/m]. The
/// virtual object is a spring of stiffness K with mass behind a virtual coupling, integrated by backward Euler without
/// a force limit. The result is the sum of |g|, where g is the impulse response from position to force, C A / (C + A),
///
///     C = K_c + beta (1 - z^-1),   A = (m/T^2) (1 - z^-1)^2 + (B_o/T) (1 - z^-1) + K.
///
/// The poles are r_1 and r_2 with |r_2| <= |r_1| = rho. From N >= 3 on, g_{k+1} = r_1 g_k + r_2^{k+1-N} u with u = g_N
/// - r_1 g_{N-1}. The terms after g_N therefore add at most (rho |g_N| + |u| |r_2| / (1 - |r_2|)) / (1 - rho). The
/// summation ends when this remainder is at most 1 % of the sum; the result includes the remainder. Returns infinity if
/// a pole does not lie inside the unit circle, or if 10^7 terms are not enough.
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
    // `first` <= 0: both terms of the sum `near` have real parts >= 0, so the sum loses no digits
    std::complex<double> far = -0.5 * first - half_difference;
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
