// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <numbers>
#include <numeric>
#include <span>
#include <vector>

namespace palpate {

/// Slopes of a force: df/dx lies in [-falling, rising] everywhere.
struct SlopeRange {
    double rising = 0.0;   ///< M >= 0
    double falling = 0.0;  ///< s >= 0

    [[nodiscard]] double steepest() const noexcept { return std::max(rising, falling); }
};

/// R(Lambda): damping over the period, b / T, that a force held for a sample needs if it is computed at a position
/// x_k - q_k with sum of q^2 <= Lambda^2 sum of d^2. Closed form, proved in docs/certificate.md.
[[nodiscard]] inline double held_need(double lag, SlopeRange slopes) noexcept {
    const double M = slopes.rising;
    const double s = slopes.falling;
    if (lag * s <= (1.0 + lag) * M) {
        return M * (0.5 + lag);
    }
    if ((lag - 1.0) * s >= lag * M) {
        return s * (lag - 0.5);
    }
    return 0.5 * (M + M * M / (s - M) + lag * lag * (s - M));
}

namespace detail {

/// a = max over rho of h(rho) - l rho - gamma rho^2, gamma > 0: the largest energy of one step. h is M (1/2 + rho)
/// above 0, M (1 + rho)^2 / 2 + s rho^2 / 2 on [-1, 0] and s (-rho - 1/2) below -1.
[[nodiscard]] inline double step_energy(SlopeRange slopes, double l, double gamma) noexcept {
    const double M = slopes.rising;
    const double s = slopes.falling;
    const double rise = std::max(0.0, M - l);
    const double above = 0.5 * M + 0.25 * rise * rise / gamma;
    const double u = std::max(1.0, 0.5 * (s + l) / gamma);
    const double below = s * (u - 0.5) + (l - gamma * u) * u;
    double most = std::max(above, below);
    if (const double bend = 2.0 * gamma - M - s; bend > 0.0) {
        const double rho = std::clamp((M - l) / bend, -1.0, 0.0);
        most =
            std::max(most, 0.5 * (M * (1.0 + rho) * (1.0 + rho) + s * rho * rho) - (l + gamma * rho) * rho);
    }
    return most;
}

/// A causal filter q_k = sum of taps[j - 1] d_{k-j}, j = 1 to N, seen at `resolution` N + 1 frequencies.
class FilterGain {
  public:
    FilterGain(std::span<const double> taps, int resolution)
        : size_{std::transform_reduce(taps.begin(), taps.end(), 0.0, std::plus<>{},
                                      [](double tap) { return std::abs(tap); })} {
        const auto points = static_cast<std::size_t>(resolution) * std::max<std::size_t>(1, taps.size());
        real_.reserve(points + 1);
        square_.reserve(points + 1);
        for (std::size_t k = 0; k <= points; ++k) {
            const double theta = std::numbers::pi * static_cast<double>(k) / static_cast<double>(points);
            double real = 0.0;
            double imaginary = 0.0;
            for (std::size_t j = 0; j < taps.size(); ++j) {
                const double phase = theta * static_cast<double>(j + 1);
                real += taps[j] * std::cos(phase);
                imaginary += taps[j] * std::sin(phase);
            }
            real_.push_back(real);
            square_.push_back(real * real + imaginary * imaginary);
        }
        // Riesz: near its maximum a trigonometric polynomial of degree N stays above a cosine of N theta; the nearest
        // frequency seen is at most pi / (2 resolution N) away.
        miss_ = 1.0 - std::cos(0.5 * std::numbers::pi / resolution);
    }

    /// Sum of |taps|, an upper bound of |Q|.
    [[nodiscard]] double size() const noexcept { return size_; }

    /// max over theta of l Re Q + gamma |Q|^2; never below the true maximum, rounding included.
    [[nodiscard]] double most(double l, double gamma) const noexcept {
        double largest = -std::numeric_limits<double>::infinity();
        for (std::size_t k = 0; k < real_.size(); ++k) {
            largest = std::max(largest, l * real_[k] + gamma * square_[k]);
        }
        return largest + (miss_ + 1e-13) * (std::abs(l) + gamma * size_) * size_;
    }

