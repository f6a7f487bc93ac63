// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "palpate/model/continuation.hpp"
#include "palpate/model/derivatives.hpp"

namespace palpate {

/// A function of x as a table of polynomials of degree 7, one for each cell. All cells have the same width h, a power
/// of two. `value` needs one look-up of a cell, one cache line and a few multiplications. Value and first three
/// derivatives are continuous.
///
/// The centre of cell k is x = k h. The variable of its polynomial is u = x - k h, which is computed without rounding
/// error. In the sums, the terms that need the most multiplications of u come last, because the longest chain of
/// dependent operations limits the speed of a step.
class PiecewiseSeptic {
  public:
    PiecewiseSeptic() = default;

    /// Builds the cells `first` to `last`. `jet(x)` is called at the borders x = (k +- 1/2) h from left to right and
    /// returns value and first three derivatives.
    template <class Function>
    PiecewiseSeptic(std::int64_t first, std::int64_t last, double width, Function jet)
        : width_{width}, rounder_{rounder * width}, origin_{std::bit_cast<std::int64_t>(rounder_) + first} {
        pieces_.reserve(static_cast<std::size_t>(last - first + 1));
        Jet left = by_t(jet((static_cast<double>(first) - 0.5) * width_));
        for (std::int64_t k = first; k <= last; ++k) {
            const Jet right = by_t(jet((static_cast<double>(k) + 0.5) * width_));
            pieces_.push_back(by_x(piece(left, right)));
            left = right;
        }
    }

    /// Returns the index of the cell that contains x if all cells have the width `width`.
    [[nodiscard]] static std::int64_t cell(double x, double width) noexcept {
        return std::bit_cast<std::int64_t>(x / width + rounder) - std::bit_cast<std::int64_t>(rounder);
    }

    [[nodiscard]] bool empty() const noexcept { return pieces_.empty(); }
    [[nodiscard]] std::size_t size() const noexcept { return pieces_.size(); }
    [[nodiscard]] double width() const noexcept { return width_; }
    /// Returns the position x of the centre of the cell with index k in the table.
    [[nodiscard]] double middle(std::size_t k) const noexcept {
        return static_cast<double>(origin_ + static_cast<std::int64_t>(k) -
                                   std::bit_cast<std::int64_t>(rounder_)) *
               width_;
    }
    /// Returns the polynomial coefficients of cell k for the powers of t = u / h: the distance from the cell's centre
    /// divided by the cell's width, between -1/2 and 1/2.
    [[nodiscard]] std::array<double, 8> coefficients(std::size_t k) const noexcept {
        std::array<double, 8> c = pieces_[k].c;
        double power = 1.0;
        for (double& coefficient : c) {
            coefficient *= power;
            power *= width_;
        }
        return c;
    }
    /// Returns true if the powers of a cell width h up to h^7 neither overflow nor lose digits.
    [[nodiscard]] static bool is_sound(double width) noexcept { return width > 0x1p-100 && width < 0x1p100; }

    /// Keeps `count` cells from index `first` on, and removes all others from the table.
    void keep(std::size_t first, std::size_t count) {
        const auto begin = pieces_.begin() + static_cast<std::ptrdiff_t>(first);
        pieces_ = std::vector<Piece>(begin, begin + static_cast<std::ptrdiff_t>(count));
        origin_ += static_cast<std::int64_t>(first);
    }

    /// Returns the value of the function at x.
    [[nodiscard, gnu::always_inline]] inline double value(double x) const noexcept {
        const Place at = place(x);
        const auto& c = pieces_[at.piece].c;
        const double u = at.u;
        const double u2 = u * u;
        const double u4 = u2 * u2;
        return ((c[0] + c[1] * u) + (c[2] + c[3] * u) * u2) +
               ((c[4] + c[5] * u) * u4 + (c[6] + c[7] * u) * (u2 * u4));
    }

