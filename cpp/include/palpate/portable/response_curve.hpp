// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <utility>

#include "palpate/model/bounds.hpp"
#include "palpate/model/derivatives.hpp"
#include "palpate/model/network_curve.hpp"

namespace palpate {

/// The force of a virtual object as a function of the position z in front of a spring of compliance `compliance` [m/N]:
///
///     F(z) = f(y),   y + compliance f(y) = z.
///
/// With the compliance 0, F is the force law f itself. With the compliance 1 / p, F solves the load line f(y) + p y = p
/// z of the massless structure; y = z - F(z) / p then follows without the loss of digits of F = q - p y. A compensated
/// model has the compliance 1 / p - 1 / K_c, because its force at y - f(y) / K_c is f(y).
class ResponseCurve {
  public:
    ResponseCurve(NetworkCurve curve, double compliance)
        : curve_{std::move(curve)},
          compliance_{compliance},
          rounding_{jet_rounding(curve_.parameters(),
                                 1.25 * std::max(std::abs(curve_.lower()), std::abs(curve_.upper())))},
          below_{line(curve_.below())},
          above_{line(curve_.above())} {}

    [[nodiscard]] const NetworkCurve& curve() const noexcept { return curve_; }
    [[nodiscard]] bool periodic() const noexcept { return curve_.periodic(); }
    /// Returns true if F differs from the force law f.
    [[nodiscard]] bool has_load_line() const noexcept { return compliance_ != 0.0; }
    /// Returns the lowest and the highest position z of the domain [m].
    [[nodiscard]] double lower() const noexcept { return below_.edge; }
    [[nodiscard]] double upper() const noexcept { return above_.edge; }
    /// Return the straight lines of F outside the domain.
    [[nodiscard]] const EdgeLine& below() const noexcept { return below_; }
    [[nodiscard]] const EdgeLine& above() const noexcept { return above_; }

    /// Returns true if F is unique on the straight lines outside the domain.
    [[nodiscard]] bool lines_rise() const noexcept {
        return periodic() || (1.0 + compliance_ * curve_.below().at_edge.slope > 0.0 &&
                              1.0 + compliance_ * curve_.above().at_edge.slope > 0.0);
    }

    /// A part of the domain, with proved properties of F.
    struct Part {
        double from = 0.0;         ///< first position z of the part [m]
        double to = 0.0;           ///< last position z of the part [m]
        Interval positions;        ///< positions y for `from` and `to` [m]
        double sixth = 0.0;        ///< bound of |F^(6)|; infinity if F is not proved to be unique
        double value_error = 0.0;  ///< bound of the rounding error of `value` in this part [N]
    };

    /// Returns the part [from, to] of the domain with its proved properties.
    [[nodiscard]] Part part(double from, double to) const noexcept {
        if (compliance_ == 0.0) {
            return {from, to, {from, to}, derivative_bounds(curve_.parameters(), from, to)[6], rounding_[0]};
        }
        const double margin = 0.125 * (curve_.upper() - curve_.lower());
        const Interval all{curve_.lower() - margin, curve_.upper() + margin};
        Part part{from, to, {solve(from, all), solve(to, all)}, infinity, 0.0};
        if (!(part.positions.lower < part.positions.upper)) {
            return part;
        }
        const auto [a, b] = part.positions;
        const double middle = 0.5 * (a + b);
        const double radius = 0.5 * (b - a);
        const DerivativeBounds f = derivative_bounds(curve_.parameters(), a, b);
        const double slope = jet(curve_.parameters(), middle)[1];
        const double spread = f[2] * radius + rounding_[1];
        // Smallest slope of y + compliance f(y) in the part
        const double least = 1.0 + compliance_ * slope - std::abs(compliance_) * spread - 1e-15;
        if (!(least > 0.0)) {
            return part;
        }
        constexpr double epsilon = std::numeric_limits<double>::epsilon();
        const double size = std::max(std::abs(from), std::abs(to)) + std::max(std::abs(a), std::abs(b));
        const double position_error =
            (std::abs(compliance_) * (rounding_[0] + 4.0 * epsilon * f[0]) + 16.0 * epsilon * size) / least;
        part.sixth = sixth_derivative(f, least);
        part.value_error = rounding_[0] + (std::abs(slope) + spread) * position_error;
        return part;
    }

