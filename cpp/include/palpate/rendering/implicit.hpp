// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>

#include "palpate/dynamics/coupling.hpp"
#include "palpate/model/environment.hpp"
#include "palpate/rendering/inertia.hpp"
#include "palpate/rendering/structure.hpp"
#include "palpate/solver/newton.hpp"

namespace palpate {

/// m v' = F_c - f(x) - B_o v behind the coupling, backward Euler with the coupling inside the solve: the load
/// line with
///
///     p = m/T^2 + B_o/T + K_c + B_c/T,
///     q = m (2 y_{k-1} - y_{k-2}) / T^2 + B_o y_{k-1} / T + K_c x_k + B_c (v_k + y_{k-1} / T),
///
/// then F = K_c (x - y) + B_c (v - (y - y_{k-1}) / T). Without coupling terms it is the paper's implicit
/// equation of section 4.3, with the damping of figure 14.
template <Environment E, class Solver = LoadLineSolver>
class Implicit {
  public:
    Implicit(E environment, Inertia inertia, VirtualCoupling coupling, double period, Solver solver = {})
        : environment_{std::move(environment)},
          coupling_{coupling},
          period_{period},
          inertial_{inertia.mass / (period * period)},
          coupled_{load_line_slope(inertia, coupling, period)},
          alone_{load_line_slope(inertia, {0.0, 0.0}, period)},
          coupled_memory_{inertial_ + coupled_ - coupling.stiffness},
          alone_memory_{inertial_ + alone_},
          solver_{std::move(solver)} {
        reset(0.0);
    }

    /// p of every step behind the coupling.
    [[nodiscard]] static double load_line_slope(Inertia inertia, VirtualCoupling coupling,
                                                double period) noexcept {
        return coupling.stiffness + coupling.damping / period +
               (inertia.mass / (period * period) + inertia.damping / period);
    }

    [[nodiscard]] const Solver& solver() const noexcept { return solver_; }

    void reset(double position) noexcept {
        state_ = environment_.start(position);
        device_ = position;
        position_ = position;
        memory_ = typename Solver::Memory{position};
        before_ = position;
    }

    /// Behind the coupling: the device's measured position in, the coupling's force out.
    [[nodiscard]] Rendered step(double device) noexcept {
        const double velocity = (device - device_) / period_;
        const double last = position_;
        Rendered rendered = advance(coupled_, coupling_.force(device, velocity), coupled_memory_);
        if (rendered.status == Status::NonFinite) {
            return rendered;
        }
        device_ = device;
        rendered.force = coupling_.force(device - position_, velocity - (position_ - last) / period_);
        return rendered;
    }

    /// Without the coupling: a given force drives the environment (paper figure 12).
    [[nodiscard]] Rendered drive(double force) noexcept {
        Rendered rendered = advance(alone_, force, alone_memory_);
        rendered.force = rendered.status == Status::NonFinite ? 0.0 : force;
        return rendered;
    }

  private:
    /// Solves the load line of slope p and moves on. `push` is what drives an environment at rest at 0,
    /// `memory` what of q goes with the last position.
    [[nodiscard]] Rendered advance(double p, double push, double memory) noexcept {
        const LoadLine line{p, push - inertial_ * before_ + memory * position_};
        const Solution solution = solver_.solve(environment_, state_, line, memory_);
        if (solution.status == Status::NonFinite) {
            return detail::refused(position_);
        }
        environment_.advance(solution.position, state_);
        before_ = position_;
        position_ = solution.position;
        return {0.0, position_, solution.evaluations, solution.status, solution.environment.extrapolated};
    }

    E environment_;
    VirtualCoupling coupling_;
    double period_;
    double inertial_;        ///< m/T^2
    double coupled_;         ///< p behind the coupling
    double alone_;           ///< p without it
    double coupled_memory_;  ///< the factor of y_{k-1} in q: 2m/T^2 + B_o/T + B_c/T
    double alone_memory_;    ///< and without the coupling: 2m/T^2 + B_o/T
    Solver solver_;
    typename E::State state_;
    typename Solver::Memory memory_;
    double device_ = 0.0;    ///< x_{k-1}
    double position_ = 0.0;  ///< y_{k-1}
    double before_ = 0.0;    ///< y_{k-2}
};

}  // namespace palpate
