// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "palpate/model/bounds.hpp"
#include "palpate/model/compiled_network.hpp"
#include "palpate/model/derivatives.hpp"
#include "palpate/model/parameters.hpp"
#include "palpate/model/piecewise_septic.hpp"

namespace palpate {

/// Required accuracy and largest size of the tables that give the solution of a load line.
struct ResolventOptions {
    /// Largest position error divided by the length of the domain; includes rounding
    double relative_error = 1e-12;
    std::size_t largest_table = 8192;  ///< largest number of cells (64 bytes each) in one table
};

/// Function whose inverse is tabulated: F(y) = f(y) + p y on an interval of positions y over which F rises. f is a
/// network of one input without continuation.
struct RisingForce {
    const NetworkParameters& network;
    double p = 0.0;
    Interval positions;
    Interval values;           ///< values of F(y) = f(y) + p y at both ends of `positions`
    bool folds_below = false;  ///< true: F falls with y below the lower end of `positions`
    bool folds_above = false;  ///< true: F falls with y above the upper end of `positions`
};

/// Table of polynomials of degree 7 that gives the position y for a value q = F(y) of a rising function F, with a
/// proved error.
struct InverseTable {
    /// Smallest and largest q for which the table contains the solution of F(y) = q
    Interval values{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
    /// Solutions y of F(y) = q for the smallest and the largest q in `values`
    Interval positions;
    double error = 0.0;  ///< proved bound of the error of the position y with F(y) = q
    PiecewiseSeptic table;

    [[nodiscard]] bool empty() const noexcept { return table.empty(); }
    /// Returns true if the table contains the solution of F(y) = q.
    [[nodiscard, gnu::always_inline]] inline bool covers(double q) const noexcept {
        return q >= values.lower && q <= values.upper;
    }
    /// Returns the position y with F(y) = q.
    [[nodiscard, gnu::always_inline]] inline double at(double q) const noexcept { return table.value(q); }
};

namespace detail {

/// Returns the position y and the derivatives of the inverse of a rising function at its value f[0]; f contains value
/// and derivatives of the function at y.
[[nodiscard]] inline Jet inverse_jet(double y, const Jet& f) noexcept {
    const double s = f[1];
    const double s3 = s * s * s;
    return {y, 1.0 / s, -f[2] / s3, (3.0 * f[2] * f[2] - s * f[3]) / (s3 * s * s)};
}

/// Returns bounds of the changes of `inverse_jet`, to first order. `change` has bounds of the change of y (element 0) and
/// of each derivative in f.
[[nodiscard]] inline Jet inverse_change(const Jet& f, const Jet& change) noexcept {
    const double s = f[1];
    const double s3 = s * s * s;
    const double f2 = std::abs(f[2]);
    const double by_slope = (15.0 * f2 * f2 / s + 4.0 * std::abs(f[3])) * change[1];
    return {change[0], change[1] / (s * s), (change[2] + 3.0 * f2 * change[1] / s) / s3,
            (change[3] + (6.0 * f2 * change[2] + by_slope) / s) / (s3 * s)};
}

/// Bounds of the Taylor coefficients |P^(j)| / j! of a function P over one cell; element 0 is not used.
using TaylorBounds = std::array<double, 9>;

/// Returns bounds of the Taylor coefficients of the polynomial with the coefficients c, for |t| <= 1/2.
[[nodiscard]] inline TaylorBounds taylor_bounds(const std::array<double, 8>& c) noexcept {
    TaylorBounds bounds{};
    std::transform(c.begin(), c.end(), bounds.begin(), [](double each) { return std::abs(each); });
    // Horner's method: the Taylor coefficients at t = 1/2 of the polynomial with absolute coefficients
    for (std::size_t j = 0; j < c.size(); ++j) {
        for (std::size_t k = c.size() - 1; k > j; --k) {
            bounds[k - 1] += 0.5 * bounds[k];
        }
    }
    return bounds;
}

/// Returns a bound of the eighth Taylor coefficient of F(P(t)) for a polynomial P of degree 7: the coefficient of t^8 in
/// sum_n |F^(n)| / n! (sum_j inner_j t^j)^n. `outer` has bounds of |F^(n)|. The term n = 1 adds 0.
[[nodiscard]] inline double eighth_coefficient(const DerivativeBounds& outer,
                                               const TaylorBounds& inner) noexcept {
    constexpr std::size_t order = 8;
    TaylorBounds composed = inner;
    double eighth = 0.0;
    double factorial = 1.0;
    for (std::size_t n = 2; n <= order; ++n) {
        TaylorBounds product{};
        for (std::size_t a = n - 1; a < order; ++a) {
            for (std::size_t b = 1; a + b <= order; ++b) {
                product[a + b] += composed[a] * inner[b];
            }
        }
        composed = product;
        factorial *= static_cast<double>(n);
        eighth += outer[n] / factorial * composed[order];
    }
    return eighth;
}

/// The inverse function of a rising function F as polynomials on cells of equal width.
///
/// The error of each cell is proved separately by the residual r(q) = F(P(q)) - q of its polynomial P. At both borders
/// of the cell, r and three derivatives are zero, so |r| <= max|r^(8)| h^8 / (256 * 8!) with the cell width h. Bounds
/// of the Taylor coefficients of F and P give a bound of the eighth derivative r^(8). The position error is at most |r|
/// / min F' over the positions of the cell.
class InverseCells {
  public:
    InverseCells(const RisingForce& force, double largest_error, double width)
        : force_{force}, largest_error_{largest_error} {
        const auto jet = [&](double q) {
            borders_.push_back(invert(q));
            return borders_.back().inverse;
        };
        table_ = {PiecewiseSeptic::cell(force.values.lower, width),
                  PiecewiseSeptic::cell(force.values.upper, width), width, jet};
        const Jet rounding = jet_rounding(
            force.network, std::max(std::abs(force.positions.lower), std::abs(force.positions.upper)));
        for (std::size_t k = 0; k < table_.size(); ++k) {
            errors_.push_back(cell_error(k, rounding));
            certified_ += certified(k) ? 1 : 0;
            improvable_ += certified(k) || errors_[k] == rounding_limited ? 0 : 1;
        }
    }

