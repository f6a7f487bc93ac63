// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <utility>

namespace palpate {

/// Force, slope and energy of a virtual object at one position x. The force is that of the object against the tool: a
/// pressed spring gives force > 0 for position > 0.
struct EnvironmentSample {
    double force = 0.0;         ///< force f(x) of the virtual object [N or N*m]
    double slope = 0.0;         ///< df/dx, the local stiffness [N/m]
    double energy = 0.0;        ///< energy stored in the virtual object, plus a constant [J]
    bool extrapolated = false;  ///< true if x lies outside the domain of the model
};

/// Type of the state of a virtual object without hysteresis: empty, because its force depends only on the present
/// position.
struct Stateless {};

/// A virtual object of one degree of freedom. `at` computes the force at a trial position x and does not change the
/// state. `advance` updates the state (the play operator of a hysteresis) with the rendered position. `start` returns
/// the state of an object at rest at position x.
template <class E>
concept Environment = requires(const E& environment, double x, const typename E::State& state,
                               typename E::State& mutable_state) {
    { environment.at(x, state) } noexcept -> std::same_as<EnvironmentSample>;
    { environment.advance(x, mutable_state) } noexcept;
    { environment.start(x) } noexcept -> std::same_as<typename E::State>;
};

}  // namespace palpate
