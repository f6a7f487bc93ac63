// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <limits>

#include "palpate/model/environment.hpp"
#include "palpate/status.hpp"

namespace palpate {

/// The equation that a tick solves for the position y of the virtual object with the force f:
///
///     f(y) + slope * y = intercept.
///
/// `slope` and `intercept` contain object mass, object damping and the virtual coupling, so all structures that solve
/// an equation solve this one. The equation has one solution for every intercept if slope + f' > 0 at all positions.
struct LoadLine {
    double slope = 0.0;      ///< slope p of the load line [N/m]
    double intercept = 0.0;  ///< right side q of the load line [N]
};

/// Position y that solves a load line f(y) + p y = q, with the force at y and the result of the search.
struct Solution {
    double position = 0.0;          ///< solution y [m]
    EnvironmentSample environment;  ///< force, slope and energy of the virtual object at the solution
    /// f(y) + p y - q at the computed y [N or N*m]; 0 if a proved error bound makes this evaluation unnecessary
    double residual = 0.0;
    int evaluations = 0;  ///< number of evaluations of the force that the search needed
    Status status = Status::Ok;
};

/// State between two calls of the solver: the last finite solution, at which the next search starts.
struct WarmStart {
    double position = 0.0;  ///< last finite solution y, at first the position given to the constructor [m]

    WarmStart() = default;
    explicit WarmStart(double at) noexcept : position{at} {}
};

/// Interval of positions that contains the solution of a load line.
struct Bracket {
    double low = -std::numeric_limits<double>::infinity();  ///< residual < 0 at `low`: the solution is > low
    double high =
        std::numeric_limits<double>::infinity();  ///< residual > 0 at `high`: the solution is < high
};

/// Solves a load line f(y) + p y = q that is not proved to have exactly one solution, by Newton's method inside a
/// bracket and with a limited number of evaluations. (`CertifiedSolver` solves load lines that are proved to have
/// exactly one solution.)
///
/// Until the residual f(y) + p y - q changes its sign, the search moves the position y in the direction of -residual,
/// by at most `longest_step` in each iteration. If `longest_step` is shorter than the distance between two solutions,
/// the search ends at the first solution in this direction. A slow motion would reach the same solution.
struct LoadLineSolver {
    int max_evaluations = 64;  ///< number of evaluations of the force after which the search stops
    double tolerance = 1e-13;  ///< largest accepted |residual / slope of the residual| / (1 + |y|)
    /// Largest change of y in a step while no interval is known to contain the solution [m]
    double longest_step = std::numeric_limits<double>::infinity();

    using Memory = WarmStart;

    [[nodiscard]] static constexpr bool tabulated() noexcept { return false; }
    /// Returns false for every slope of the load line: this solver has no proof that a load line has only one solution.
    [[nodiscard]] static constexpr bool unique(double) noexcept { return false; }
    [[nodiscard]] const LoadLineSolver& uncertified() const noexcept { return *this; }

    /// Solves the load line from the last solution in `memory`, and stores the new solution in `memory` unless it is
    /// not finite.
    template <Environment E>
    [[nodiscard]] Solution solve(const E& environment, const typename E::State& state, LoadLine line,
                                 WarmStart& memory) const noexcept {
        const Solution solution = search(environment, state, line, memory.position, Bracket{});
        if (solution.status != Status::NonFinite) {
            memory.position = solution.position;
        }
        return solution;
    }

    /// Solves the load line from the position `start`.
    template <Environment E>
    [[nodiscard]] Solution solve(const E& environment, const typename E::State& state, LoadLine line,
                                 double start) const noexcept {
        return search(environment, state, line, start, Bracket{});
    }

    /// Solves the load line from the position `start`, inside a bracket over which the residual rises with the
    /// position.
    template <Environment E>
    [[nodiscard]] Solution solve(const E& environment, const typename E::State& state, LoadLine line,
                                 double start, Bracket bracket) const noexcept {
        Solution at = search(environment, state, line, start, bracket);
        if (at.status == Status::NotUnique) {
            at.status = Status::Ok;  // the search ended at an end of `bracket`, which is then the solution
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
        Solution at;
        at.position = start;
        auto [low, high] = within;
        double last_step = infinity;
        double last_residual = infinity;
        for (at.evaluations = 1;; ++at.evaluations) {
            at.environment = environment.at(at.position, state);
            at.residual = at.environment.force + (line.slope * at.position - line.intercept);
            const double slope = line.slope + at.environment.slope;
            if (!std::isfinite(at.residual) || !std::isfinite(slope)) {
                at.status = Status::NonFinite;
                return at;
            }
            // The residual is tested before the bracket can replace a Newton step by a bisection, and the tolerance is
            // at least the rounding error of the residual. Otherwise a solution at an end of the bracket would need
            // dozens of bisections.
            const double tolerated = accepted(at.position);
            const double size = std::abs(line.slope * at.position) + std::abs(line.intercept);
            if (std::abs(at.residual) <= std::fmax(tolerated * std::abs(slope), rounding * size)) {
                at.status = slope > 0.0 ? Status::Ok : Status::NotUnique;
                return at;
            }
            (at.residual < 0.0 ? low : high) = at.position;
            if (at.evaluations >= max_evaluations) {
                at.status = Status::MaxIterations;
                return at;
            }
            if (high - low <= tolerated) {
                return at;
            }
            // Newton's step is used while the slope p + f' of the residual is > 0, the step stays inside the bracket,
            // and each step at least halves the residual.
            const double newton = slope > 0.0 ? -at.residual / slope : 0.0;
            const double direction = at.residual < 0.0 ? 1.0 : -1.0;
            double step = newton;
            if (std::isfinite(low) && std::isfinite(high)) {
                const double target = at.position + newton;
                if (!(target > low && target < high) || std::abs(at.residual) > 0.5 * last_residual) {
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
