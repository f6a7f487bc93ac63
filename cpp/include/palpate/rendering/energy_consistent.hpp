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

/// Virtual object with mass m behind a virtual coupling, m v' = F_c - f(y) - B_o v, integrated by a step that never
/// generates energy. F_c is the force of the coupling and V the stored energy of the model's force f. In a step from
/// y_{k-1} to y the mean force D(y) = (V(y) - V(y_{k-1})) / (y - y_{k-1}) does exactly the work V(y) - V(y_{k-1}). With
/// the midpoint rule the equation of the step is the load line D(y) + p y = q, with
///
///     p = 2m/T^2 + B_o/T + K_c + B_c/T,
///     q = (2m/T^2 + B_o/T) y_{k-1} + (2m/T) v_{k-1} + K_c x_k + B_c (v_device + y_{k-1}/T).
///
/// The velocity of the object is v_k = 2 (y_k - y_{k-1}) / T - v_{k-1}.
///
/// A step that always uses D oscillates on stiff walls. With `switched`, D replaces the force f(y) only if f(y) would
/// generate energy, which means (f(y) - D)(y - y_{k-1}) < 0.
///
/// Every solution generates no energy. If the slope f' is at least -s, the load line of D has one solution y_D for
/// p > s/2, because the slope of D is at least -s/2. The switched step has one solution for p > s, and up to three for
/// s/2 < p < s. The step takes y_D if D replaces f at y_D. Otherwise f(y) + p y - q changes its sign between y_{k-1}
/// and y_D, and the step takes the zero of this function nearest to y_{k-1}, where D does not replace f. A `Solver`
/// that cannot identify the nearest zero may return another zero between y_{k-1} and y_D.
///
/// A force limit F_max acts as in `Implicit`: if the coupling's force exceeds F_max, device and object both receive the
/// limited force +-F_max.
template <Environment E, class Solver = LoadLineSolver>
class EnergyConsistent {
  public:
    /// Makes the structure. If the object moves less than `shortest` in a step, D is computed from three Gauss points
    /// of f, because a quotient of small differences loses digits; 1e-2 of the finest wavelet's width is suitable. The
    /// Gauss points are not used if the work of their mean force differs from the change of energy by more than 1e-12
    /// of the stored energy, as when the slope of f jumps inside the step.
    EnergyConsistent(E environment, Inertia inertia, VirtualCoupling coupling, double period,
                     double shortest = 1e-4, bool switched = true,
                     double force_limit = std::numeric_limits<double>::infinity(), Solver solver = {})
        : environment_{std::move(environment)},
          inertia_{inertia},
          coupling_{coupling},
          period_{period},
          shortest_{shortest},
          switched_{switched},
          force_limit_{force_limit},
          solver_{std::move(solver)} {
        reset(0.0);
    }

    /// Returns the slope p of the load line of every step, for a virtual object behind a virtual coupling.
    [[nodiscard]] static double load_line_slope(Inertia inertia, VirtualCoupling coupling,
                                                double period) noexcept {
        return inertia.midpoint_slope(period) + coupling.load_line_slope(period);
    }

    [[nodiscard]] const Solver& solver() const noexcept { return solver_; }

    /// Sets the virtual object at rest at a position.
    void reset(double position) noexcept {
        state_ = environment_.start(position);
        device_ = position;
        position_ = position;
        velocity_ = 0.0;
    }

    /// Moves the object by one step and returns the force on device and object, for the measured position of the
    /// device.
    [[nodiscard]] Rendered step(double device) noexcept {
        const double device_velocity = (device - device_) / period_;
        const double driving_force = coupling_.force(device, device_velocity + position_ / period_);
        const Solution solution = solve(coupling_, driving_force);
        if (solution.status == Status::NonFinite) {
            return detail::refused(position_);
        }
        const double force = coupling_.force(device - solution.position,
                                             device_velocity - (solution.position - position_) / period_);
        if (std::abs(force) > force_limit_) {
            const double limited = std::copysign(force_limit_, force);
            const Solution limited_solution = search({0.0, 0.0}, limited, solution.position);
            if (limited_solution.status == Status::NonFinite) {
                return detail::refused(position_);
            }
            device_ = device;
            Rendered rendered = moved_to(limited_solution, limited);
            rendered.evaluations += solution.evaluations;
            rendered.status = rendered.status == Status::Ok ? Status::Limited : rendered.status;
            return rendered;
        }
        device_ = device;
        return moved_to(solution, force);
    }

