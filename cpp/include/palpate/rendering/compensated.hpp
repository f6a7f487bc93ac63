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

/// An environment with its force multiplied: what remains of f on a load line from which f itself is taken out.
template <Environment E>
struct Scaled {
    using State = typename E::State;
    const E& environment;
    double factor;

    [[nodiscard]] EnvironmentSample at(double x, const State& state) const noexcept {
        const EnvironmentSample sample = environment.at(x, state);
        return {factor * sample.force, factor * sample.slope, factor * sample.energy, sample.extrapolated};
    }
    void advance(double x, State& state) const noexcept { environment.advance(x, state); }
    [[nodiscard]] State start(double x) const noexcept { return environment.start(x); }
};

/// An environment that feels like `E` through a coupling of stiffness K_c. The coupling's spring is taken out
/// of the curve beforehand: the curve (x - f(x)/K_c, f(x)) in place of (x, f(x)), of slope
/// K_c f' / (K_c - f') > -K_c. It exists where f' < K_c everywhere, and for forces without memory.
template <Environment E>
    requires std::same_as<typename E::State, Stateless>
class Compensated {
  public:
    using State = Stateless;

    Compensated(E environment, double coupling_stiffness)
        : environment_{std::move(environment)}, stiffness_{coupling_stiffness} {}

    [[nodiscard]] const E& felt() const noexcept { return environment_; }
    [[nodiscard]] double stiffness() const noexcept { return stiffness_; }

    /// x - f(x)/K_c = shifted is the load line -f(x) + K_c x = K_c shifted.
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

/// The load line of a compensated environment, f + p (x - f/K_c) = q, is one of f itself, multiplied:
/// (1 - p/K_c) f(x) + p x = q. It rises wherever f' < K_c: one table, and one evaluation of f.
class CompensatedResolvent {
  public:
    using Memory = Resolvent::Memory;

    CompensatedResolvent(PiecewiseForce force, double coupling_stiffness, double p,
                         const ResolventOptions& options = {})
        : slope_{p},
          factor_{1.0 - p / coupling_stiffness},
          felt_{scaled(std::move(force), factor_), p, options} {}

    [[nodiscard]] bool tabulated() const noexcept { return felt_.tabulated(); }
    /// Whether every load line of this slope is certified to have one solution. f rises by the shifted position
    /// where it does by x: x - f(x)/K_c rises with x.
    [[nodiscard]] bool unique(double p) const noexcept { return p == slope_ && felt_.unique(p); }
    /// The search for a force of which nothing is certified.
    [[nodiscard]] const LoadLineSolver& uncertified() const noexcept { return felt_.uncertified(); }

    template <Environment E>
    [[nodiscard, gnu::always_inline]] inline Solution solve(const Compensated<E>& environment,
                                                            const Stateless& state, LoadLine line,
                                                            Memory& memory) const noexcept {
        Solution solution = felt_.solve(Scaled<E>{environment.felt(), factor_}, state, line, memory);
        solution.environment = environment.felt().at(solution.position, state);
        solution.position -= solution.environment.force / environment.stiffness();
        solution.evaluations += 1;
        return solution;
    }

  private:
    double slope_;
    double factor_;
    Resolvent felt_;
};

}  // namespace palpate
