// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "palpate/model/continuation.hpp"
#include "palpate/model/parameters.hpp"
#include "palpate/model/wavelet.hpp"

namespace palpate {

/// What many positions may be asked for at once.
enum class HatQuantity : std::uint8_t { Value, Slope, Integral };

namespace detail {

/// Beyond this |u| a hat is below 1e-300. It keeps e^{-u^2/2} a normal number.
inline constexpr double hat_reach = 37.4;

/// e^r for |r| <= ln 2 / 2 as a polynomial, interpolated at the Chebyshev nodes: right to 2e-17.
inline constexpr std::array<double, 12> exponential{
    0x1.0000000000000p+0,  0x1.0000000000000p+0,  0x1.0000000000011p-1,  0x1.555555555555ap-3,
    0x1.555555554f0bap-5,  0x1.111111110f21ep-7,  0x1.6c16c1880029fp-10, 0x1.a01a01b1461c5p-13,
    0x1.a01991a10d9aep-16, 0x1.71ddf56d8deb5p-19, 0x1.28b4101c77212p-22, 0x1.af632a0f7e2cep-26};

/// Parameters column by column. Beyond `count` wavelets, up to `size`, their weights are zero.
struct HatColumns {
    std::size_t count, size;
    const double *alpha, *beta, *weight;
    const double *weight_by_width, *weight_width, *weight_width_squared;  ///< w alpha, w / alpha, w / alpha^2
};

/// Radial hats of several inputs, input by input and each column by column, and the box of their data. Padded as
/// above.
struct RadialColumns {
    std::size_t dimension, size;
    const double *alpha, *beta, *weight;
    const double *lower, *upper;

    /// One component of the projection of x onto the box.
    [[nodiscard]] double projected(const double* x, std::size_t j) const noexcept {
        return x[j] < lower[j] ? lower[j] : x[j] > upper[j] ? upper[j] : x[j];
    }
};

/// The functions of one instruction set.
struct HatKernel {
    void (*at)(const HatColumns& of, double x, Curve& sum) noexcept;
    std::array<void (*)(const HatColumns& of, const double* x, std::size_t n, double* sum) noexcept, 3>
        batch;  ///< by quantity
    void (*radial)(const RadialColumns& of, const double* x, double& value, double* gradient) noexcept;
    void (*gaussians)(const double* square, std::size_t n, double* e) noexcept;
};

#if defined(__GNUC__) && defined(__x86_64__)

#define PALPATE_KERNEL sse2
#define PALPATE_LANES 2
#define PALPATE_TARGET
#include "palpate/model/detail/hat_kernel.hpp"
#undef PALPATE_KERNEL
#undef PALPATE_LANES
#undef PALPATE_TARGET

#define PALPATE_KERNEL avx2
#define PALPATE_LANES 4
#define PALPATE_TARGET __attribute__((target("avx2,fma")))
#include "palpate/model/detail/hat_kernel.hpp"
#undef PALPATE_KERNEL
#undef PALPATE_LANES
#undef PALPATE_TARGET

#define PALPATE_KERNEL avx512
#define PALPATE_LANES 8
#define PALPATE_TARGET __attribute__((target("avx512f,avx512dq,avx512vl,avx2,fma")))
#include "palpate/model/detail/hat_kernel.hpp"
#undef PALPATE_KERNEL
#undef PALPATE_LANES
#undef PALPATE_TARGET

/// Every kernel that this machine can run, the widest last.
[[nodiscard]] inline std::vector<HatKernel> usable_hat_kernels() {
    __builtin_cpu_init();
    std::vector<HatKernel> kernels{sse2::kernel()};
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
        kernels.push_back(avx2::kernel());
    }
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512vl")) {
        kernels.push_back(avx512::kernel());
    }
    return kernels;
}

#else

/// Elsewhere: plain loops.
namespace plain {

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
        Curve here;
        at(of, x[k], here);
        sum[k] += here.*member;
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

inline void gaussians(const double* square, std::size_t n, double* e) noexcept {
    for (std::size_t k = 0; k < n; ++k) {
        e[k] = std::exp(-0.5 * std::min(square[k], hat_reach * hat_reach));
    }
}

}  // namespace plain

[[nodiscard]] inline std::vector<HatKernel> usable_hat_kernels() {
    return {{plain::at,
             {plain::batch<&Curve::value>, plain::batch<&Curve::slope>, plain::batch<&Curve::integral>},
             plain::radial,
             plain::gaussians}};
}

#endif

/// The widest kernel of this machine, chosen once.
[[nodiscard]] inline const HatKernel& hat_kernel() {
    static const HatKernel kernel = usable_hat_kernels().back();
    return kernel;
}

}  // namespace detail

/// The sum of the wavelets of a network of one input, w_i psi(alpha_i (x - beta_i)), with its derivative and
/// antiderivatives: one vectorised exponential a wavelet, by the widest instructions that the machine has.
/// Any x is safe: far away a hat is below 1e-300, NaN gives NaN.
class HatSum {
  public:
    explicit HatSum(const NetworkParameters& network, const detail::HatKernel& kernel = detail::hat_kernel())
        : kernel_{kernel}, count_{network.weight.size()}, size_{(count_ + 7) / 8 * 8} {
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
    }

    /// Adds the sums at x.
    void add(double x, Curve& sum) const noexcept { kernel_.at(columns(), x, sum); }

    /// Adds one of the sums at every x; both spans have the same size.
    void add(HatQuantity quantity, std::span<const double> x, std::span<double> sum) const noexcept {
        kernel_.batch[static_cast<std::size_t>(quantity)](columns(), x.data(), x.size(), sum.data());
    }

  private:
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
};

}  // namespace palpate
