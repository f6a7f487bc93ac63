// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <utility>

namespace palpate {

/// State of a virtual object at one position. Force is the force of the object against the tool: a pressed spring gives
/// force > 0 for position > 0.
struct EnvironmentSample {
    double force = 0.0;         ///< f(x) [N or N*m]
    double slope = 0.0;         ///< df/dx, the local stiffness [N/m]
    double energy = 0.0;        ///< stored energy [J], up to a constant
    bool extrapolated = false;  ///< true if x lies outside the data from which the model was identified
};

/// State of an environment without memory.
struct Stateless {};

/// A virtual object of one degree of freedom. `at` evaluates a trial position and changes nothing. `advance` commits
/// the rendered position. `start` returns the state of an object at rest at x.
template <class E>
concept Environment = requires(const E& environment, double x, const typename E::State& state,
                               typename E::State& mutable_state) {
    { environment.at(x, state) } noexcept -> std::same_as<EnvironmentSample>;
    { environment.advance(x, mutable_state) } noexcept;
    { environment.start(x) } noexcept -> std::same_as<typename E::State>;
};

}  // namespace palpate
