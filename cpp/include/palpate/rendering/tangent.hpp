// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "palpate/model/derivatives.hpp"
#include "palpate/model/environment.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/model/network_curve.hpp"
#include "palpate/rendering/any_structure.hpp"
#include "palpate/rendering/held_slope.hpp"
#include "palpate/rendering/structure.hpp"

namespace palpate {

namespace detail {

/// Returns an upper bound of the rising slope of a network over [low, high] inside its domain, at least 0 [N/m]: the
/// larger slope at an end, plus max|f'''| h^2 / 8 with the width h.
[[nodiscard]] inline double rising_slope(const NetworkParameters& network, double sign, double low,
                                         double high) noexcept {
    const double ends = std::max(sign * derivatives(network, low)[1], sign * derivatives(network, high)[1]);
    const double h = high - low;
    const double rounding = derivatives_rounding(network, std::max(std::abs(low), std::abs(high)))[1];
    return ends + derivative_bounds(network, low, high)[3] * h * h / 8.0 + rounding;
}

/// Returns the largest slope >= 0 of a continuation.
[[nodiscard]] inline double rising_slope(const EdgeLine& line) noexcept {
    return std::max(0.0, line_slopes(line).upper);
}

/// Returns the largest value over 0 < d <= n of (2 / d^2) * integral of (d - u) m(u) du from 0 to d, for a function m
/// >= 0 with the values m(0), ..., m(n - 1) in the steps 0 to 1, ..., n - 1 to n.
template <class Step>
[[nodiscard]] double largest_weighted_mean(int n, Step m) noexcept {
    double most = 0.0;
    double area = 0.0;    // integral of m up to the step
    double moment = 0.0;  // integral of (k - u) m up to the step k
    for (int k = 0; k < n; ++k) {
        const double value = m(k);
        const auto mean = [&](double d) {
            const double beyond = d - k;
            return 2.0 * (moment + (area + 0.5 * value * beyond) * beyond) / (d * d);
        };
        most = std::max(most, mean(k + 1.0));
        // In each step the mean has at most one extremum
        const double at = 2.0 * (moment - area * k) + value * k * k;
        const double per = value * k - area;
        if (per != 0.0 && at / per > k && at / per < k + 1.0) {
            most = std::max(most, mean(at / per));
        }
        moment += area + 0.5 * value;
        area += value;
    }
    return most * (1.0 + 1e-12);
}

}  // namespace detail

/// Slopes kappa by position, such that a line of slope kappa through the force at x stores at least the energy of the
/// force in every motion of at most w from x:
///
///     kappa >= 2 [V(x + d) - V(x) - f(x) d] / d^2,  0 < |d| <= w.
///
/// The right side is the mean of f' over the motion with weights that fall from x to x + d. The slopes are computed for
/// cells of w / 16 from upper bounds of f' and hold for every position within half an encoder step of the measured one,
/// if an encoder step is at most w / 8. With hysteresis, f' is that of the branch on which the play operator sticks.
class SteepestSlopes {
  public:
    SteepestSlopes(const ForceModel& model, double motion) {
        const Domain& domain = model.domain();
        const double travel = domain.upper[0] - domain.lower[0];
        const auto cells = static_cast<int>(std::ceil(cells_in_motion * travel / motion));
        width_ = travel / cells;
        periodic_ = domain.period.has_value();
        const int reach = static_cast<int>(std::ceil(motion / width_));
        const std::vector<double> rising = rising_slopes(model, cells);
        const int beyond =
            periodic_ ? 0 : reach + 4;  // cells outside the domain from which it can be reached
        from_ = domain.lower[0] - beyond * width_;
        const auto slope = [&](int cell) {
            // The slopes of the cells follow that below the domain
            const int index = 1 + (periodic_ ? (cell % cells + cells) % cells : std::clamp(cell, -1, cells));
            return rising[static_cast<std::size_t>(index)];
        };
        // The true position lies in the measured cell or in one of its neighbours
        const auto steepest = [&](int first, int last) {
            double most = 0.0;
            for (int cell = first; cell <= last; ++cell) {
                most = std::max(most, slope(cell));
            }
            return most;
        };
        for (int cell = -beyond; cell < cells + beyond; ++cell) {
            slopes_.push_back(
                std::max(detail::largest_weighted_mean(
                             reach, [&](int k) { return steepest(cell - 1 + k, cell + 2 + k); }),
                         detail::largest_weighted_mean(
                             reach, [&](int k) { return steepest(cell - 2 - k, cell + 1 - k); })));
        }
    }

    /// Returns the slope at a measured position that is finite [N/m or N*m/rad].
    [[nodiscard]] double at(double position) const noexcept {
        const auto cells = static_cast<double>(slopes_.size());
        double cell = std::floor((position - from_) / width_);
        if (periodic_) {
            cell -= cells * std::floor(cell / cells);
        }
        return slopes_[static_cast<std::size_t>(std::clamp(cell, 0.0, cells - 1.0))];
    }

