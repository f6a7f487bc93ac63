// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "palpate/model/continuation.hpp"
#include "palpate/model/derivatives.hpp"
#include "palpate/model/environment.hpp"
#include "palpate/model/hysteresis.hpp"
#include "palpate/model/network.hpp"
#include "palpate/model/network_curve.hpp"
#include "palpate/model/piecewise_septic.hpp"

namespace palpate {

/// Required accuracy and largest size of the table of polynomials that replaces a wavelet network.
struct CompileOptions {
    /// Largest force error divided by max|f| over the domain; includes rounding
    double relative_error = 1e-12;
    std::size_t largest_table = 8192;  ///< largest number of cells (80 bytes each) in the table.
    /// A network with fewer wavelets gets no table, because the sum of its wavelets is as fast as a table.
    std::size_t fewest_wavelets = 2;
};

namespace detail {

/// Largest change of the value and of the slope of a cell's polynomial for an error of 1 in its value or one of three
/// derivatives at both borders. Derivatives are by t, the position in the cell divided by the cell's width. The numbers
/// are suprema of the sums of absolute Hermite basis functions.
inline constexpr Jet hermite_value{1.0, 11.0 / 32.0, 3.0 / 64.0, 1.0 / 384.0};
inline constexpr Jet hermite_slope{4.375, 1.1875, 0.1468, 0.008945};

}  // namespace detail

/// Replaces a wavelet network f of one input, with its continuations, by a table of polynomials p of degree 7. The
/// computing time of an evaluation then does not depend on the number of wavelets.
///
/// The error of the table is proved when the table is built. If p has the value and three derivatives of f at both
/// borders of a cell of width h,
///
///     |f - p| <= max|f^(8)| h^8 / (256 * 8!),   |f' - p'| <= max|f^(8)| h^7 / (64 * 6!).
///
/// `derivative_bounds` gives max|f^(8)|; a bound of the rounding error is added. The class evaluates the network
/// itself, without a table, if the proved error exceeds the required error, the table is too large, or the network has
/// too few wavelets.
class CompiledCurve {
  public:
    explicit CompiledCurve(NetworkCurve curve, const CompileOptions& options = {})
        : curve_{std::move(curve)}, lower_{curve_.lower()}, upper_{curve_.upper()} {
        build(options);
    }

    /// Returns the wavelet network and its continuations, from which the table was computed.
    [[nodiscard]] const NetworkCurve& curve() const noexcept { return curve_; }
    /// Returns true if the polynomials of the table are used, false if the network itself is evaluated.
    [[nodiscard]] bool compiled() const noexcept { return !table_.empty(); }
    /// Returns the number of cells of the table.
    [[nodiscard]] std::size_t cells() const noexcept { return table_.size(); }
    /// Return proved bounds of the errors of the table inside the domain, |p - f| for the force and |p' - f'| for the
    /// slope; 0 without a table.
    [[nodiscard]] double value_error() const noexcept { return value_error_; }
    [[nodiscard]] double slope_error() const noexcept { return slope_error_; }

    /// Returns force, slope and antiderivatives at position x. Inlined, so that the compiler drops the results that a
    /// caller does not use.
    [[nodiscard, gnu::always_inline]] inline Curve at(double x) const noexcept {
        if (x >= table_from_ && x <= table_to_) {
            return table_.at(x);
        }
        return outside_table(x);
    }

    /// Returns true if x is not finite, or lies outside the domain of a force that is not periodic.
    [[nodiscard]] bool extrapolated(double x) const noexcept { return curve_.extrapolated(x); }

  private:
    /// Returns force, slope and antiderivatives at a position outside the domain, or at any position if there is no
    /// table or the force is periodic.
    [[nodiscard, gnu::noinline]] Curve outside_table(double x) const noexcept {
        if (!compiled()) {
            return curve_.at(x);
        }
        // A periodic force moves a distant position x by whole periods; rounding can place the result just outside the
        // domain.
        return curve_.continued(x, [this](double within) noexcept {
            return table_.at(within > lower_ ? std::min(within, upper_) : lower_);
        });
    }

    /// Builds the table of polynomials, and keeps the table only if its proved error is at most the required error.
    void build(const CompileOptions& options) {
        const NetworkParameters& network = curve_.parameters();
        if (network.weight.size() < options.fewest_wavelets) {
            return;
        }
        const double reach = 2.0 * std::max(std::abs(lower_), std::abs(upper_));
        const double largest_error = options.relative_error * largest_force();
        const double eighth = largest_eighth_derivative();
        // The distance of the polynomials from f may be a tenth of the required error; nine tenths are reserved for
        // rounding.
        const double width = std::pow(0.1 * largest_error * 256.0 * 40320.0 / eighth, 0.125);
        const double widest = (upper_ - lower_) / 32.0;
        const int fineness = -static_cast<int>(std::floor(std::log2(std::min(width, widest))));
        // If position x is more than 2^40 cell widths from zero, rounding of x is too large compared with the cell
        // width.
        const double h = std::ldexp(1.0, -fineness);
        if (!((upper_ - lower_) / h + 4.0 <= static_cast<double>(options.largest_table) &&
              reach / h < 0x1p40 && PiecewiseSeptic::is_sound(h))) {
            return;
        }
        // One additional cell on each side, because rounding can place a position just outside an edge of the domain.
        PiecewiseSeptic table{PiecewiseSeptic::cell(lower_, h) - 1, PiecewiseSeptic::cell(upper_, h) + 1, h,
                              [&](double x) noexcept { return jet(network, x); }};
        certify(table, eighth, jet_rounding(network, reach));
        if (!(value_error_ <= largest_error)) {
            value_error_ = slope_error_ = 0.0;
            return;
        }
        table.integrate([this](double x) noexcept {
            const Curve curve = curve_.inside(x);
            return std::array{curve.integral, curve.double_integral};
        });
        table_ = std::move(table);
        if (!curve_.periodic()) {
            table_from_ = lower_;
            table_to_ = upper_;
        }
    }

