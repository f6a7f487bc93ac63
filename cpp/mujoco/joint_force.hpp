// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

#include "palpate/model/compiled_network.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/solver/newton.hpp"

namespace palpate {

/// Motion of a joint in a simulation step without the force of the model.
struct JointStep {
    double position = 0.0;      ///< position x of the joint at the start of the step [m or rad]
    double velocity = 0.0;      ///< velocity v of the joint at the start of the step [m/s or rad/s]
    double acceleration = 0.0;  ///< acceleration of the joint by all other forces [m/s^2 or rad/s^2]
    double mobility = 0.0;  ///< a, acceleration of the joint by a force of 1 N or 1 N*m [1/kg or 1/(kg*m^2)]
    double period = 0.0;    ///< length h of the step [s]

    /// Returns the position at the end of the step without the force of the model.
    [[nodiscard]] double free_end() const noexcept {
        return position + period * (velocity + period * acceleration);
    }
};

/// Equation that gives the force of a step. `Implicit` uses the force at the end of the step, `EnergyConsistent` the
/// mean force over the steps before and after the present position.
enum class JointMethod : std::uint8_t { Implicit, EnergyConsistent };

/// Force of a model on a joint of a simulator that integrates v+ = v + h (a_free - a F), x+ = x + h v+. The force F of
/// the model is held over the step; this class chooses F such that large steps are stable. `E` is the force law f.
///
/// - Implicit: F = f(x+). The end of the step solves the load line x+ + h^2 a f(x+) = x_free.
/// - Energy-consistent: F = (D + D_last) / 2. D is the mean force from x to x+, D_last that of the last step, and x+
///   solves x+ + h^2 a D(x+) / 2 = x_free - h^2 a D_last / 2. With the velocity u = v+ + h a D / 2 at x, each step
///   conserves the sum of u^2 / (2 a) and the work of the model, because u+ = u - h a D and x+ = x + h (u + u+) / 2.
template <Environment E>
class JointForce {
  public:
    using State = typename E::State;

    /// Force of a step and the force to give to the next step [N or N*m].
    struct Result {
        double force = 0.0;  ///< force F of the model over the step
        double mean = 0.0;   ///< mean force D from the start to the end of the step
    };

    /// `width` is the width of the finest wavelet [m or rad].
    JointForce(E environment, double width) : environment_{std::move(environment)}, width_{width} {
        // The search for the first solution takes short steps. A fast joint passes many wavelets in a step.
        solver_.max_evaluations = 2000;
        solver_.longest_step = 0.25 * width;
        // A position error of 1e-15 m is a force error of 1e-11 N at a stiffness of 10 kN/m.
        solver_.tolerance = energy_solver_.tolerance = 1e-15;
    }

    [[nodiscard]] const E& environment() const noexcept { return environment_; }

    /// Returns the force of a step by the given method. `state` is the state of the model at the start of the step,
    /// `last_mean` the mean force of the last step.
    [[nodiscard]] Result solve(JointMethod method, const JointStep& step, const State& state,
                               double last_mean) const noexcept {
        const double inertial = 1.0 / (step.period * step.period * step.mobility);
        if (method == JointMethod::Implicit) {
            const LoadLine line{inertial, inertial * step.free_end()};
            const Solution end = solver_.solve(environment_, state, line, step.position);
            return {end.environment.force, end.environment.force};
        }
        const LoadLine line{2.0 * inertial, 2.0 * inertial * step.free_end() - last_mean};
        const MeanForce mean{environment_, step.position, 1e-2 * width_};
        const Solution end = energy_solver_.solve(mean, state, line, step.position);
        return {0.5 * (end.environment.force + last_mean), end.environment.force};
    }

  private:
    /// Mean force D(y) over a motion from the position `from` to y, as an environment.
    struct MeanForce {
        using State = typename E::State;
        const E& environment;
        double from;
        double shortest;  ///< motion below which a difference of energies loses too many digits [m or rad]

        [[nodiscard]] EnvironmentSample at(double y, const State& state) const noexcept {
            EnvironmentSample sample = environment.at(y, state);
            const double moved = y - from;
            if (std::abs(moved) > shortest) {
                const double mean = work(y, state) / moved;
                sample.slope = (sample.force - mean) / moved;
                sample.force = mean;
            } else {
                const double middle = 0.5 * (from + y);
                const double offset = 0.7745966692414834 * 0.5 * moved;  // three Gauss points
                sample.force = (5.0 * environment.at(middle - offset, state).force +
                                8.0 * environment.at(middle, state).force +
                                5.0 * environment.at(middle + offset, state).force) /
                               18.0;
                sample.slope *= 0.5;
            }
            return sample;
        }
        void advance(double y, State& state) const noexcept { environment.advance(y, state); }
        [[nodiscard]] State start(double y) const noexcept { return environment.start(y); }

