// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "palpate/model/bounds.hpp"
#include "palpate/model/compiled_network.hpp"
#include "palpate/model/environment.hpp"
#include "palpate/model/network_curve.hpp"
#include "palpate/model/piecewise_septic.hpp"
#include "palpate/solver/load_line.hpp"
#include "palpate/solver/newton.hpp"

namespace palpate {

/// How exact a tabulated resolvent must be, and how large it may become.
struct ResolventOptions {
    double relative_error = 1e-12;     ///< of the travel, rounding included
    std::size_t largest_table = 8192;  ///< cells of 64 bytes
};

/// The certified bounds by which a numerical search may stop early, for load lines of slope p.
[[nodiscard]] inline LoadLineSolver certified_solver(const NetworkCurve& curve, double p) {
    LoadLineSolver solver;
    const double edges = std::min(curve.below().at_edge.slope, curve.above().at_edge.slope);
    const double least = p + std::min({curve.slope_bounds().lower, edges, 0.0});
    if (!(least > 0.0)) {
        return solver;
    }
    solver.least_slope = least;
    if (!curve.periodic()) {
        constexpr int cuts = 256;
        const double step = (curve.upper() - curve.lower()) / cuts;
        solver.curvature = 0.0;
        for (int k = 0; k < cuts; ++k) {
            const double from = curve.lower() + k * step;
            solver.curvature =
                std::max(solver.curvature, derivative_bounds(curve.parameters(), from, from + step)[2]);
        }
        solver.smooth_from = curve.lower();
        solver.smooth_to = curve.upper();
    }
    return solver;
}

/// y = R(q), the solution of f(y) + p y = q as a function of q, for a fixed p: the implicit step without any
/// iteration. Where p + f' > 0 is certified R is smooth between the edges of the domain and is tabulated there
/// by polynomials of degree 7; beyond the edges f is a line and R is solved exactly.
///
/// The error is certified on every cell by the residual of its polynomial P, r(q) = f(P(q)) + p P(q) - q. At
/// both borders r and three derivatives vanish, so |r| <= max|r^(8)| h^8 / (256 * 8!), the composition's eighth
/// derivative is bounded by the bounds of both factors' Taylor coefficients, and |P - R| <= |r| / min(p + f').
/// Where this does not certify the error asked for, the load line is solved by `LoadLineSolver`.
class Resolvent {
  public:
    Resolvent(const NetworkCurve& curve, double p, const ResolventOptions& options = {})
        : solver_{certified_solver(curve, p)}, slope_{p}, below_{curve.below()}, above_{curve.above()} {
        if (solver_.least_slope > 0.0 && std::isfinite(p) && !curve.periodic()) {
            tabulate(curve, options);
        }
    }

    [[nodiscard]] bool tabulated() const noexcept { return !table_.empty(); }
    [[nodiscard]] std::size_t cells() const noexcept { return table_.size(); }
    /// Proved bound of |y - R(q)|; zero where nothing was tabulated.
    [[nodiscard]] double position_error() const noexcept { return position_error_; }
    [[nodiscard]] const LoadLineSolver& solver() const noexcept { return solver_; }

    using Memory = WarmStart;

    [[nodiscard]] WarmStart remember(LoadLine line, const Solution& solution) const noexcept {
        return tabulated() ? WarmStart{solution.position} : solver_.remember(line, solution);
    }

    /// Inlined, so that a step pays for what it uses of the answer.
    template <Environment E>
    [[nodiscard, gnu::always_inline]] inline Solution solve(const E& environment,
                                                            const typename E::State& state, LoadLine line,
                                                            const WarmStart& start) const noexcept {
        const double q = line.intercept;
        if (q >= from_ && q <= to_ && line.slope == slope_) {
            const double y = table_.value(q - origin_);
            return {y, {q - slope_ * y, unknown, unknown, false}};
        }
        if (tabulated() && line.slope == slope_ && std::isfinite(q)) {
            return beyond(q);
        }
        return solver_.solve(environment, state, line, start);
    }

  private:
    /// The table gives position and force. Slope and energy would cost as much again, and no structure asks.
    static constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

