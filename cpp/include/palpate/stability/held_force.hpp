// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
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

/// Bounds of the slope of a force [N/m]: df/dx is between -falling and rising at every position.
struct SlopeRange {
    double rising = 0.0;   ///< M, steepest rising slope, >= 0 [N/m]
    double falling = 0.0;  ///< s, steepest falling slope, >= 0 [N/m]

    /// Returns the larger of `rising` and `falling` [N/m].
    [[nodiscard]] double steepest() const noexcept { return std::max(rising, falling); }
};

/// Returns R(Lambda): device damping divided by the period, b / T [N/m], that a held force needs if it is computed at a
/// position x_k - q_k instead of the position x_k of the handle. The position error q_k satisfies sum of q^2 <=
/// Lambda^2 sum of d^2 for the steps d_k = x_{k+1} - x_k; Lambda is `lag`. The formula is proved in
/// docs/certificate.md.
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

/// Returns a = max over rho of h(rho) - l rho - gamma rho^2, gamma > 0. In one sample a held force gives at most the
/// energy (a + l rho + gamma rho^2) d^2, where d is the handle's step and rho the position error divided by d. The
/// function h(rho) is M (1/2 + rho) for rho > 0, M (1 + rho)^2 / 2 + s rho^2 / 2 for -1 <= rho <= 0, and s (-rho - 1/2)
/// for rho < -1.
[[nodiscard]] inline double step_coefficient(SlopeRange slopes, double l, double gamma) noexcept {
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

/// Calls use(z) for z = exp(i pi k / last), k from 0 to `last`. A block of numbers is one block turned, because a
/// product costs less than a sine and a cosine.
template <class Use>
void along_half_circle(std::size_t last, Use use) {
    const auto at = [&](std::size_t k) {
        return std::polar(1.0, std::numbers::pi * static_cast<double>(k) / static_cast<double>(last));
    };
    std::array<std::complex<double>, 64> block;
    for (std::size_t k = 0; k < std::min(block.size(), last + 1); ++k) {
        block[k] = at(k);
    }
    std::complex<double> turn;
    for (std::size_t k = 0; k <= last; ++k) {
        const std::size_t within = k % block.size();
        turn = within == 0 ? at(k) : turn;
        use(turn * block[within]);
    }
}

/// Returns the conjugate of the frequency response Q = sum of taps[j - 1] z^-j of a filter at a number z of size 1.
/// Computes the powers of z by a recurrence.
[[nodiscard]] inline std::complex<double> response(std::span<const double> taps,
                                                   std::complex<double> z) noexcept {
    const double twice = 2.0 * z.real();
    std::complex<double> before = 1.0;
    std::complex<double> now = z;
    std::complex<double> sum;
    for (const double tap : taps) {
        sum += tap * now;
        before = std::exchange(now, twice * now - before);
    }
    return sum;
}

/// Returns the sum of the absolute values of the filter coefficients `taps`.
[[nodiscard]] inline double size_of(std::span<const double> taps) noexcept {
    double size = 0.0;
    for (const double tap : taps) {
        size += std::abs(tap);
    }
    return size;
}

/// Method that computes the maximum over all frequencies of a trigonometric polynomial of degree N from its values at
/// (`resolution` times N) + 1 frequencies.
enum class Maximum : std::uint8_t {
    Likely,  ///< estimate: maximum of the parabola through the largest value and its two neighbours
    Proved,  ///< proved upper bound of the maximum over all frequencies, rounding included
};

/// Returns the maximum over all frequencies of a trigonometric polynomial with the sampled values value(0) to
/// value(last). `size` is a bound of |polynomial minus its mean|.
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
        // By a theorem of Riesz, the polynomial of degree N stays above a cosine of N theta near its maximum. The
        // distance from the maximum to the nearest sampled frequency is at most pi / (2 resolution N).
        return largest + (1.0 - std::cos(0.5 * std::numbers::pi / resolution) + 1e-12) * size;
    }
    if (at == 0 || at == last) {
        return largest;
    }
    const double rise = value(at + 1) - value(at - 1);
    const double bend = 2.0 * largest - value(at + 1) - value(at - 1);
    return bend > 0.0 ? largest + 0.125 * rise * rise / bend : largest;
}

/// Frequency response Q, at `resolution` N + 1 frequencies, of the filter q_k = sum of taps[j - 1] d_{k-j}, j = 1 to N,
/// from the handle's steps d to the position error q.
class FilterGain {
  public:
    FilterGain(std::span<const double> taps, Maximum kind, int resolution)
        : kind_{kind}, resolution_{resolution}, size_{size_of(taps)} {
        const auto last = static_cast<std::size_t>(resolution) * std::max<std::size_t>(1, taps.size());
        along_half_circle(last, [&](std::complex<double> z) {
            const std::complex<double> Q = response(taps, z);
            real_.push_back(Q.real());
            square_.push_back(std::norm(Q));
        });
    }

    /// Returns the sum of the absolute filter coefficients, an upper bound of the frequency response |Q|.
    [[nodiscard]] double size() const noexcept { return size_; }

