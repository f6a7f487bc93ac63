// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <limits>
#include <utility>

#include "palpate/dynamics/coupling.hpp"
#include "palpate/model/environment.hpp"
#include "palpate/rendering/any_structure.hpp"
#include "palpate/rendering/structure.hpp"
#include "palpate/solver/newton.hpp"

namespace palpate {

/// Virtual object with mass m behind a virtual coupling, m v' = F_c - f(y) - B_o v, integrated by backward Euler. F_c
/// is the coupling's force and f the model's force. The position y at the end of a step solves the load line f(y) + p y
/// = q, which includes the coupling, with
///
///     p = m/T^2 + B_o/T + K_c + B_c/T,
///     q = m (2 y_{k-1} - y_{k-2}) / T^2 + B_o y_{k-1} / T + K_c x_k + B_c (v_k + y_{k-1} / T),
///
/// where x_k and v_k are position and velocity of the device. The force is F = K_c (x - y) + B_c (v - (y - y_{k-1}) /
/// T). With K_c = B_c = 0 the load line is the paper's implicit equation of section 4.3, with the damping of figure 14.
///
/// A force limit F_max acts equally on device and object. If |F| > F_max at the solution y*, the limited force
/// G = +-F_max alone drives the object: y is the first solution of the object's load line without coupling, searched
/// from y* in the direction of -G. At this y also |F(y)| > F_max, because F falls with y. The device receives the same
/// G.
template <Environment E, class Solver = LoadLineSolver>
class Implicit {
  public:
    Implicit(E environment, Inertia inertia, VirtualCoupling coupling, double period, Solver solver = {},
             double force_limit = std::numeric_limits<double>::infinity())
        : Implicit{std::move(environment), inertia, coupling, period, solver, force_limit, solver} {}

    /// Makes the structure with two solvers: `solver` for the load line with the coupling, `uncoupled` for the load
    /// line of the object without the coupling.
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

    /// Returns the slope p of the load line of every step. Zero K_c and B_c give the slope without the coupling.
    [[nodiscard]] static double load_line_slope(Inertia inertia, VirtualCoupling coupling,
                                                double period) noexcept {
        return coupling.load_line_slope(period) + inertia.load_line_slope(period);
    }

    [[nodiscard]] const Solver& solver() const noexcept { return coupled_; }

    /// Sets the virtual object at rest at a position.
    void reset(double position) noexcept {
        state_ = environment_.start(position);
        device_ = position;
        position_ = position;
        memory_ = driven_ = typename Solver::Memory{position};
        driven_to_ = position;
        before_ = position;
    }

    /// Moves the object by one step and returns the force on device and object, for the measured position of the
    /// device.
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
            driven_ = typename Solver::Memory{solution.position};
            Rendered rendered = drive_from(std::copysign(force_limit_, force), solution.evaluations);
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

    /// Moves the virtual object by one step; `force` acts on it in place of the coupling's force (paper figure 12).
    [[nodiscard]] Rendered drive(double force, const DriveLimits& limits = {}) noexcept {
        if (driven_to_ != position_) {
            driven_ = typename Solver::Memory{position_};
        }
        return drive_from(force, 0, limits);
    }

  private:
    /// Moves the virtual object by one step; `force` acts on it in place of the coupling's force. The search for the
    /// object's new position starts at the solution in `driven_`.
    [[nodiscard]] Rendered drive_from(double force, int evaluations,
                                      const DriveLimits& limits = {}) noexcept {
        bool again = false;
        const Solution solution =
            detail::limited_step(position_, force, limits, [&](double driving) noexcept {
                const LoadLine line{uncoupled_slope_,
                                    driving - inertial_ * before_ + uncoupled_factor_ * position_};
                if (std::exchange(again, true)) {
                    driven_ = typename Solver::Memory{position_};
                }
                const Solution found = uncoupled_.solve(environment_, state_, line, driven_);
                driven_to_ = found.position;
                return found;
            });
        if (solution.status == Status::NonFinite) {
            memory_ = typename Solver::Memory{position_};
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
    double force_limit_;  ///< F_max, largest force sent to the device [N or N*m]
    // The state of the last step is stored between constants. Compilers store adjacent variables together, and the next
    // step would wait longer for such a store.
    double position_ = 0.0;   ///< y_{k-1}, last position of the object
    double inertial_;         ///< m/T^2
    double before_ = 0.0;     ///< y_{k-2}, position of the object before the last one
    double coupled_slope_;    ///< slope p of the load line with the coupling
    double uncoupled_slope_;  ///< slope p of the load line without the coupling
    /// Factor of the last position y_{k-1} in the load line's q: 2m/T^2 + B_o/T + B_c/T
    double coupled_factor_;
    /// Factor of the last position y_{k-1} in the q of the load line without the coupling: 2m/T^2 + B_o/T
    double uncoupled_factor_;
    Solver coupled_;
    Solver uncoupled_;
    typename E::State state_;
    typename Solver::Memory memory_;
    typename Solver::Memory driven_;  ///< memory of the last step without the coupling
    double driven_to_ = 0.0;  ///< end of that step before its limits; the memory holds for this position
    double device_ = 0.0;     ///< x_{k-1}, last position of the device
};

/// Builds the implicit structure.
struct ImplicitStructure {
    static constexpr StructureTraits traits{.name = "implicit", .coupling = true, .mass = true};

    template <Environment E, class SolverOf>
    static AnyStructure build(E environment, const StructureNumbers& numbers, const SolverOf& solver_of) {
        const double p = Implicit<E>::load_line_slope(numbers.inertia, numbers.coupling, numbers.period_s);
        const double uncoupled = Implicit<E>::load_line_slope(numbers.inertia, {0.0, 0.0}, numbers.period_s);
        return Implicit{std::move(environment), numbers.inertia,     numbers.coupling,    numbers.period_s,
                        solver_of(p),           numbers.force_limit, solver_of(uncoupled)};
    }
};

}  // namespace palpate
