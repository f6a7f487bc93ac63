// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <limits>

#include "palpate/model/environment.hpp"
#include "palpate/solver/load_line.hpp"
#include "palpate/status.hpp"

namespace palpate {

/// The position on the load line, and why the search ended there.
struct Solution {
    double position = 0.0;
    EnvironmentSample environment;
    double residual = 0.0;  ///< f(y) + p y - q [N or N*m]; 0 where a bound confirms what was not evaluated
    int evaluations = 0;    ///< of the environment
    Status status = Status::Ok;
};

/// What the last step leaves to the next: the solution as a function of q, to first order.
struct WarmStart {
    double position = 0.0;    ///< the last solution
    double at_zero = 0.0;     ///< what its tangent predicts for q = 0
    double compliance = 0.0;  ///< its 1 / (p + f'); 0: the solution is taken to stay

    WarmStart() = default;
    explicit WarmStart(double at) noexcept : position{at}, at_zero{at} {}
    WarmStart(double at, double q, double by_q) noexcept
        : position{at}, at_zero{at - q * by_q}, compliance{by_q} {}

    [[nodiscard]] double predicted(double q) const noexcept { return at_zero + q * compliance; }
};

/// Where a solution is known to lie.
struct Bracket {
    double low = -std::numeric_limits<double>::infinity();  ///< residual < 0 here: the solution lies above
    double high = std::numeric_limits<double>::infinity();  ///< residual > 0 here: the solution lies below
};

/// Newton's method on f(y) + p y = q, kept inside a bracket, warm-started and bounded in evaluations.
///
/// Until the residual changes sign the search walks in the direction of -residual, no farther than
/// `longest_step` at a time: where the solution is not unique it ends on the first branch met from the start,
/// which is the branch a slow motion would follow.
///
/// Where p + `least_slope` > 0 certifies that the solution is unique, the search starts where the last step
/// predicts it and has a bracket from the first residual on: |y - solution| <= |residual| / (p + least_slope).
/// With a certified `curvature` a correction d needs no evaluation to confirm it, if what it may leave of the residual
/// r, |r - (p + f') d| + curvature d^2 / 2, is small enough: most steps end after one evaluation.
struct LoadLineSolver {
    int max_evaluations = 64;
    double tolerance = 1e-13;                                       ///< on |residual / slope|, times 1 + |y|
    double longest_step = std::numeric_limits<double>::infinity();  ///< while searching the bracket
    double least_slope = -std::numeric_limits<double>::infinity();  ///< lower bound of f' on the whole line
    double curvature =
        std::numeric_limits<double>::infinity();  ///< upper bound of |f''| over [smooth_from, smooth_to]
    double smooth_from = -std::numeric_limits<double>::infinity();
    double smooth_to = std::numeric_limits<double>::infinity();

    using Memory = WarmStart;

    [[nodiscard]] static constexpr bool tabulated() noexcept { return false; }

    /// Whether every load line of this slope is certified to have one solution.
    [[nodiscard]] bool unique(double p) const noexcept { return p + least_slope > 0.0; }

    /// The same search for a force of which nothing is certified.
    [[nodiscard]] LoadLineSolver uncertified() const noexcept {
        return {.max_evaluations = max_evaluations, .tolerance = tolerance, .longest_step = longest_step};
    }

    /// Solves from where the last step predicts the solution, and leaves to the next what it may start from. A
    /// step that is not finite leaves the memory as it was.
    template <Environment E>
    [[nodiscard, gnu::always_inline]] inline Solution solve(const E& environment,
                                                            const typename E::State& state, LoadLine line,
                                                            WarmStart& memory) const noexcept {
        double start = memory.predicted(line.intercept);
        int evaluations = 0;
        if (unique(line.slope)) {
            const EnvironmentSample sample = environment.at(start, state);
            const double residual = sample.force + (line.slope * start - line.intercept);
            const double slope = line.slope + sample.slope;
            // Newton's correction by the last compliance, itself improved by one step of Newton's method: nothing
            // has to wait for a division.
            const double rough = residual * memory.compliance;
            const double missing = (1.0 - memory.compliance * line.slope) - memory.compliance * sample.slope;
            const double position = (start - rough) - rough * missing;
            if (confirmed(start, position, residual + slope * (position - start), line)) {
                memory = WarmStart{position, line.intercept, 1.0 / slope};
                return {position,
                        {line.intercept - line.slope * position, sample.slope, sample.energy,
                         sample.extrapolated},
                        0.0,
                        1,
                        Status::Ok};
            }
            start = std::isfinite(position) ? position : start;
            evaluations = 1;
        }
        const Solution found = search(environment, state, line, start, memory);
        // Field by field: a copy as a whole would send every step's position through memory.
        const auto& there = found.environment;
        return {found.position,
                {there.force, there.slope, there.energy, there.extrapolated},
                found.residual,
                found.evaluations + evaluations,
                found.status};
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

    /// Whether a correction from one position to another, which leaves so much of the residual to first order,
    /// is certified to end within the tolerance of the solution.
    [[nodiscard]] bool confirmed(double from, double to, double left, LoadLine line) const noexcept {
        const double most = std::abs(left) + 0.5 * curvature * ((to - from) * (to - from));
        return most <= accepted(from) * (line.slope + least_slope) && from >= smooth_from &&
               from <= smooth_to && to >= smooth_from && to <= smooth_to;
    }

    template <Environment E>
    [[nodiscard, gnu::noinline]] Solution search(const E& environment, const typename E::State& state,
                                                 LoadLine line, double start,
                                                 WarmStart& memory) const noexcept {
        const Solution solution = search(environment, state, line, start, Bracket{});
        if (solution.status != Status::NonFinite) {
            const double slope = line.slope + solution.environment.slope;
            memory = unique(line.slope) && std::isfinite(slope)
                         ? WarmStart{solution.position, line.intercept,
                                     1.0 / std::fmax(slope, line.slope + least_slope)}
                         : WarmStart{solution.position};
        }
        return solution;
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
            if (unique(line.slope)) {
                const double farthest = at.position - 1.0000001 * at.residual / (line.slope + least_slope);
                (at.residual < 0.0 ? high : low) =
                    at.residual < 0.0 ? std::fmin(high, farthest) : std::fmax(low, farthest);
                const double target = at.position - at.residual / slope;
                if (confirmed(at.position, target, 0.0, line)) {
                    at.position = target;
                    at.environment.force = line.intercept - line.slope * target;
                    at.residual = 0.0;
                    return at;
                }
            }
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
