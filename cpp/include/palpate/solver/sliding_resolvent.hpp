// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "palpate/model/environment.hpp"
#include "palpate/model/hysteresis.hpp"
#include "palpate/solver/certified_solver.hpp"
#include "palpate/solver/newton.hpp"
#include "palpate/solver/piecewise_force.hpp"
#include "palpate/solver/resolvent.hpp"

namespace palpate {

/// Solves the load line of a force with hysteresis by tables: one `Resolvent` for the press force g + h and one for the
/// release force g - h. `CertifiedSolver` solves load lines outside the tables, and those whose solution does not move
/// the play operator (sticking).
///
/// It must be proved that f(y) + p y rises for press, release and sticking. The solution for press is then valid if it
/// lies at or above play + r (position of the play operator + play radius). The solution for release is valid if it
/// lies at or below play - r.
class SlidingResolvent {
  public:
    /// State between two calls of `solve`: the states of three solvers, `CertifiedSolver` and one `Resolvent` each for
    /// press and release.
    struct Memory {
        CertifiedSolver::Memory newton;
        Resolvent::Memory press;
        Resolvent::Memory release;

        Memory() = default;
        explicit Memory(double position) noexcept : newton{position} {}
    };

    SlidingResolvent(const HysteresisNetwork& pair, double p, const ResolventOptions& options = {})
        : press_{piecewise(pair, 1.0), p, options},
          release_{piecewise(pair, -1.0), p, options},
          solver_{pair, p},
          radius_{pair.play_radius()} {}

    /// Returns true if press force and release force both have a table, and load lines of slope p are proved to have
    /// exactly one solution.
    [[nodiscard]] bool tabulated() const noexcept {
        return solver_.cells() > 0 && press_.tabulated() && release_.tabulated();
    }
    /// Returns true if it is proved that every load line of slope p has exactly one solution.
    [[nodiscard]] bool unique(double p) const noexcept { return solver_.unique(p); }
    /// Returns the solver for load lines that are not proved to have exactly one solution.
    [[nodiscard]] const LoadLineSolver& uncertified() const noexcept { return solver_.uncertified(); }
    [[nodiscard]] const CertifiedSolver& solver() const noexcept { return solver_; }
    [[nodiscard]] std::size_t cells() const noexcept { return press_.cells() + release_.cells(); }
    [[nodiscard]] double position_error() const noexcept {
        return std::max(press_.position_error(), release_.position_error());
    }

    /// Returns the position on the load line with its force, and updates `memory` with this solution.
    template <Environment E>
    [[nodiscard, gnu::always_inline]] inline Solution solve(const E& environment,
                                                            const typename E::State& state, LoadLine line,
                                                            Memory& memory) const noexcept {
        if (unique(line.slope)) {
            const Solution press = press_.without_evaluation(line, memory.press);
            if (press.position >= state.play + radius_) {
                memory.newton = CertifiedSolver::Memory{press.position};
                return press;
            }
            const Solution release = release_.without_evaluation(line, memory.release);
            if (release.position <= state.play - radius_) {
                memory.newton = CertifiedSolver::Memory{release.position};
                return release;
            }
        }
        return by_newton(environment, state, line, memory.newton);
    }

  private:
    template <Environment E>
    [[nodiscard, gnu::noinline]] Solution by_newton(const E& environment, const typename E::State& state,
                                                    LoadLine line,
                                                    CertifiedSolver::Memory& memory) const noexcept {
        return solver_.solve(environment, state, line, memory);
    }

    Resolvent press_;
    Resolvent release_;
    CertifiedSolver solver_;
    double radius_;
};

}  // namespace palpate