  private:
    /// Returns upper bounds of the rising slope, at least 0: below the domain, in each cell, and above the domain.
    [[nodiscard]] static std::vector<double> rising_slopes(const ForceModel& model, int cells) {
        const HysteresisNetwork* both = model.hysteresis();
        const NetworkCurve& g = both != nullptr ? both->force() : model.network()->curve();
        const NetworkCurve* h = both != nullptr ? &both->hysteresis_force() : nullptr;
        const double travel = g.upper() - g.lower();
        const auto outside = [&](const EdgeLine& force, const EdgeLine* hysteresis) {
            double most = detail::rising_slope(force);
            if (hysteresis != nullptr) {
                most += std::abs(hysteresis->at_edge.slope) +
                        std::max(0.0, hysteresis->at_edge.value) / both->play_radius();
            }
            return most;
        };
        std::vector<double> rising{outside(g.below(), h != nullptr ? &h->below() : nullptr)};
        for (int k = 0; k < cells; ++k) {
            const double low = g.lower() + travel * k / cells;
            const double high = g.lower() + travel * (k + 1) / cells;
            double most = detail::rising_slope(g.parameters(), 1.0, low, high);
            if (h != nullptr) {
                const NetworkParameters& loss = h->parameters();
                const double width = high - low;
                most += std::max(detail::rising_slope(loss, 1.0, low, high),
                                 detail::rising_slope(loss, -1.0, low, high));
                most += (std::max({0.0, derivatives(loss, low)[0], derivatives(loss, high)[0]}) +
                         derivative_bounds(loss, low, high)[2] * width * width / 8.0 +
                         derivatives_rounding(loss, std::max(std::abs(low), std::abs(high)))[0]) /
                        both->play_radius();
            }
            rising.push_back(std::max(0.0, most));
        }
        rising.push_back(outside(g.above(), h != nullptr ? &h->above() : nullptr));
        return rising;
    }

    double from_ = 0.0;   ///< lower end of the first cell [m or rad]
    double width_ = 1.0;  ///< width of a cell [m or rad]
    bool periodic_ = false;
    std::vector<double> slopes_;
};

/// Renders a force of position by lines, F + kappa (x - x_k), that the motor controller of the device holds until the
/// next one. F = f(x_k) is the force at the measured position x_k; `HeldSlope` gives the slope kappa >= 0. A force that
/// is held for a period lags the motion; a line does not (docs/certificate.md).
///
/// With the rule `Steepest` the force is limited before it is sent. With the other rules the line of the unlimited
/// force is sent, and the limit acts on the line (`ForceLimit`) and in the controller: a line through the limited force
/// with the slope of the unlimited force gives energy.
template <Environment E>
class Tangent {
  public:
    Tangent(E environment, const HeldSlope& line, double force_limit, const ForceModel& model)
        : environment_{std::move(environment)}, line_{line}, force_limit_{force_limit} {
        if (line.rule == SlopeRule::Steepest) {
            steepest_.emplace(model, line.motion.value_or(0.0));
        }
        reset(0.0);
    }

    /// Resets the state of the virtual object to that of an object at rest at this position.
    void reset(double position) noexcept { state_ = environment_.start(position); }

    /// Returns the force at the measured position and the slope of the line.
    [[nodiscard]] Rendered step(double position) noexcept {
        typename E::State state = state_;
        const EnvironmentSample sample = environment_.at(position, state);
        environment_.advance(position, state);
        if (!std::isfinite(position) || !std::isfinite(sample.force)) {
            return detail::refused(position);
        }
        state_ = state;
        const bool limits = line_.rule == SlopeRule::Steepest;
        return {limits ? std::clamp(sample.force, -force_limit_, force_limit_) : sample.force,
                position,
                1,
                Status::Ok,
                sample.extrapolated,
                slope(position, sample.slope)};
    }

  private:
    [[nodiscard]] double slope(double position, double slope_of_force) const noexcept {
        switch (line_.rule) {
            case SlopeRule::Steepest:
                return std::min(steepest_->at(position), line_.slope);
            case SlopeRule::Raised:
                return std::max(slope_of_force, 0.0) + line_.lift;
            case SlopeRule::Constant:
                break;
        }
        return line_.slope;
    }

    E environment_;
    typename E::State state_;
    HeldSlope line_;
    double force_limit_;
    std::optional<SteepestSlopes> steepest_;
};

/// Builds the tangent structure.
struct TangentStructure {
    static constexpr StructureTraits traits{.name = "tangent", .line = true};

    template <Environment E, class SolverOf>
    static AnyStructure build(E environment, const StructureNumbers& numbers, const SolverOf& /*solver_of*/) {
        return Tangent{std::move(environment), numbers.line.value_or(HeldSlope{}), numbers.force_limit,
                       *numbers.model};
    }
};

}  // namespace palpate
