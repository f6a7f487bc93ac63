// SPDX-License-Identifier: Apache-2.0
// Sums of Mexican hats for one instruction set. hat_kernels.hpp includes this file once for each instruction set, with
// PALPATE_KERNEL the namespace, PALPATE_LANES doubles in a register, PALPATE_TARGET a function attribute. The file has
// no include guard, because it is included several times. Every function with vectors has the attribute PALPATE_TARGET,
// because otherwise the compiler does not keep its vectors in registers of PALPATE_LANES doubles.

namespace PALPATE_KERNEL {

using Lanes = double __attribute__((vector_size(8 * PALPATE_LANES)));
using Integers = std::int64_t __attribute__((vector_size(8 * PALPATE_LANES)));

PALPATE_TARGET inline void load(Lanes& lanes, const double* from) noexcept {
    __builtin_memcpy(&lanes, from, sizeof(Lanes));
}

/// Computes the Gaussian e^{-s/2} of a squared distance 0 <= s <= hat_reach^2 without branches, as 2^n e^r with an
/// integer n and |r| <= ln 2 / 2. A polynomial approximates e^r. NaN stays NaN.
PALPATE_TARGET inline void gaussian_within(const Lanes& square, Lanes& e) noexcept {
    const Lanes exponent = -0.5 * square;
    const Lanes rounded = exponent * 0x1.71547652b82fep+0 + 0x1.8p52;  // log2(e)
    const Lanes n = rounded - 0x1.8p52;
    // ln 2 is written as a sum of two numbers. The first number has so few digits that its product with n is exact.
    const Lanes r = (exponent - n * 6.93147180369123816490e-01) - n * 1.90821492927058770002e-10;
    const Lanes r2 = r * r;
    const Lanes r4 = r2 * r2;
    const auto& c = exponential;
    const Lanes low = (c[0] + c[1] * r) + (c[2] + c[3] * r) * r2;
    const Lanes middle = (c[4] + c[5] * r) + (c[6] + c[7] * r) * r2;
    const Lanes high = (c[8] + c[9] * r) + (c[10] + c[11] * r) * r2;
    // The low bits of `rounded` contain the integer n. n is at least -1010, so 2^n is a normal floating-point number.
    Integers bits;
    __builtin_memcpy(&bits, &rounded, sizeof(bits));
    bits = (bits << 52) + 0x3ff0000000000000;
    Lanes power;
    __builtin_memcpy(&power, &bits, sizeof(power));
    e = (low + (middle + high * r4) * r4) * power;
}

/// Computes the Gaussian e^{-s/2} of any squared distance s >= 0; an s above hat_reach^2 is replaced by hat_reach^2.
PALPATE_TARGET inline void gaussian(Lanes& square, Lanes& e) noexcept {
    const Lanes farthest = Lanes{} + hat_reach * hat_reach;
    square = square > farthest ? farthest : square;
    gaussian_within(square, e);
}

/// Limits the distance u to +-hat_reach and computes the square of u and the Gaussian e^{-u^2/2}.
PALPATE_TARGET inline void gaussian(Lanes& u, Lanes& square, Lanes& e) noexcept {
    const Lanes reach = Lanes{} + hat_reach;
    u = u > reach ? reach : u;
    u = u < -reach ? -reach : u;
    square = u * u;
    gaussian_within(square, e);
}

/// Returns the sum of the doubles in a vector register.
PALPATE_TARGET inline double total(const Lanes& lanes) noexcept {
    double sums[PALPATE_LANES];
    __builtin_memcpy(sums, &lanes, sizeof(sums));
    for (int half = PALPATE_LANES / 2; half > 0; half /= 2) {
        for (int k = 0; k < half; ++k) {
            sums[k] += sums[k + half];
        }
    }
    return sums[0];
}

/// Adds value, slope and antiderivatives of all wavelets at one position x. Each iteration computes PALPATE_LANES
/// wavelets, one in each element of a register.
PALPATE_TARGET inline void at(const HatColumns& of, double x, Curve& sum) noexcept {
    Lanes value{};
    Lanes slope{};
    Lanes integral{};
    Lanes double_integral{};
    for (std::size_t i = 0; i < of.size; i += PALPATE_LANES) {
        Lanes alpha, beta, weight, weight_by_width, weight_width, weight_width_squared, square, e;
        load(alpha, of.alpha + i);
        load(beta, of.beta + i);
        load(weight, of.weight + i);
        load(weight_by_width, of.weight_by_width + i);
        load(weight_width, of.weight_width + i);
        load(weight_width_squared, of.weight_width_squared + i);
        Lanes u = alpha * (x - beta);
        gaussian(u, square, e);
        const Lanes ue = u * e;
        value += weight * ((square - 1.0) * e);
        slope += weight_by_width * ((3.0 - square) * ue);
        integral -= weight_width * ue;
        double_integral += weight_width_squared * e;
    }
    sum.value += total(value);
    sum.slope += total(slope);
    sum.integral += total(integral);
    sum.double_integral += total(double_integral);
}

/// Adds value, slope or antiderivative of all wavelets at each position in one vector register.
template <HatQuantity quantity>
PALPATE_TARGET inline void sum_at(const HatColumns& of, const Lanes& position, Lanes& sum) noexcept {
    for (std::size_t i = 0; i < of.count; ++i) {
        Lanes u = of.alpha[i] * (position - of.beta[i]);
        Lanes square, e;
        if constexpr (quantity == HatQuantity::Force) {
            square = u * u;
            gaussian(square, e);
            sum += of.weight[i] * ((square - 1.0) * e);
        } else if constexpr (quantity == HatQuantity::Slope) {
            gaussian(u, square, e);
            sum += of.weight_by_width[i] * ((3.0 - square) * (u * e));
        } else {
            gaussian(u, square, e);
            sum -= of.weight_width[i] * (u * e);
        }
    }
}

/// Adds value, slope or antiderivative of all wavelets at n positions to the n elements of `sum`.
template <HatQuantity quantity>
PALPATE_TARGET void batch(const HatColumns& of, const double* x, std::size_t n, double* sum) noexcept {
    Lanes position, total;
    std::size_t k = 0;
    for (; k + PALPATE_LANES <= n; k += PALPATE_LANES) {
        load(position, x + k);
        load(total, sum + k);
        sum_at<quantity>(of, position, total);
        __builtin_memcpy(sum + k, &total, sizeof(total));
    }
    double rest[2][PALPATE_LANES] = {};
    for (std::size_t j = 0; k + j < n; ++j) {
        rest[0][j] = x[k + j];
        rest[1][j] = sum[k + j];
    }
    load(position, rest[0]);
    load(total, rest[1]);
    sum_at<quantity>(of, position, total);
    for (std::size_t j = 0; k + j < n; ++j) {
        sum[k + j] = total[j];
    }
}

/// Adds the sum of radial Mexican hats of several inputs to `value`, and its gradient to `gradient` unless `gradient`
/// is null. The sum is computed at the point of the box that is nearest to x.
PALPATE_TARGET inline void radial(const RadialColumns& of, const double* x, double& value,
                                  double* gradient) noexcept {
    // Number of wavelets that are computed together: a multiple of the count of numbers in a vector register
    constexpr std::size_t block = 64;
    const auto inputs = static_cast<double>(of.dimension);
    const Lanes reach = Lanes{} + hat_reach;
    // Factor w (d + 2 - r^2) E of each wavelet; factor times scaled distance u from the centre is the gradient by u
    double factors[block];
    Lanes values{};
    for (std::size_t first = 0; first < of.size; first += block) {
        const std::size_t count = of.size - first < block ? of.size - first : block;
        for (std::size_t k = 0; k < count; k += PALPATE_LANES) {
            Lanes square{};
            Lanes weight, e;
            for (std::size_t j = 0; j < of.dimension; ++j) {
                Lanes alpha, beta;
                load(alpha, of.alpha + j * of.size + first + k);
                load(beta, of.beta + j * of.size + first + k);
                const Lanes u = alpha * (of.projected(x, j) - beta);
                square += u * u;
            }
            gaussian(square, e);
            load(weight, of.weight + first + k);
            const Lanes weighted = weight * e;
            values += (square - inputs) * weighted;
            const Lanes factor = (inputs + 2.0 - square) * weighted;
            __builtin_memcpy(factors + k, &factor, sizeof(factor));
        }
        for (std::size_t j = 0; gradient != nullptr && j < of.dimension; ++j) {
            const double at = of.projected(x, j);
            Lanes along{};
            for (std::size_t k = 0; k < count; k += PALPATE_LANES) {
                Lanes alpha, beta, factor;
                load(alpha, of.alpha + j * of.size + first + k);
                load(beta, of.beta + j * of.size + first + k);
                load(factor, factors + k);
                Lanes u = alpha * (at - beta);
                u = u > reach ? reach : u;
                u = u < -reach ? -reach : u;
                along += factor * alpha * u;
            }
            gradient[j] += total(along);
        }
    }
    value += total(values);
}

PALPATE_TARGET inline void multiply(Lanes& product, const double* column) noexcept {
    Lanes factor;
    load(factor, column);
    product *= factor;
}

/// Multiplies the given columns element by element (one element for each wavelet), and returns the sum of the products.
template <class... Columns>
PALPATE_TARGET inline double sum_of(std::size_t size, const Columns*... columns) noexcept {
    Lanes sum{};
    for (std::size_t i = 0; i < size; i += PALPATE_LANES) {
        Lanes product = Lanes{} + 1.0;
        (multiply(product, columns + i), ...);
        sum += product;
    }
    return total(sum);
}

/// Computes the terms of Taylor's formula for a sum of radial Mexican hats psi about the middle of a box. A wavelet has
/// the weight w and the scaled distance u from its centre; r = |u|, E = e^{-r^2/2} and A_n = w (d + n - r^2) E. Its
/// value w psi is -A_0, its first derivative A_2 u, and its second derivative A_2 I - A_4 u u'. Its third derivative is
/// A_6 u u u minus A_4 u_j for each pair of equal other indices. The factors A_n of all wavelets are computed first,
/// then the sums over the wavelets.
PALPATE_TARGET inline void expansion(const RadialColumns& of, const double* middle, const double* radius,
                                     RadialExpansion& sums) noexcept {
    const std::size_t n = of.size;
    const std::size_t d = of.dimension;
    const auto inputs = static_cast<double>(d);
    // `first`, `second` and `third` contain the factors A_2, A_4 and A_6 of each wavelet
    double* const first = sums.workspace.data();
    double* const second = first + n;
    double* const third = second + n;
    double* const rest = third + n;
    double* const offset = rest + n;        // u_j s_j for each input j; s_j = alpha times half the width
    double* const spread = offset + d * n;  // s_j^2
    double* const mixed = spread + d * n;   // d x d sums over the wavelets of A_4 s_j^2 u_l s_l
    const Lanes zero{};
    const Lanes reach = zero + hat_reach;
    Lanes values{};
    for (std::size_t i = 0; i < n; i += PALPATE_LANES) {
        Lanes square{};
        Lanes least{};
        Lanes whole{};
        for (std::size_t j = 0; j < d; ++j) {
            Lanes alpha, beta;
            load(alpha, of.alpha + j * n + i);
            load(beta, of.beta + j * n + i);
            const Lanes scale = alpha * radius[j];
            Lanes u = alpha * (middle[j] - beta);
            u = u > reach ? reach : u;
            u = u < -reach ? -reach : u;
            Lanes near = (u < zero ? -u : u) - scale;
            near = near > zero ? near : zero;
            square += u * u;
            least += near * near;
            const Lanes along = scale * scale;
            whole += along;
            u *= scale;
            __builtin_memcpy(offset + j * n + i, &u, sizeof(u));
            __builtin_memcpy(spread + j * n + i, &along, sizeof(along));
        }
        Lanes weight, uncancelled, e, beyond;
        load(weight, of.weight + i);
        load(uncancelled, of.uncancelled + i);
        gaussian(square, e);
        least *= 2.0 * fourth_derivative_decay;
        gaussian(least, beyond);
        e *= weight;
        values += (square - inputs) * e;
        const Lanes factors[] = {(inputs + 2.0 - square) * e, (inputs + 4.0 - square) * e,
                                 (inputs + 6.0 - square) * e};
        const Lanes left = uncancelled * (fourth_derivative_supremum(d) * beyond) * whole;
        __builtin_memcpy(first + i, &factors[0], sizeof(left));
        __builtin_memcpy(second + i, &factors[1], sizeof(left));
        __builtin_memcpy(third + i, &factors[2], sizeof(left));
        __builtin_memcpy(rest + i, &left, sizeof(left));
    }
    sums.value = total(values);
    for (std::size_t j = 0; j < d; ++j) {
        sums.gradient[j] = sum_of(n, first, offset + j * n);
        sums.rest[j] = sum_of(n, rest, spread + j * n);
        for (std::size_t l = 0; l < d; ++l) {
            mixed[j * d + l] = sum_of(n, second, spread + j * n, offset + l * n);
        }
    }
    for (std::size_t j = 0; j < d; ++j) {
        for (std::size_t k = 0; k <= j; ++k) {
            const double second_sum = (j == k ? sum_of(n, first, spread + j * n) : 0.0) -
                                      sum_of(n, second, offset + j * n, offset + k * n);
            sums.second_derivative[j * d + k] = second_sum;
            sums.second_derivative[k * d + j] = second_sum;
            for (std::size_t l = 0; l <= k; ++l) {
                const double third_sum = sum_of(n, third, offset + j * n, offset + k * n, offset + l * n) -
                                         (j == k ? mixed[j * d + l] : 0.0) -
                                         (j == l ? mixed[j * d + k] : 0.0) -
                                         (k == l ? mixed[k * d + j] : 0.0);
                for (const std::size_t at : {(j * d + k) * d + l, (j * d + l) * d + k, (k * d + j) * d + l,
                                             (k * d + l) * d + j, (l * d + j) * d + k, (l * d + k) * d + j}) {
                    sums.third_derivative[at] = third_sum;
                }
            }
        }
    }
}

/// Computes the Gaussian e^{-s/2} of n squared distances s >= 0.
PALPATE_TARGET inline void gaussians(const double* square, std::size_t n, double* e) noexcept {
    Lanes s, result;
    std::size_t k = 0;
    for (; k + PALPATE_LANES <= n; k += PALPATE_LANES) {
        load(s, square + k);
        gaussian(s, result);
        __builtin_memcpy(e + k, &result, sizeof(result));
    }
    double rest[PALPATE_LANES] = {};
    for (std::size_t j = 0; k + j < n; ++j) {
        rest[j] = square[k + j];
    }
    load(s, rest);
    gaussian(s, result);
    for (std::size_t j = 0; k + j < n; ++j) {
        e[k + j] = result[j];
    }
}

/// Returns the functions that compute sums of Mexican hats with this instruction set of the processor.
[[nodiscard]] inline HatKernel kernel() noexcept {
    return {PALPATE_LANES,
            at,
            {batch<HatQuantity::Force>, batch<HatQuantity::Slope>, batch<HatQuantity::Integral>},
            radial,
            expansion,
            gaussians};
}

}  // namespace PALPATE_KERNEL
