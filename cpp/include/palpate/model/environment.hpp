// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <utility>

namespace palpate {

/// What a virtual object answers at one position.
/// Force is what the object exerts against the tool: pressing a spring gives force > 0 for position > 0.
struct EnvironmentSample {
    double force = 0.0;         ///< f(x) [N or N*m]
    double slope = 0.0;         ///< df/dx, the local stiffness
    double energy = 0.0;        ///< stored energy [J], up to a constant
    bool extrapolated = false;  ///< x lies outside the data the environment was identified on
};

/// State of an environment without memory.
struct Stateless {};

/// A virtual object of one degree of freedom. `at` may be asked at any number of trial positions and
/// changes nothing; `advance` commits the position that was rendered; `start` is the state of an object
/// that has rested at x.
template <class E>
concept Environment = requires(const E& environment, double x, const typename E::State& state,
                               typename E::State& mutable_state) {
    { environment.at(x, state) } noexcept -> std::same_as<EnvironmentSample>;
    { environment.advance(x, mutable_state) } noexcept;
    { environment.start(x) } noexcept -> std::same_as<typename E::State>;
};

}  // namespace palpate
