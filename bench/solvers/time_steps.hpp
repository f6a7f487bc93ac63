// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <utility>

#include "palpate/dynamics/coupling.hpp"
#include "palpate/model/environment.hpp"
#include "palpate/rendering/explicit.hpp"
#include "palpate/rendering/structure.hpp"
#include "palpate/solver/newton.hpp"

// Integration methods of the virtual object that are only compared with those of palpate, in benchmarks.
namespace palpate::bench {

/// One step of Newton's method from the last position. With it `Implicit` is the linearly implicit Euler scheme. It
/// needs one evaluation a step and is exact for a line only.
struct OneNewtonStep {
    using Memory = WarmStart;

    [[nodiscard]] static constexpr bool tabulated() noexcept { return false; }

    template <Environment E>
    [[nodiscard]] Solution solve(const E& environment, const typename E::State& state, LoadLine line,
                                 WarmStart& memory) const noexcept {
        const double y = memory.position;
        const EnvironmentSample at = environment.at(y, state);
        const double slope = line.slope + at.slope;
        const double step = (line.intercept - line.slope * y - at.force) / slope;
        if (!std::isfinite(step)) {
            return {y, at, step, 1, Status::NonFinite};
        }
        memory = WarmStart{y + step};
        EnvironmentSample linearised = at;
        linearised.force = at.force + at.slope * step;
        return {memory.position, linearised, 0.0, 1, slope > 0.0 ? Status::Ok : Status::NotUnique};
    }
};

/// Explicit structure with n steps of T/n in every tick; the device moves with constant speed in the tick. It is stable
/// for slopes n^2 times steeper and takes n times the computing time.
template <Environment E>
class Substepped {
  public:
    Substepped(E environment, Inertia inertia, VirtualCoupling coupling, double period, int substeps)
        : inner_{std::move(environment), inertia, coupling, period / substeps}, substeps_{substeps} {}

    void reset(double position) noexcept {
        inner_.reset(position);
        device_ = position;
    }

    [[nodiscard]] Rendered step(double device) noexcept {
        const double from = device_;
        const Rendered rendered = repeat([&](int k) noexcept {
            return inner_.step(k == substeps_ ? device : from + (device - from) * k / substeps_);
        });
        if (rendered.status == Status::Ok) {
            device_ = device;
        }
        return rendered;
    }

    [[nodiscard]] Rendered drive(double force) noexcept {
        return repeat([&](int /*k*/) noexcept { return inner_.drive(force); });
    }

  private:
    template <class Step>
    [[nodiscard]] Rendered repeat(Step step) noexcept {
        Rendered rendered;
        for (int k = 1; k <= substeps_; ++k) {
            rendered = step(k);
            if (rendered.status != Status::Ok) {
                return rendered;
            }
            rendered.evaluations = k;
        }
        return rendered;
    }

    Explicit<E> inner_;
    int substeps_;
    double device_ = 0.0;  ///< x_{k-1}
};

/// Integrates m v' = F_c - f(x) - B_o v behind the coupling by the trapezoidal rule, of second order in T. G is the sum
/// of the forces:
///
///     v_k = v_{k-1} + T (G_k + G_{k-1}) / (2m),   y_k = y_{k-1} + T (v_k + v_{k-1}) / 2,
///
/// The load line has p = 4m/T^2 + 2(B_o + B_c)/T + K_c. The rule adds no damping and rings on stiff walls.
template <Environment E, class Solver = LoadLineSolver>
class Trapezoidal {
  public:
    Trapezoidal(E environment, Inertia inertia, VirtualCoupling coupling, double period, Solver solver = {})
        : environment_{std::move(environment)},
          inertia_{inertia},
          coupling_{coupling},
          period_{period},
          solver_{std::move(solver)} {
        reset(0.0);
    }

    void reset(double position) noexcept {
        state_ = environment_.start(position);
        memory_ = typename Solver::Memory{position};
        device_ = position;
        position_ = position;
        velocity_ = 0.0;
        object_force_ = -environment_.at(position, state_).force;
        force_ = -object_force_;
    }

    /// Computes one tick with a virtual coupling: from the measured device position to the force of the coupling.
    [[nodiscard]] Rendered step(double device) noexcept {
        const double device_velocity = (device - device_) / period_;
        Rendered rendered = advance(coupling_, coupling_.force(device, device_velocity), force_);
        if (rendered.status == Status::NonFinite) {
            return rendered;
        }
        device_ = device;
        force_ = coupling_.force(device - position_, device_velocity - velocity_);
        rendered.force = force_;
        return rendered;
    }

    /// Computes one tick of the virtual object without a coupling: `force` drives the object during the tick.
    [[nodiscard]] Rendered drive(double force) noexcept {
        Rendered rendered = advance({0.0, 0.0}, force, force);
        rendered.force = rendered.status == Status::NonFinite ? 0.0 : force;
        return rendered;
    }

  private:
    /// `coupling_force`: force of the coupling if the object rests at position 0; `before`: force of the last tick.
    [[nodiscard]] Rendered advance(VirtualCoupling coupling, double coupling_force, double before) noexcept {
        const double inertia = 4.0 * inertia_.mass / (period_ * period_);
        const double damping = coupling.damping + inertia_.damping;
        const double memory = inertia + 2.0 * damping / period_;
        const LoadLine line{memory + coupling.stiffness,
                            memory * position_ + (4.0 * inertia_.mass / period_ + damping) * velocity_ +
                                coupling_force + before + object_force_};
        const Solution solution = solver_.solve(environment_, state_, line, memory_);
        if (solution.status == Status::NonFinite) {
            return detail::refused(position_);
        }
        const double position = solution.position;
        velocity_ = 2.0 * (position - position_) / period_ - velocity_;
        position_ = position;
        object_force_ = -inertia_.damping * velocity_ - solution.environment.force;
        environment_.advance(position, state_);
        return {0.0, position, solution.evaluations, solution.status, solution.environment.extrapolated};
    }

    E environment_;
    Inertia inertia_;
    VirtualCoupling coupling_;
    double period_;
    Solver solver_;
    typename E::State state_;
    typename Solver::Memory memory_;
    double device_ = 0.0;        ///< x_{k-1}
    double position_ = 0.0;      ///< y_{k-1}
    double velocity_ = 0.0;      ///< v_{k-1}
    double object_force_ = 0.0;  ///< last force on the object without the coupling: -f(y_{k-1}) - B_o v_{k-1}
    double force_ = 0.0;         ///< F_{k-1}
};

}  // namespace palpate::bench
