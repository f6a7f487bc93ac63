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

/// The resolvent of a hysteresis pair: one table for sliding in press, g + h, and one for sliding in release, g - h.
/// `CertifiedSolver` solves the cases outside the tables and the sticking between both slides.
///
/// If `CertifiedSolver` certifies that f + p y rises, sliding and sticking, the solution is that of press if it lies at
/// or above play + r, and that of release if it lies at or below play - r.
class SlidingResolvent {
  public:
    /// State between two steps.
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

    /// Returns true if both slides have a table.
    [[nodiscard]] bool tabulated() const noexcept {
        return solver_.cells() > 0 && press_.tabulated() && release_.tabulated();
    }
    /// Returns true if every load line of this slope is certified to have one solution.
    [[nodiscard]] bool unique(double p) const noexcept { return solver_.unique(p); }
    /// Returns the search for a force without a certificate.
    [[nodiscard]] const LoadLineSolver& uncertified() const noexcept { return solver_.uncertified(); }
    [[nodiscard]] const CertifiedSolver& solver() const noexcept { return solver_; }
    [[nodiscard]] std::size_t cells() const noexcept { return press_.cells() + release_.cells(); }
    [[nodiscard]] double position_error() const noexcept {
        return std::max(press_.position_error(), release_.position_error());
    }

    /// Solves the load line and updates the memory.
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
