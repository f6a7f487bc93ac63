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

/// Required accuracy and largest size of a tabulated resolvent.
struct ResolventOptions {
    double relative_error = 1e-12;     ///< largest error, divided by the travel; includes rounding
    std::size_t largest_table = 8192;  ///< largest number of cells of 64 bytes for each branch
};

/// Function to invert: F(y) = f(y) + p y on an interval where it rises; f is a network of one input without
/// continuation.
struct RisingForce {
    const NetworkParameters& network;
    double p = 0.0;
    Interval positions;
    Interval values;           ///< F at both ends
    bool folds_below = false;  ///< true: F has a fold at the lower end; false: it continues to rise there
    bool folds_above = false;
};

/// Part of the inverse of a rising F as polynomials of degree 7, with a proved error.
struct InverseTable {
    Interval values{std::numeric_limits<double>::infinity(),
                    -std::numeric_limits<double>::infinity()};  ///< of F: range of the table
    Interval positions;                                         ///< inverse at both ends
    double error = 0.0;                                         ///< proved bound of |y - F^-1(q)|
    PiecewiseSeptic table;

    [[nodiscard]] bool empty() const noexcept { return table.empty(); }
    /// Returns true if q lies in the table.
    [[nodiscard, gnu::always_inline]] inline bool covers(double q) const noexcept {
        return q >= values.lower && q <= values.upper;
    }
    /// Returns the inverse at q.
    [[nodiscard, gnu::always_inline]] inline double at(double q) const noexcept { return table.value(q); }
};

namespace detail {

/// The inverse of F on cells of one width.
///
/// Each cell is certified separately by the residual of its polynomial P, r(q) = F(P(q)) - q. At both borders r and
/// three derivatives are zero, so |r| <= max|r^(8)| h^8 / (256 * 8!). Bounds of the Taylor coefficients of both
/// functions bound the eighth derivative of their composition. The error is at most |r| / min F' over the positions of
/// the cell.
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

    /// Return the number of certified cells, and of the others that could be certified if they were narrower.
    [[nodiscard]] std::size_t certified() const noexcept { return certified_; }
    [[nodiscard]] std::size_t improvable() const noexcept { return improvable_; }
    [[nodiscard]] std::size_t size() const noexcept { return table_.size(); }

    /// Returns the runs of certified cells from left to right. Runs of fewer than four cells are dropped as too short.
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
                // Rounding may place a border itself in the next cell.
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
    /// The inverse and its derivatives at one q, with the forward function at that position.
    struct InverseJet {
        Jet inverse;
        Jet forward;      ///< F and its derivatives at the inverse
        double residual;  ///< F(y) - q
    };

    [[nodiscard]] bool certified(std::size_t k) const noexcept { return errors_[k] <= largest_error_; }

    /// Applies Newton's method to the last digit, in a bracket between the ends.
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

    /// Returns a Taylor polynomial from the border before, if there is one.
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

    /// Error of a cell that a narrower cell would not reduce.
    static constexpr double rounding_limited = std::numeric_limits<double>::max();

    /// Returns a bound of |P - F^-1| on one cell; infinity without a proof.
    [[nodiscard]] double cell_error(std::size_t k, const Jet& of_f) noexcept {
        constexpr std::size_t order = 8;
        const auto c = table_.coefficients(k);
        if (!std::all_of(c.begin(), c.end(), [](double one) { return std::isfinite(one); })) {
            return std::numeric_limits<double>::infinity();
        }
        // Bounds of |P^(j)| / j! over the cell, rounding included.
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
        // The coefficient of t^8 in sum_k |f^(k)| / k! (sum_j inner_j t^j)^k. k = 1 adds 0, because P has degree 7.
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

    /// Returns a bound of the change of a cell's polynomial by rounding at a border.
    [[nodiscard]] double border_rounding(const InverseJet& at, const Jet& of_f,
                                         double least_slope) const noexcept {
        constexpr double epsilon = std::numeric_limits<double>::epsilon();
        const auto& [y, s, second, third] = at.forward;
        const double argument =
            4.0 * epsilon * (std::abs(at.forward[0]) + std::abs(force_.p * at.inverse[0]));
        const double offset = (std::abs(at.residual) + of_f[0] + argument) / least_slope;
        // An error in y changes every derivative by the next one; the change by the fourth is below rounding.
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

/// Returns tables of the inverse of a rising F, with the widest cells that cover all values or as many as any cells do.
/// Near a fold the inverse is a square root, which polynomials do not approximate, so a few cells are missing there.
/// They are also missing if F is so flat that rounding alone exceeds the required error.
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
