// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "palpate/device/device_profile.hpp"

namespace palpate {

/// Range of the slopes of a force: df/dx lies in [-falling, rising] everywhere.
struct SlopeRange {
    double rising = 0.0;   ///< M >= 0
    double falling = 0.0;  ///< s >= 0

    /// Returns the larger absolute slope.
    [[nodiscard]] double steepest() const noexcept { return std::max(rising, falling); }
};

/// Returns R(Lambda): damping divided by the period, b / T, that a held force needs if it is computed at a position
/// x_k - q_k with sum of q^2 <= Lambda^2 sum of d^2. The closed form is proved in docs/certificate.md.
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

/// Returns a = max over rho of h(rho) - l rho - gamma rho^2, gamma > 0: the largest energy of one step. h is M
/// (1/2 + rho) above 0, M (1 + rho)^2 / 2 + s rho^2 / 2 on [-1, 0] and s (-rho - 1/2) below -1.
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

/// Returns the conjugate of Q = sum of taps[j - 1] z^-j at z = exp(i theta), by the recurrence of cos and sin of j
/// theta.
[[nodiscard]] inline std::complex<double> response(std::span<const double> taps, double theta) noexcept {
    const double twice = 2.0 * std::cos(theta);
    std::complex<double> before = 1.0;
    std::complex<double> now{0.5 * twice, std::sin(theta)};
    std::complex<double> sum;
    for (const double tap : taps) {
        sum += tap * now;
        before = std::exchange(now, twice * now - before);
    }
    return sum;
}

/// Returns the sum of |taps|.
[[nodiscard]] inline double size_of(std::span<const double> taps) noexcept {
    double size = 0.0;
    for (const double tap : taps) {
        size += std::abs(tap);
    }
    return size;
}

/// Method for the maximum over frequency of a trigonometric polynomial of degree N, from `resolution` N + 1 values.
enum class Maximum : std::uint8_t {
    Likely,  ///< from a parabola through the largest value and its neighbours
    Proved,  ///< never below the true maximum, rounding included
};

/// Returns the maximum of value(k) over k = 0 to last. `size` bounds the polynomial minus its mean.
template <class Value>
[[nodiscard]] double maximum_of(Maximum kind, int resolution, std::size_t last, double size, Value value) {
    std::size_t at = 0;
    double largest = value(0);
    for (std::size_t k = 1; k <= last; ++k) {
        if (const double sample = value(k); sample > largest) {
            largest = sample;
            at = k;
        }
    }
    if (kind == Maximum::Proved) {
        // Riesz: near its maximum the polynomial stays above a cosine of N theta, and the nearest sampled frequency is
        // at most pi / (2 resolution N) away.
        return largest + (1.0 - std::cos(0.5 * std::numbers::pi / resolution) + 1e-12) * size;
    }
    if (at == 0 || at == last) {
        return largest;
    }
    const double rise = value(at + 1) - value(at - 1);
    const double bend = 2.0 * largest - value(at + 1) - value(at - 1);
    return bend > 0.0 ? largest + 0.125 * rise * rise / bend : largest;
}

/// A causal filter q_k = sum of taps[j - 1] d_{k-j}, j = 1 to N, at `resolution` N + 1 frequencies.
class FilterGain {
  public:
    FilterGain(std::span<const double> taps, Maximum kind, int resolution)
        : kind_{kind}, resolution_{resolution}, size_{size_of(taps)} {
        const auto last = static_cast<std::size_t>(resolution) * std::max<std::size_t>(1, taps.size());
        for (std::size_t k = 0; k <= last; ++k) {
            const std::complex<double> Q =
                response(taps, std::numbers::pi * static_cast<double>(k) / static_cast<double>(last));
            real_.push_back(Q.real());
            square_.push_back(std::norm(Q));
        }
    }

    /// Returns the sum of |taps|, an upper bound of |Q|.
    [[nodiscard]] double size() const noexcept { return size_; }

    /// Returns max over theta of l Re Q + gamma |Q|^2.
    [[nodiscard]] double most(double l, double gamma) const noexcept {
        return maximum_of(kind_, resolution_, real_.size() - 1, (std::abs(l) + gamma * size_) * size_,
                          [&](std::size_t k) { return l * real_[k] + gamma * square_[k]; });
    }