    /// Moves the virtual object by one step; the given force acts on it in place of the coupling's force.
    [[nodiscard]] Rendered drive(double force, const DriveLimits& limits = {}) noexcept {
        const Solution solution = detail::limited_step(
            position_, force, limits, [&](double driving) noexcept { return solve({0.0, 0.0}, driving); });
        return solution.status == Status::NonFinite ? detail::refused(position_) : moved_to(solution, force);
    }

    /// Returns the velocity of the object [m/s or rad/s].
    [[nodiscard]] double velocity() const noexcept { return velocity_; }

  private:
    /// The force f(y) or the mean force D(y) of a step from the position `from` to y, as an environment.
    struct Stepped {
        using State = typename E::State;
        const E& environment;
        double from;
        double energy;
        double shortest;
        bool switched;
        int& evaluations;  ///< number of evaluations of the environment; counts up

        [[nodiscard]] EnvironmentSample at(double y, const State& state) const noexcept {
            EnvironmentSample sample = counted(y, state);
            const double moved = y - from;
            const double quotient = mean(y, sample, state);
            if (!switched || (sample.force - quotient) * moved < 0.0) {
                // Slope of the mean force D over y: D' = (f - D) / (y - from), or about f' / 2 for y near `from`.
                sample.slope =
                    std::abs(moved) > shortest ? (sample.force - quotient) / moved : 0.5 * sample.slope;
                sample.force = quotient;
            }
            return sample;
        }
        void advance(double y, State& state) const noexcept { environment.advance(y, state); }
        [[nodiscard]] State start(double y) const noexcept { return environment.start(y); }

        /// Returns true if a step to y with the force f(y) would generate energy.
        [[nodiscard]] bool generates(double y, const State& state) const noexcept {
            const EnvironmentSample sample = counted(y, state);
            return (sample.force - mean(y, sample, state)) * (y - from) < 0.0;
        }

        /// Returns the mean force D(y); for a y near `from` it is computed from three Gauss points.
        [[nodiscard]] double mean(double y, const EnvironmentSample& at_y,
                                  const State& state) const noexcept {
            const double moved = y - from;
            const double gained = at_y.energy - energy;
            if (std::abs(moved) > shortest) {
                return gained / moved;
            }
            const double middle = 0.5 * (from + y);
            const double offset = 0.7745966692414834 * 0.5 * moved;
            const double gauss =
                (5.0 * counted(middle - offset, state).force + 8.0 * counted(middle, state).force +
                 5.0 * counted(middle + offset, state).force) /
                18.0;
            // Over a ten-thousandth of `shortest`, a jump of the slope cannot generate more than rounding errors.
            const bool exact = std::abs(gauss * moved - gained) <=
                               1e-12 * std::fmax(std::abs(energy), std::abs(at_y.energy));
            return exact || std::abs(moved) < 1e-4 * shortest ? gauss : gained / moved;
        }

        [[nodiscard]] EnvironmentSample counted(double y, const State& state) const noexcept {
            ++evaluations;
            return environment.at(y, state);
        }
    };

    /// Returns the load line of the next step. `driving_force` is the coupling's force on an object at position 0, with
    /// the damper's part that depends on the last position of the object.
    [[nodiscard]] LoadLine line_of(VirtualCoupling coupling, double driving_force) const noexcept {
        const double memory = load_line_slope(inertia_, {0.0, 0.0}, period_);
        return {load_line_slope(inertia_, coupling, period_),
                memory * position_ + 2.0 * inertia_.mass / period_ * velocity_ + driving_force};
    }

