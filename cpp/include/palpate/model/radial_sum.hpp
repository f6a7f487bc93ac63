// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "palpate/model/hat_sum.hpp"
#include "palpate/model/parameters.hpp"

namespace palpate {

namespace detail {

/// Bound of (|D^5 psi| max(r, 1) + 4 |D^4 psi|) e^{0.24 r^2} divided by `fourth_derivative_supremum`, where D^n psi is
/// derivative n of the radial Mexican hat psi at the distance r from its centre.
inline constexpr double fourth_derivative_change = 16.8;

/// Returns the numbers that replace the absolute weights |w_i| of the wavelets in bounds of fourth derivatives. Two
/// wavelets with weights of opposite sign and almost equal shape cancel each other almost completely. The remainder
/// depends on their difference delta: the largest relative difference of their dilations plus the sum of dilation
/// |difference of their translations|. From one wavelet to the other, the fourth derivative D^4 psi(t, t, t, t) along a
/// vector t changes by at most (|D^5 psi| max(r, 1) + 4 |D^4 psi|) |t|^4 delta, at the distance r from the centre. For
/// delta <= 0.02 the changes of r, t and the dilations add at most a tenth, with the decay e^{-0.22 r^2}.
[[nodiscard]] inline std::vector<double> uncancelled_weights(const NetworkParameters& network) {
    constexpr double near = 0.02;
    constexpr double change = 1.11 * fourth_derivative_change;
    const std::size_t d = network.dimension;
    std::vector<double> merged = network.weight;
    std::vector<double> residual(merged.size(), 0.0);
    const auto distance = [&](std::size_t one, std::size_t other) {
        double by_alpha = 0.0;
        double by_beta = 0.0;
        for (std::size_t j = 0; j < d; ++j) {
            const double alpha = network.alpha[one * d + j];
            const double other_alpha = network.alpha[other * d + j];
            by_alpha = std::max(by_alpha, std::abs(other_alpha - alpha) / std::min(other_alpha, alpha));
            by_beta += alpha * std::abs(network.beta[other * d + j] - network.beta[one * d + j]);
        }
        return by_alpha + by_beta;
    };
    for (std::size_t i = 0; i < merged.size(); ++i) {
        const double weight = merged[i];
        for (std::size_t first = 0; first < i && merged[i] != 0.0; ++first) {
            const double cancelled =
                std::abs(merged[first]) + std::abs(weight) - std::abs(merged[first] + weight);
            if (cancelled <= 0.0) {
                continue;
            }
            const double delta = distance(first, i);
            const double left = change * std::abs(weight) * delta;
            if (delta <= near && left < cancelled) {
                merged[first] += weight;
                residual[first] += left;
                merged[i] = 0.0;
            }
        }
    }
    for (std::size_t i = 0; i < merged.size(); ++i) {
        merged[i] = std::abs(merged[i]) + residual[i];
    }
    return merged;
}

}  // namespace detail

/// The sum of the wavelets of a network of any number of inputs, evaluated at the point of a box that is nearest to the
/// input. Computes one vectorised exponential for each wavelet, with the widest registers of the processor.
class RadialSum {
  public:
    RadialSum(const NetworkParameters& network, std::span<const double> lower, std::span<const double> upper,
              const detail::HatKernel& kernel = detail::hat_kernel())
        : kernel_{kernel},
          dimension_{network.dimension},
          size_{(network.weight.size() + 7) / 8 * 8},
          columns_((2 * dimension_ + 2) * size_, 0.0),
          box_{lower.begin(), lower.end()} {
        box_.insert(box_.end(), upper.begin(), upper.end());
        const std::size_t d = dimension_;
        for (std::size_t i = 0; i < network.weight.size(); ++i) {
            for (std::size_t j = 0; j < d; ++j) {
                columns_[j * size_ + i] = network.alpha[i * d + j];
                columns_[(d + j) * size_ + i] = network.beta[i * d + j];
            }
            columns_[2 * d * size_ + i] = network.weight[i];
        }
        const std::vector<double> uncancelled = detail::uncancelled_weights(network);
        std::copy(uncancelled.begin(), uncancelled.end(),
                  columns_.end() - static_cast<std::ptrdiff_t>(size_));
    }

    /// Adds the sum of the wavelets, at the point of the box nearest to x, to `value`, and the gradient of the sum to
    /// `gradient` unless `gradient` is null.
    void add(const double* x, double& value, double* gradient) const noexcept {
        kernel_.radial(columns(), x, value, gradient);
    }

    /// Computes the terms of Taylor's formula about the middle of a box for the sum of the wavelets: value, derivatives
    /// and a bound of the remainder.
    void expand(const double* middle, const double* radius, detail::RadialExpansion& sums) const noexcept {
        kernel_.expansion(columns(), middle, radius, sums);
    }

    /// Returns memory for the terms of Taylor's formula that `expand` computes.
    [[nodiscard]] detail::RadialExpansion expansion() const { return {dimension_, size_}; }

  private:
    [[nodiscard]] detail::RadialColumns columns() const noexcept {
        const double* first = columns_.data();
        return {dimension_,
                size_,
                first,
                first + dimension_ * size_,
                first + 2 * dimension_ * size_,
                first + (2 * dimension_ + 1) * size_,
                box_.data(),
                box_.data() + dimension_};
    }

    detail::HatKernel kernel_;
    std::size_t dimension_;
    std::size_t size_;
    std::vector<double> columns_;
    std::vector<double> box_;  ///< lower end of the box for each input, then upper end for each input
};

}  // namespace palpate
