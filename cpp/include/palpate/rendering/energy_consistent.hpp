// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <limits>
#include <utility>

#include "palpate/dynamics/coupling.hpp"
#include "palpate/model/environment.hpp"
#include "palpate/rendering/inertia.hpp"
#include "palpate/rendering/structure.hpp"
#include "palpate/solver/newton.hpp"

namespace palpate {

/// m v' = F_c - f(x) - B_o v behind the coupling with the force that does exactly the work that is stored,
/// D(y) = (V(y) - V(y_{k-1})) / (y - y_{k-1}), and midpoint kinematics: the load line D + p y = q with
///
///     p = 2m/T^2 + B_o/T + K_c + B_c/T,
///     q = (2m/T^2 + B_o/T) y_{k-1} + (2m/T) v_{k-1} + K_c x_k + B_c (v_device + y_{k-1}/T),
///     v_k = 2 (y_k - y_{k-1}) / T - v_{k-1}.
///
/// D alone rings on stiff walls. With the switch it stands in for f(y) only where f(y) would generate energy,
/// (f(y) - D)(y - y_{k-1}) < 0.
///
/// A force limit acts as in `Implicit`: beyond it device and object both get G = +-F_max.
template <Environment E>
class EnergyConsistent {
  public:
    /// `shortest`: steps below it take D from Gauss points of f, because the quotient loses digits; 1e-2 of
    /// the finest wavelet's width is right.
    EnergyConsistent(E environment, Inertia inertia, VirtualCoupling coupling, double period,
                     double shortest = 1e-4, bool switched = true,
                     double force_limit = std::numeric_limits<double>::infinity())
        : environment_{std::move(environment)},
          inertia_{inertia},
          coupling_{coupling},
          period_{period},
          shortest_{shortest},
          switched_{switched},
          force_limit_{force_limit} {
        reset(0.0);
    }

    void reset(double position) noexcept {
        state_ = environment_.start(position);
        device_ = position;
        position_ = position;
        velocity_ = 0.0;
    }

    /// Behind the coupling: the device's measured position in, the force on device and object out.
    [[nodiscard]] Rendered step(double device) noexcept {
        const double device_velocity = (device - device_) / period_;
        const double push = coupling_.force(device, device_velocity + position_ / period_);
        const Solution solution = solve(coupling_, push, position_);
        if (solution.status == Status::NonFinite) {
            return detail::refused(position_);
        }
        const double force = coupling_.force(device - solution.position,
                                             device_velocity - (solution.position - position_) / period_);
        if (std::abs(force) > force_limit_) {
            const double limited = std::copysign(force_limit_, force);
            const Solution driven = solve({0.0, 0.0}, limited, solution.position);
            if (driven.status == Status::NonFinite) {
                return detail::refused(position_);
            }
            device_ = device;
            Rendered rendered = moved_to(driven, limited);
            rendered.evaluations += solution.evaluations;
            rendered.status = rendered.status == Status::Ok ? Status::Limited : rendered.status;
            return rendered;
        }
        device_ = device;
        return moved_to(solution, force);
    }

    /// Without the coupling: a given force drives the environment.
    [[nodiscard]] Rendered drive(double force) noexcept {
        const Solution solution = solve({0.0, 0.0}, force, position_);
        return solution.status == Status::NonFinite ? detail::refused(position_) : moved_to(solution, force);
    }

    [[nodiscard]] double velocity() const noexcept { return velocity_; }

  private:
    /// f or D as an environment of its own, for the step from `from`.
    struct Stepped {
        using State = typename E::State;
        const E& environment;
        double from;
        double energy;
        double shortest;
        bool switched;

        [[nodiscard]] EnvironmentSample at(double y, const State& state) const noexcept {
            EnvironmentSample sample = environment.at(y, state);
            const double moved = y - from;
            const double quotient =
                std::abs(moved) > shortest ? (sample.energy - energy) / moved : mean(y, state);
            if (!switched || (sample.force - quotient) * moved < 0.0) {
                // D' = (f - D) / (y - from), and half of f' where that is nothing over nothing.
                sample.slope =
                    std::abs(moved) > shortest ? (sample.force - quotient) / moved : 0.5 * sample.slope;
                sample.force = quotient;
            }
            return sample;
        }
        void advance(double y, State& state) const noexcept { environment.advance(y, state); }
        [[nodiscard]] State start(double y) const noexcept { return environment.start(y); }

        /// The mean of f between `from` and y by three Gauss points.
        [[nodiscard]] double mean(double y, const State& state) const noexcept {
            const double middle = 0.5 * (from + y);
            const double offset = 0.7745966692414834 * 0.5 * (y - from);
            return (5.0 * environment.at(middle - offset, state).force +
                    8.0 * environment.at(middle, state).force +
                    5.0 * environment.at(middle + offset, state).force) /
                   18.0;
        }
    };

    /// The end of the step, searched from `start`. `push` is what the coupling would exert on an environment at
    /// rest at 0, its damper's memory included.
    [[nodiscard]] Solution solve(VirtualCoupling coupling, double push, double start) const noexcept {
        const double memory = 2.0 * inertia_.mass / (period_ * period_) + inertia_.damping / period_;
        const LoadLine line{memory + coupling.stiffness + coupling.damping / period_,
                            memory * position_ + 2.0 * inertia_.mass / period_ * velocity_ + push};
        const Stepped stepped{environment_, position_, environment_.at(position_, state_).energy, shortest_,
                              switched_};
        Solution solution = LoadLineSolver{}.solve(stepped, state_, line, start);
        ++solution.evaluations;
        return solution;
    }

    [[nodiscard]] Rendered moved_to(const Solution& solution, double force) noexcept {
        environment_.advance(solution.position, state_);
        velocity_ = 2.0 * (solution.position - position_) / period_ - velocity_;
        position_ = solution.position;
        return {force, position_, solution.evaluations, solution.status, solution.environment.extrapolated};
    }

    E environment_;
    Inertia inertia_;
    VirtualCoupling coupling_;
    double period_;
    double shortest_;
    bool switched_;
    double force_limit_;  ///< F_max
    typename E::State state_;
    double device_ = 0.0;    ///< x_{k-1}
    double position_ = 0.0;  ///< y_{k-1}
    double velocity_ = 0.0;  ///< v_{k-1}
};

}  // namespace palpate