  private:
    Maximum kind_;
    int resolution_;
    double size_;
    std::vector<double> real_;
    std::vector<double> square_;
};

/// Position and value of the minimum of a convex function.
struct Minimum {
    double at = 0.0;
    double value = 0.0;
};
/// Finds the minimum of a convex function between two ends by golden sections.
template <class Function>
[[nodiscard]] Minimum minimum_between(double low, double high, Function function) {
    constexpr int steps = 40;  // to 4e-9 of the interval
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
    return at_left <= at_right ? Minimum{left, at_left} : Minimum{right, at_right};
}

/// Returns min over l and gamma of cost(gain, l, gamma), convex in both. Every l and gamma is a proof, so the search
/// may use likely maxima; the result uses proved maxima. A small weight on l and gamma makes the search end at the same
/// values on every machine.
template <class Gain = FilterGain, class Cost>
[[nodiscard]] double least_cost(std::span<const double> taps, SlopeRange slopes, Cost cost) {
    constexpr double weight = 1e-8;
    const Gain rough{taps, Maximum::Likely, 8};
    const double slope = slopes.rising + slopes.falling;
    const double highest = 8.0 * slope / rough.size();
    const auto least_over_gamma = [&](double l) {
        return minimum_between(0.0, highest, [&](double gamma) {
            return cost(rough, l, gamma) +
                   weight * (l * l / slope + slope * (gamma / highest) * (gamma / highest));
        });
    };
    const double l = minimum_between(-slope, slope, [&](double at) { return least_over_gamma(at).value; }).at;
    return cost(Gain{taps, Maximum::Proved, 2048}, l, least_over_gamma(l).at) * (1.0 + 1e-13);
}

}  // namespace detail

