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

/// An environment whose force f is that of another environment multiplied by a factor. `CompensatedResolvent` uses it
/// with the factor 1 - p/K_c to solve load lines of a compensated model.
template <Environment E>
struct Scaled {
    using State = typename E::State;
    const E& environment;
    double factor;

    /// Returns force, slope and energy of `environment`, multiplied by `factor`.
    [[nodiscard]] EnvironmentSample at(double x, const State& state) const noexcept {
        const EnvironmentSample sample = environment.at(x, state);
        return {factor * sample.force, factor * sample.slope, factor * sample.energy, sample.extrapolated};
    }
    void advance(double x, State& state) const noexcept { environment.advance(x, state); }
    [[nodiscard]] State start(double x) const noexcept { return environment.start(x); }
};

/// A stiffer environment that, in series with a coupling of stiffness K_c, gives the force f of the environment `E`.
/// The deflection f(x)/K_c of the coupling's spring is subtracted from the position: the force at the position x -
/// f(x)/K_c is f(x). The slope of the stiffer force is K_c f' / (K_c - f') > -K_c. This requires a slope f' < K_c
/// everywhere, and a force without memory.
template <Environment E>
    requires std::same_as<typename E::State, Stateless>
class Compensated {
  public:
    using State = Stateless;

    Compensated(E environment, double coupling_stiffness)
        : environment_{std::move(environment)}, stiffness_{coupling_stiffness} {}

    /// Returns the force law before compensation: the force that the hand feels through the coupling.
    [[nodiscard]] const E& uncompensated() const noexcept { return environment_; }
    /// Returns the stiffness K_c of the coupling [N/m or N*m/rad].
    [[nodiscard]] double stiffness() const noexcept { return stiffness_; }

    /// Returns force, slope and energy of the stiffer environment at the position `shifted`. The equation x - f(x)/K_c
    /// = shifted for the position x of the original environment is the load line -f(x) + K_c x = K_c shifted.
    [[nodiscard]] EnvironmentSample at(double shifted, const State& state) const noexcept {
        const Solution found = LoadLineSolver{}.solve(Scaled<E>{environment_, -1.0}, state,
                                                      {stiffness_, stiffness_ * shifted}, shifted);
        const double force = -found.environment.force;
        const double slope = -found.environment.slope;
        return {found.status == Status::NonFinite ? std::numeric_limits<double>::quiet_NaN() : force,
                stiffness_ * slope / (stiffness_ - slope),
                -found.environment.energy - 0.5 * force * force / stiffness_, found.environment.extrapolated};
    }

    void advance(double /*shifted*/, State&) const noexcept {}
    [[nodiscard]] State start(double /*shifted*/) const noexcept { return {}; }

  private:
    E environment_;
    double stiffness_;
};

/// Solves the load line of a compensated environment, f(x) + p (x - f(x)/K_c) = q, for the position x, with the force f
/// of the original environment. This equation is a load line of the force multiplied by a factor: (1 - p/K_c) f(x) + p
/// x = q. Its left side rises with x if f' < K_c, so one table of solutions and one evaluation of f are sufficient.
class CompensatedResolvent {
  public:
    using Memory = Resolvent::Memory;

    CompensatedResolvent(PiecewiseForce force, double coupling_stiffness, double p,
                         const ResolventOptions& options = {})
        : slope_{p},
          factor_{1.0 - p / coupling_stiffness},
          resolvent_{scaled(std::move(force), factor_), p, options} {}

    /// Returns true if this solver has at least one table of load-line solutions.
    [[nodiscard]] bool tabulated() const noexcept { return resolvent_.tabulated(); }
    /// Returns true if every load line of slope p is proved to have exactly one solution.
    [[nodiscard]] bool unique(double p) const noexcept { return p == slope_ && resolvent_.unique(p); }
    /// Returns the solver for load lines that are not proved to have exactly one solution.
    [[nodiscard]] const LoadLineSolver& uncertified() const noexcept { return resolvent_.uncertified(); }

    /// Solves the load line and stores the solution in `memory`, where the search of the next tick starts.
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
