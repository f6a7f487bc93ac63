// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "palpate/model/continuation.hpp"

namespace palpate {

/// Quantity that is computed for many positions in one call.
enum class HatQuantity : std::uint8_t { Value, Slope, Integral };

namespace detail {

/// |u| from which a hat is below 1e-300. The limit keeps e^{-u^2/2} a normal number.
inline constexpr double hat_reach = 37.4;

/// Parameters of hats, column by column. Entries from `count` to `size` have weight zero.
struct HatColumns {
    std::size_t count, size;
    const double *alpha, *beta, *weight;
    const double *weight_by_width, *weight_width, *weight_width_squared;  ///< w alpha, w / alpha, w / alpha^2
};

/// Parameters of radial hats of several inputs, input by input and each column by column, and the box of their data.
/// Padded like `HatColumns`.
struct RadialColumns {
    std::size_t dimension, size;
    const double *alpha, *beta, *weight;
    const double* uncancelled;  ///< replaces |weight| in the remainder of an expansion
    const double *lower, *upper;

    /// Returns component j of the projection of x onto the box.
    [[nodiscard]] double projected(const double* x, std::size_t j) const noexcept {
        return x[j] < lower[j] ? lower[j] : x[j] > upper[j] ? upper[j] : x[j];
    }
};

/// Decay of the bound of the fourth derivative. The radial hat of d inputs is the Laplacian of a Gaussian. With x along
/// a direction and y across it, its fourth derivative along that direction is (He_6(x) + He_4(x) (|y|^2 - d + 1)) E.
/// Multiplied by e^{0.22 r^2}, each factor is largest at 0. A symmetric form is largest for equal vectors. At a
/// distance r from the centre therefore |D^4 psi(a, b, c, e)| <= 3 (d + 4) e^{-0.22 r^2} for any unit vectors.
inline constexpr double fourth_derivative_decay = 0.22;

/// Returns the factor 3 (d + 4) of that bound.
[[nodiscard]] constexpr double fourth_derivative_supremum(std::size_t dimension) noexcept {
    return 3.0 * static_cast<double>(dimension + 4);
}

/// Taylor's formula about the middle of a box for a sum of radial hats. Distances along an input are divided by the
/// box's radius along it. `rest` bounds the fourth order: rest_j = sum w B |s|^2 s_j^2, where s_j is a wavelet's
/// dilation times the radius, B bounds |D^4 psi| at the wavelet's least distance, and w are the uncancelled weights.
struct RadialExpansion {
    RadialExpansion(std::size_t d, std::size_t size)
        : gradient(d),
          second_derivative(d * d),
          third_derivative(d * d * d),
          rest(d),
          workspace((2 * d + 4) * size + d * d) {}

    double value = 0.0;
    std::vector<double> gradient;           ///< d
    std::vector<double> second_derivative;  ///< d x d second derivatives
    std::vector<double> third_derivative;   ///< d x d x d third derivatives
    std::vector<double> rest;               ///< d
    std::vector<double> workspace;          ///< working memory of the kernel
};

/// Functions that one instruction set implements.
struct HatKernel {
    void (*at)(const HatColumns& of, double x, Curve& sum) noexcept;
    std::array<void (*)(const HatColumns& of, const double* x, std::size_t n, double* sum) noexcept, 3>
        batch;  ///< one function for each `HatQuantity`
    void (*radial)(const RadialColumns& of, const double* x, double& value, double* gradient) noexcept;
    void (*expansion)(const RadialColumns& of, const double* middle, const double* radius,
                      RadialExpansion& sums) noexcept;
    void (*gaussians)(const double* square, std::size_t n, double* e) noexcept;
};

}  // namespace detail

}  // namespace palpate
