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

/// How exact a compiled curve must be, and how large it may become.
struct CompileOptions {
    double relative_error = 1e-12;     ///< of max|f| over the domain, rounding included
    std::size_t largest_table = 8192;  ///< cells of 80 bytes
    std::size_t fewest_wavelets = 2;   ///< below, eq. 4 itself is as fast
};

namespace detail {

/// Largest effect on a cell's polynomial, and on its slope by t, of a unit error in each derivative by t at
/// both borders: suprema of the sums of absolute Hermite basis functions.
inline constexpr Jet hermite_value{1.0, 11.0 / 32.0, 3.0 / 64.0, 1.0 / 384.0};
inline constexpr Jet hermite_slope{4.375, 1.1875, 0.1468, 0.008945};

}  // namespace detail

/// A network of one input with its continuations, compiled to polynomials of degree 7: the cost of one
/// evaluation no longer depends on the number of wavelets.
///
/// The error is certified when the table is built. Between two borders of a cell of width h at which f and
/// three derivatives agree,
///
///     |f - p| <= max|f^(8)| h^8 / (256 * 8!),   |f' - p'| <= max|f^(8)| h^7 / (64 * 6!),
///
/// max|f^(8)| from `derivative_bounds`, and what rounding can add is bounded term by term. Where the error
/// asked for is out of reach, or the table would be too large, or there is next to nothing to sum up, the
/// curve stays what it was: `compiled` says so.
class CompiledCurve {
  public:
    explicit CompiledCurve(NetworkCurve curve, const CompileOptions& options = {})
        : curve_{std::move(curve)}, lower_{curve_.lower()}, upper_{curve_.upper()} {
        build(options);
    }

    [[nodiscard]] const NetworkCurve& curve() const noexcept { return curve_; }
    [[nodiscard]] bool compiled() const noexcept { return !table_.empty(); }
    [[nodiscard]] std::size_t cells() const noexcept { return table_.size(); }
    /// Proved bounds of |p - f| and |p' - f'| inside the domain; zero where nothing was compiled.
    [[nodiscard]] double value_error() const noexcept { return value_error_; }
    [[nodiscard]] double slope_error() const noexcept { return slope_error_; }

    /// Inlined, so that a caller pays for what it uses of the answer.
    [[nodiscard, gnu::always_inline]] inline Curve at(double x) const noexcept {
        if (x >= table_from_ && x <= table_to_) {
            return table_.at(x);
        }
        return elsewhere(x);
    }

    [[nodiscard]] bool extrapolated(double x) const noexcept { return curve_.extrapolated(x); }

  private:
    [[nodiscard, gnu::noinline]] Curve elsewhere(double x) const noexcept {
        if (!compiled() || !std::isfinite(x)) {
            return curve_.at(x);
        }
        // A position that was wrapped from far away may end beside the domain.
        return curve_.continued(x, [this](double within) noexcept {
            return table_.at(within > lower_ ? std::min(within, upper_) : lower_);
        });
    }

    void build(const CompileOptions& options) {
        const NetworkParameters& network = curve_.parameters();
        if (network.weight.size() < options.fewest_wavelets) {
            return;
        }
        const double reach = 2.0 * std::max(std::abs(lower_), std::abs(upper_));
        const double asked = options.relative_error * largest_force();
        const double eighth = largest_eighth_derivative();
        // A tenth of the error asked for is left to the polynomials, the rest to rounding.
        const double width = std::pow(0.1 * asked * 256.0 * 40320.0 / eighth, 0.125);
        const double widest = (upper_ - lower_) / 32.0;
        const int fineness = -static_cast<int>(std::floor(std::log2(std::min(width, widest))));
        // Beyond 2^40 cells from zero the position itself says little about its place in the cell.
        const double h = std::ldexp(1.0, -fineness);
        if (!((upper_ - lower_) / h + 4.0 <= static_cast<double>(options.largest_table) &&
              reach / h < 0x1p40 && PiecewiseSeptic::is_sound(h))) {
            return;
        }
        // One more cell on either side: rounding may take a position that was wrapped past an edge.
        PiecewiseSeptic table{PiecewiseSeptic::cell(lower_, h) - 1, PiecewiseSeptic::cell(upper_, h) + 1, h,
                              [&](double x) noexcept { return jet(network, x); }};
        certify(table, eighth, jet_rounding(network, reach));
        if (!(value_error_ <= asked)) {
            value_error_ = slope_error_ = 0.0;
            return;
        }
        table.integrate([this](double x) noexcept {
            const Curve here = curve_.inside(x);
            return std::array{here.integral, here.double_integral};
        });
        table_ = std::move(table);
        if (!curve_.periodic()) {
            table_from_ = lower_;
            table_to_ = upper_;
        }
    }

    /// Largest |f| met at a few places: never more than the true one, so that no more error is allowed.
    [[nodiscard]] double largest_force() const noexcept {
        constexpr int places = 64;
        double largest = 0.0;
        for (int k = 0; k <= places; ++k) {
            const double x = lower_ + (upper_ - lower_) * k / places;
            largest = std::max(largest, std::abs(curve_.inside(x).value));
        }
        return largest;
    }

    /// Over the domain and what the outermost cells cover beyond it. The domain is cut up because few
    /// wavelets are large everywhere.
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
    // Where the table answers alone: nowhere if there is none, or if every turn adds to the energy.
    double table_from_ = std::numeric_limits<double>::infinity();
    double table_to_ = -std::numeric_limits<double>::infinity();
    double value_error_ = 0.0;
    double slope_error_ = 0.0;
};

/// A `WaveletNetwork` compiled, continuations included.
class CompiledNetwork {
  public:
    using State = Stateless;

    explicit CompiledNetwork(const WaveletNetwork& network, const CompileOptions& options = {})
        : curve_{network.curve(), options} {}

    [[nodiscard]] const CompiledCurve& curve() const noexcept { return curve_; }

    [[nodiscard, gnu::always_inline]] inline EnvironmentSample at(double x,
                                                                  const State& /*stateless*/) const noexcept {
        const Curve here = curve_.at(x);
        return {here.value, here.slope, here.integral, curve_.extrapolated(x)};
    }
    void advance(double /*x*/, State& /*stateless*/) const noexcept {}
    [[nodiscard]] State start(double /*x*/) const noexcept { return {}; }

  private:
    CompiledCurve curve_;
};

static_assert(Environment<CompiledNetwork>);

/// A `HysteresisNetwork` with both its curves compiled.
class CompiledHysteresis : public HysteresisPair<CompiledCurve> {
  public:
    explicit CompiledHysteresis(const HysteresisNetwork& network, const CompileOptions& options = {})
        : HysteresisPair{CompiledCurve{network.force(), options}, CompiledCurve{network.loss(), options},
                         network.play_radius()} {}
};

static_assert(Environment<CompiledHysteresis>);

}  // namespace palpate
