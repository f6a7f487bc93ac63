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

namespace palpate {

/// Value and first three derivatives of a function at one position.
using Jet = std::array<double, 4>;

/// A function as polynomials of degree 7 on cells of equal width h: one look-up, one cache line and a few
/// multiplications, however the function came about. Value and first three derivatives are continuous.
///
/// Cell k is centred at x = k h, its local coordinate is t = x/h - k in [-1/2, 1/2]; both are exact if h is a
/// power of two.
class PiecewiseSeptic {
  public:
    PiecewiseSeptic() = default;

    /// Cells `first` to `last`; `jet(x)` gives the derivatives at their borders x = (k +- 1/2) h.
    template <class Function>
    PiecewiseSeptic(std::int64_t first, std::int64_t last, double width, Function jet)
        : scale_{1.0 / width}, width_{width}, origin_{std::bit_cast<std::int64_t>(rounder) + first} {
        pieces_.reserve(static_cast<std::size_t>(last - first + 1));
        Jet left = scaled(jet((static_cast<double>(first) - 0.5) * width_));
        for (std::int64_t k = first; k <= last; ++k) {
            const Jet right = scaled(jet((static_cast<double>(k) + 0.5) * width_));
            pieces_.push_back(piece(left, right));
            left = right;
        }
    }

    /// The cell that holds x.
    [[nodiscard]] static std::int64_t cell(double x, double width) noexcept {
        return std::bit_cast<std::int64_t>(x / width + rounder) - std::bit_cast<std::int64_t>(rounder);
    }

    [[nodiscard]] bool empty() const noexcept { return pieces_.empty(); }
    [[nodiscard]] std::size_t size() const noexcept { return pieces_.size(); }
    [[nodiscard]] double width() const noexcept { return width_; }
    [[nodiscard]] double middle(std::size_t k) const noexcept {
        return static_cast<double>(origin_ + static_cast<std::int64_t>(k) -
                                   std::bit_cast<std::int64_t>(rounder)) *
               width_;
    }
    /// Coefficients of the powers of t in cell k.
    [[nodiscard]] const std::array<double, 8>& coefficients(std::size_t k) const noexcept {
        return pieces_[k].c;
    }

    [[nodiscard, gnu::always_inline]] inline double value(double x) const noexcept {
        const Place at = place(x);
        const auto& c = pieces_[at.piece].c;
        const double t = at.t;
        const double t2 = t * t;
        return ((c[0] + c[1] * t) + (c[2] + c[3] * t) * t2) +
               ((c[4] + c[5] * t) + (c[6] + c[7] * t) * t2) * (t2 * t2);
    }

    /// Value, slope and both antiderivatives from one look-up, after `integrate`.
    [[nodiscard, gnu::always_inline]] inline Curve at(double x) const noexcept {
        const Place at = place(x);
        const auto& c = pieces_[at.piece].c;
        const double t = at.t;
        const double t2 = t * t;
        const double t4 = t2 * t2;
        const double value =
            ((c[0] + c[1] * t) + (c[2] + c[3] * t) * t2) + ((c[4] + c[5] * t) + (c[6] + c[7] * t) * t2) * t4;
        const auto [first, second] = integrals_[at.piece];
        // Powers of t below: the antiderivatives of t^j are t^(j+1)/(j+1) and t^(j+2)/((j+1)(j+2)).
        const double once =
            ((c[0] + 1.0 / 2.0 * c[1] * t) + (1.0 / 3.0 * c[2] + 1.0 / 4.0 * c[3] * t) * t2) +
            ((1.0 / 5.0 * c[4] + 1.0 / 6.0 * c[5] * t) + (1.0 / 7.0 * c[6] + 1.0 / 8.0 * c[7] * t) * t2) * t4;
        const double twice =
            ((1.0 / 2.0 * c[0] + 1.0 / 6.0 * c[1] * t) + (1.0 / 12.0 * c[2] + 1.0 / 20.0 * c[3] * t) * t2) +
            ((1.0 / 30.0 * c[4] + 1.0 / 42.0 * c[5] * t) + (1.0 / 56.0 * c[6] + 1.0 / 72.0 * c[7] * t) * t2) *
                t4;
        const double along = t * width_;
        return {value, slope(c, t) * scale_, first + along * once, second + along * (first + along * twice)};
    }

    /// Takes the antiderivatives at the middle of every cell from `antiderivatives(x)`.
    template <class Function>
    void integrate(Function antiderivatives) {
        integrals_.reserve(size());
        for (std::size_t k = 0; k < size(); ++k) {
            integrals_.push_back(antiderivatives(middle(k)));
        }
    }

    /// What rounding may add to the value and to the slope in the making and the evaluation of the cells'
    /// polynomials: sums of the absolute terms of `piece`, its derivatives bounded by the coefficients.
    [[nodiscard]] std::array<double, 2> rounding() const noexcept {
        double value = 0.0;
        double slope = 0.0;
        for (const Piece& one : pieces_) {
            Jet by_t{std::abs(one.c[0]), 0.0, 0.0, 0.0};  // bounds of the derivatives by t
            for (std::size_t j = 1; j < one.c.size(); ++j) {
                double term = std::ldexp(std::abs(one.c[j]), -static_cast<int>(j));
                for (std::size_t d = 1; d <= std::min<std::size_t>(j, 3); ++d) {
                    term *= 2.0 * static_cast<double>(j + 1 - d);
                    by_t[d] += term;
                }
            }
            value = std::max(value, by_t[0] + 6.0 * by_t[1] + 1.5 * by_t[2] + 0.1 * by_t[3]);
            slope = std::max(slope, 36.0 * by_t[1] + 6.0 * by_t[2] + by_t[3]);
        }
        constexpr double units = 8.0 * std::numeric_limits<double>::epsilon();
        return {units * value, units * slope * scale_};
    }

  private:
    struct alignas(64) Piece {
        std::array<double, 8> c;
    };

    /// Adding this rounds a double to an integer, which then stands in its low bits.
    static constexpr double rounder = 0x1.8p52;

    struct Place {
        std::size_t piece;
        double t;
    };

    [[nodiscard]] Place place(double x) const noexcept {
        const double z = x * scale_;
        const double rounded = z + rounder;
        return {static_cast<std::size_t>(std::bit_cast<std::int64_t>(rounded) - origin_),
                z - (rounded - rounder)};
    }

    [[nodiscard]] static double slope(const std::array<double, 8>& c, double t) noexcept {
        const double t2 = t * t;
        return ((c[1] + 2.0 * c[2] * t) + (3.0 * c[3] + 4.0 * c[4] * t) * t2) +
               ((5.0 * c[5] + 6.0 * c[6] * t) + 7.0 * c[7] * t2) * (t2 * t2);
    }

    /// Derivatives by t instead of x.
    [[nodiscard]] Jet scaled(const Jet& jet) const noexcept {
        return {jet[0], jet[1] * width_, jet[2] * (width_ * width_), jet[3] * (width_ * width_ * width_)};
    }

    /// The polynomial of degree 7 with these derivatives at t = -1/2 and 1/2, even and odd powers apart.
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

    double scale_ = 1.0;
    double width_ = 1.0;
    std::int64_t origin_ = 0;
    std::vector<Piece> pieces_;
    std::vector<std::array<double, 2>> integrals_;
};

}  // namespace palpate
