// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <concepts>
#include <string_view>

#include "palpate/dynamics/coupling.hpp"
#include "palpate/model/environment.hpp"
#include "palpate/status.hpp"

namespace palpate {

/// Result of one tick of a structure.
struct Rendered {
    double force = 0.0;                 ///< force on the device, positive out of the object [N or N*m]
    double environment_position = 0.0;  ///< y, position of the virtual object [m or rad]
    int evaluations = 0;                ///< evaluations of the environment
    Status status = Status::Ok;
    bool extrapolated = false;  ///< true if y lies outside the model's data
};

/// Computes a force from the measured position of the device, once a tick. `reset` sets the object at rest under the
/// device. A `step` whose input or result is not finite returns zero force and does not change the state.
template <class S>
concept Structure = requires(S& structure, double position) {
    { structure.reset(position) } noexcept;
    { structure.step(position) } noexcept -> std::same_as<Rendered>;
};

/// Properties of a structure that do not depend on the model.
struct StructureTraits {
    std::string_view name;               ///< in options and files
    bool coupling = false;               ///< a virtual coupling
    bool mass = false;                   ///< an object with mass and damping
    bool solved = false;                 ///< a load line in each step
    bool velocity = false;               ///< a force of position and velocity
    bool predicts = false;               ///< a force at a predicted position
    bool may_reduce_hysteresis = false;  ///< hysteresis that may dissipate less than the play
};

/// Numbers from which a structure is built, without the environment.
struct StructureNumbers {
    VirtualCoupling coupling;
    Inertia inertia;
    int predict = 0;            ///< taps of the prediction
    double period_s = 1e-3;     ///< period T [s]
    double force_limit = 0.0;   ///< infinity without a limit [N or N*m]
    double finest_width = 0.0;  ///< of the model's wavelets [m or rad]
};

namespace detail {

/// Returns the result for an input that is not finite: zero force, unchanged state.
[[nodiscard]] inline Rendered refused(double environment_position) noexcept {
    return {0.0, environment_position, 0, Status::NonFinite, false};
}

}  // namespace detail

}  // namespace palpate
