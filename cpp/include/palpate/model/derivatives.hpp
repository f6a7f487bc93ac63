// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "palpate/model/parameters.hpp"
#include "palpate/model/wavelet.hpp"

namespace palpate {

/// Value and first three derivatives of a function at one position.
using Jet = std::array<double, 4>;

/// Value and first four derivatives of a function at one position.
using Derivatives = std::array<double, 5>;

/// Returns force and first four derivatives of a wavelet network of position at x, without continuation.
[[nodiscard]] inline Derivatives derivatives(const NetworkParameters& network, double x) noexcept {
    const double c = network.linear[0];
    Derivatives sum{c * x + network.bias, c, 0.0, 0.0, 0.0};
    for (std::size_t i = 0; i < network.hats(); ++i) {
        const double alpha = network.alpha[i];
        const double u = std::clamp(alpha * (x - network.beta[i]), -wavelet_reach, wavelet_reach);
        const double square = u * u;
        double factor = network.weight[i] * std::exp(-0.5 * square);
        sum[0] += factor * (square - 1.0);
        sum[1] += (factor *= alpha) * (3.0 - square) * u;
        sum[2] += (factor *= alpha) * ((square - 6.0) * square + 3.0);
        sum[3] += (factor *= alpha) * ((10.0 - square) * square - 15.0) * u;
        sum[4] += factor * alpha * (((square - 15.0) * square + 45.0) * square - 15.0);
    }
    for (std::size_t i = network.hats(); i < network.weight.size(); ++i) {
        const double alpha = network.alpha[i];
        const double u = alpha * (x - network.beta[i]);
        double cosine = network.weight[i] * std::cos(u);
        double sine = network.weight[i] * std::sin(u);
        sum[0] += cosine;
        sum[1] -= (sine *= alpha);
        sum[2] -= (cosine *= alpha * alpha);
        sum[3] += (sine *= alpha * alpha);
        sum[4] += cosine * alpha * alpha;
    }
    return sum;
}

/// Returns force and first three derivatives of a wavelet network of position at x, without continuation.
[[nodiscard]] inline Jet jet(const NetworkParameters& network, double x) noexcept {
    const Derivatives f = derivatives(network, x);
    return {f[0], f[1], f[2], f[3]};
}

/// `derivative_bounds` computes bounds of the derivatives up to this order.
inline constexpr std::size_t highest_derivative = 9;

/// Upper bounds of |f|, |f'|, ..., |f^(9)| of a network f of one input over an interval of positions.
using DerivativeBounds = std::array<double, highest_derivative + 1>;

namespace detail {

/// Suprema of the derivatives |psi^(n)| of the Mexican hat, rounded up. Apart from the sign psi^(n) is He_{n+2}(u)
/// e^{-u^2/2} with the Hermite polynomial He, so for even n the supremum is at u = 0.
inline constexpr DerivativeBounds hat_suprema{1.0,    1.3801190462, 3.0,     5.7831, 15.0,
                                              35.539, 105.0,        288.492, 945.0,  2913.41};

/// Factors a_n for which |psi^(n)(u)| <= a_n e^{-u^2/4}, the decay of the Mexican hat's derivative n with the distance
/// u from its centre. They follow from Cramer's inequality |He_n(u)| e^{-u^2/4} <= 1.0865 sqrt(n!) for Hermite
/// polynomials He_n.
inline constexpr DerivativeBounds hat_tails{1.5366,  2.6614,   5.3228,   11.9021,   29.1540,
                                            77.1341, 218.1682, 654.5044, 2069.7211, 6864.48};

/// Rounding error of derivative n of one wavelet, divided by epsilon |weight| dilation^n. The polynomial of the Mexican
/// hat psi, the exponent u^2/2 and u itself have errors of a few epsilon each. The numbers are suprema over u of ((n +
/// 6 + u^2) P_n + 1.5 |u| P_{n+1}) e^{-u^2/2}, where P_n is the polynomial of psi^(n) with absolute coefficients.
inline constexpr Derivatives hat_rounding{14.47, 40.6, 129.3, 452.5, 1714.2};

}  // namespace detail

/// Returns bounds of the rounding errors of the value and the four derivatives that `derivatives` computes, for
/// positions from -reach to reach.
[[nodiscard]] inline Derivatives derivatives_rounding(const NetworkParameters& network,
                                                      double reach) noexcept {
    const double c = std::abs(network.linear[0]);
    const double terms = 0.5 * static_cast<double>(network.weight.size() + 4);
    Derivatives sum{(terms + 2.0) * (std::abs(network.bias) + c * reach), (terms + 2.0) * c, 0.0, 0.0, 0.0};
    for (std::size_t i = 0; i < network.weight.size(); ++i) {
        const bool hat = i < network.hats();
        // The argument u of a cosine has an error of 1.5 epsilon |u|, its powers of alpha and the cosine itself of a
        // few epsilon
        const double wave = 2.0 * network.alpha[i] * (reach + std::abs(network.beta[i])) + 8.0;
        double factor = std::abs(network.weight[i]);
        for (std::size_t n = 0; n < sum.size(); ++n) {
            sum[n] +=
                factor * (hat ? detail::hat_rounding[n] + terms * detail::hat_suprema[n] : wave + terms);
            factor *= network.alpha[i];
        }
    }
    for (double& rounding : sum) {
        rounding *= std::numeric_limits<double>::epsilon();
    }
    return sum;
}

/// Returns bounds of the rounding errors of the value and the three derivatives that `jet` computes, for positions from
/// -reach to reach.
[[nodiscard]] inline Jet jet_rounding(const NetworkParameters& network, double reach) noexcept {
    const Derivatives f = derivatives_rounding(network, reach);
    return {f[0], f[1], f[2], f[3]};
}

/// Returns proved upper bounds of the absolute value of a network f and of its first nine derivatives over [from, to].
/// Each bound is the sum of the largest contributions of all wavelets at their distance from [from, to]; a harmonic
/// contributes |w| alpha^n everywhere. The bounds can be much wider than those of `value_bounds` and `slope_bounds`, but need no search.
[[nodiscard]] inline DerivativeBounds derivative_bounds(const NetworkParameters& network, double from,
                                                        double to) noexcept {
    const double c = std::abs(network.linear[0]);
    DerivativeBounds bounds{std::abs(network.bias) + c * std::max(std::abs(from), std::abs(to)), c};
    for (std::size_t i = 0; i < network.weight.size(); ++i) {
        const double alpha = network.alpha[i];
        const double beta = network.beta[i];
        const double distance = alpha * std::max({from - beta, beta - to, 0.0});
        const double decay = std::exp(-0.25 * std::min(distance * distance, 2800.0));
        double factor = std::abs(network.weight[i]);
        for (std::size_t n = 0; n <= highest_derivative; ++n) {
            bounds[n] += i < network.hats()
                             ? factor * std::min(detail::hat_suprema[n], detail::hat_tails[n] * decay)
                             : factor;
            factor *= alpha;
        }
    }
    for (double& bound : bounds) {
        // Makes each bound larger by more than the rounding error of the sum over the wavelets
        bound *= 1.0 + 1e-9;
    }
    return bounds;
}

}  // namespace palpate
