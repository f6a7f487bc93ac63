// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <limits>

#include "palpate/model/environment.hpp"
#include "palpate/status.hpp"

namespace palpate {

/// What a time step asks of the environment: the position y where
///
///     f(y) + slope * y = intercept.
///
/// Inertia, damping and the virtual coupling are all in the two numbers, so every implicit structure ends in
/// the same scalar equation. It has one solution for every intercept where slope + f' > 0.
struct LoadLine {
    double slope = 0.0;      ///< p
    double intercept = 0.0;  ///< q
};

/// The position on the load line, and why the search ended there.
struct Solution {
    double position = 0.0;
    EnvironmentSample environment;
    double residual = 0.0;  ///< f(y) + p y - q [N or N*m]; 0 where a bound confirms what was not evaluated
    int evaluations = 0;    ///< of the environment
    Status status = Status::Ok;
};

/// What the last step leaves to the next.
struct WarmStart {
    double position = 0.0;  ///< the last solution

    WarmStart() = default;
    explicit WarmStart(double at) noexcept : position{at} {}
};

/// Where a solution is known to lie.
struct Bracket {
    double low = -std::numeric_limits<double>::infinity();  ///< residual < 0 here: the solution lies above
    double high = std::numeric_limits<double>::infinity();  ///< residual > 0 here: the solution lies below
};

/// Newton's method on f(y) + p y = q for a force of which nothing is certified: kept inside a bracket and bounded
/// in evaluations. (`CertifiedSolver` solves what is certified to have one solution.)
///
/// Until the residual changes sign the search walks in the direction of -residual, no farther than
/// `longest_step` at a time: where the solution is not unique it ends on the first branch met from the start,
/// which is the branch a slow motion would follow.
struct LoadLineSolver {
    int max_evaluations = 64;
    double tolerance = 1e-13;                                       ///< on |residual / slope|, times 1 + |y|
    double longest_step = std::numeric_limits<double>::infinity();  ///< while searching the bracket

    using Memory = WarmStart;

    [[nodiscard]] static constexpr bool tabulated() noexcept { return false; }
    /// Whether every load line of this slope is certified to have one solution: never.
    [[nodiscard]] static constexpr bool unique(double /*p*/) noexcept { return false; }
    [[nodiscard]] const LoadLineSolver& uncertified() const noexcept { return *this; }

    /// Solves from the last position. A step that is not finite leaves the memory as it was.
    template <Environment E>
    [[nodiscard]] Solution solve(const E& environment, const typename E::State& state, LoadLine line,
                                 WarmStart& memory) const noexcept {
        const Solution solution = search(environment, state, line, memory.position, Bracket{});
        if (solution.status != Status::NonFinite) {
            memory.position = solution.position;
        }
        return solution;
    }

    /// From a start, without memory.
    template <Environment E>
    [[nodiscard]] Solution solve(const E& environment, const typename E::State& state, LoadLine line,
                                 double start) const noexcept {
        return search(environment, state, line, start, Bracket{});
    }

    /// From a start inside a bracket in which the residual rises.
    template <Environment E>
    [[nodiscard]] Solution solve(const E& environment, const typename E::State& state, LoadLine line,
                                 double start, Bracket bracket) const noexcept {
        Solution at = search(environment, state, line, start, bracket);
        if (at.status == Status::NotUnique) {
            at.status = Status::Ok;  // the very end of the rise
        }
        return at;
    }

  private:
    [[nodiscard]] double accepted(double position) const noexcept {
        return tolerance * (1.0 + std::abs(position));
    }

    template <Environment E>
    [[nodiscard]] Solution search(const E& environment, const typename E::State& state, LoadLine line,
                                  double start, Bracket within) const noexcept {
        constexpr double infinity = std::numeric_limits<double>::infinity();
        constexpr double rounding = 4.0 * std::numeric_limits<double>::epsilon();
        Solution at{start, {}, 0.0, 0, Status::Ok};
        auto [low, high] = within;
        double last_step = infinity;
        double last_residual = infinity;
        while (true) {
            at.environment = environment.at(at.position, state);
            at.residual = at.environment.force + (line.slope * at.position - line.intercept);
            ++at.evaluations;
            const double slope = line.slope + at.environment.slope;
            if (!std::isfinite(at.residual) || !std::isfinite(slope)) {
                at.status = Status::NonFinite;
                return at;
            }
            // Tested before the bracket may halve the step, and never below what rounding leaves of a residual:
            // the bracket's end would cost dozens of bisections.
            const double close = accepted(at.position);
            const double size = std::abs(line.slope * at.position) + std::abs(line.intercept);
            if (std::abs(at.residual) <= std::fmax(close * std::abs(slope), rounding * size)) {
                at.status = slope > 0.0 ? Status::Ok : Status::NotUnique;
                return at;
            }
            (at.residual < 0.0 ? low : high) = at.position;
            if (at.evaluations >= max_evaluations) {
                at.status = Status::MaxIterations;
                return at;
            }
            const bool bracketed = std::isfinite(low) && std::isfinite(high);
            if (bracketed && high - low <= close) {
                return at;
            }
            // Newton's step is trusted while it leads uphill and the search is getting somewhere.
            const double newton = slope > 0.0 ? -at.residual / slope : 0.0;
            const double direction = at.residual < 0.0 ? 1.0 : -1.0;
            double step = newton;
            if (bracketed) {
                const double target = at.position + newton;
                const bool inside = newton != 0.0 && target > low && target < high;
                if (!inside || std::abs(at.residual) > 0.5 * last_residual) {
                    step = 0.5 * (low + high) - at.position;
                }
            } else {
                double stride = std::abs(newton);
                if (newton == 0.0 || std::abs(at.residual) > 0.5 * last_residual) {
                    const double least = 1e-3 * (1e-3 + std::abs(at.position));
                    stride = std::fmax(stride, std::isfinite(last_step) ? 2.0 * last_step : least);
                }
                step = direction * std::fmin(stride, longest_step);
            }
            at.position += step;
            last_step = std::abs(step);
            last_residual = std::abs(at.residual);
        }
    }
};

}  // namespace palpate