    /// Returns the largest |f| at 65 positions of the domain [N]. It is at most the true maximum, so the relative error
    /// computed with it is never too small.
    [[nodiscard]] double largest_force() const noexcept {
        constexpr int places = 64;
        double largest = 0.0;
        for (int k = 0; k <= places; ++k) {
            const double x = lower_ + (upper_ - lower_) * k / places;
            largest = std::max(largest, std::abs(curve_.inside(x).value));
        }
        return largest;
    }

    /// Returns an upper bound of the eighth derivative |f^(8)| over the domain and the parts of the outermost cells
    /// outside the domain. This interval is divided into 256 pieces, because few wavelets are large in all of them.
    [[nodiscard]] double largest_eighth_derivative() const noexcept {
        constexpr int cuts = 256;
        const double beyond = (upper_ - lower_) / 16.0;
        const double step = (upper_ - lower_ + 2.0 * beyond) / cuts;
        double largest = 0.0;
        for (int k = 0; k < cuts; ++k) {
            const double from = lower_ - beyond + k * step;
            largest = std::max(largest, derivative_bounds(curve_.parameters(), from, from + step)[8]);
        }
        return largest;
    }

    /// Computes the proved errors of value and slope: the distance of the polynomials from f plus the rounding errors
    /// of the coefficients and of the evaluation. `eighth` is a bound of |f^(8)|.
    void certify(const PiecewiseSeptic& table, double eighth, const Jet& rounding) noexcept {
        const double h = table.width();
        value_error_ = eighth * std::pow(h, 8) / (256.0 * 40320.0);
        slope_error_ = eighth * std::pow(h, 7) / (64.0 * 720.0);
        double power = 1.0;
        for (std::size_t d = 0; d < rounding.size(); ++d) {
            value_error_ += detail::hermite_value[d] * rounding[d] * power;
            slope_error_ += detail::hermite_slope[d] * rounding[d] * power / h;
            power *= h;
        }
        std::array<double, 2> worst{};
        for (std::size_t k = 0; k < table.size(); ++k) {
            const auto [value, slope] = table.rounding(k);
            worst = {std::max(worst[0], value), std::max(worst[1], slope)};
        }
        value_error_ += worst[0];
        slope_error_ += worst[1];
    }

    NetworkCurve curve_;
    PiecewiseSeptic table_;
    double lower_;
    double upper_;
    // Lowest and highest position at which only the table is used. The interval is empty without a table, and for a
    // periodic force, whose energy changes with each period.
    double table_from_ = std::numeric_limits<double>::infinity();
    double table_to_ = -std::numeric_limits<double>::infinity();
    double value_error_ = 0.0;
    double slope_error_ = 0.0;
};

/// A `WaveletNetwork` with its continuations, evaluated from a table of polynomials (`CompiledCurve`).
class CompiledNetwork {
  public:
    using State = Stateless;

    explicit CompiledNetwork(const WaveletNetwork& network, const CompileOptions& options = {})
        : curve_{network.curve(), options} {}

    /// Returns the table of polynomials that is evaluated in place of the wavelet network.
    [[nodiscard]] const CompiledCurve& curve() const noexcept { return curve_; }

    /// Returns force, slope and energy at position x.
    [[nodiscard, gnu::always_inline]] inline EnvironmentSample at(double x, const State&) const noexcept {
        const Curve curve = curve_.at(x);
        return {curve.value, curve.slope, curve.integral, curve_.extrapolated(x)};
    }
    void advance(double /*x*/, State&) const noexcept {}
    [[nodiscard]] State start(double /*x*/) const noexcept { return {}; }

  private:
    CompiledCurve curve_;
};

static_assert(Environment<CompiledNetwork>);

/// A `HysteresisNetwork` whose mean force and hysteresis are evaluated from tables of polynomials (`CompiledCurve`).
class CompiledHysteresis : public HysteresisPair<CompiledCurve> {
  public:
    explicit CompiledHysteresis(const HysteresisNetwork& network, const CompileOptions& options = {})
        : HysteresisPair{CompiledCurve{network.force(), options},
                         CompiledCurve{network.hysteresis_force(), options}, network.play_radius()} {}
};

static_assert(Environment<CompiledHysteresis>);

}  // namespace palpate
