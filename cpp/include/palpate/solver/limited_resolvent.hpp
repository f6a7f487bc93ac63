// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <limits>
#include <utility>

#include "palpate/model/environment.hpp"
#include "palpate/model/limited_environment.hpp"
#include "palpate/solver/newton.hpp"

namespace palpate {

/// Solves the load line of a force-limited environment, c(f(y)) + p y = q, by the solver of f(y) + p y = q.
///
/// Let F(y) = f(y) + p y rise, and let F(u) = q. Then c(f(y)) + p y rises too, because p > 0 and every slope of
/// it is F' or p, so that it has one solution:
/// - |f(u)| <= F_max: u itself, since c(f(u)) = f(u).
/// - f(u) > F_max: y = (q - F_max) / p. Since p y = q - F_max > q - f(u) = p u, y > u and F(y) > q, which is
///   f(y) > q - p y = F_max: the limit acts at y.
/// - f(u) < -F_max: y = (q + F_max) / p in the same way.
/// For an environment with memory this holds for each of its states.
///
/// Where p does not certify that F rises, the limited environment is searched from the last position.
template <class Solver>
class LimitedResolvent {
  public:
    struct Memory {
        typename Solver::Memory unlimited;
        WarmStart newton;

        Memory() = default;
        explicit Memory(double position) noexcept : unlimited{position}, newton{position} {}
    };

    explicit LimitedResolvent(Solver unlimited) : unlimited_{std::move(unlimited)} {}

    [[nodiscard]] bool tabulated() const noexcept { return unlimited_.tabulated(); }
    [[nodiscard]] const Solver& unlimited() const noexcept { return unlimited_; }

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
