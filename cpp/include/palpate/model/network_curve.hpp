// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

#include "palpate/model/bounds.hpp"
#include "palpate/model/continuation.hpp"
#include "palpate/model/hat_sum.hpp"
#include "palpate/model/parameters.hpp"

namespace palpate {

namespace detail {

/// Requested accuracy of the proved bounds of a slope: their difference from its true minimum and maximum, as a share
/// of the steepest slope. A wider bound reduces the stiffness that can be rendered.
inline constexpr double slope_slack = 1e-4;

/// Returns the smallest and the largest slope of a force outside one edge of the domain: the slope of its straight
/// line, and 0 where the line has ended.
[[nodiscard]] inline Interval line_slopes(const EdgeLine& line) noexcept {
    const double slope = line.at_edge.slope;
    return std::isfinite(line.reach) ? Interval{std::min(slope, 0.0), std::max(slope, 0.0)}
                                     : Interval{slope, slope};
}

}  // namespace detail

/// The force of a wavelet network of one input over all positions: the sum of eq. 4 inside the domain, and outside the
/// domain either a straight line on each side or, for a periodic force, the force inside the domain repeated.
class NetworkCurve {
  public:
    NetworkCurve(const NetworkParameters& network, const Domain& domain)
        : network_{network},
          hats_{network},
          lower_{domain.lower[0]},
          upper_{domain.upper[0]},
          periodic_{domain.period.has_value()} {
        if (periodic_) {
            remove_jump_between_ends();
        }
        continue_with({lower_, inside(lower_)}, {upper_, inside(upper_)});
    }

    /// Sets the straight lines that continue the force below and above the domain.
    void continue_with(const EdgeLine& below, const EdgeLine& above) noexcept {
        below_ = below;
        above_ = above;
    }

    [[nodiscard]] const NetworkParameters& parameters() const noexcept { return network_; }
    [[nodiscard]] double lower() const noexcept { return lower_; }
    [[nodiscard]] double upper() const noexcept { return upper_; }
    [[nodiscard]] bool periodic() const noexcept { return periodic_; }
    [[nodiscard]] const EdgeLine& below() const noexcept { return below_; }
    [[nodiscard]] const EdgeLine& above() const noexcept { return above_; }

    /// Returns force, slope and antiderivatives at any position x, continuation included.
    [[nodiscard]] Curve at(double x) const noexcept {
        return continued(x, [this](double within) noexcept { return inside(within); });
    }

    /// Returns force, slope and antiderivatives at any position x, continuation included. Inside the domain they are
    /// computed by `inside` instead of eq. 4. A position that is not finite gives NaN.
    template <class Inside>
    [[nodiscard]] Curve continued(double x, Inside inside) const noexcept {
        if (!periodic_ && x >= lower_ && x <= upper_) {
            return inside(x);
        }
        if (!std::isfinite(x)) {
            constexpr double none = std::numeric_limits<double>::quiet_NaN();
            return {none, none, none, none};
        }
        return periodic_ ? wrapped(x, inside) : x < lower_ ? below_.at(x) : above_.at(x);
    }

    /// Returns true if x is not finite, or lies outside the domain of a force that is not periodic.
    [[nodiscard]] bool extrapolated(double x) const noexcept {
        return periodic_ ? !std::isfinite(x) : !(x >= lower_ && x <= upper_);
    }

    /// Returns force, slope and antiderivatives at position x by eq. 4 of the paper, without continuation. Computes one
    /// exponential for each wavelet.
    [[nodiscard]] Curve inside(double x) const noexcept {
        const double c = network_.linear[0];
        const double b = network_.bias;
        Curve sum{c * x + b, c, (0.5 * c * x + b) * x, (c * x / 6.0 + 0.5 * b) * x * x};
        hats_.add(x, sum);
        return sum;
    }

