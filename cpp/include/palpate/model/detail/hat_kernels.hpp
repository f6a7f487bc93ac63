// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "palpate/inline.hpp"
#include "palpate/model/detail/hat_columns.hpp"
#include "palpate/model/detail/plain_hats.hpp"
#include "palpate/model/hat_sum.hpp"

namespace palpate::detail {

/// Coefficients of a polynomial that approximates e^r for |r| <= ln 2 / 2, interpolated at the Chebyshev nodes; largest
/// error 2e-17.
inline constexpr std::array<double, 12> exponential{
    0x1.0000000000000p+0,  0x1.0000000000000p+0,  0x1.0000000000011p-1,  0x1.555555555555ap-3,
    0x1.555555554f0bap-5,  0x1.111111110f21ep-7,  0x1.6c16c1880029fp-10, 0x1.a01a01b1461c5p-13,
    0x1.a01991a10d9aep-16, 0x1.71ddf56d8deb5p-19, 0x1.28b4101c77212p-22, 0x1.af632a0f7e2cep-26};

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

#endif

PALPATE_INLINE std::vector<HatKernel> usable_hat_kernels() {
    std::vector<HatKernel> kernels{plain::kernel()};
#if defined(__GNUC__) && defined(__x86_64__)
    __builtin_cpu_init();
    kernels.push_back(sse2::kernel());
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
        kernels.push_back(avx2::kernel());
    }
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512vl")) {
        kernels.push_back(avx512::kernel());
    }
#endif
    return kernels;
}

}  // namespace palpate::detail
