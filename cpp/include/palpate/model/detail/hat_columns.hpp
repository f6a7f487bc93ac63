// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "palpate/model/continuation.hpp"

namespace palpate {

/// Quantity of a sum of wavelets that one call computes for many positions: force, slope or antiderivative.
enum class HatQuantity : std::uint8_t { Force, Slope, Integral };

namespace detail {

/// Distance |u| from the centre above which a Mexican hat is below 1e-300. With |u| limited to it, e^{-u^2/2} is a
/// normal floating-point number.
inline constexpr double hat_reach = 37.4;

/// Parameters of `count` Mexican hats of one input, one column for each parameter. A column has `size` entries; those
/// from `count` on have weight zero.
struct HatColumns {
    std::size_t count, size;
    const double *alpha, *beta, *weight;
    /// Products w alpha, w / alpha and w / alpha^2 for each wavelet (weight w, dilation alpha)
    const double *weight_by_width, *weight_width, *weight_width_squared;
};

/// Parameters of radial Mexican hats of several inputs, and the box to which inputs are limited. `alpha` and `beta`
/// have one column of `size` entries for each input. Unused entries have weight zero.
struct RadialColumns {
    std::size_t dimension, size;
    const double *alpha, *beta, *weight;
    /// Result of `uncancelled_weights`: numbers that replace the weights in the bounds of fourth derivatives
    const double* uncancelled;
    const double *lower, *upper;

    /// Returns coordinate j of the point in the box from `lower` to `upper` that is nearest to x.
    [[nodiscard]] double projected(const double* x, std::size_t j) const noexcept {
        return x[j] < lower[j] ? lower[j] : x[j] > upper[j] ? upper[j] : x[j];
    }
};

/// Decay of a bound of the fourth derivative D^4 psi with the distance r from the centre: |D^4 psi(a, b, c, e)| <= 3 (d
/// + 4) e^{-0.22 r^2} for any unit vectors. The radial Mexican hat psi of d inputs is the Laplacian of a Gaussian E =
/// e^{-r^2/2}. With x along a direction and y across it, the fourth derivative along this direction is (He_6(x) +
/// He_4(x) (|y|^2 - d + 1)) E with Hermite polynomials He. Multiplied by e^{0.22 r^2}, each factor is largest at 0. A
/// symmetric form such as D^4 psi is largest for four equal vectors.
inline constexpr double fourth_derivative_decay = 0.22;

/// Returns 3 (d + 4), the largest fourth derivative of the radial Mexican hat of d inputs.
[[nodiscard]] constexpr double fourth_derivative_supremum(std::size_t dimension) noexcept {
    return 3.0 * static_cast<double>(dimension + 4);
}

/// Taylor's formula about the middle of a box for a sum of radial Mexican hats psi. Distances along an input are
/// divided by half the width of the box along this input. `rest` is a bound of the fourth-order term: rest_j = sum over
/// the wavelets of w B |s|^2 s_j^2. Here s_j is the dilation times half the width of the box along input j, B is a
/// bound of |D^4 psi| at the wavelet's smallest distance from the box, and w is its `uncancelled` weight.
struct RadialExpansion {
    RadialExpansion(std::size_t d, std::size_t size)
        : gradient(d),
          second_derivative(d * d),
          third_derivative(d * d * d),
          rest(d),
          workspace((2 * d + 4) * size + d * d) {}

    double value = 0.0;
    std::vector<double> gradient;  ///< gradient of the sum in the middle of the box, d numbers
    /// Second derivatives of the sum in the middle of the box, d x d numbers
    std::vector<double> second_derivative;
    /// Third derivatives of the sum in the middle of the box, d x d x d numbers
    std::vector<double> third_derivative;
    /// Bound of the fourth-order term of Taylor's formula for each input, d numbers
    std::vector<double> rest;
    std::vector<double> workspace;  ///< memory for the intermediate results of `expansion`
};

/// Functions that compute sums of Mexican hat wavelets, compiled for one instruction set of the processor.
struct HatKernel {
    int lanes;  ///< doubles in a register
    void (*at)(const HatColumns& of, double x, Curve& sum) noexcept;
    /// Functions that compute the sum of the wavelets at many positions, one function for each `HatQuantity`
    std::array<void (*)(const HatColumns& of, const double* x, std::size_t n, double* sum) noexcept, 3> batch;
    void (*radial)(const RadialColumns& of, const double* x, double& value, double* gradient) noexcept;
    void (*expansion)(const RadialColumns& of, const double* middle, const double* radius,
                      RadialExpansion& sums) noexcept;
    void (*gaussians)(const double* square, std::size_t n, double* e) noexcept;
};

}  // namespace detail

}  // namespace palpate
