// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

namespace palpate {

/// |u| from which every function of the Mexican hat is zero in double precision. Clamping to it keeps u^2 finite for
/// any finite u; NaN stays NaN.
inline constexpr double wavelet_reach = 40.0;

/// The Mexican hat psi(u) = (u^2 - 1) e^{-u^2/2}, its derivative and its first two antiderivatives from one
/// exponential. It is the second derivative of a Gaussian (paper eq. 5 with zeta = 1/2).
struct MexicanHat {
    double value;            ///< (u^2 - 1) E
    double slope;            ///< (3u - u^3) E
    double integral;         ///< -u E
    double double_integral;  ///< E
};

/// Returns the Mexican hat at u.
[[nodiscard]] inline MexicanHat mexican_hat(double u) noexcept {
    u = std::clamp(u, -wavelet_reach, wavelet_reach);
    const double square = u * u;
    const double gaussian = std::exp(-0.5 * square);
    return {(square - 1.0) * gaussian, (3.0 - square) * u * gaussian, -u * gaussian, gaussian};
}

/// Returns psi''(u) = (u^4 - 6u^2 + 3) E.
[[nodiscard]] inline double mexican_hat_curvature(double u) noexcept {
    u = std::clamp(u, -wavelet_reach, wavelet_reach);
    const double square = u * u;
    return ((square - 6.0) * square + 3.0) * std::exp(-0.5 * square);
}

/// Returns psi'''(u) = (-u^5 + 10u^3 - 15u) E.
[[nodiscard]] inline double mexican_hat_jerk(double u) noexcept {
    u = std::clamp(u, -wavelet_reach, wavelet_reach);
    const double square = u * u;
    return ((10.0 - square) * square - 15.0) * u * std::exp(-0.5 * square);
}

/// The radial Mexican hat of d inputs, psi(u) = (|u|^2 - d) e^{-|u|^2/2}, as functions of r^2 = |u|^2.
struct RadialMexicanHat {
    double value;            ///< (r^2 - d) E
    double gradient_over_u;  ///< (d + 2 - r^2) E; the gradient is this times u

    /// Returns d^2 psi / du_j^2 for a component u_j of u (2 E is the sum of the two members above).
    [[nodiscard]] double curvature(double u) const noexcept {
        return gradient_over_u - u * u * (2.0 * gradient_over_u + value);
    }
};

/// Returns the radial Mexican hat at r^2 = `square`.
[[nodiscard]] inline RadialMexicanHat radial_mexican_hat(double square, double dimension) noexcept {
    square = std::min(square, wavelet_reach * wavelet_reach);
    const double gaussian = std::exp(-0.5 * square);
    return {(square - dimension) * gaussian, (dimension + 2.0 - square) * gaussian};
}

}  // namespace palpate
