// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <limits>

#include "palpate/model/environment.hpp"
#include "palpate/status.hpp"

namespace palpate {

/// The equation that a time step solves for the position y of the environment:
///
///     f(y) + slope * y = intercept.
///
/// The two numbers contain inertia, damping and the virtual coupling, so every implicit structure uses the same scalar
/// equation. It has one solution for every intercept if slope + f' > 0.
struct LoadLine {
    double slope = 0.0;      ///< p [N/m]
    double intercept = 0.0;  ///< q [N]
};

/// Position on the load line, and the result of the search.
struct Solution {
    double position = 0.0;          ///< solution y [m]
    EnvironmentSample environment;  ///< force, slope and energy there
    double residual = 0.0;  ///< f(y) + p y - q [N or N*m]; 0 if a bound confirms it without an evaluation
    int evaluations = 0;    ///< evaluations of the environment
    Status status = Status::Ok;
};

/// State between two steps.
struct WarmStart {
    double position = 0.0;  ///< last solution [m]

    WarmStart() = default;
    explicit WarmStart(double at) noexcept : position{at} {}
};

/// Interval that contains the solution.
struct Bracket {
    double low = -std::numeric_limits<double>::infinity();  ///< residual < 0 here: the solution lies above
    double high = std::numeric_limits<double>::infinity();  ///< residual > 0 here: the solution lies below
};

/// Applies Newton's method to f(y) + p y = q for a force without a certificate, inside a bracket and with a limit of
/// evaluations. (`CertifiedSolver` solves load lines that are certified to have one solution.)
///
/// Until the residual changes sign the search moves in the direction of -residual, at most `longest_step` at a time. If
/// the solution is not unique, the search ends on the first branch from the start. A slow motion would follow the same
/// branch.
struct LoadLineSolver {
    int max_evaluations = 64;  ///< evaluations after which the search stops
    double tolerance = 1e-13;  ///< largest |residual / slope|, divided by 1 + |y|
    double longest_step = std::numeric_limits<double>::infinity();  ///< until the bracket is found [m]

    using Memory = WarmStart;

    [[nodiscard]] static constexpr bool tabulated() noexcept { return false; }
    /// Returns false: without a certificate several solutions are possible.
    [[nodiscard]] static constexpr bool unique(double /*p*/) noexcept { return false; }
    [[nodiscard]] const LoadLineSolver& uncertified() const noexcept { return *this; }

    /// Solves from the last position. A step that is not finite does not change the memory.
    template <Environment E>
    [[nodiscard]] Solution solve(const E& environment, const typename E::State& state, LoadLine line,
                                 WarmStart& memory) const noexcept {
        const Solution solution = search(environment, state, line, memory.position, Bracket{});
        if (solution.status != Status::NonFinite) {
            memory.position = solution.position;
        }
        return solution;
    }

    /// Solves from a start, without memory.
    template <Environment E>
    [[nodiscard]] Solution solve(const E& environment, const typename E::State& state, LoadLine line,
                                 double start) const noexcept {
        return search(environment, state, line, start, Bracket{});
    }

    /// Solves from a start inside a bracket in which the residual rises.
    template <Environment E>
    [[nodiscard]] Solution solve(const E& environment, const typename E::State& state, LoadLine line,
                                 double start, Bracket bracket) const noexcept {
        Solution at = search(environment, state, line, start, bracket);
        if (at.status == Status::NotUnique) {
            at.status = Status::Ok;  // the end of the rising interval
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
            // This test comes before the bracket can halve the step, and its bound is at least the rounding error of a
            // residual. Otherwise the end of the bracket would cost dozens of bisections.
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
            const bool bracketed = std::isfinite(low) && std::isfinite(high);
            if (bracketed && high - low <= tolerated) {
                return at;
            }
            // Newton's step is used while it leads uphill and reduces the residual.
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