    /// Return the number of cells whose proved error is small enough, and the number of other cells that could satisfy
    /// the required error if they were narrower.
    [[nodiscard]] std::size_t certified() const noexcept { return certified_; }
    [[nodiscard]] std::size_t improvable() const noexcept { return improvable_; }
    [[nodiscard]] std::size_t size() const noexcept { return table_.size(); }

    /// Returns one table for each group of adjacent cells whose proved error is small enough, in the order of q. Groups
    /// of fewer than four cells are omitted.
    [[nodiscard]] std::vector<InverseTable> runs() const {
        constexpr std::size_t shortest = 4;
        std::vector<InverseTable> runs;
        for (std::size_t first = 0; first < table_.size();) {
            std::size_t past = first;
            InverseTable run;
            while (past < table_.size() && certified(past)) {
                run.error = std::max(run.error, errors_[past++]);
            }
            if (past - first >= shortest) {
                // Rounding may place a value q at the border of the last cell in the next cell, so the table ends
                // slightly before the border.
                const double low = table_.middle(first) - 0.5 * table_.width();
                const double high = table_.middle(past - 1) + 0.5 * table_.width();
                run.values = {std::max(force_.values.lower, std::nextafter(low, high)),
                              std::min(force_.values.upper, std::nextafter(high, low))};
                run.table = table_;
                run.table.keep(first, past - first);
                run.positions = {run.at(run.values.lower), run.at(run.values.upper)};
                runs.push_back(std::move(run));
            }
            first = past + 1;
        }
        return runs;
    }

  private:
    /// For one value q: the position y that solves F(y) = q, and the function F at this position, both with their
    /// derivatives.
    struct InverseJet {
        Jet inverse;      ///< position y = F^-1(q) and its derivatives with respect to q
        Jet forward;      ///< F(y) and its derivatives with respect to y
        double residual;  ///< difference F(y) - q that remains at the computed position y [N]
    };

    [[nodiscard]] bool certified(std::size_t k) const noexcept { return errors_[k] <= largest_error_; }

    /// Returns the position y with F(y) = q, exact to rounding, and its derivatives. Applies Newton's method with a
    /// bracket, from the position of the previous border. At a value that F does not reach, the result has no meaning,
    /// and the error of its cell is not proved.
    [[nodiscard]] InverseJet invert(double q) const noexcept {
        constexpr double infinity = std::numeric_limits<double>::infinity();
        constexpr double epsilon = std::numeric_limits<double>::epsilon();
        const auto [lower, upper] = force_.positions;
        const bool below = q < force_.values.lower;
        const bool above = q > force_.values.upper;
        double low = below ? -infinity : above ? upper : lower;
        double high = above ? infinity : below ? lower : upper;
        double y = std::fmin(std::fmax(borders_.empty() ? lower : borders_.back().inverse[0], low), high);
        InverseJet at{};
        for (int evaluations = 0; evaluations < 100; ++evaluations) {
            at.forward = jet(force_.network, y);
            at.forward[0] += force_.p * y;
            at.forward[1] += force_.p;
            at.residual = at.forward[0] - q;
            (at.residual < 0.0 ? low : high) = y;
            double next = y - at.residual / at.forward[1];
            if (!(next >= low && next <= high)) {
                next = 0.5 * (low + high);
            }
            if (!(std::abs(next - y) > 2.0 * epsilon * std::abs(y))) {
                break;
            }
            y = next;
        }
        at.inverse = inverse_jet(y, at.forward);
        return at;
    }