    /// Returns F at a position z of a part of the domain [N].
    [[nodiscard]] double value(const Part& part, double z) const noexcept {
        return curve_.inside(compliance_ == 0.0 ? z : solve(z, part.positions)).value;
    }

    /// Returns a lower bound of max |F| and max |F'| over the domain, from samples.
    [[nodiscard]] std::array<double, 2> largest_samples() const noexcept {
        constexpr int places = 512;
        std::array<double, 2> largest{};
        for (int k = 0; k <= places; ++k) {
            const Curve at = curve_.inside(curve_.lower() + (curve_.upper() - curve_.lower()) * k / places);
            largest = {std::max(largest[0], std::abs(at.value)),
                       std::max(largest[1], std::abs(at.slope / (1.0 + compliance_ * at.slope)))};
        }
        return largest;
    }

  private:
    static constexpr double infinity = std::numeric_limits<double>::infinity();

    /// Returns a bound of |F^(6)|, which is the sixth derivative of y divided by the compliance.
    ///
    /// Taylor coefficient n of the inverse of y + compliance f(y) is at most b_n, with b_1 = 1 / least. For n >= 2, b_n
    /// is the coefficient of s^n in 1 / least sum_k a_k (sum_j b_j s^j)^k, where a_k bounds |compliance f^(k)| / k!.
    [[nodiscard]] double sixth_derivative(const DerivativeBounds& f, double least) const noexcept {
        constexpr std::size_t order = 6;
        std::array<double, order + 1> b{};
        b[1] = 1.0 / least;
        double last = 0.0;
        for (std::size_t n = 2; n <= order; ++n) {
            std::array<double, order + 1> power = b;
            double sum = 0.0;
            double factorial = 1.0;
            for (std::size_t k = 2; k <= n; ++k) {
                std::array<double, order + 1> product{};
                for (std::size_t i = k - 1; i <= n; ++i) {
                    for (std::size_t j = 1; i + j <= n; ++j) {
                        product[i + j] += power[i] * b[j];
                    }
                }
                power = product;
                factorial *= static_cast<double>(k);
                sum += f[k] / factorial * power[n];
            }
            last = sum / least;
            b[n] = std::abs(compliance_) * last;
        }
        return 720.0 * last * (1.0 + 1e-9);
    }

    /// Returns the position y between the ends of `bracket` with y + compliance f(y) = z, exact to rounding. Applies
    /// Newton's method with a bracket.
    [[nodiscard]] double solve(double z, Interval bracket) const noexcept {
        double low = bracket.lower;
        double high = bracket.upper;
        double y = std::clamp(z, low, high);
        for (int k = 0; k < 100; ++k) {
            const Jet f = jet(curve_.parameters(), y);
            const double residual = y + compliance_ * f[0] - z;
            (residual < 0.0 ? low : high) = y;
            double next = y - residual / (1.0 + compliance_ * f[1]);
            if (!(next >= low && next <= high)) {
                next = 0.5 * (low + high);
            }
            if (!(std::abs(next - y) > 2.0 * std::numeric_limits<double>::epsilon() * std::abs(y))) {
                return next;
            }
            y = next;
        }
        return y;
    }

    /// Returns a straight line of f as a straight line of F over z.
    [[nodiscard]] EdgeLine line(const EdgeLine& of_force) const noexcept {
        const double stretch = 1.0 + compliance_ * of_force.at_edge.slope;
        EdgeLine line = of_force;
        line.edge += compliance_ * of_force.at_edge.value;
        line.at_edge.slope /= stretch;
        line.reach *= stretch;
        return line;
    }

    NetworkCurve curve_;
    double compliance_;
    Jet rounding_;
    EdgeLine below_;
    EdgeLine above_;
};

}  // namespace palpate
