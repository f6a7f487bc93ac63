// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <utility>

#include "palpate/dynamics/coupling.hpp"
#include "palpate/model/environment.hpp"
#include "palpate/model/limited_environment.hpp"
#include "palpate/rendering/any_structure.hpp"
#include "palpate/rendering/structure.hpp"
#include "palpate/solver/limited_resolvent.hpp"
#include "palpate/solver/newton.hpp"

namespace palpate {

/// Virtual object without mass and damping behind a virtual coupling. Its position y is where the coupling's force
/// equals the model's force f(y): the solution of the load line f(y) + p y = q, with the measured position x_k, the
/// period T, and
///
///     p = K_c + B_c / T,   q = K_c x_k + (B_c / T)(x_k - x_{k-1} + y_{k-1});   then F = f(y).
///
/// If `E` is a `LimitedEnvironment`, the force is limited to the force limit.
template <Environment E, class Solver = LoadLineSolver>
class Massless {
  public:
    Massless(E environment, VirtualCoupling coupling, double period, Solver solver = {})
        : environment_{std::move(environment)},
          coupling_{coupling},
          period_{period},
          solver_{std::move(solver)} {
        reset(0.0);
    }

    /// Returns the slope p of the load line of every step.
    [[nodiscard]] static double load_line_slope(VirtualCoupling coupling, double period) noexcept {
        return coupling.load_line_slope(period);
    }

    [[nodiscard]] const Solver& solver() const noexcept { return solver_; }

    /// Sets the virtual object at rest at a position.
    void reset(double position) noexcept {
        state_ = environment_.start(position);
        device_ = position;
        position_ = position;
        memory_ = typename Solver::Memory{position};
    }

    /// Moves the object by one step and returns the force for the measured position of the device.
    [[nodiscard]] Rendered step(double device) noexcept {
        const double damping = coupling_.damping / period_;
        const LoadLine line{
            coupling_.load_line_slope(period_),
            (coupling_.stiffness * device + damping * (device - device_)) + damping * position_};
        const Solution solution = solver_.solve(environment_, state_, line, memory_);
        if (solution.status == Status::NonFinite) {
            return detail::refused(position_);
        }
        environment_.advance(solution.position, state_);
        device_ = device;
        position_ = solution.position;
        return {solution.environment.force, position_, solution.evaluations,
                limited(solution) ? Status::Limited : solution.status, solution.environment.extrapolated};
    }

  private:
    /// Returns true if the environment has a force limit, and the load line was solved with a force at this limit.
    [[nodiscard]] bool limited(const Solution& solution) const noexcept {
        if constexpr (requires { environment_.force_limit(); }) {
            return solution.status == Status::Ok &&
                   std::abs(solution.environment.force) >= environment_.force_limit();
        } else {
            return false;
        }
    }

    E environment_;
    // The state of the last step is stored between constants. Compilers store adjacent variables together, and the next
    // step would wait longer for such a store.
    double position_ = 0.0;  ///< y_{k-1}, last position of the object
    VirtualCoupling coupling_;
    double period_;
    Solver solver_;
    typename E::State state_;
    typename Solver::Memory memory_;
    double device_ = 0.0;  ///< x_{k-1}, last position of the device
};

/// Builds the massless structure.
struct MasslessStructure {
    static constexpr StructureTraits traits{.name = "massless", .coupling = true};

    template <Environment E, class SolverOf>
    static AnyStructure build(E environment, const StructureNumbers& numbers, const SolverOf& solver_of) {
        const double p = numbers.coupling.load_line_slope(numbers.period_s);
        if (std::isfinite(numbers.force_limit)) {
            return Massless{LimitedEnvironment{std::move(environment), numbers.force_limit}, numbers.coupling,
                            numbers.period_s, LimitedResolvent{solver_of(p)}};
        }
        return Massless{std::move(environment), numbers.coupling, numbers.period_s, solver_of(p)};
    }
};

}  // namespace palpate