/// Returns b / T that a static force needs if it is computed at x_k - q_k. Here q = Q d is a causal filter of the steps
/// d_k = x_{k+1} - x_k: q_k = sum of taps[j - 1] d_{k-j}. The result is the smaller of
///
///     min over l, gamma of a + max over theta of l Re Q + gamma |Q|^2     and     R(sum of |taps|).
///
/// n samples of delay are n taps of 1. For a force with hysteresis only delays are proved (docs/certificate.md).
[[nodiscard]] inline double filtered_need(std::span<const double> taps, SlopeRange slopes) {
    const double size = detail::size_of(taps);
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

/// Returns the need of `delayed_need` for exactly n + tau samples, 0 < tau < 1.
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

/// Returns b / T that a held force needs with a delay of n + tau samples, static or with hysteresis. Each sample begins
/// with the command before; the motion during that part, alpha, is free. With Q = z^-1 + ... + z^-n + tau z^-(n+1), for
/// one l and gamma,
///
///     Z = a + max over theta of (l Re Q + gamma |Q|^2) + gamma tau (1 - tau)
///     b / T >= (Z + sqrt(Z^2 - 4 tau (1 - tau) (a gamma - l^2 / 4))) / 2,
///
/// the largest eigenvalue of the form in d and alpha. It is continuous in the delay. A falling force can need slightly
/// less after n + tau samples than after n. The result is the larger need, because a delay may be shorter than stated.
[[nodiscard]] inline double delayed_need(int whole, double fraction, SlopeRange slopes) {
    const std::vector<double> taps(static_cast<std::size_t>(whole), 1.0);
    const double need = filtered_need(taps, slopes);
    return fraction > 0.0 ? std::max(need, detail::split_sample_need(whole, fraction, slopes)) : need;
}

namespace detail {

/// A causal filter in both parts of a sample: Q for the command of this sample and (1 + Q) / z for the one before.
class SplitGain {
  public:
    SplitGain(std::span<const double> taps, Maximum kind, int resolution)
        : kind_{kind}, resolution_{resolution}, size_{1.0 + size_of(taps)} {
        const std::size_t last = static_cast<std::size_t>(resolution) * (taps.size() + 1);
        for (std::size_t k = 0; k <= last; ++k) {
            const double theta = std::numbers::pi * static_cast<double>(k) / static_cast<double>(last);
            now_.push_back(response(taps, theta));
            before_.push_back((1.0 + now_.back()) * std::polar(1.0, theta));
        }
    }

    [[nodiscard]] double size() const noexcept { return size_; }

    /// Returns the largest eigenvalue over all frequencies of the form of both parts, with a gamma for each.
    [[nodiscard]] double most(double fraction, double rest, SlopeRange slopes, double l, double gamma_first,
                              double gamma_second) const noexcept {
        const double first = step_energy(slopes, l, gamma_first);
        const double second = step_energy(slopes, l, gamma_second);
        const auto eigenvalue = [&](std::size_t k) {
            const std::complex<double> Q = now_[k];
            const std::complex<double> other = std::conj(1.0 + Q);
            const double wide = gamma_first * std::norm(other);
            const double one =
                fraction * (first + l * before_[k].real() + wide + gamma_second * std::norm(other));
            const double two = rest * (second + l * Q.real() + wide + gamma_second * std::norm(Q));
            const double across =
                fraction * rest * std::norm(0.5 * l * (before_[k] + other) + wide + gamma_second * other * Q);
            return 0.5 * (one + two + std::sqrt((one - two) * (one - two) + 4.0 * across));
        };
        return maximum_of(kind_, resolution_, now_.size() - 1,
                          (2.0 * std::abs(l) + (gamma_first + gamma_second) * size_) * size_, eigenvalue);
    }

  private:
    Maximum kind_;
    int resolution_;
    double size_;
    std::vector<std::complex<double>> now_;
    std::vector<std::complex<double>> before_;
};

}  // namespace detail

/// Returns the need of a static force whose command, computed at x_k - q_k, acts a further fraction tau of a sample
/// late. During the first part of a sample, in which the handle moves by alpha, the command before acts. Each part is a
/// separate step, alpha^2 h(q' / alpha) and beta^2 h((q + alpha) / beta), compared with B
/// (alpha^2 / tau + beta^2 / (1 - tau)). `rest` is 1 - tau. If the instant between both parts varies, tau and `rest`
/// are the longest of each.
[[nodiscard]] inline double filtered_need(std::span<const double> taps, double fraction, SlopeRange slopes,
                                          double rest) {
    if (!(fraction > 0.0) || !(slopes.steepest() > 0.0) || !std::isfinite(slopes.rising + slopes.falling)) {
        return filtered_need(taps, slopes);
    }
    const auto least = [&](double gamma_first, double gamma_second) {
        return detail::least_cost<detail::SplitGain>(
            taps, slopes, [&](const detail::SplitGain& gain, double l, double gamma) {
                return gain.most(fraction, rest, slopes, l, gamma_first * gamma, gamma_second * gamma);
            });
    };
    return std::min(least(fraction, rest), least(std::sqrt(fraction), std::sqrt(rest)));
}
/// Returns the same need with `rest` = 1 - tau.
[[nodiscard]] inline double filtered_need(std::span<const double> taps, double fraction, SlopeRange slopes) {
    return filtered_need(taps, fraction, slopes, 1.0 - fraction);
}

namespace detail {

/// Returns the need of a filter that ignores the motion during a time of at most nu T around each sample. That motion
/// enters q up to `gain` times.
[[nodiscard]] inline double roughly_filtered_need(std::span<const double> taps, double gain, double nu,
                                                  SlopeRange slopes) {
    const double off = gain * std::sqrt(nu);
    const double eta = off / size_of(taps);
    return least_cost(taps, slopes, [&](const FilterGain& filter, double l, double gamma) {
        return step_energy(slopes, l, gamma) + filter.most(l, gamma * (1.0 + eta)) +
               gamma * (1.0 + 1.0 / eta) * off * off + std::abs(l) * off;
    });
}

/// Returns nu of `roughly_filtered_need`: the time between a sample and the instant `delay` after the one `whole`
/// before it, times the number of such times that can overlap, divided by T.
[[nodiscard]] inline double uncertain_time(double delay, double period, double jitter, int whole) noexcept {
    const double off = std::abs(delay - whole * period);
    const double span = off + jitter + std::max(0.0, jitter - off);
    return (off + jitter) * std::ceil(span / (period - jitter)) / (period + jitter);
}

/// Returns the need with samples at k period + u_k, 0 <= u_k <= jitter. Each command acts `delay` after its sample. It
/// is the smaller of R(Lambda) and the need for n samples of delay plus the effect of the remaining delay, at most a
/// time nu T from the n-th sample.
[[nodiscard]] inline double jittered_need(double delay, double period, double jitter, SlopeRange slopes) {
    const double T = period + jitter;
    if (delay <= period - jitter) {  // within the same sample
        return delayed_need(0, delay / T, slopes);
    }
    // Lambda^2 T: overlap of the delay that begins at one sample with all others, itself included.
    double common = delay;
    for (int j = 1; j * period < delay + jitter; ++j) {
        const double rest = delay - j * period;
        common += std::min(delay, rest + jitter) + std::max(0.0, rest);
    }
    const double simple = held_need(std::sqrt(common / T), slopes);
    const int whole = static_cast<int>(std::lround(delay / period));
    if (jitter >= period || whole == 0 || !(slopes.steepest() > 0.0) || !std::isfinite(simple)) {
        return simple;
    }
    const std::vector<double> taps(static_cast<std::size_t>(whole), 1.0);
    const double nu = uncertain_time(delay, period, jitter, whole);
    return std::min(simple, roughly_filtered_need(taps, 1.0, nu, slopes));
}

}  // namespace detail

/// Returns b / T that a held force needs on a device, static or with hysteresis; T is the longest time between two
/// samples. Samples are taken at k period_s + u_k with 0 <= u_k <= jitter_s, because the loop uses absolute times. Each
/// command acts delay_s after its sample. If a device counts its delay in samples, jitter does not increase its need.
[[nodiscard]] inline double device_need(const DeviceProfile& device, SlopeRange slopes) {
    const bool steady = device.jitter_s == 0.0 || device.late_samples() == 0;
    return steady ? delayed_need(device.whole_delay_samples(), device.delay_fraction(), slopes)
                  : detail::jittered_need(device.delay_s, device.period_s, device.jitter_s, slopes);
}

}  // namespace palpate