    /// Returns value, slope and both antiderivatives of the function at x from one look-up of the cell; call
    /// `integrate` first.
    [[nodiscard, gnu::always_inline]] inline Curve at(double x) const noexcept {
        const Place at = place(x);
        const auto& c = pieces_[at.piece].c;
        const Pair both = value_and_slope(c, at.u);
        const double u = at.u;
        const double u2 = u * u;
        const double u4 = u2 * u2;
        const auto [first, second] = integrals_[at.piece];
        // The first antiderivative of u^j is u^(j+1)/(j+1), the second is u^(j+2)/((j+1)(j+2)).
        const double once =
            ((c[0] + 1.0 / 2.0 * c[1] * u) + (1.0 / 3.0 * c[2] + 1.0 / 4.0 * c[3] * u) * u2) +
            ((1.0 / 5.0 * c[4] + 1.0 / 6.0 * c[5] * u) + (1.0 / 7.0 * c[6] + 1.0 / 8.0 * c[7] * u) * u2) * u4;
        const double twice =
            ((1.0 / 2.0 * c[0] + 1.0 / 6.0 * c[1] * u) + (1.0 / 12.0 * c[2] + 1.0 / 20.0 * c[3] * u) * u2) +
            ((1.0 / 30.0 * c[4] + 1.0 / 42.0 * c[5] * u) + (1.0 / 56.0 * c[6] + 1.0 / 72.0 * c[7] * u) * u2) *
                u4;
        return {both[0], both[1], first + u * once, second + u * (first + u * twice)};
    }

    /// Stores the first and the second antiderivative of the function at the centre of every cell. `antiderivatives(x)`
    /// computes both.
    template <class Function>
    void integrate(Function antiderivatives) {
        integrals_.reserve(size());
        for (std::size_t k = 0; k < size(); ++k) {
            integrals_.push_back(antiderivatives(middle(k)));
        }
    }

    /// Returns bounds of the rounding errors of value and slope in cell k, from the computation of the coefficients and
    /// from the evaluation of the polynomial. They are sums of the absolute terms of `piece`; the coefficients give
    /// bounds of the derivatives.
    [[nodiscard]] std::array<double, 2> rounding(std::size_t k) const noexcept {
        const auto c = coefficients(k);
        // |c_0|, then bounds of the polynomial's derivatives with respect to t
        Jet bounds{std::abs(c[0]), 0.0, 0.0, 0.0};
        for (std::size_t j = 1; j < c.size(); ++j) {
            double term = std::ldexp(std::abs(c[j]), -static_cast<int>(j));
            for (std::size_t d = 1; d <= std::min<std::size_t>(j, 3); ++d) {
                term *= 2.0 * static_cast<double>(j + 1 - d);
                bounds[d] += term;
            }
        }
        constexpr double units = 8.0 * std::numeric_limits<double>::epsilon();
        return {units * (bounds[0] + 6.0 * bounds[1] + 1.5 * bounds[2] + 0.1 * bounds[3]),
                units / width_ * (36.0 * bounds[1] + 6.0 * bounds[2] + bounds[3])};
    }

  private:
    /// Polynomial coefficients of one cell, in one cache line.
    struct alignas(64) Piece {
        std::array<double, 8> c;
    };

    /// Constant that rounds a double to an integer when it is added to the double; the low bits of the sum then contain
    /// the integer. The constant times h rounds a double to a multiple of h.
    static constexpr double rounder = 0x1.8p52;

    /// Index of the cell that contains x, and the distance u of x from the centre of this cell.
    struct Place {
        std::size_t piece;
        double u;
    };

    /// Returns the index of the cell that contains x, and the distance of x from the centre of this cell.
    [[nodiscard, gnu::always_inline]] inline Place place(double x) const noexcept {
        const double rounded = x + rounder_;
        return {static_cast<std::size_t>(std::bit_cast<std::int64_t>(rounded) - origin_),
                x - (rounded - rounder_)};
    }

