// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <concepts>
#include <string_view>

#include "palpate/dynamics/coupling.hpp"
#include "palpate/model/environment.hpp"
#include "palpate/status.hpp"

namespace palpate {

/// What one tick of a structure yields.
struct Rendered {
    double force = 0.0;                 ///< on the device, pushing it out of the object [N or N*m]
    double environment_position = 0.0;  ///< y, where the virtual object was evaluated
    int evaluations = 0;                ///< of the environment
    Status status = Status::Ok;
    bool extrapolated = false;  ///< y lies outside the model's data
};

/// A way to turn the measured position of the device into a force, once a tick. `reset` puts the object at
/// rest under the device; a `step` whose input or result is not finite yields zero force and changes nothing.
template <class S>
concept Structure = requires(S& structure, double position) {
    { structure.reset(position) } noexcept;
    { structure.step(position) } noexcept -> std::same_as<Rendered>;
};

/// Properties of a structure that do not depend on the model.
struct StructureTraits {
    std::string_view name;
    bool coupling = false;    ///< the object stands behind a virtual coupling
    bool mass = false;        ///< the object has mass and damping
    bool solved = false;      ///< each step solves a load line
    bool velocity = false;    ///< also renders a force of position and velocity
    bool predicts = false;    ///< the force can be taken at a predicted position
    bool keeps_loss = false;  ///< the step need not lose what the play of a hysteresis loses
};

/// Everything but the environment that a structure is built from.
struct StructureNumbers {
    VirtualCoupling coupling;
    Inertia inertia;
    int predict = 0;
    double period_s = 1e-3;
    double force_limit = 0.0;   ///< infinite for none
    double finest_width = 0.0;  ///< of the model's wavelets [m or rad]
};

namespace detail {

/// The answer to an input that is not a number: no force, state untouched.
[[nodiscard]] inline Rendered refused(double environment_position) noexcept {
    return {0.0, environment_position, 0, Status::NonFinite, false};
}

}  // namespace detail

}  // namespace palpate