  private:
    std::vector<double> real_;
    std::vector<double> square_;
    double size_;
    double miss_ = 0.0;
};

/// Least value of a convex function between two ends, and where.
struct Least {
    double at = 0.0;
    double value = 0.0;
};
template <class Function>
[[nodiscard]] Least least_between(double low, double high, Function function) {
    constexpr int steps = 56;  // to 2e-12 of the interval
    constexpr double golden = 0.6180339887498949;
    double left = high - golden * (high - low);
    double right = low + golden * (high - low);
    double at_left = function(left);
    double at_right = function(right);
    for (int k = 0; k < steps; ++k) {
        if (at_left <= at_right) {
            high = right;
            right = left;
            at_right = at_left;
            left = high - golden * (high - low);
            at_left = function(left);
        } else {
            low = left;
            left = right;
            at_left = at_right;
            right = low + golden * (high - low);
            at_right = function(right);
        }
    }
    return at_left <= at_right ? Least{left, at_left} : Least{right, at_right};
}

/// min over l and gamma of cost(gain, l, gamma), convex in both: sought with few frequencies, told with many. Every
/// l and gamma gives a proof, so the search decides only how tight the result is.
template <class Cost>
[[nodiscard]] double least_cost(std::span<const double> taps, SlopeRange slopes, Cost cost) {
    const FilterGain rough{taps, 64};
    const double slope = slopes.rising + slopes.falling;
    const double highest = 8.0 * slope / rough.size();
    double gamma = highest;
    const Least best = least_between(-slope, slope, [&](double l) {
        return least_between(0.0, highest, [&](double g) { return cost(rough, l, g); }).value;
    });
    gamma = least_between(0.0, highest, [&](double g) { return cost(rough, best.at, g); }).at;
    return cost(FilterGain{taps, 2048}, best.at, gamma) * (1.0 + 1e-13);
}

}  // namespace detail

/// b / T that a static force needs if it is computed at x_k - q_k, q = Q d a causal filter of the steps
/// d_k = x_{k+1} - x_k: q_k = sum of taps[j - 1] d_{k-j}. The smaller of
///
///     min over l, gamma of a + max over theta of l Re Q + gamma |Q|^2     and     R(sum of |taps|).
///
/// n samples of delay are n taps of 1; a force with hysteresis may be delayed only (docs/certificate.md).
[[nodiscard]] inline double filtered_need(std::span<const double> taps, SlopeRange slopes) {
    double size = 0.0;
    for (const double tap : taps) {
        size += std::abs(tap);
    }
    const double simple = held_need(size, slopes);
    if (!(slopes.steepest() > 0.0) || !std::isfinite(simple) || size == 0.0) {
        return simple;
    }
    const double sharp =
        detail::least_cost(taps, slopes, [&](const detail::FilterGain& gain, double l, double gamma) {
            return detail::step_energy(slopes, l, gamma) + gain.most(l, gamma);
        });
    return std::min(simple, sharp);
}

namespace detail {

/// The line of `delayed_need` for exactly n + tau samples, 0 < tau < 1.
[[nodiscard]] inline double split_sample_need(int whole, double fraction, SlopeRange slopes) {
    const double uneven = fraction * (1.0 - fraction);
    const double simple = held_need(std::sqrt(whole * (whole + 2.0 * fraction) + fraction), slopes);
    if (!(slopes.steepest() > 0.0) || !std::isfinite(simple)) {
        return simple;
    }
    std::vector<double> taps(static_cast<std::size_t>(whole), 1.0);
    taps.push_back(fraction);
    const double sharp = least_cost(taps, slopes, [&](const FilterGain& gain, double l, double gamma) {
        const double a = step_energy(slopes, l, gamma);
        const double Z = a + gain.most(l, gamma) + gamma * uneven;
        return 0.5 * (Z + std::sqrt(std::max(0.0, Z * Z - 4.0 * uneven * (a * gamma - 0.25 * l * l))));
    });
    return std::min(simple, sharp);
}

}  // namespace detail

/// b / T that a held force needs if it comes n + tau samples late, static or with hysteresis. Each sample begins
/// with the command before: the motion of its first part, alpha, is free. With
/// Q = z^-1 + ... + z^-n + tau z^-(n+1), for one l and gamma,
///
///     Z = a + max over theta of (l Re Q + gamma |Q|^2) + gamma tau (1 - tau)
///     b / T >= (Z + sqrt(Z^2 - 4 tau (1 - tau) (a gamma - l^2 / 4))) / 2,
///
/// the largest eigenvalue of the form in d and alpha. It is continuous in the delay. A force that falls can need a
/// little less after n + tau samples than after n: the larger of both, because a delay may be shorter than stated.
[[nodiscard]] inline double delayed_need(int whole, double fraction, SlopeRange slopes) {
    const std::vector<double> taps(static_cast<std::size_t>(whole), 1.0);
    const double need = filtered_need(taps, slopes);
    return fraction > 0.0 ? std::max(need, detail::split_sample_need(whole, fraction, slopes)) : need;
}

}  // namespace palpate