    /// Two doubles in one vector register, available on every processor and compiler that this library supports.
    using Pair = double __attribute__((vector_size(16)));

    /// Returns value and slope of a polynomial with the coefficients c at u. The sum for the slope has the coefficients
    /// (j + 1) c[j + 1] instead of c[j], so both sums are computed together in one register, in the time of one. The
    /// factors j + 1 multiply the powers of u, which are computed while the coefficients are loaded.
    [[nodiscard, gnu::always_inline]] static inline Pair value_and_slope(const std::array<double, 8>& c,
                                                                         double u) noexcept {
        const auto at = [&c](std::size_t j) {
            Pair pair;
            __builtin_memcpy(&pair, &c[j], sizeof(pair));
            return pair;
        };
        const Pair u1 = {u, u};
        const Pair u2 = u1 * u1;
        const Pair u4 = u2 * u2;
        return ((at(0) + at(1) * (u1 * Pair{1.0, 2.0})) +
                (at(2) + at(3) * (u1 * Pair{1.0, 4.0 / 3.0})) * (u2 * Pair{1.0, 3.0})) +
               ((at(4) + at(5) * (u1 * Pair{1.0, 6.0 / 5.0})) * (u4 * Pair{1.0, 5.0}) +
                (at(6) + Pair{c[7], 0.0} * u1) * (u2 * Pair{1.0, 7.0} * u4));
    }

    /// Converts the coefficients of a cell's polynomial from powers of t = u / h to powers of u (cell width h).
    [[nodiscard]] Piece by_x(const Piece& piece) const noexcept {
        Piece scaled = piece;
        double power = 1.0;
        for (double& coefficient : scaled.c) {
            coefficient *= power;
            power /= width_;
        }
        return scaled;
    }

    /// Converts derivatives of a function with respect to x to derivatives with respect to t = x / h (cell width h).
    [[nodiscard]] Jet by_t(const Jet& jet) const noexcept {
        return {jet[0], jet[1] * width_, jet[2] * (width_ * width_), jet[3] * (width_ * width_ * width_)};
    }

    /// Returns the coefficients of the polynomial of degree 7 in t that has the value and three derivatives `left` at t
    /// = -1/2 and `right` at t = 1/2. The even and the odd powers are computed separately.
    [[nodiscard]] static Piece piece(const Jet& left, const Jet& right) noexcept {
        Jet even;
        Jet odd;
        for (std::size_t d = 0; d < 4; ++d) {
            const double mirrored = d % 2 == 0 ? left[d] : -left[d];
            even[d] = 0.5 * (right[d] + mirrored);
            odd[d] = 0.5 * (right[d] - mirrored);
        }
        const auto& e = even;
        const auto& o = odd;
        return {{e[0] - 11.0 / 32.0 * e[1] + 3.0 / 64.0 * e[2] - e[3] / 384.0,
                 35.0 / 8.0 * o[0] - 19.0 / 16.0 * o[1] + o[2] / 8.0 - o[3] / 192.0,
                 15.0 / 8.0 * e[1] - 7.0 / 16.0 * e[2] + e[3] / 32.0,
                 -35.0 / 2.0 * o[0] + 35.0 / 4.0 * o[1] - 5.0 / 4.0 * o[2] + o[3] / 16.0,
                 -5.0 / 2.0 * e[1] + 5.0 / 4.0 * e[2] - e[3] / 8.0,
                 42.0 * o[0] - 21.0 * o[1] + 4.0 * o[2] - o[3] / 4.0, 2.0 * e[1] - e[2] + e[3] / 6.0,
                 -40.0 * o[0] + 20.0 * o[1] - 4.0 * o[2] + o[3] / 3.0}};
    }

    double width_ = 1.0;
    double rounder_ = rounder;
    std::int64_t origin_ = 0;
    std::vector<Piece> pieces_;
    std::vector<std::array<double, 2>> integrals_;
};

}  // namespace palpate
