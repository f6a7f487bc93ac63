// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "palpate/portable/cell_grid.hpp"
#include "palpate/portable/cell_polynomial.hpp"
#include "palpate/portable/response_curve.hpp"

namespace palpate {

/// Errors of the polynomials of a table that are allowed without rounding, as shares of max|f| and max|f'|.
struct TableTolerance {
    double value = 0.0;
    double slope = 0.0;

    /// Returns the tolerance of a precision. In single precision rounding adds about 2e-7 of max|f|. In double precision
    /// smaller errors need many more cells: the number of cells grows with the sixth root.
    [[nodiscard]] static constexpr TableTolerance of(Precision precision) noexcept {
        return precision == Precision::Single ? TableTolerance{3e-7, 1.5e-5} : TableTolerance{1e-10, 1e-7};
    }
};

/// Proved bounds of the errors of an exported curve inside the domain, rounding included, with and without contraction
/// of a product and a sum to one operation.
struct CurveErrors {
    double value = 0.0;     ///< [N]
    double slope = 0.0;     ///< [N/m]
    double integral = 0.0;  ///< of the first antiderivative, for a table of numbers in double precision [J]
    double largest = 0.0;   ///< bound of the absolute value of the curve [N]
    double steepest = 0.0;  ///< bound of the absolute slope of the curve [N/m]
};

/// One or two curves (the force, or mean force and hysteresis) over the cells of a grid, as polynomials of degree 5 in
/// the number type of the export.
///
/// Each coarse cell is split until the derivative bounds prove the tolerance. In each cell the coefficients of the
/// curves follow each other.
class CellTable {
  public:
    static constexpr std::size_t terms = CellPolynomial::degree + 1;
    /// Largest number of cells of a table; 24 bytes each for a curve in single precision.
    static constexpr std::size_t most_cells = 16384;
    /// A coarse cell is split into at most 2^12 cells.
    static constexpr unsigned deepest_split = 12;

    CellTable(std::vector<ResponseCurve> curves, const CellGrid& grid, Precision precision, bool fractions,
              TableTolerance tolerance)
        : curves_{std::move(curves)}, grid_{grid}, precision_{precision}, fractions_{fractions} {
        allowed_ = largest_force(curves_);
        // A force without a slope, such as a constant one, has the slope tolerance of a force that falls to 0
        allowed_[1] = std::max(allowed_[1], allowed_[0] / (grid_.upper - grid_.lower)) * tolerance.slope;
        allowed_[0] *= tolerance.value;
        errors_.resize(curves_.size());
        for (std::size_t k = 0; k < grid_.coarse_cells(); ++k) {
            add_coarse_cell(k);
        }
    }

    [[nodiscard]] const CellGrid& grid() const noexcept { return grid_; }
    [[nodiscard]] const std::vector<ResponseCurve>& curves() const noexcept { return curves_; }
    /// Returns for each coarse cell the number of its first cell and, in the lowest four bits, k: it has 2^k cells.
    [[nodiscard]] const std::vector<std::uint32_t>& splits() const noexcept { return splits_; }
    /// Returns the coefficients of all cells; each is a number of the precision.
    [[nodiscard]] const std::vector<double>& coefficients() const noexcept { return coefficients_; }
    /// Returns the antiderivatives of all cells at their centres: first and second one of each curve.
    [[nodiscard]] const std::vector<double>& integrals() const noexcept { return integrals_; }
    [[nodiscard]] const std::vector<CurveErrors>& errors() const noexcept { return errors_; }
    [[nodiscard]] std::size_t cells() const noexcept {
        return coefficients_.size() / (terms * curves_.size());
    }
    /// Returns the size of the coefficients and of the splits [bytes].
    [[nodiscard]] std::size_t bytes() const noexcept {
        const std::size_t number = precision_ == Precision::Single ? 4 : 8;
        return number * coefficients_.size() + split_bytes() * splits_.size();
    }
    /// Returns the size of one split: 2 bytes, or 4 if the table has too many cells.
    [[nodiscard]] std::size_t split_bytes() const noexcept { return cells() <= 4096 ? 2 : 4; }
    /// Returns the largest width of a cell [m].
    [[nodiscard]] double widest() const noexcept {
        unsigned least = deepest_split;
        for (const std::uint32_t split : splits_) {
            least = std::min(least, split & 15U);
        }
        return grid_.width(least);
    }