    /// Number stored as the error of a cell in which rounding alone exceeds the required error. Such a cell is not
    /// counted as improvable, because a narrower cell would not reduce the error.
    static constexpr double rounding_limited = std::numeric_limits<double>::max();

    /// Returns a proved bound of the position error of the polynomial in cell k; infinity if no bound is proved,
    /// `rounding_limited` if rounding alone exceeds the required error. `of_f` has bounds of the rounding errors of f
    /// and its derivatives.
    [[nodiscard]] double cell_error(std::size_t k, const Jet& of_f) noexcept {
        const auto c = table_.coefficients(k);
        if (!std::all_of(c.begin(), c.end(), [](double one) { return std::isfinite(one); })) {
            return std::numeric_limits<double>::infinity();
        }
        // `derivative_bounds` exceeds the true bounds by a factor that also covers the rounding of the sums below.
        const TaylorBounds inner = taylor_bounds(c);
        const double spread = 0.5 * inner[1] + largest_error_;
        const DerivativeBounds outer = derivative_bounds(force_.network, c[0] - spread, c[0] + spread);
        const double least_slope = force_.p + jet(force_.network, c[0])[1] - of_f[1] - outer[2] * spread;
        if (!(least_slope > 0.0)) {
            return std::numeric_limits<double>::infinity();
        }
        const double truncation = eighth_coefficient(outer, inner) / 256.0 / least_slope;
        const double rounding =
            table_.rounding(k)[0] + std::max(border_rounding(borders_[k], of_f, least_slope),
                                             border_rounding(borders_[k + 1], of_f, least_slope));
        return rounding < largest_error_ ? truncation + rounding : rounding_limited;
    }

    /// Returns a bound of the position error of a cell's polynomial that comes from rounding errors of the inverse and
    /// its derivatives at one border of the cell.
    [[nodiscard]] double border_rounding(const InverseJet& at, const Jet& of_f,
                                         double least_slope) const noexcept {
        constexpr double epsilon = std::numeric_limits<double>::epsilon();
        const auto& f = at.forward;
        const double argument = 4.0 * epsilon * (std::abs(f[0]) + std::abs(force_.p * at.inverse[0]));
        const double offset = (std::abs(at.residual) + of_f[0] + argument) / least_slope;
        // A position error `offset` changes each derivative of F by `offset` times the next derivative; the change of
        // the third derivative is below rounding. Two epsilon of F' cover the rounding of the quotients.
        const Jet errors =
            inverse_change(f, {offset, of_f[1] + std::abs(f[2]) * offset + 2.0 * epsilon * f[1],
                               of_f[2] + std::abs(f[3]) * offset, 2.0 * of_f[3]});
        double sum = 0.0;
        double power = 1.0;
        for (std::size_t d = 0; d < errors.size(); ++d) {
            sum += hermite_value[d] * errors[d] * power;
            power *= table_.width();
        }
        return sum;
    }

    const RisingForce& force_;
    double largest_error_;
    PiecewiseSeptic table_;
    std::vector<InverseJet> borders_;
    std::vector<double> errors_;
    std::size_t certified_ = 0;
    std::size_t improvable_ = 0;
};

}  // namespace detail

/// Returns tables of the inverse of a rising function F. The cell width is halved until no cell could be improved (near
/// folds: at most 1/32 of the cells), or until a narrower cell width would need more than `largest_table` cells. Near a
/// fold of F the inverse is a square root, which polynomials do not approximate well, so the tables omit some cells
/// there. The tables also omit cells in which F is so flat that rounding alone exceeds the required error.
[[nodiscard]] inline std::vector<InverseTable> inverse_tables(const RisingForce& force, double largest_error,
                                                              std::size_t largest_table) {
    const double range = force.values.upper - force.values.lower;
    const double size = std::max(std::abs(force.values.lower), std::abs(force.values.upper));
    const double left_out = force.folds_below || force.folds_above ? 1.0 / 32.0 : 0.0;
    std::vector<InverseTable> tables;
    double width = std::exp2(std::floor(std::log2(range / 128.0)));
    while (range / width + 2.0 <= static_cast<double>(largest_table) && size / width < 0x1p40 &&
           PiecewiseSeptic::is_sound(width)) {
        const detail::InverseCells cells{force, largest_error, width};
        tables = cells.runs();
        if (static_cast<double>(cells.improvable()) <= left_out * static_cast<double>(cells.size())) {
            break;
        }
        width *= 0.5;
    }
    return tables;
}

}  // namespace palpate