    /// Returns the force of the next step as an environment: the mean force D. If `switched`: the force f where f does
    /// not generate energy, otherwise D. Its evaluations of the environment are added to `evaluations`.
    [[nodiscard]] Stepped stepped(bool switched, int& evaluations) const noexcept {
        ++evaluations;
        return {environment_, position_, environment_.at(position_, state_).energy,
                shortest_,    switched,  evaluations};
    }

    /// Returns the first solution of the step's load line that a search from the position `start` finds.
    [[nodiscard]] Solution search(VirtualCoupling coupling, double driving_force,
                                  double start) const noexcept {
        int evaluations = 0;
        Solution solution = LoadLineSolver{}.solve(stepped(switched_, evaluations), state_,
                                                   line_of(coupling, driving_force), start);
        solution.evaluations = evaluations;
        return solution;
    }

    /// Returns the solution of the next step: the position of the object at the end of the step.
    [[nodiscard]] Solution solve(VirtualCoupling coupling, double driving_force) const noexcept {
        const LoadLine line = line_of(coupling, driving_force);
        int evaluations = 0;
        const Stepped quotient = stepped(false, evaluations);
        const LoadLineSolver newton;
        const auto by_force = [&](Solution solution) {
            evaluations += solution.evaluations;
            return solution;
        };
        const auto end = [&](Solution solution) {
            solution.evaluations = evaluations;
            return solution;
        };
        const auto bracket_to = [&](double y) {
            return Bracket{std::fmin(position_, y), std::fmax(position_, y)};
        };
        typename Solver::Memory memory{position_};
        if (switched_ && solver_.unique(line.slope)) {
            const Solution unique = by_force(solver_.solve(environment_, state_, line, memory));
            if (unique.status != Status::Ok || !quotient.generates(unique.position, state_)) {
                return end(unique);
            }
            // With the force f the step would generate energy, so y_D, the solution with the mean force D, is used.
            return end(newton.solve(quotient, state_, line, unique.position, bracket_to(unique.position)));
        }
        const Solution by_energy = newton.solve(quotient, state_, line, position_);
        if (!switched_ || by_energy.status != Status::Ok || quotient.generates(by_energy.position, state_)) {
            return end(by_energy);
        }
        const Bracket between = bracket_to(by_energy.position);
        if (solver_.tabulated()) {
            const Solution nearest = by_force(solver_.solve(environment_, state_, line, memory));
            if (nearest.status == Status::Ok && nearest.position >= between.low &&
                nearest.position <= between.high) {
                return end(nearest);
            }
        }
        const Solution any = by_force(newton.solve(environment_, state_, line, by_energy.position, between));
        return end(quotient.generates(any.position, state_) ? by_energy : any);
    }

    /// Moves the object to the solution of a step and returns the result of the tick.
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
    double force_limit_;  ///< F_max, largest force sent to the device [N or N*m]
    Solver solver_;
    typename E::State state_;
    double device_ = 0.0;    ///< x_{k-1}, last position of the device
    double position_ = 0.0;  ///< y_{k-1}, last position of the object
    double velocity_ = 0.0;  ///< v_{k-1}, last velocity of the object
};

/// Builds the energy-consistent structure.
struct EnergyConsistentStructure {
    static constexpr StructureTraits traits{
        .name = "energy-consistent", .coupling = true, .mass = true, .may_reduce_hysteresis = true};

    template <Environment E, class SolverOf>
    static AnyStructure build(E environment, const StructureNumbers& numbers, const SolverOf& solver_of) {
        const double p =
            EnergyConsistent<E>::load_line_slope(numbers.inertia, numbers.coupling, numbers.period_s);
        return EnergyConsistent{std::move(environment),
                                numbers.inertia,
                                numbers.coupling,
                                numbers.period_s,
                                1e-2 * numbers.finest_width,
                                true,
                                numbers.force_limit,
                                solver_of(p)};
    }
};

}  // namespace palpate
