// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <limits>
#include <utility>

#include "palpate/model/environment.hpp"
#include "palpate/solver/newton.hpp"
#include "palpate/solver/piecewise_force.hpp"
#include "palpate/solver/resolvent.hpp"

namespace palpate {

/// An environment with its force multiplied by a factor. It describes the part of f that stays on a load line after f
/// is subtracted from it.
template <Environment E>
struct Scaled {
    using State = typename E::State;
    const E& environment;
    double factor;

    /// Returns the environment's force and slope, multiplied.
    [[nodiscard]] EnvironmentSample at(double x, const State& state) const noexcept {
        const EnvironmentSample sample = environment.at(x, state);
        return {factor * sample.force, factor * sample.slope, factor * sample.energy, sample.extrapolated};
    }
    void advance(double x, State& state) const noexcept { environment.advance(x, state); }
    [[nodiscard]] State start(double x) const noexcept { return environment.start(x); }
};

/// An environment that feels like `E` through a coupling of stiffness K_c. The compliance of the coupling's spring is
/// subtracted from the curve: (x - f(x)/K_c, f(x)) replaces (x, f(x)). Its slope is K_c f' / (K_c - f') > -K_c. This
/// requires f' < K_c everywhere, and a force without memory.
template <Environment E>
    requires std::same_as<typename E::State, Stateless>
class Compensated {
  public:
    using State = Stateless;

    Compensated(E environment, double coupling_stiffness)
        : environment_{std::move(environment)}, stiffness_{coupling_stiffness} {}

    /// Returns the environment that the hand feels.
    [[nodiscard]] const E& uncompensated() const noexcept { return environment_; }
    /// Returns K_c [N/m or N*m/rad].
    [[nodiscard]] double stiffness() const noexcept { return stiffness_; }

    /// Returns force and slope at a shifted position. x - f(x)/K_c = shifted is the load line -f(x) + K_c x = K_c
    /// shifted.
    [[nodiscard]] EnvironmentSample at(double shifted, const State& state) const noexcept {
        const Solution found = LoadLineSolver{}.solve(Scaled<E>{environment_, -1.0}, state,
                                                      {stiffness_, stiffness_ * shifted}, shifted);
        const double force = -found.environment.force;
        const double slope = -found.environment.slope;
        return {found.status == Status::NonFinite ? std::numeric_limits<double>::quiet_NaN() : force,
                stiffness_ * slope / (stiffness_ - slope),
                -found.environment.energy - 0.5 * force * force / stiffness_, found.environment.extrapolated};
    }

    void advance(double /*shifted*/, State& /*stateless*/) const noexcept {}
    [[nodiscard]] State start(double /*shifted*/) const noexcept { return {}; }

  private:
    E environment_;
    double stiffness_;
};

/// Solves the load line of a compensated environment, f + p (x - f/K_c) = q. It is a multiple of a load line of f:
/// (1 - p/K_c) f(x) + p x = q. It rises if f' < K_c: one table, and one evaluation of f.
class CompensatedResolvent {
  public:
    using Memory = Resolvent::Memory;

    CompensatedResolvent(PiecewiseForce force, double coupling_stiffness, double p,
                         const ResolventOptions& options = {})
        : slope_{p},
          factor_{1.0 - p / coupling_stiffness},
          resolvent_{scaled(std::move(force), factor_), p, options} {}

    /// Returns true if the load line has a table.
    [[nodiscard]] bool tabulated() const noexcept { return resolvent_.tabulated(); }
    /// Returns true if every load line of this slope is certified to have one solution. f rises with the shifted
    /// position if it rises with x, because x - f(x)/K_c rises with x.
    [[nodiscard]] bool unique(double p) const noexcept { return p == slope_ && resolvent_.unique(p); }
    /// Returns the search for a force without a certificate.
    [[nodiscard]] const LoadLineSolver& uncertified() const noexcept { return resolvent_.uncertified(); }

    /// Solves the load line and updates the memory.
    template <Environment E>
    [[nodiscard, gnu::always_inline]] inline Solution solve(const Compensated<E>& environment,
                                                            const Stateless& state, LoadLine line,
                                                            Memory& memory) const noexcept {
        Solution solution =
            resolvent_.solve(Scaled<E>{environment.uncompensated(), factor_}, state, line, memory);
        solution.environment = environment.uncompensated().at(solution.position, state);
        solution.position -= solution.environment.force / environment.stiffness();
        solution.evaluations += 1;
        return solution;
    }

  private:
    double slope_;
    double factor_;
    Resolvent resolvent_;
};

}  // namespace palpate
