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
    /// bracket; outside the interval of F the result is NaN if F has a fold there.
    [[nodiscard]] InverseJet invert(double q) const noexcept {
        constexpr double infinity = std::numeric_limits<double>::infinity();
        constexpr double epsilon = std::numeric_limits<double>::epsilon();
        const bool below = q < force_.values.lower;
        const bool above = q > force_.values.upper;
        constexpr double nan = std::numeric_limits<double>::quiet_NaN();
        InverseJet at{{nan, nan, nan, nan}, {}, nan};
        if ((below && force_.folds_below) || (above && force_.folds_above)) {
            return at;
        }
        double low = below ? -infinity : above ? force_.positions.upper : force_.positions.lower;
        double high = above ? infinity : below ? force_.positions.lower : force_.positions.upper;
        double y = first_guess(q, low, high);
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
            if (!(std::abs(next - y) > 2.0 * epsilon * std::abs(y)) ||
                std::abs(at.residual) <= 4.0 * epsilon * std::abs(q)) {
                break;
            }
            y = next;
        }
        const auto& f = at.forward;
        const double s = f[1];
        const double s3 = s * s * s;
        at.inverse = {y, 1.0 / s, -f[2] / s3, (3.0 * f[2] * f[2] - s * f[3]) / (s3 * s * s)};
        return at;
    }

    /// Returns a first position for Newton's method at the value q: the Taylor polynomial of the previous border if
    /// there is one, otherwise the middle or an end of the bracket from `low` to `high`.
    [[nodiscard]] double first_guess(double q, double low, double high) const noexcept {
        if (!borders_.empty()) {
            const InverseJet& last = borders_.back();
            const auto& [y, first, second, third] = last.inverse;
            const double d = q - (last.forward[0] - last.residual);
            const double guess = y + d * (first + d * (0.5 * second + d * third / 6.0));
            if (guess > low && guess < high) {
                return guess;
            }
        }
        return std::isfinite(low) ? (std::isfinite(high) ? 0.5 * (low + high) : low) : high;
    }

    /// Number stored as the error of a cell in which rounding alone exceeds the required error. Such a cell is not
    /// counted as improvable, because a narrower cell would not reduce the error.
    static constexpr double rounding_limited = std::numeric_limits<double>::max();

    /// Returns a proved bound of the position error of the polynomial in cell k; infinity if no bound is proved,
    /// `rounding_limited` if rounding alone exceeds the required error. `of_f` has bounds of the rounding errors of f
    /// and its derivatives.
    [[nodiscard]] double cell_error(std::size_t k, const Jet& of_f) noexcept {
        constexpr std::size_t order = 8;
        const auto c = table_.coefficients(k);
        if (!std::all_of(c.begin(), c.end(), [](double one) { return std::isfinite(one); })) {
            return std::numeric_limits<double>::infinity();
        }
        // Element j is an upper bound of |P^(j)| / j! over one cell, rounding included. P^(j) is derivative j of the
        // polynomial P of the cell.
        std::array<double, order + 1> inner{};
        for (std::size_t j = 1; j < c.size(); ++j) {
            double binomial = 1.0;
            double power = 1.0;
            for (std::size_t m = j; m < c.size(); ++m) {
                inner[j] += binomial * std::abs(c[m]) * power;
                binomial *= static_cast<double>(m + 1) / static_cast<double>(m + 1 - j);
                power *= 0.5;
            }
            inner[j] *= 1.0 + 1e-9;
        }
        const double spread = 0.5 * inner[1] + largest_error_;
        const DerivativeBounds outer = derivative_bounds(force_.network, c[0] - spread, c[0] + spread);
        const double least_slope = force_.p + jet(force_.network, c[0])[1] - of_f[1] - outer[2] * spread;
        if (!(least_slope > 0.0)) {
            return std::numeric_limits<double>::infinity();
        }
        // Bound of the eighth Taylor coefficient of F(P): the coefficient of t^8 in sum_k |f^(k)| / k! (sum_j inner_j
        // t^j)^k. The term k = 1 adds 0, because P has degree 7.
        std::array<double, order + 1> composed = inner;
        double eighth = 0.0;
        double factorial = 1.0;
        for (std::size_t n = 2; n <= order; ++n) {
            std::array<double, order + 1> product{};
            for (std::size_t a = n - 1; a <= order; ++a) {
                for (std::size_t b = 1; a + b <= order; ++b) {
                    product[a + b] += composed[a] * inner[b];
                }
            }
            composed = product;
            factorial *= static_cast<double>(n);
            eighth += outer[n] / factorial * composed[order];
        }
        const double truncation = (1.0 + 1e-9) * eighth / 256.0 / least_slope;
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
        const auto& [y, s, second, third] = at.forward;
        const double argument =
            4.0 * epsilon * (std::abs(at.forward[0]) + std::abs(force_.p * at.inverse[0]));
        const double offset = (std::abs(at.residual) + of_f[0] + argument) / least_slope;
        // A position error `offset` changes each derivative of F by `offset` times the next derivative; the change of
        // the third derivative is below rounding.
        const double f2 = std::abs(second);
        const double f3 = std::abs(third);
        const double d1 = of_f[1] + f2 * offset + 2.0 * epsilon * s;
        const double d2 = of_f[2] + f3 * offset;
        const double d3 = 2.0 * of_f[3];
        const Jet derivative_errors{offset, d1 / (s * s), d2 / (s * s * s) + 3.0 * f2 * d1 / (s * s * s * s),
                                    (6.0 * f2 * d2 + s * d3 + f3 * d1) / std::pow(s, 5) +
                                        5.0 * (3.0 * f2 * f2 + s * f3) * d1 / std::pow(s, 6)};
        double sum = 0.0;
        double power = 1.0;
        for (std::size_t d = 0; d < derivative_errors.size(); ++d) {
            sum += detail::hermite_value[d] *
                   (derivative_errors[d] + 16.0 * epsilon * std::abs(at.inverse[d])) * power;
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
/// folds: at most 1/32 of the cells), or until a narrower cell width would need more than `largest_table` cells.
/// Returns the tables of the cell width with the largest share of proved cells. Near a fold of F the inverse is a
/// square root, which polynomials do not approximate well, so the tables omit some cells there. The tables also omit
/// cells in which F is so flat that rounding alone exceeds the required error.
[[nodiscard]] inline std::vector<InverseTable> inverse_tables(const RisingForce& force, double largest_error,
                                                              std::size_t largest_table) {
    const double range = force.values.upper - force.values.lower;
    const double size = std::max(std::abs(force.values.lower), std::abs(force.values.upper));
    const double left_out = force.folds_below || force.folds_above ? 1.0 / 32.0 : 0.0;
    std::vector<InverseTable> best;
    double covered = 0.0;
    double width = std::exp2(std::floor(std::log2(range / 128.0)));
    while (range / width + 2.0 <= static_cast<double>(largest_table) && size / width < 0x1p40 &&
           PiecewiseSeptic::is_sound(width)) {
        const detail::InverseCells cells{force, largest_error, width};
        const auto share = [&](std::size_t count) {
            return static_cast<double>(count) / static_cast<double>(cells.size());
        };
        if (share(cells.certified()) > covered) {
            covered = share(cells.certified());
            best = cells.runs();
        }
        if (share(cells.improvable()) <= left_out) {
            break;
        }
        width *= 0.5;
    }
    return best;
}

}  // namespace palpate