    /// Returns lower bounds of max|f| and max|f'| from samples; with two curves for g + h and g - h.
    [[nodiscard]] static std::array<double, 2> largest_force(const std::vector<ResponseCurve>& curves) {
        std::array<double, 2> largest = curves[0].largest_samples();
        if (curves.size() > 1) {
            const NetworkCurve& g = curves[0].curve();
            constexpr int places = 512;
            for (int k = 0; k <= places; ++k) {
                const double x = g.lower() + (g.upper() - g.lower()) * k / places;
                const Curve mean = g.inside(x);
                const Curve half = curves[1].curve().inside(x);
                largest[0] = std::max(largest[0], std::abs(mean.value) + std::abs(half.value));
                largest[1] = std::max(largest[1], std::abs(mean.slope) + std::abs(half.slope));
            }
        }
        return largest;
    }

  private:
    /// One cell before it is stored.
    struct Cell {
        double middle = 0.0;
        std::vector<CellPolynomial> polynomials;
        std::vector<CurveErrors> errors;
    };

    void add_coarse_cell(std::size_t index) {
        const double from = grid_.start + static_cast<double>(index) * grid_.coarse_width;
        for (unsigned k = 0; k <= deepest_split; ++k) {
            const double width = grid_.width(k);
            std::vector<Cell> made;
            bool good = true;
            for (std::size_t j = 0; good && j < (std::size_t{1} << k); ++j) {
                const double left = from + static_cast<double>(j) * width;
                if (left > grid_.upper + margin() && j > 0) {
                    break;  // the last cells of the last coarse cell lie outside the domain
                }
                made.push_back(cell(left, width));
                good = is_accurate(made.back());
            }
            if (good) {
                store(made, k);
                return;
            }
        }
        refuse("the force changes too fast near " + readable(from) + ": no table has the required accuracy" +
               (curves_[0].has_load_line() ? ", or the load line has several solutions" : ""));
    }

    [[noreturn]] void refuse(const std::string& reason) const {
        throw std::invalid_argument(reason + (curves_[0].has_load_line()
                                                  ? ": plan a stiffer coupling"
                                                  : ": identify the model with fewer or wider wavelets"));
    }

    /// Returns a distance from the domain that contains every rounding of a position at an end of the domain [m].
    [[nodiscard]] double margin() const noexcept { return 1e-9 * (grid_.upper - grid_.lower); }

    [[nodiscard]] bool is_accurate(const Cell& cell) const noexcept {
        double value = 0.0;
        double slope = 0.0;
        for (const CurveErrors& errors : cell.errors) {
            value += errors.value;
            slope += errors.slope;
        }
        return value <= allowed_[0] && slope <= allowed_[1];
    }

    /// Returns the polynomials of the cell from `left`, with the errors that do not include rounding. A cell outside the
    /// domain is never evaluated, so its polynomials are 0.
    [[nodiscard]] Cell cell(double left, double width) const {
        Cell cell{left + 0.5 * width, {}, {}};
        const bool outside = left > grid_.upper + margin() || left + width < grid_.lower - margin();
        for (const ResponseCurve& curve : curves_) {
            if (outside) {
                cell.polynomials.emplace_back();
                cell.errors.emplace_back();
                continue;
            }
            const ResponseCurve::Part part = curve.part(left, left + width);
            CurveErrors errors;
            const double power = std::pow(width, 5);
            errors.value = CellPolynomial::value_factor * part.sixth * power * width +
                           CellPolynomial::value_amplification * part.value_error;
            errors.slope = CellPolynomial::slope_factor * part.sixth * power +
                           CellPolynomial::slope_amplification * part.value_error / width;
            cell.errors.push_back(errors);
            if (std::isfinite(part.sixth)) {
                cell.polynomials.push_back(CellPolynomial::through(
                    [&](double t) { return curve.value(part, cell.middle + t * width); }));
            }
        }
        return cell;
    }