    /// The edge line, or nothing but p y = q where contact is lost.
    [[nodiscard, gnu::noinline]] Solution beyond(double q) const noexcept {
        const EdgeLine& line = q < from_ ? below_ : above_;
        const double slope = slope_ + line.at_edge.slope;
        const double distance = (q - (line.at_edge.value + slope_ * line.edge)) / slope;
        if (std::abs(distance) < line.reach) {
            const double y = line.edge + distance;
            return {y, {q - slope_ * y, unknown, unknown, true}};
        }
        return {q / slope_, {0.0, unknown, unknown, true}};
    }

    /// One attempt: a table of some number of cells, and what is certified about it.
    struct Attempt {
        PiecewiseSeptic table;
        double origin;      ///< q in the middle of the first cell
        double truncation;  ///< of the polynomials, in y
        double rounding;
    };

    void tabulate(const NetworkCurve& curve, const ResolventOptions& options) {
        const double asked = options.relative_error * (curve.upper() - curve.lower());
        for (double cells = 128.0; cells <= static_cast<double>(options.largest_table);) {
            Attempt attempt = tabulated(curve, static_cast<std::int64_t>(cells));
            if (!(attempt.rounding <= 0.9 * asked)) {
                return;
            }
            if (attempt.truncation <= 0.1 * asked) {
                position_error_ = attempt.truncation + attempt.rounding;
                table_ = std::move(attempt.table);
                origin_ = attempt.origin;
                from_ = curve.inside(curve.lower()).value + slope_ * curve.lower();
                to_ = curve.inside(curve.upper()).value + slope_ * curve.upper();
                return;
            }
            cells =
                std::ceil(cells * std::fmax(1.1, 1.05 * std::pow(attempt.truncation / (0.1 * asked), 0.125)));
        }
    }

    [[nodiscard]] Attempt tabulated(const NetworkCurve& curve, std::int64_t cells) const {
        const NetworkParameters& network = curve.parameters();
        const double lower = curve.lower();
        const double upper = curve.upper();
        const double from = curve.inside(lower).value + slope_ * lower;
        const double to = curve.inside(upper).value + slope_ * upper;
        const double width = (to - from) / static_cast<double>(cells);
        const double origin = from + 0.5 * width;
        const double reach = std::max(std::abs(lower), std::abs(upper));
        const Jet rounding = detail::jet_rounding(network, reach);
        const double epsilon = std::numeric_limits<double>::epsilon();
        const double argument = 4.0 * epsilon * (std::max(std::abs(from), std::abs(to)) + (to - from));
        double data = 0.0;
        Jet last{lower, 0.0, 0.0, 0.0};
        const auto jet = [&](double x) noexcept {
            const double q = std::clamp(origin + x, from, to);
            const InverseJet inverse = invert(network, q, continued(last, width)[0], lower, upper);
            last = inverse.jet;
            data = std::max(data, inverse.rounding(rounding, argument, solver_.least_slope, width));
            return continued(inverse.jet, origin + x - q);
        };
        Attempt attempt{{-1, cells, width, jet}, origin, 0.0, 0.0};
        for (std::size_t k = 1; k + 1 < attempt.table.size(); ++k) {
            attempt.truncation =
                std::max(attempt.truncation, cell_error(network, attempt.table.coefficients(k)));
        }
        attempt.rounding = data + attempt.table.rounding()[0];
        return attempt;
    }

    /// R and its derivatives at one q, with what they came from.
    struct InverseJet {
        Jet jet;
        Jet forward;      ///< F = f + p y and its derivatives there
        double residual;  ///< F(y) - q