    /// Computes force, slope or antiderivative at every position in `x`, continuation included. `result` has the same
    /// size as `x`.
    void at(HatQuantity quantity, std::span<const double> x, std::span<double> result) const noexcept {
        const double c = network_.linear[0];
        const double b = network_.bias;
        for (std::size_t k = 0; k < x.size(); ++k) {
            result[k] = quantity == HatQuantity::Force   ? c * x[k] + b
                        : quantity == HatQuantity::Slope ? c
                                                         : (0.5 * c * x[k] + b) * x[k];
        }
        hats_.add(quantity, x, result);
        for (std::size_t k = 0; k < x.size(); ++k) {
            if (!(x[k] >= lower_ && x[k] <= upper_) || periodic_) {
                const Curve curve = at(x[k]);
                result[k] = quantity == HatQuantity::Force   ? curve.value
                            : quantity == HatQuantity::Slope ? curve.slope
                                                             : curve.integral;
            }
        }
    }

    /// Return proved lower and upper bounds of the force and of its slope inside the domain, wider than the true ones
    /// by at most 1 % of the largest absolute value.
    [[nodiscard]] Interval value_bounds() const { return palpate::value_bounds(network_, lower_, upper_); }
    [[nodiscard]] Interval slope_bounds() const { return palpate::slope_bounds(network_, lower_, upper_); }
    /// Returns proved bounds of the slope at every position, continuation included. A certificate uses these bounds, so
    /// every other limit of the slope must use them too.
    [[nodiscard]] Interval slopes_everywhere() const {
        const Interval inside = palpate::slope_bounds(network_, lower_, upper_, detail::slope_slack);
        return periodic_ ? inside
                         : inside.with(detail::line_slopes(below_)).with(detail::line_slopes(above_));
    }

    /// Returns the properties of the force inside the domain from which its straight lines outside the domain are
    /// computed.
    [[nodiscard]] CurveExtent extent() const {
        const double travel = upper_ - lower_;
        const double margin = uncertain_end * travel;
        const double steepest = palpate::slope_bounds(network_, lower_ + margin, upper_ - margin).upper;
        return {travel, value_bounds().largest(), std::max(0.0, steepest)};
    }

  private:
    /// Returns force, slope and antiderivatives of a periodic force. Force and slope repeat; the antiderivatives change
    /// from period to period.
    template <class Inside>
    [[nodiscard]] Curve wrapped(double x, Inside inside) const noexcept {
        const double period = upper_ - lower_;
        const double turns = std::floor((x - lower_) / period);
        const double along = x - turns * period - lower_;
        const Curve& first = below_.at_edge;
        const Curve& last = above_.at_edge;
        const double turn = last.integral - first.integral;
        const double double_turn = last.double_integral - first.double_integral - first.integral * period;
        Curve curve = inside(lower_ + along);
        curve.double_integral += turns * (turn * along + double_turn + 0.5 * (turns - 1.0) * turn * period) -
                                 first.double_integral - first.integral * along;
        curve.integral += turns * turn - first.integral;
        return curve;
    }

    /// Makes a periodic force continuous: subtracts a straight line from the force so that both ends of a period have
    /// the same force. A difference of rounding size is ignored, so that a network that is already continuous keeps its
    /// parameters.
    void remove_jump_between_ends() noexcept {
        double size = std::abs(network_.bias) +
                      std::abs(network_.linear[0]) * std::max(std::abs(lower_), std::abs(upper_));
        for (const double weight : network_.weight) {
            size += std::abs(weight);
        }
        const double jump = inside(upper_).value - inside(lower_).value;
        if (std::abs(jump) <= 1e-12 * size) {
            return;
        }
        const double ramp = jump / (upper_ - lower_);
        network_.linear[0] -= ramp;
        network_.bias += ramp * 0.5 * (lower_ + upper_);
    }

    NetworkParameters network_;
    HatSum hats_;
    double lower_;
    double upper_;
    bool periodic_;
    EdgeLine below_;
    EdgeLine above_;
};

}  // namespace palpate
