// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <limits>
#include <utility>

#include "palpate/model/environment.hpp"
#include "palpate/model/limited_environment.hpp"
#include "palpate/solver/newton.hpp"

namespace palpate {

/// Solves the load line of a force that is limited to +-F_max, c(f(y)) + p y = q, with a solver for the unlimited force
/// f. c(f) is f limited to +-F_max.
///
/// Let F(y) = f(y) + p y rise, and let u be the solution for the unlimited force, F(u) = q. Then c(f(y)) + p y also
/// rises, because p > 0 and each of its slopes is F' or p. The limited load line has one solution y:
/// - |f(u)| <= F_max: u itself, since c(f(u)) = f(u).
/// - f(u) > F_max: y = (q - F_max) / p. Since p y = q - F_max > q - f(u) = p u, y > u and F(y) > q. This means
///   f(y) > q - p y = F_max: the force limit is active at y.
/// - f(u) < -F_max: y = (q + F_max) / p in the same way.
///
/// For a force with hysteresis this holds for each position of the play operator. If it is not proved that F rises, the
/// solver searches the load line of the limited force from the last position.
template <class Solver>
class LimitedResolvent {
  public:
    /// State between two calls of `solve`: the state of the solver for the unlimited force, and the last solution for
    /// the limited force, at which the next search starts.
    struct Memory {
        typename Solver::Memory unlimited;
        WarmStart newton;

        Memory() = default;
        explicit Memory(double position) noexcept : unlimited{position}, newton{position} {}
    };

    explicit LimitedResolvent(Solver unlimited) : unlimited_{std::move(unlimited)} {}

    [[nodiscard]] bool tabulated() const noexcept { return unlimited_.tabulated(); }
    [[nodiscard]] const Solver& unlimited() const noexcept { return unlimited_; }

    /// Solves the load line for the limited force, and updates `memory` for the next call.
    template <Environment E>
    [[nodiscard, gnu::always_inline]] inline Solution solve(const LimitedEnvironment<E>& environment,
                                                            const typename E::State& state, LoadLine line,
                                                            Memory& memory) const noexcept {
        if (!(line.slope > 0.0) || !unlimited_.unique(line.slope)) {
            return search(environment, state, line, memory);
        }
        const Solution solution = unlimited_.solve(environment.unlimited(), state, line, memory.unlimited);
        const double force = solution.environment.force;
        if (solution.status == Status::NonFinite || !(std::abs(force) > environment.force_limit())) {
            return solution;
        }
        const double limited = std::copysign(environment.force_limit(), force);
        const double y = (line.intercept - limited) / line.slope;
        return {
            y,
            {limited, 0.0, std::numeric_limits<double>::quiet_NaN(), environment.at(y, state).extrapolated},
            0.0,
            solution.evaluations + 1,
            solution.status};
    }

  private:
    template <Environment E>
    [[nodiscard, gnu::noinline]] Solution search(const LimitedEnvironment<E>& environment,
                                                 const typename E::State& state, LoadLine line,
                                                 Memory& memory) const noexcept {
        return unlimited_.uncertified().solve(environment, state, line, memory.newton);
    }

    Solver unlimited_;
};

}  // namespace palpate
