// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include "palpate/model/hat_sum.hpp"
#include "palpate/model/parameters.hpp"

namespace palpate {

/// The sum of the wavelets of a network of any number of inputs, at projections onto a box: one vectorised
/// exponential a wavelet, by the widest instructions that the machine has.
class RadialSum {
  public:
    RadialSum(const NetworkParameters& network, std::span<const double> lower, std::span<const double> upper,
              const detail::HatKernel& kernel = detail::hat_kernel())
        : kernel_{kernel},
          dimension_{network.dimension},
          size_{(network.weight.size() + 7) / 8 * 8},
          columns_((2 * dimension_ + 1) * size_, 0.0),
          box_{lower.begin(), lower.end()} {
        box_.insert(box_.end(), upper.begin(), upper.end());
        const std::size_t d = dimension_;
        std::fill_n(columns_.begin(), d * size_, 1.0);
        for (std::size_t i = 0; i < network.weight.size(); ++i) {
            for (std::size_t j = 0; j < d; ++j) {
                columns_[j * size_ + i] = network.alpha[i * d + j];
                columns_[(d + j) * size_ + i] = network.beta[i * d + j];
            }
            columns_[2 * d * size_ + i] = network.weight[i];
        }
    }

    /// Adds the sum at the projection of x to `value`, and its gradient, unless that is null, to `gradient`.
    void add(const double* x, double& value, double* gradient) const noexcept {
        kernel_.radial(columns(), x, value, gradient);
    }

    /// Taylor's formula about the middle of a box.
    void expand(const double* middle, const double* radius, detail::RadialExpansion& sums) const noexcept {
        kernel_.expansion(columns(), middle, radius, sums);
    }

    /// What `expand` fills.
    [[nodiscard]] detail::RadialExpansion expansion() const { return {dimension_, size_}; }

  private:
    [[nodiscard]] detail::RadialColumns columns() const noexcept {
        const double* first = columns_.data();
        return {dimension_,
                size_,
                first,
                first + dimension_ * size_,
                first + 2 * dimension_ * size_,
                box_.data(),
                box_.data() + dimension_};
    }

    detail::HatKernel kernel_;
    std::size_t dimension_;
    std::size_t size_;
    std::vector<double> columns_;
    std::vector<double> box_;  ///< lower, upper
};

}  // namespace palpate
