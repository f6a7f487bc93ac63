// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <limits>
#include <utility>

#include "palpate/model/environment.hpp"

namespace palpate {

/// A virtual object whose force f(x) is limited to +-`force_limit` [N].
///
/// While the force limit is active, the slope is 0. The energy is NaN, because the limited force does not have a closed
/// integral.
template <Environment E>
class LimitedEnvironment {
  public:
    using State = typename E::State;

    LimitedEnvironment(E environment, double force_limit)
        : environment_{std::move(environment)}, force_limit_{force_limit} {}

    /// Returns the virtual object without the force limit.
    [[nodiscard]] const E& unlimited() const noexcept { return environment_; }
    [[nodiscard]] double force_limit() const noexcept { return force_limit_; }

    /// Returns limited force and slope at position x.
    [[nodiscard]] EnvironmentSample at(double x, const State& state) const noexcept {
        const EnvironmentSample sample = environment_.at(x, state);
        const double force = std::clamp(sample.force, -force_limit_, force_limit_);
        return {force, force == sample.force ? sample.slope : 0.0, std::numeric_limits<double>::quiet_NaN(),
                sample.extrapolated};
    }
    void advance(double x, State& state) const noexcept { environment_.advance(x, state); }
    [[nodiscard]] State start(double x) const noexcept { return environment_.start(x); }

  private:
    E environment_;
    double force_limit_;
};

}  // namespace palpate
