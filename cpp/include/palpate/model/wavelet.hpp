// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

namespace palpate {

/// Distance |u| from the centre above which the Mexican hat, its derivatives and its antiderivatives are zero in double
/// precision. Limiting u to this distance keeps u^2 finite for any finite u; NaN stays NaN.
inline constexpr double wavelet_reach = 40.0;

/// The Mexican hat psi(u) = (u^2 - 1) E with E = e^{-u^2/2}, its derivative and its first two antiderivatives, from one
/// exponential. psi is the second derivative of the Gaussian E (paper eq. 5 with zeta = 1/2).
struct MexicanHat {
    double value;            ///< (u^2 - 1) E
    double slope;            ///< (3u - u^3) E
    double integral;         ///< -u E
    double double_integral;  ///< E
};

/// Returns the Mexican hat psi(u) of one input, its derivative and its two antiderivatives at u.
[[nodiscard]] inline MexicanHat mexican_hat(double u) noexcept {
    u = std::clamp(u, -wavelet_reach, wavelet_reach);
    const double square = u * u;
    const double gaussian = std::exp(-0.5 * square);
    return {(square - 1.0) * gaussian, (3.0 - square) * u * gaussian, -u * gaussian, gaussian};
}

/// Returns the second derivative of the Mexican hat, psi''(u) = (u^4 - 6u^2 + 3) e^{-u^2/2}.
[[nodiscard]] inline double mexican_hat_curvature(double u) noexcept {
    u = std::clamp(u, -wavelet_reach, wavelet_reach);
    const double square = u * u;
    return ((square - 6.0) * square + 3.0) * std::exp(-0.5 * square);
}

/// Returns the third derivative of the Mexican hat, psi'''(u) = (-u^5 + 10u^3 - 15u) e^{-u^2/2}.
[[nodiscard]] inline double mexican_hat_jerk(double u) noexcept {
    u = std::clamp(u, -wavelet_reach, wavelet_reach);
    const double square = u * u;
    return ((10.0 - square) * square - 15.0) * u * std::exp(-0.5 * square);
}

/// The radial Mexican hat of d inputs, psi(u) = (r^2 - d) E with r^2 = |u|^2 and E = e^{-r^2/2}, and the factor of its
/// gradient.
struct RadialMexicanHat {
    double value;            ///< (r^2 - d) E
    double gradient_over_u;  ///< (d + 2 - r^2) E; this factor times the vector u is the gradient

    /// Returns the second derivative d^2 psi / du_j^2 for a component u_j = `u` (2 E is `value` + `gradient_over_u`).
    [[nodiscard]] double curvature(double u) const noexcept { return gradient_over_u + mixed(u, u); }
    /// Returns the second derivative d^2 psi / du_j du_l for two different components u_j = `u` and u_l = `v`.
    [[nodiscard]] double mixed(double u, double v) const noexcept {
        return -u * v * (2.0 * gradient_over_u + value);
    }
};

/// Returns the radial Mexican hat and the factor of its gradient at the squared distance r^2 = `square` from the
/// centre.
[[nodiscard]] inline RadialMexicanHat radial_mexican_hat(double square, double dimension) noexcept {
    square = std::min(square, wavelet_reach * wavelet_reach);
    const double gaussian = std::exp(-0.5 * square);
    return {(square - dimension) * gaussian, (dimension + 2.0 - square) * gaussian};
}

}  // namespace palpate
