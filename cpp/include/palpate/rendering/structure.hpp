// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <limits>
#include <optional>
#include <string_view>

#include "palpate/dynamics/coupling.hpp"
#include "palpate/model/environment.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/rendering/held_slope.hpp"
#include "palpate/status.hpp"

namespace palpate {

/// Force and state that a structure computed in one tick.
struct Rendered {
    double force = 0.0;                 ///< force on the device, positive out of the object [N or N*m]
    double environment_position = 0.0;  ///< y, position of the virtual object [m or rad]
    int evaluations = 0;                ///< number of evaluations of the model's force
    Status status = Status::Ok;
    bool extrapolated = false;  ///< true if y lies outside the model's domain
    /// Slope of the line through (y, force) that the device holds; 0: the device holds the force [N/m or N*m/rad]
    double stiffness = 0.0;
};

/// A class that computes a force from the measured position of the device, once a tick. `reset` sets the virtual object
/// at rest at the device's position. If the input or the result of `step` is not finite, `step` returns zero force and
/// does not change the state.
template <class S>
concept Structure = requires(S& structure, double position) {
    { structure.reset(position) } noexcept;
    { structure.step(position) } noexcept -> std::same_as<Rendered>;
};

/// Limits of the motion of a virtual object that a force drives. Both act inside the step: the object's state contains
/// them, so they take energy out of the object and never put energy in.
struct DriveLimits {
    double largest_step = std::numeric_limits<double>::infinity();  ///< largest motion in a step [m or rad]
    double friction = 0.0;  ///< Coulomb friction of the object [N or N*m]
};

/// Properties of a structure that do not depend on the model.
struct StructureTraits {
    std::string_view name;               ///< name of the structure, as in --structure
    bool coupling = false;               ///< true: the structure has a virtual coupling
    bool mass = false;                   ///< true: the virtual object has mass and damping
    bool velocity = false;               ///< true: the structure can render a force that depends on velocity
    bool predicts = false;               ///< true: the structure can use a predicted position
    bool line = false;                   ///< true: the structure sends lines instead of forces
    bool may_reduce_hysteresis = false;  ///< true: may dissipate less energy than the model's hysteresis
};

/// Parameters of a structure, except the environment (the force law of the virtual object).
struct StructureNumbers {
    VirtualCoupling coupling;
    Inertia inertia;
    int predict = 0;            ///< number of past positions from which the prediction is computed
    double period_s = 1e-3;     ///< period T [s]
    double force_limit = 0.0;   ///< force limit [N or N*m]; infinity without a limit
    double finest_width = 0.0;  ///< width of the model's finest wavelet [m or rad]
    std::optional<HeldSlope> line = std::nullopt;  ///< slope of a held line
    const ForceModel* model = nullptr;             ///< model whose force the structure renders
};

namespace detail {

/// Returns the result of a step whose input or force is not finite: zero force, and the given position of the object.
[[nodiscard]] inline Rendered refused(double environment_position) noexcept {
    return {0.0, environment_position, 0, Status::NonFinite, false};
}

/// Returns the end of a step from the position `from` that the limits allow. `solve(force)` returns the solution of the
/// step without limits; it rises with the force. With friction the object moves only if it moves in the direction of
/// the force that friction leaves; otherwise it stays.
template <class Solve>
[[nodiscard]] auto limited_step(double from, double force, const DriveLimits& limits,
                                const Solve& solve) noexcept {
    auto end = solve(force - limits.friction);
    if (limits.friction > 0.0 && end.position <= from) {
        const int evaluations = end.evaluations;
        end = solve(force + limits.friction);
        end.evaluations += evaluations;
        end.position = std::min(end.position, from);
    }
    const double moved = end.position - from;
    // A branch, because the next step would wait for the result of a minimum and a maximum
    if (std::abs(moved) > limits.largest_step) [[unlikely]] {
        end.position = from + std::copysign(limits.largest_step, moved);
    }
    return end;
}

}  // namespace detail

}  // namespace palpate
