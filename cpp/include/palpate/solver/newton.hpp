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

/// What the last step leaves to the next: the solution moved with the load line, to first order.
struct WarmStart {
    double position = 0.0;    ///< the last solution
    double intercept = 0.0;   ///< its q
    double compliance = 0.0;  ///< its 1 / (p + f'); 0: the solution is taken to stay

    [[nodiscard]] double predicted(double q) const noexcept {
        return position + (q - intercept) * compliance;
    }
};

/// Newton's method on f(y) + p y = q, kept inside a bracket, warm-started and bounded in evaluations.
///
/// Until the residual changes sign the search walks in the direction of -residual, no farther than
/// `longest_step` at a time: where the solution is not unique it ends on the first branch met from the start,
/// which is the branch a slow motion would follow.
///
/// Where `least_slope` > 0 certifies that the solution is unique, the search starts where the last step
/// predicts it and has a bracket from the first residual on: |y - solution| <= |residual| / least_slope. With a
/// certified `curvature` Newton's last correction d needs no evaluation to confirm it, as long as it leaves a
/// residual of at most curvature d^2 / 2.
struct LoadLineSolver {
    int max_evaluations = 64;
    double tolerance = 1e-13;                                       ///< on |residual / slope|, times 1 + |y|
    double longest_step = std::numeric_limits<double>::infinity();  ///< while searching the bracket
    double least_slope = 0.0;  ///< lower bound of p + f' on the whole line; 0: none is known
    double curvature =
        std::numeric_limits<double>::infinity();  ///< upper bound of |f''| over [smooth_from, smooth_to]
    double smooth_from = -std::numeric_limits<double>::infinity();
    double smooth_to = std::numeric_limits<double>::infinity();

    using Memory = WarmStart;

    /// What the next step may start from.
    [[nodiscard]] WarmStart remember(LoadLine line, const Solution& solution) const noexcept {
        const double slope = line.slope + solution.environment.slope;
        if (least_slope > 0.0 && std::isfinite(slope)) {
            return {solution.position, line.intercept, 1.0 / std::fmax(slope, least_slope)};
        }
        return {solution.position};
    }

    template <Environment E>
    [[nodiscard]] Solution solve(const E& environment, const typename E::State& state, LoadLine line,
                                 const WarmStart& start) const noexcept {
        return solve(environment, state, line, start.predicted(line.intercept));
    }

    template <Environment E>
    [[nodiscard]] Solution solve(const E& environment, const typename E::State& state, LoadLine line,
                                 double start) const noexcept {
        constexpr double infinity = std::numeric_limits<double>::infinity();
        Solution at{start, {}, 0.0, 0, Status::Ok};
        double low = -infinity;  // residual < 0 here: the solution lies above
        double high = infinity;  // residual > 0 here: the solution lies below
        double last_step = infinity;
        double last_residual = infinity;
        while (true) {
            at.environment = environment.at(at.position, state);
            at.residual = at.environment.force + line.slope * at.position - line.intercept;
            ++at.evaluations;
            const double slope = line.slope + at.environment.slope;
            if (!std::isfinite(at.residual) || !std::isfinite(slope)) {
                at.status = Status::NonFinite;
                return at;
            }
            // Tested before the bracket may halve the step: rounding at the bracket's end would cost dozens
            // of bisections.
            const double accepted = tolerance * (1.0 + std::abs(at.position));
            if (std::abs(at.residual) <= accepted * std::abs(slope)) {
                at.status = slope > 0.0 ? Status::Ok : Status::NotUnique;
                return at;
            }
            (at.residual < 0.0 ? low : high) = at.position;
            if (least_slope > 0.0) {
                const double farthest = at.position - 1.0000001 * at.residual / least_slope;
                (at.residual < 0.0 ? high : low) =
                    at.residual < 0.0 ? std::fmin(high, farthest) : std::fmax(low, farthest);
                if (confirmed(at, slope, accepted)) {
                    at.position -= at.residual / slope;
                    at.environment.force = line.intercept - line.slope * at.position;
                    at.residual = 0.0;
                    return at;
                }
            }
            if (at.evaluations >= max_evaluations) {
                at.status = Status::MaxIterations;
                return at;
            }
            const bool bracketed = std::isfinite(low) && std::isfinite(high);
            if (bracketed && high - low <= accepted) {
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

  private:
    /// Whether Newton's correction from here is certified to end within `accepted` of the solution.
    [[nodiscard]] bool confirmed(const Solution& at, double slope, double accepted) const noexcept {
        const double correction = at.residual / slope;
        const double target = at.position - correction;
        return slope > 0.0 && at.position >= smooth_from && at.position <= smooth_to &&
               target >= smooth_from && target <= smooth_to &&
               0.5 * curvature * correction * correction <= accepted * least_slope;
    }
};

}  // namespace palpate
