// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include "palpate/device/device_profile.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/rendering/scheme.hpp"

namespace palpate {

/// Size of a model's positions and forces, relative to a model that suits the default simulated knob. Default settings
/// in m, rad, N or N*m are multiplied by these factors; times do not change.
struct ModelScale {
    double length = 1.0;  ///< default positions are multiplied by this factor, 1 for the simulated knob
    double force = 1.0;   ///< default forces are multiplied by this factor, 1 for the simulated knob

    /// Returns the factor for default stiffnesses: the factor of forces divided by the factor of positions.
    [[nodiscard]] double stiffness() const noexcept { return force / length; }
};

namespace detail {

/// A model whose domain has this length gets the position factor 1 [rad]
inline constexpr double knob_travel = 0.5;
/// The default force limit of a simulated device is this factor times the model's largest force, unless the positions
/// are angles [-]
inline constexpr double force_reserve = 1.05;

/// Returns the force of a model at a position during a long stroke in a direction, +1 for press and -1 for release. A
/// model of position and velocity is evaluated at the largest velocity of its domain in that direction.
[[nodiscard]] inline double sliding_force(const ForceModel& model, double position,
                                          double direction) noexcept {
    if (const VelocityNetwork* force = model.velocity()) {
        const Domain& box = model.domain();
        return force->force(position, direction > 0.0 ? box.upper[1] : box.lower[1]);
    }
    return model.hysteresis() != nullptr ? model.hysteresis()->sliding(position, direction).force
                                         : model.network()->at(position, {}).force;
}

/// Returns the largest absolute force of a model at 1001 positions of its domain, in both directions, plus the largest
/// force of its memory [N or N*m]; 1 if all forces are 0.
[[nodiscard]] inline double largest_force(const ForceModel& model) noexcept {
    const double lower = model.domain().lower[0];
    const double step = (model.domain().upper[0] - lower) / 1000.0;
    double largest = 0.0;
    for (int k = 0; k <= 1000; ++k) {
        for (const double direction : {-1.0, 1.0}) {
            largest = std::max(largest, std::abs(sliding_force(model, lower + k * step, direction)));
        }
    }
    if (const MemoryNetwork* memory = model.memory()) {
        largest += memory->largest_ratio() * memory->largest_tension();
    }
    return largest > 0.0 ? largest : 1.0;
}

}  // namespace detail

/// Returns the scale of a model of position, or of position and velocity. If `is_angle`, the model's positions are in
/// rad, and the scale is 1. For any other unit (millimetres of a keyswitch, micrometres under an AFM tip) the scale is
/// the model's travel and largest force, relative to those that suit the default knob.
[[nodiscard]] inline ModelScale scale_of(const ForceModel& model, bool is_angle) {
    require_renderable(model);
    if (is_angle) {
        return {};
    }
    const double length = (model.domain().upper[0] - model.domain().lower[0]) / detail::knob_travel;
    const double force = detail::force_reserve * detail::largest_force(model) / DeviceProfile{}.force_limit;
    return {length, force};
}

/// Returns the profile of the default simulated knob, with lengths and forces multiplied by a model's scale.
[[nodiscard]] inline DeviceProfile scaled_knob(const ModelScale& scale, bool is_angle, double period_s) {
    DeviceProfile device;
    device.period_s = period_s;
    if (!is_angle) {
        device.id += ", scaled";
        device.position_unit = "m";
        device.inertia *= scale.stiffness();
        device.viscous_damping *= scale.stiffness();
        device.coulomb_friction *= scale.force;
        device.encoder_step *= scale.length;
        device.force_step *= scale.force;
        device.force_limit *= scale.force;
    }
    return device;
}

/// Fields of a scheme that the user chose, in the units of the model. Fields without a value get a default that is
/// scaled to the model.
struct SchemeChoices {
    std::optional<StructureKind> structure;
    std::optional<bool> compensated;
    std::optional<double> coupling_stiffness;
    std::optional<double> coupling_damping;
    std::optional<double> mass;
    std::optional<double> object_damping;
    std::optional<double> play_radius;
    std::optional<int> predict;

    /// Returns true if the user chose at least one field of the scheme; `compensated` = false is not a choice.
    [[nodiscard]] bool any() const noexcept {
        return structure || compensated.value_or(false) || coupling_stiffness || coupling_damping || mass ||
               object_damping || play_radius || predict;
    }
};

template <>
inline constexpr auto fields_of<SchemeChoices> =
    FieldTable{Field<&SchemeChoices::structure>{"structure"},
               Field<&SchemeChoices::compensated>{"compensated"},
               Field<&SchemeChoices::coupling_stiffness>{"coupling_stiffness"},
               Field<&SchemeChoices::coupling_damping>{"coupling_damping"},
               Field<&SchemeChoices::mass>{"mass"},
               Field<&SchemeChoices::object_damping>{"object_damping"},
               Field<&SchemeChoices::play_radius>{"play_radius"},
               Field<&SchemeChoices::predict>{"predict"}};

/// Returns the default play radius for a hysteresis model that does not define one [m or rad]; otherwise 0.
[[nodiscard]] inline double default_play_radius(const ForceModel& model, double encoder_step) noexcept {
    if (model.hysteresis() == nullptr || model.play_radius()) {
        return 0.0;
    }
    return usual_play_radius(model.domain().upper[0] - model.domain().lower[0], encoder_step);
}

/// Returns a scheme with the fields that the user chose; the other fields have defaults, multiplied by the model's
/// scale.
[[nodiscard]] inline Scheme scheme_for(const ForceModel& model, const ModelScale& scale,
                                       const DeviceProfile& device, const SchemeChoices& chosen = {}) {
    const Scheme standard;
    const bool is_direct =
        model.velocity() != nullptr || model.memory() != nullptr || chosen.predict.value_or(0) > 0;
    return {chosen.structure.value_or(is_direct ? StructureKind::Direct : standard.structure),
            {chosen.coupling_stiffness.value_or(standard.coupling.stiffness * scale.stiffness()),
             chosen.coupling_damping.value_or(standard.coupling.damping * scale.stiffness())},
            {chosen.mass.value_or(standard.inertia.mass * scale.stiffness()),
             chosen.object_damping.value_or(standard.inertia.damping * scale.stiffness())},
            chosen.compensated.value_or(standard.compensated),
            chosen.play_radius.value_or(default_play_radius(model, device.encoder_step)),
            chosen.predict.value_or(standard.predict)};
}

}  // namespace palpate