        /// How far rounding may take the value of a cell's polynomial, in y.
        [[nodiscard]] double rounding(const Jet& of_f, double argument, double least_slope,
                                      double width) const noexcept {
            const double epsilon = std::numeric_limits<double>::epsilon();
            const double off = (std::abs(residual) + of_f[0] + argument) / least_slope;
            // An error in y moves every derivative by the next one; the fourth is below what rounding costs.
            const double s = forward[1];
            const double d1 = of_f[1] + std::abs(forward[2]) * off + 2.0 * epsilon * s;
            const double d2 = of_f[2] + std::abs(forward[3]) * off;
            const double d3 = 2.0 * of_f[3];
            const double f2 = std::abs(forward[2]);
            const double f3 = std::abs(forward[3]);
            const Jet error{off, d1 / (s * s), d2 / (s * s * s) + 3.0 * f2 * d1 / (s * s * s * s),
                            (6.0 * f2 * d2 + s * d3 + f3 * d1) / std::pow(s, 5) +
                                5.0 * (3.0 * f2 * f2 + s * f3) * d1 / std::pow(s, 6)};
            double sum = 0.0;
            double power = 1.0;
            for (std::size_t d = 0; d < error.size(); ++d) {
                sum += detail::hermite_value[d] * (error[d] + 16.0 * epsilon * std::abs(jet[d])) * power;
                power *= width;
            }
            return sum;
        }
    };

    /// Newton's method in a bracket, to the last digit.
    [[nodiscard]] InverseJet invert(const NetworkParameters& network, double q, double start, double low,
                                    double high) const noexcept {
        double y = start;
        Jet forward{};
        double residual = 0.0;
        for (int evaluations = 0; evaluations < 100; ++evaluations) {
            forward = detail::jet(network, y);
            forward[0] += slope_ * y;
            forward[1] += slope_;
            residual = forward[0] - q;
            (residual < 0.0 ? low : high) = y;
            double next = y - residual / forward[1];
            if (!(next >= low && next <= high)) {
                next = 0.5 * (low + high);
            }
            if (std::abs(next - y) <= 2.0 * std::numeric_limits<double>::epsilon() * std::abs(y) ||
                std::abs(residual) <= 4.0 * std::numeric_limits<double>::epsilon() * std::abs(q)) {
                break;
            }
            y = next;
        }
        const double s = forward[1];
        const double s3 = s * s * s;
        return {
            {y, 1.0 / s, -forward[2] / s3, (3.0 * forward[2] * forward[2] - s * forward[3]) / (s3 * s * s)},
            forward,
            residual};
    }

    /// The cubic that goes on from a jet: a first guess, and what rounding may meet beyond the edges.
    [[nodiscard]] static Jet continued(const Jet& jet, double distance) noexcept {
        const double d = distance;
        return {jet[0] + d * (jet[1] + d * (0.5 * jet[2] + d * jet[3] / 6.0)),
                jet[1] + d * (jet[2] + 0.5 * d * jet[3]), jet[2] + d * jet[3], jet[3]};
    }

    /// |P - R| on one cell, P(t) of these coefficients.
    [[nodiscard]] double cell_error(const NetworkParameters& network,
                                    const std::array<double, 8>& c) const noexcept {
        constexpr std::size_t order = highest_derivative;
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
        const double spread = 0.5 * inner[1];
        const DerivativeBounds outer = derivative_bounds(network, c[0] - spread, c[0] + spread);
        // The coefficient of t^8 in sum_k |f^(k)| / k! (sum_j inner_j t^j)^k. k = 1 has none: P has degree 7.
        std::array<double, order + 1> composed = inner;
        double eighth = 0.0;
        double factorial = 1.0;
        for (std::size_t k = 2; k <= order; ++k) {
            std::array<double, order + 1> product{};
            for (std::size_t a = k - 1; a <= order; ++a) {
                for (std::size_t b = 1; a + b <= order; ++b) {
                    product[a + b] += composed[a] * inner[b];
                }
            }
            composed = product;
            factorial *= static_cast<double>(k);
            eighth += outer[k] / factorial * composed[order];
        }
        const double steepness = slope_ + detail::jet(network, c[0])[1] - outer[2] * spread;
        return (1.0 + 1e-9) * eighth / 256.0 / std::max(solver_.least_slope, steepness);
    }

    LoadLineSolver solver_;
    double slope_;
    double from_ = std::numeric_limits<double>::infinity();  ///< q at the lower edge
    double to_ = -std::numeric_limits<double>::infinity();   ///< q at the upper edge
    double origin_ = 0.0;
    PiecewiseSeptic table_;
    EdgeLine below_;
    EdgeLine above_;
    double position_error_ = 0.0;
};

}  // namespace palpate