    void store(const std::vector<Cell>& made, unsigned k) {
        splits_.push_back(static_cast<std::uint32_t>(cells() << 4U) | k);
        if (cells() + made.size() > most_cells) {
            refuse("the table needs more than " + std::to_string(most_cells) + " cells");
        }
        const double width = grid_.width(k);
        for (const Cell& cell : made) {
            for (std::size_t n = 0; n < curves_.size(); ++n) {
                for (const double c : cell.polynomials[n].c) {
                    coefficients_.push_back(
                        precision_ == Precision::Single ? static_cast<double>(static_cast<float>(c)) : c);
                }
                const Curve at = curves_[n].curve().inside(cell.middle);
                integrals_.push_back(at.integral);
                integrals_.push_back(at.double_integral);
                add_rounding(cell.polynomials[n], cell.errors[n], width, k, errors_[n]);
            }
        }
    }

    /// Adds the rounding errors of a cell to the errors of its polynomial, and keeps the largest errors of all cells.
    ///
    /// The coefficients are rounded once. In the Horner scheme the term of t^j then has 2 j + 1 roundings; in the scheme
    /// for value and slope, with the factor 1 / width, the term of j t^(j - 1) has at most 2 j + 3. A contracted product
    /// and sum has one rounding less, so the bounds hold too. The smallest normal number covers processors that replace
    /// smaller numbers by zero.
    void add_rounding(const CellPolynomial& p, const CurveErrors& without, double width, unsigned k,
                      CurveErrors& all) const noexcept {
        const double u = unit_roundoff(precision_);
        const double tiny =
            16.0 * (precision_ == Precision::Single ? static_cast<double>(std::numeric_limits<float>::min())
                                                    : std::numeric_limits<double>::min());
        constexpr double of_coefficients = 128.0 * 0x1p-53;
        constexpr double slack = 1.0 + 1e-5;
        const double t =
            u * 0.5 + grid_.position_error(precision_, fractions_) / width +
            (precision_ == Precision::Double ? 8.0 * u * std::ldexp(1.0, static_cast<int>(grid_.bits + k))
                                             : 0.0);
        const double largest = p.largest();
        const double value = without.value + of_coefficients * largest +
                             slack * u * p.sum_of_terms([](double j) { return 2.0 * j + 2.0; }) +
                             slack * t * p.steepest() + tiny;
        const double of_slope = p.sum_of_terms([](double j) { return 2.0 * j * (2.0 * j + 4.0); });
        const double slope = without.slope + (8.0 * of_coefficients * largest + slack * t * p.most_curved() +
                                              slack * u * of_slope + tiny) /
                                                 width;
        all.value = std::max(all.value, value);
        all.slope = std::max(all.slope, slope);
        // An antiderivative starts in the middle of its cell
        all.integral = std::max(all.integral, 0.5 * value * width);
        all.largest = std::max(all.largest, largest + value);
        all.steepest = std::max(all.steepest, p.steepest() / width + slope);
    }

    std::vector<ResponseCurve> curves_;
    CellGrid grid_;
    Precision precision_;
    bool fractions_;
    std::array<double, 2> allowed_{};
    std::vector<std::uint32_t> splits_;
    std::vector<double> coefficients_;
    std::vector<double> integrals_;
    std::vector<CurveErrors> errors_;
};

/// Returns the table with the fewest bytes among those with 32 to 256 coarse cells. A force that needs too many cells with
/// few coarse cells can have a table with more of them.
[[nodiscard]] inline CellTable smallest_table(const std::vector<ResponseCurve>& curves, double encoder_step,
                                              bool fractions, Precision precision) {
    std::optional<CellTable> best;
    std::exception_ptr refusal;
    for (unsigned bits = 5; bits <= 8; ++bits) {
        const CellGrid grid{
            encoder_step, curves[0].lower(), curves[0].upper(), curves[0].periodic(), fractions, precision,
            bits};
        try {
            CellTable table{curves, grid, precision, fractions, TableTolerance::of(precision)};
            if (!best || table.bytes() < best->bytes()) {
                best = std::move(table);
            }
        } catch (const std::invalid_argument&) {
            refusal = std::current_exception();
        }
    }
    if (!best) {
        std::rethrow_exception(refusal);
    }
    return *best;
}

}  // namespace palpate
