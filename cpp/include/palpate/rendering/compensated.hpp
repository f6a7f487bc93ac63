// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>

#include "palpate/model/environment.hpp"
#include "palpate/solver/newton.hpp"

namespace palpate {

/// An environment that feels like `E` through a coupling of stiffness K_c. The coupling's spring is taken out
/// of the curve beforehand: the curve (x - f(x)/K_c, f(x)) in place of (x, f(x)), of slope
/// K_c f' / (K_c - f') > -K_c. It exists where f' < K_c everywhere.
template <Environment E>
class Compensated {
  public:
    using State = typename E::State;

    Compensated(E environment, double coupling_stiffness)
        : environment_{std::move(environment)}, stiffness_{coupling_stiffness} {}

    [[nodiscard]] EnvironmentSample at(double shifted, const State& state) const noexcept {
        const Solution felt = solve(shifted, state);
        const double force = -felt.environment.force;
        const double slope = -felt.environment.slope;
        return {felt.status == Status::NonFinite ? std::numeric_limits<double>::quiet_NaN() : force,
                stiffness_ * slope / (stiffness_ - slope),
                felt.environment.energy - 0.5 * force * force / stiffness_, felt.environment.extrapolated};
    }

    void advance(double shifted, State& state) const noexcept {
        environment_.advance(solve(shifted, state).position, state);
    }

    [[nodiscard]] State start(double shifted) const noexcept {
        const State resting = environment_.start(shifted);
        return environment_.start(solve(shifted, resting).position);
    }

  private:
    /// x - f(x)/K_c = shifted is the load line -f(x) + K_c x = K_c shifted of the environment turned over.
    struct Negated {
        using State = typename E::State;
        const E& environment;

        [[nodiscard]] EnvironmentSample at(double x, const State& state) const noexcept {
            const EnvironmentSample sample = environment.at(x, state);
            return {-sample.force, -sample.slope, sample.energy, sample.extrapolated};
        }
        void advance(double x, State& state) const noexcept { environment.advance(x, state); }
        [[nodiscard]] State start(double x) const noexcept { return environment.start(x); }
    };

    [[nodiscard]] Solution solve(double shifted, const State& state) const noexcept {
        return LoadLineSolver{}.solve(Negated{environment_}, state, {stiffness_, stiffness_ * shifted},
                                      shifted);
    }

    E environment_;
    double stiffness_;
};

}  // namespace palpate