    /// Returns the maximum over all frequencies of l Re Q + gamma |Q|^2, with the frequency response Q of the filter
    /// and the given factors l and gamma.
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
/// Finds the minimum of a convex function between `low` and `high` by golden-section search.
template <class Function>
[[nodiscard]] Minimum minimum_between(double low, double high, Function function) {
    // Number of steps; together they reduce the interval from `low` to `high` to 4e-9 of its length
    constexpr int steps = 40;
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

/// Returns an upper bound of the minimum over l and gamma of cost(gain, l, gamma), which is convex in l and gamma.
/// Every pair (l, gamma) gives a proved bound, so the search may use approximate maxima over the frequencies; the
/// result uses proved maxima. A small penalty for large l and gamma makes the search end at the same values on every
/// computer.
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

/// Returns the device damping divided by the period, b / T [N/m], that a held force without hysteresis needs if it is
/// computed at x_k - q_k instead of the handle's position x_k. The position error q is filtered from the handle's steps
/// d_k = x_{k+1} - x_k: q_k = sum of taps[j - 1] d_{k-j}, with the frequency response Q. The result is the smaller of
///
///     min over l, gamma of a + max over theta of l Re Q + gamma |Q|^2     and     R(sum of |taps|).
///
/// a is computed by `step_coefficient`, R by `held_need`. For n samples of delay the filter has n taps of 1. For a
/// force with hysteresis the result is proved only for delays, not for other filters (docs/certificate.md).
[[nodiscard]] inline double filtered_need(std::span<const double> taps, SlopeRange slopes) {
    const double size = detail::size_of(taps);
    const double simple = held_need(size, slopes);
    if (!(slopes.steepest() > 0.0) || !std::isfinite(simple) || size == 0.0) {
        return simple;
    }
    const double sharp =
        detail::least_cost(taps, slopes, [&](const detail::FilterGain& gain, double l, double gamma) {
            return detail::step_coefficient(slopes, l, gamma) + gain.most(l, gamma);
        });
    return std::min(simple, sharp);
}

namespace detail {

/// Returns the device damping divided by the period that a held force needs with a delay of exactly n + tau samples (n
/// = `whole`, tau = `fraction`, 0 < tau < 1) [N/m]. `delayed_need` gives the formula.
[[nodiscard]] inline double split_sample_need(int whole, double fraction, SlopeRange slopes) {
    const double uneven = fraction * (1.0 - fraction);
    const double simple = held_need(std::sqrt(whole * (whole + 2.0 * fraction) + fraction), slopes);
    if (!(slopes.steepest() > 0.0) || !std::isfinite(simple)) {
        return simple;
    }
    std::vector<double> taps(static_cast<std::size_t>(whole), 1.0);
    taps.push_back(fraction);
    const double sharp = least_cost(taps, slopes, [&](const FilterGain& gain, double l, double gamma) {
        const double a = step_coefficient(slopes, l, gamma);
        const double Z = a + gain.most(l, gamma) + gamma * uneven;
        return 0.5 * (Z + std::sqrt(std::max(0.0, Z * Z - 4.0 * uneven * (a * gamma - 0.25 * l * l))));
    });
    return std::min(simple, sharp);
}

}  // namespace detail

/// Returns the device damping divided by the period, b / T [N/m], that a held force with or without hysteresis needs
/// with a delay of n + tau samples. During the first part tau of each sample the previous force still acts; the
/// handle's motion alpha in this part is arbitrary. With Q = z^-1 + ... + z^-n + tau z^-(n+1) and any l and gamma,
///
///     Z = a + max over theta of (l Re Q + gamma |Q|^2) + gamma tau (1 - tau)
///     b / T >= (Z + sqrt(Z^2 - 4 tau (1 - tau) (a gamma - l^2 / 4))) / 2,
///
/// the largest eigenvalue of a quadratic form in the handle's step d and alpha; a is computed by `step_coefficient`.
/// The bound is continuous in the delay. A falling force can need slightly less damping with n + tau samples of delay than
/// with n samples. The result is the larger of both, because the true delay may be shorter than n + tau samples.
[[nodiscard]] inline double delayed_need(int whole, double fraction, SlopeRange slopes) {
    const std::vector<double> taps(static_cast<std::size_t>(whole), 1.0);
    const double need = filtered_need(taps, slopes);
    return fraction > 0.0 ? std::max(need, detail::split_sample_need(whole, fraction, slopes)) : need;
}

namespace detail {

/// Frequency responses of a filter in both parts of a sample whose force changes within the sample: Q for the force of
/// this sample, and (1 + Q) / z for the force of the previous sample, which acts first.
class SplitGain {
  public:
    SplitGain(std::span<const double> taps, Maximum kind, int resolution)
        : kind_{kind}, resolution_{resolution}, size_{1.0 + size_of(taps)} {
        const std::size_t last = static_cast<std::size_t>(resolution) * (taps.size() + 1);
        along_half_circle(last, [&](std::complex<double> z) {
            now_.push_back(response(taps, z));
            before_.push_back((1.0 + now_.back()) * z);
        });
    }

    [[nodiscard]] double size() const noexcept { return size_; }

    /// Returns the largest eigenvalue over all frequencies of the quadratic form of both parts of a sample, with the
    /// shares `fraction` and `rest` and a separate gamma for each part. For each unit vector the form is a
    /// trigonometric polynomial, so `maximum_of` also holds for its largest eigenvalue.
    [[nodiscard]] double most(double fraction, double rest, SlopeRange slopes, double l, double gamma_first,
                              double gamma_second) const noexcept {
        const double first = step_coefficient(slopes, l, gamma_first);
        const double second = step_coefficient(slopes, l, gamma_second);
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

/// Returns the device damping divided by the period, b / T [N/m], that a force without hysteresis needs if it is
/// computed at x_k - q_k and acts with an additional delay of a fraction tau of a sample. During the first part of a
/// sample, in which the handle moves by alpha, the previous force acts; in the second part the handle moves by beta.
/// Each part is treated as a separate step. The energies of the parts, alpha^2 h(q' / alpha) and beta^2 h((q + alpha) /
/// beta), are compared with B (alpha^2 / tau + beta^2 / (1 - tau)), where B is the result. `rest` is 1 - tau. If the
/// time of the force change within the sample varies, tau and `rest` are the longest durations of both parts.
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

namespace detail {

/// Returns the device damping divided by the period, b / T [N/m], for a filter that describes the position error q
/// except for the handle's motion during a time of at most nu T for each sample. This unknown motion changes q by at
/// most `gain` times the motion.
[[nodiscard]] inline double roughly_filtered_need(std::span<const double> taps, double gain, double nu,
                                                  SlopeRange slopes) {
    const double off = gain * std::sqrt(nu);
    const double eta = off / size_of(taps);
    return least_cost(taps, slopes, [&](const FilterGain& filter, double l, double gamma) {
        return step_coefficient(slopes, l, gamma) + filter.most(l, gamma * (1.0 + eta)) +
               gamma * (1.0 + 1.0 / eta) * off * off + std::abs(l) * off;
    });
}

/// Returns nu of `roughly_filtered_need`: the difference between the delay and `whole` periods, jitter included, times
/// the number of such time intervals that can overlap, divided by the longest period T.
[[nodiscard]] inline double uncertain_time(double delay, double period, double jitter, int whole) noexcept {
    const double off = std::abs(delay - whole * period);
    const double span = off + jitter + std::max(0.0, jitter - off);
    return (off + jitter) * std::ceil(span / (period - jitter)) / (period + jitter);
}

/// Returns Lambda^2 for samples at k period + u_k, 0 <= u_k <= jitter, and T = period + jitter. D is the motion during the
/// time `delay` after a sample. The sum of D^2 over all samples is at most Lambda^2 T times the integral of the squared
/// velocity. Lambda^2 is the sum over all samples of the largest time during which the delay after a sample overlaps the delay
/// after one given sample, divided by T. For n + tau samples and no jitter it is n^2 + (2 n + 1) tau.
[[nodiscard]] inline double lag_squared_of(double delay, double period, double jitter) noexcept {
    double common = delay;
    for (int j = 1; j * period < delay + jitter; ++j) {
        const double rest = delay - j * period;
        common += std::min(delay, rest + jitter) + std::max(0.0, rest);
    }
    return common / (period + jitter);
}

/// Returns the device damping divided by the longest period, b / T [N/m], for samples at the times k period + u_k with
/// 0 <= u_k <= jitter, if each force acts the time `delay` after its sample. If each force acts before the next sample,
/// `delayed_need` gives the result. Otherwise it is the smaller of two bounds. One is R(Lambda) of `held_need`; the
/// other is the damping for n whole samples of delay plus the effect of the remaining delay, at most nu T.
[[nodiscard]] inline double jittered_need(double delay, double period, double jitter, SlopeRange slopes) {
    const double T = period + jitter;
    if (delay <= period - jitter) {  // the force always acts before the next position is read
        return delayed_need(0, delay / T, slopes);
    }
    const double simple = held_need(std::sqrt(lag_squared_of(delay, period, jitter)), slopes);
    const int whole = static_cast<int>(std::lround(delay / period));
    if (jitter >= period || whole == 0 || !(slopes.steepest() > 0.0) || !std::isfinite(simple)) {
        return simple;
    }
    const std::vector<double> taps(static_cast<std::size_t>(whole), 1.0);
    const double nu = uncertain_time(delay, period, jitter, whole);
    return std::min(simple, roughly_filtered_need(taps, 1.0, nu, slopes));
}

}  // namespace detail

/// Returns the device damping divided by the longest period, b / T [N/m], that a held force with or without hysteresis
/// needs on a device. Samples are taken at k period_s + u_k with 0 <= u_k <= jitter_s, because the control loop uses
/// absolute times. Each force acts delay_s after its sample.
[[nodiscard]] inline double device_need(const DeviceProfile& device, SlopeRange slopes) {
    const bool steady = device.jitter_s == 0.0 || device.late_samples() == 0;
    return steady ? delayed_need(device.whole_delay_samples(), device.delay_fraction(), slopes)
                  : detail::jittered_need(device.delay_s, device.period_s, device.jitter_s, slopes);
}

}  // namespace palpate
