// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "palpate/model/detail/hat_columns.hpp"
#include "palpate/model/wavelet.hpp"

/// Functions that compute sums of Mexican hat wavelets by plain loops, for any processor and compiler.
namespace palpate::detail::plain {

inline void at(const HatColumns& of, double x, Curve& sum) noexcept {
    for (std::size_t i = 0; i < of.count; ++i) {
        const MexicanHat psi = mexican_hat(of.alpha[i] * (x - of.beta[i]));
        sum.value += of.weight[i] * psi.value;
        sum.slope += of.weight_by_width[i] * psi.slope;
        sum.integral += of.weight_width[i] * psi.integral;
        sum.double_integral += of.weight_width_squared[i] * psi.double_integral;
    }
}

template <double Curve::* member>
void batch(const HatColumns& of, const double* x, std::size_t n, double* sum) noexcept {
    for (std::size_t k = 0; k < n; ++k) {
        Curve curve;
        at(of, x[k], curve);
        sum[k] += curve.*member;
    }
}

inline void radial(const RadialColumns& of, const double* x, double& value, double* gradient) noexcept {
    const auto inputs = static_cast<double>(of.dimension);
    for (std::size_t i = 0; i < of.size; ++i) {
        const auto scaled = [&](std::size_t j) {
            const std::size_t at = j * of.size + i;
            return std::clamp(of.alpha[at] * (of.projected(x, j) - of.beta[at]), -hat_reach, hat_reach);
        };
        double square = 0.0;
        for (std::size_t j = 0; j < of.dimension; ++j) {
            square += scaled(j) * scaled(j);
        }
        const RadialMexicanHat psi = radial_mexican_hat(square, inputs);
        value += of.weight[i] * psi.value;
        for (std::size_t j = 0; gradient != nullptr && j < of.dimension; ++j) {
            gradient[j] += of.weight[i] * psi.gradient_over_u * of.alpha[j * of.size + i] * scaled(j);
        }
    }
}

inline void expansion(const RadialColumns& of, const double* middle, const double* radius,
                      RadialExpansion& sums) noexcept {
    const std::size_t d = of.dimension;
    const auto inputs = static_cast<double>(d);
    double* const u = sums.workspace.data();
    double* const scale = u + d;
    sums.value = 0.0;
    for (auto* all : {&sums.gradient, &sums.second_derivative, &sums.third_derivative, &sums.rest}) {
        std::fill(all->begin(), all->end(), 0.0);
    }
    for (std::size_t i = 0; i < of.size; ++i) {
        double square = 0.0;
        double least = 0.0;
        double spread = 0.0;
        for (std::size_t j = 0; j < d; ++j) {
            scale[j] = of.alpha[j * of.size + i] * radius[j];
            u[j] = std::clamp(of.alpha[j * of.size + i] * (middle[j] - of.beta[j * of.size + i]), -hat_reach,
                              hat_reach);
            const double near = std::max(std::abs(u[j]) - scale[j], 0.0);
            square += u[j] * u[j];
            least += near * near;
            spread += scale[j] * scale[j];
        }
        // Derivatives of the radial Mexican hat psi at u, with A_n = (d + n - r^2) E, r = |u| and E = e^{-r^2/2}: psi =
        // -A_0, D psi = A_2 u, D^2 psi = A_2 I - A_4 u u'. D^3 psi is A_6 u u u minus A_4 u_j for each pair of equal
        // other indices.
        const double factor = of.weight[i] * std::exp(-0.5 * std::min(square, hat_reach * hat_reach));
        const double first = (inputs + 2.0 - square) * factor;
        const double second = (inputs + 4.0 - square) * factor;
        const double third = (inputs + 6.0 - square) * factor;
        const double beyond = fourth_derivative_supremum(d) *
                              std::exp(-fourth_derivative_decay * std::min(least, hat_reach * hat_reach));
        sums.value += (square - inputs) * factor;
        for (std::size_t j = 0; j < d; ++j) {
            sums.gradient[j] += first * u[j] * scale[j];
            sums.rest[j] += of.uncancelled[i] * beyond * spread * scale[j] * scale[j];
            for (std::size_t k = 0; k < d; ++k) {
                const double by_two = scale[j] * scale[k];
                sums.second_derivative[j * d + k] += by_two * ((j == k ? first : 0.0) - second * u[j] * u[k]);
                for (std::size_t l = 0; l < d; ++l) {
                    const double mixed =
                        (j == k ? u[l] : 0.0) + (j == l ? u[k] : 0.0) + (k == l ? u[j] : 0.0);
                    sums.third_derivative[(j * d + k) * d + l] +=
                        by_two * scale[l] * (third * u[j] * u[k] * u[l] - second * mixed);
                }
            }
        }
    }
}

inline void gaussians(const double* square, std::size_t n, double* e) noexcept {
    for (std::size_t k = 0; k < n; ++k) {
        e[k] = std::exp(-0.5 * std::min(square[k], hat_reach * hat_reach));
    }
}

[[nodiscard]] inline HatKernel kernel() noexcept {
    return {1,      at,        {batch<&Curve::value>, batch<&Curve::slope>, batch<&Curve::integral>},
            radial, expansion, gaussians};
}

}  // namespace palpate::detail::plain
