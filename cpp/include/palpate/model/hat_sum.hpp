// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "palpate/inline.hpp"
#include "palpate/model/continuation.hpp"
#include "palpate/model/detail/hat_columns.hpp"
#include "palpate/model/parameters.hpp"

namespace palpate {

namespace detail {

/// Returns the functions for sums of wavelets of every instruction set that this processor supports, in the order of
/// the register width; the widest is last.
[[nodiscard]] PALPATE_INLINE std::vector<HatKernel> usable_hat_kernels();

/// Returns the functions that compute sums of wavelets with the widest vector registers of this processor. The
/// processor is examined only at the first call.
[[nodiscard]] inline const HatKernel& hat_kernel() {
    static const HatKernel kernel = usable_hat_kernels().back();
    return kernel;
}

}  // namespace detail

/// The sum of the wavelets of a network of one input, w_i psi(alpha_i (x - beta_i)), with its derivative and
/// antiderivatives. Computes one vectorised exponential for each wavelet, with the widest registers of the processor,
/// and one sine and cosine for each harmonic. Any position x is allowed: a distant wavelet adds less than rounding, and
/// NaN gives NaN.
class HatSum {
  public:
    explicit HatSum(const NetworkParameters& network, const detail::HatKernel& kernel = detail::hat_kernel())
        : kernel_{kernel}, count_{network.hats()}, size_{(count_ + 7) / 8 * 8} {
        columns_.assign(6 * size_, 0.0);
        std::fill_n(columns_.begin(), size_, 1.0);
        for (std::size_t i = 0; i < count_; ++i) {
            const double alpha = network.alpha[i];
            const double weight = network.weight[i];
            const std::array values{alpha,          network.beta[i], weight,
                                    weight * alpha, weight / alpha,  weight / alpha / alpha};
            for (std::size_t j = 0; j < values.size(); ++j) {
                columns_[j * size_ + i] = values[j];
            }
        }
        for (std::size_t i = count_; i < network.weight.size(); ++i) {
            harmonics_.push_back({network.alpha[i], network.beta[i], network.weight[i]});
        }
    }

    /// Adds value, derivative and antiderivatives of the sum of all wavelets at position x to `sum`.
    void add(double x, Curve& sum) const noexcept {
        kernel_.at(columns(), x, sum);
        for (const Harmonic& each : harmonics_) {
            const double u = each.alpha * (x - each.beta);
            const double cosine = each.weight * std::cos(u);
            const double sine = each.weight * std::sin(u);
            sum.value += cosine;
            sum.slope -= each.alpha * sine;
            sum.integral += sine / each.alpha;
            sum.double_integral -= cosine / each.alpha / each.alpha;
        }
    }

    /// Adds the wavelets' value, derivative or antiderivative at every position in `x` to the element of `sum` with the
    /// same index. Both spans have the same size.
    void add(HatQuantity quantity, std::span<const double> x, std::span<double> sum) const noexcept {
        kernel_.batch[static_cast<std::size_t>(quantity)](columns(), x.data(), x.size(), sum.data());
        for (const Harmonic& each : harmonics_) {
            for (std::size_t k = 0; k < x.size(); ++k) {
                const double u = each.alpha * (x[k] - each.beta);
                sum[k] += each.weight * (quantity == HatQuantity::Force   ? std::cos(u)
                                         : quantity == HatQuantity::Slope ? -each.alpha * std::sin(u)
                                                                          : std::sin(u) / each.alpha);
            }
        }
    }

  private:
    struct Harmonic {
        double alpha, beta, weight;
    };

    [[nodiscard]] detail::HatColumns columns() const noexcept {
        const double* first = columns_.data();
        return {count_,
                size_,
                first,
                first + size_,
                first + 2 * size_,
                first + 3 * size_,
                first + 4 * size_,
                first + 5 * size_};
    }

    detail::HatKernel kernel_;
    std::size_t count_;
    std::size_t size_;
    std::vector<double> columns_;
    std::vector<Harmonic> harmonics_;
};

}  // namespace palpate

#ifndef PALPATE_COMPILED
#include "palpate/model/detail/hat_kernels.hpp"
#endif
