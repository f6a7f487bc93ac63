// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace palpate {

/// A function in one cell as a polynomial of degree 5. Its variable t is the distance from the centre of the cell,
/// divided by the width w of the cell: -1/2 <= t <= 1/2.
///
/// The polynomial has the values of the function at six positions, the extrema of the Chebyshev polynomial T5. Two of
/// them are the ends of the cell, so the function stays continuous from cell to cell. With W(t) = (t - t_0) ... (t -
/// t_5), the errors of value and slope are at most
///
///     |f - p| <= max|W| / 6! max|f^(6)| w^6,   |f' - p'| <= max|W'| / 6! max|f^(6)| w^5.
///
/// The second bound is Howell's conjecture, which A. Shadrin proved: Error bounds for Lagrange interpolation, Journal of
/// Approximation Theory 80 (1995).
struct CellPolynomial {
    static constexpr std::size_t degree = 5;

    /// Coefficients of t^0 to t^5
    std::array<double, degree + 1> c{};

    /// Largest error of the value and of the slope for |f^(6)| = 1 and w = 1: max|W| / 6! and max|W'| / 6!, rounded up.
    static constexpr double value_factor = 1.0 / 1024.0 / 720.0 * (1.0 + 1e-9);
    static constexpr double slope_factor = 5.0 / 256.0 / 720.0 * (1.0 + 1e-9);
    /// Largest error of the value and of the slope times w, if each of the six values has an error of 1, rounded up.
    static constexpr double value_amplification = 2.0;
    static constexpr double slope_amplification = 51.0;

    /// Positions t >= 0 of the six values; the others are their negatives.
    static constexpr std::array<double, 3> nodes{0.15450849718747371, 0.40450849718747371, 0.5};

    /// Returns the polynomial with the values of a function at the six positions. `function(t)` returns the value at t.
    template <class Function>
    [[nodiscard]] static CellPolynomial through(Function function) {
        std::array<double, 3> even{};
        std::array<double, 3> odd{};
        for (std::size_t k = 0; k < nodes.size(); ++k) {
            const double right = function(nodes[k]);
            const double left = function(-nodes[k]);
            even[k] = 0.5 * (right + left);
            odd[k] = 0.5 * (right - left) / nodes[k];
        }
        const auto e = by_squares(even);
        const auto o = by_squares(odd);
        return {{e[0], o[0], e[1], o[1], e[2], o[2]}};
    }

    /// Returns sum |c_j| 2^-j times `factor(j)`: a bound of the polynomial, or of the sum of rounding errors.
    template <class Factor>
    [[nodiscard]] double sum_of_terms(Factor factor) const noexcept {
        double sum = 0.0;
        for (std::size_t j = 0; j < c.size(); ++j) {
            sum += std::ldexp(std::abs(c[j]), -static_cast<int>(j)) * factor(static_cast<double>(j));
        }
        return sum;
    }
    /// Returns bounds of the polynomial and of its first and second derivatives by t in the cell.
    [[nodiscard]] double largest() const noexcept {
        return sum_of_terms([](double) { return 1.0; });
    }
    [[nodiscard]] double steepest() const noexcept {
        return sum_of_terms([](double j) { return 2.0 * j; });
    }
    [[nodiscard]] double most_curved() const noexcept {
        return sum_of_terms([](double j) { return 4.0 * j * (j - 1.0); });
    }

  private:
    /// Returns the coefficients of the polynomial a + b s + c s^2 with the given values at the squares s of the nodes.
    [[nodiscard]] static std::array<double, 3> by_squares(const std::array<double, 3>& value) noexcept {
        constexpr std::array<double, 3> s{nodes[0] * nodes[0], nodes[1] * nodes[1], nodes[2] * nodes[2]};
        const double first = (value[1] - value[0]) / (s[1] - s[0]);
        const double second = ((value[2] - value[1]) / (s[2] - s[1]) - first) / (s[2] - s[0]);
        const double b = first - second * (s[0] + s[1]);
        return {value[0] - (b + second * s[0]) * s[0], b, second};
    }
};

}  // namespace palpate
