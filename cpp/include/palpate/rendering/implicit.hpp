// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <limits>
#include <utility>

#include "palpate/dynamics/coupling.hpp"
#include "palpate/model/environment.hpp"
#include "palpate/rendering/structure.hpp"
#include "palpate/solver/newton.hpp"

namespace palpate {

/// Object with mass behind the coupling, m v' = F_c - f(x) - B_o v, by backward Euler with the coupling in the same
/// equation. The load line has
///
///     p = m/T^2 + B_o/T + K_c + B_c/T,
///     q = m (2 y_{k-1} - y_{k-2}) / T^2 + B_o y_{k-1} / T + K_c x_k + B_c (v_k + y_{k-1} / T),
///
/// then F = K_c (x - y) + B_c (v - (y - y_{k-1}) / T). Without coupling terms it is the paper's implicit equation of
/// section 4.3, with the damping of figure 14.
///
/// A force limit acts equally on device and object. If |F| > F_max at the solution y*, only G = +-F_max drives the
/// object: y is the first root of its load line from y* in the direction of -G. There |F(y)| > F_max, because F falls
/// with y, and the device receives the same G.
template <Environment E, class Solver = LoadLineSolver>
class Implicit {
  public:
    Implicit(E environment, Inertia inertia, VirtualCoupling coupling, double period, Solver solver = {},
             double force_limit = std::numeric_limits<double>::infinity())
        : Implicit{std::move(environment), inertia, coupling, period, solver, force_limit, solver} {}

    /// Makes the structure with two solvers: `solver` for the load line behind the coupling, `uncoupled` for that of the
    /// object alone.
    Implicit(E environment, Inertia inertia, VirtualCoupling coupling, double period, Solver solver,
             double force_limit, Solver uncoupled)
        : environment_{std::move(environment)},
          coupling_{coupling},
          period_{period},
          force_limit_{force_limit},
          inertial_{inertia.mass / (period * period)},
          coupled_slope_{load_line_slope(inertia, coupling, period)},
          uncoupled_slope_{load_line_slope(inertia, {0.0, 0.0}, period)},
          coupled_factor_{inertial_ + coupled_slope_ - coupling.stiffness},
          uncoupled_factor_{inertial_ + uncoupled_slope_},
          coupled_{std::move(solver)},
          uncoupled_{std::move(uncoupled)} {
        reset(0.0);
    }

    /// Returns p of every step behind the coupling; with a coupling of zeros, p of the object alone.
    [[nodiscard]] static double load_line_slope(Inertia inertia, VirtualCoupling coupling,
                                                double period) noexcept {
        return coupling.load_line_slope(period) + inertia.load_line_slope(period);
    }

    [[nodiscard]] const Solver& solver() const noexcept { return coupled_; }

    /// Sets the object at rest at a position.
    void reset(double position) noexcept {
        state_ = environment_.start(position);
        device_ = position;
        position_ = position;
        memory_ = typename Solver::Memory{position};
        before_ = position;
    }

    /// Returns the force on device and object for the device's measured position.
    [[nodiscard]] Rendered step(double device) noexcept {
        const double velocity = (device - device_) / period_;
        const LoadLine line{coupled_slope_, coupling_.force(device, velocity) - inertial_ * before_ +
                                                coupled_factor_ * position_};
        const Solution solution = coupled_.solve(environment_, state_, line, memory_);
        if (solution.status == Status::NonFinite) {
            return detail::refused(position_);
        }
        const double force =
            coupling_.force(device - solution.position, velocity - (solution.position - position_) / period_);
        if (std::abs(force) > force_limit_) {
            Rendered rendered =
                drive_from(solution.position, std::copysign(force_limit_, force), solution.evaluations);
            if (rendered.status == Status::NonFinite) {
                return rendered;
            }
            device_ = device;
            rendered.status = rendered.status == Status::Ok ? Status::Limited : rendered.status;
            return rendered;
        }
        device_ = device;
        return moved_to(solution, force, 0);
    }

    /// Moves the object by a given force, without the coupling (paper figure 12).
    [[nodiscard]] Rendered drive(double force) noexcept { return drive_from(position_, force, 0); }

  private:
    /// Moves the object by a force alone, to the first root from `start`.
    [[nodiscard]] Rendered drive_from(double start, double force, int evaluations) noexcept {
        const LoadLine line{uncoupled_slope_, force - inertial_ * before_ + uncoupled_factor_ * position_};
        typename Solver::Memory from{start};
        const Solution solution = uncoupled_.solve(environment_, state_, line, from);
        memory_ = typename Solver::Memory{position_};
        if (solution.status == Status::NonFinite) {
            return detail::refused(position_);
        }
        memory_ = typename Solver::Memory{solution.position};
        return moved_to(solution, force, evaluations);
    }

    [[nodiscard]] Rendered moved_to(const Solution& solution, double force, int evaluations) noexcept {
        environment_.advance(solution.position, state_);
        before_ = position_;
        position_ = solution.position;
        return {force, position_, solution.evaluations + evaluations, solution.status,
                solution.environment.extrapolated};
    }

    E environment_;
    VirtualCoupling coupling_;
    double period_;
    double force_limit_;       ///< F_max [N or N*m]
    double inertial_;          ///< m/T^2
    double coupled_slope_;     ///< p behind the coupling
    double uncoupled_slope_;   ///< p without it
    double coupled_factor_;    ///< factor of y_{k-1} in q: 2m/T^2 + B_o/T + B_c/T
    double uncoupled_factor_;  ///< the same without the coupling: 2m/T^2 + B_o/T
    Solver coupled_;
    Solver uncoupled_;
    typename E::State state_;
    typename Solver::Memory memory_;
    double device_ = 0.0;    ///< x_{k-1}
    double position_ = 0.0;  ///< y_{k-1}
    double before_ = 0.0;    ///< y_{k-2}
};

/// Builds `Implicit`.
struct ImplicitStructure {
    static constexpr StructureTraits traits{
        .name = "implicit", .coupling = true, .mass = true, .solved = true};

    template <Environment E, class SolverOf, class Visit>
    static auto build(E environment, const StructureNumbers& numbers, const SolverOf& solver_of,
                      Visit& visit) {
        const double p = Implicit<E>::load_line_slope(numbers.inertia, numbers.coupling, numbers.period_s);
        const double uncoupled = Implicit<E>::load_line_slope(numbers.inertia, {0.0, 0.0}, numbers.period_s);
        return visit(Implicit{std::move(environment), numbers.inertia, numbers.coupling, numbers.period_s,
                              solver_of(p), numbers.force_limit, solver_of(uncoupled)});
    }
};

}  // namespace palpate