        /// Returns the work of the force from `from` to y [J]: the change of the stored energy, and with hysteresis
        /// also the energy that the motion dissipates.
        [[nodiscard]] double work(double y, const State& state) const noexcept {
            if constexpr (requires { state.play; }) {
                const double radius = environment.play_radius();
                const State at_from{play(from, state.play, radius)};
                const double direction = y > from ? 1.0 : -1.0;
                const double sliding_from = at_from.play + direction * radius;
                if ((y - sliding_from) * direction <= 0.0) {
                    return environment.at(y, at_from).energy - environment.at(from, at_from).energy;
                }
                const auto at_slide = environment.sliding(sliding_from, direction);
                const double sticking =
                    environment.at(sliding_from, at_from).energy - environment.at(from, at_from).energy;
                const auto& h = environment.hysteresis_force();
                return sticking + environment.sliding(y, direction).energy - at_slide.energy +
                       direction * (h.at(y).integral - h.at(sliding_from).integral);
            } else {
                return environment.at(y, state).energy - environment.at(from, state).energy;
            }
        }
    };

    E environment_;
    double width_;
    LoadLineSolver solver_;
    LoadLineSolver energy_solver_;
};

/// Force of a model from a model file on a joint. A simulator stores its state, an array of four numbers.
class ModelOnJoint {
  public:
    static constexpr int states = 4;  ///< number of stored values

    /// Throws std::invalid_argument if the model is not a force of position, with or without hysteresis.
    ModelOnJoint(const ForceModel& model, JointMethod method) : method_{method}, force_{force_of(model)} {}

    /// Sets the stored values for an object at rest at a position [m or rad].
    static void start(double position, double* stored) noexcept {
        stored[play_] = position;
        stored[last_mean_] = 0.0;
        stored[has_moved_] = 0.0;
        stored[constraints_] = 0.0;
    }

    /// Returns the acceleration of the joint by constraints in the last step, an estimate for the next step.
    [[nodiscard]] static double by_constraints(const double* stored) noexcept { return stored[constraints_]; }

    /// Returns the force of the model over a step [N or N*m]; positive values push the joint to lower positions.
    [[nodiscard]] double force(const JointStep& step, const double* stored) noexcept {
        // Before the first step the joint is in equilibrium: model and other forces cancel.
        const double last_mean =
            stored[has_moved_] != 0.0 ? stored[last_mean_] : step.acceleration / step.mobility;
        return std::visit(
            [&](const auto& force) {
                const auto [held, mean] = force.solve(method_, step, state_of(force, stored), last_mean);
                mean_ = mean;
                return held;
            },
            force_);
    }

    /// Updates the stored values at the end of the step whose force was computed last: `position` of the joint, and its
    /// acceleration by the forces of constraints [m/s^2 or rad/s^2].
    void advance(double position, double by_constraints, double* stored) const noexcept {
        std::visit(
            [&](const auto& force) {
                auto state = state_of(force, stored);
                force.environment().advance(position, state);
                if constexpr (requires { state.play; }) {
                    stored[play_] = state.play;
                }
            },
            force_);
        stored[last_mean_] = mean_;
        stored[has_moved_] = 1.0;
        stored[constraints_] = by_constraints;
    }

  private:
    using Force = std::variant<JointForce<CompiledNetwork>, JointForce<CompiledHysteresis>>;

    /// Places of the stored values: position of the play operator, mean force of the last step, 1 after the first step,
    /// acceleration by constraints in the last step.
    enum Place : std::uint8_t { play_, last_mean_, has_moved_, constraints_ };

    static Force force_of(const ForceModel& model) {
        const double width = model.finest_width();
        if (const HysteresisNetwork* both = model.hysteresis()) {
            return JointForce{CompiledHysteresis{*both}, std::min(width, 2.0 * both->play_radius())};
        }
        detail::require(model.network() != nullptr && model.memory() == nullptr,
                        "the force depends on more than the position, must be a force of position, with or "
                        "without hysteresis");
        return JointForce{CompiledNetwork{*model.network()}, width};
    }

    template <class F>
    static typename F::State state_of(const F& /*force*/, const double* stored) noexcept {
        if constexpr (requires(typename F::State state) { state.play; }) {
            return {stored[play_]};
        } else {
            return {};
        }
    }

    JointMethod method_;
    Force force_;
    double mean_ = 0.0;
};

}  // namespace palpate
