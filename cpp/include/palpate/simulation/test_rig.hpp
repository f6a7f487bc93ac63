// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <vector>

#include "palpate/device/device_profile.hpp"
#include "palpate/fields/readable.hpp"
#include "palpate/io/tick_record.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/rendering/any_structure.hpp"
#include "palpate/rendering/make_structure.hpp"
#include "palpate/rendering/scale.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/simulation/closed_loop.hpp"
#include "palpate/simulation/hand.hpp"

namespace palpate {

/// Simulated device and hand, scaled to a model. For a model with positions in rad the device is the default knob. For
/// any other unit, lengths and forces of the default knob are multiplied by the scale of the model. The hand moves the
/// handle through the model's domain.
struct TestRig {
    DeviceProfile device;
    Hand hand;
    ModelScale scale;

    /// Returns a scheme with the fields that the user chose; the other fields have defaults, multiplied by the model's
    /// scale.
    [[nodiscard]] Scheme scheme(const ForceModel& model, const SchemeChoices& chosen = {}) const {
        return scheme_for(model, scale, device, chosen);
    }
};

template <>
inline constexpr auto fields_of<TestRig> =
    FieldTable{Field<&TestRig::device>{"device"}, Field<&TestRig::hand>{"hand"},
               Field<&TestRig::scale, &ModelScale::length>{
                   "length", "Factor of positions, relative to those of the default knob [-]."},
               Field<&TestRig::scale, &ModelScale::force>{
                   "force", "Factor of forces, relative to those of the default knob [-]."}};

namespace detail {

/// Returns the position of the hand's spring target that holds the handle at rest at the last position of a slow
/// motion, or at the last position where the rendered force is at most 80 % of the force limit. The remaining 20 % are
/// for the forces of coupling and damping.
[[nodiscard]] inline double resting_target(const std::vector<Rendered>& rendered,
                                           const std::vector<double>& motion, double force_limit,
                                           double hand_stiffness) {
    constexpr double held_share = 0.8;
    std::size_t last = motion.size() - 1;
    while (last > 0 && std::abs(rendered[last].force) > held_share * force_limit) {
        --last;
    }
    return motion[last] + rendered[last].force / hand_stiffness;
}

/// Returns a simulated hand that moves the handle through the model's domain, except 1 % at both ends, as far as the
/// force limit allows.
///
/// The hand is a spring to a moving target. The distance from handle to target is the rendered force divided by the
/// hand's stiffness. The target is computed for the default coupling, which reduces the force. With a stiffer structure
/// the hand presses the handle less far. The handle therefore stays in the domain during slow motion.
[[nodiscard]] inline Hand sweeping_hand(const ForceModel& model, const TestRig& rig) {
    constexpr int steps = 1000;
    const double lower = model.domain().lower[0];
    const double travel = model.domain().upper[0] - lower;
    const double largest = std::min(largest_force(model), rig.device.force_limit);
    Hand hand;
    hand.stiffness = std::max(hand.stiffness * rig.scale.stiffness(), 2.0 * largest / travel);
    hand.damping *= rig.scale.stiffness();

    SchemeChoices soft;
    soft.coupling_damping = 0.0;
    const Scheme scheme = rig.scheme(model, soft);
    std::vector<double> inwards;
    for (int k = 0; k <= steps; ++k) {
        inwards.push_back(lower + travel * (0.01 + 0.98 * k / steps));
    }
    const std::vector<double> outwards{inwards.rbegin(), inwards.rend()};
    const auto end_of = [&](const std::vector<double>& motion) {
        const std::vector<Rendered> rendered = motion_driven(model, scheme, motion, rig.device.period_s);
        return resting_target(rendered, motion, rig.device.force_limit, hand.stiffness);
    };
    const double first = end_of(outwards);
    const double last = end_of(inwards);
    hand.lower = std::min(first, last);
    hand.upper = std::max(first, last);
    return hand;
}

}  // namespace detail

/// Returns the simulated device and hand for a model of position, or of position and velocity. If `is_angle`, the
/// model's positions are in rad.
[[nodiscard]] inline TestRig rig_for(const ForceModel& model, bool is_angle, double period_s) {
    TestRig rig;
    rig.scale = scale_of(model, is_angle);
    rig.device = scaled_knob(rig.scale, is_angle, period_s);
    rig.hand = detail::sweeping_hand(model, rig);
    return rig;
}

/// Returns a hand for an admittance display with the stiffness and damping of the profile. It moves the handle through
/// the model's domain, except 1 % at both ends, as far as the force stays below 80 % of the sensor's range.
[[nodiscard]] inline Hand pedal_hand(const ForceModel& model, const DeviceProfile& device, Hand hand) {
    constexpr int steps = 1000;
    const AdmittanceDisplay& display = *device.admittance;
    if (!(display.hand_stiffness > 0.0)) {
        return hand;
    }
    const double lower = model.domain().lower[0];
    const double travel = model.domain().upper[0] - lower;
    std::vector<double> inwards;
    for (int k = 0; k <= steps; ++k) {
        inwards.push_back(lower + travel * (0.01 + 0.98 * k / steps));
    }
    Scheme direct;
    direct.structure = StructureKind::Direct;
    const std::vector<Rendered> rendered = motion_driven(model, direct, inwards, device.period_s);
    hand.stiffness = display.hand_stiffness;
    hand.damping = display.hand_damping;
    hand.lower = inwards.front() + rendered.front().force / hand.stiffness;
    hand.upper = detail::resting_target(rendered, inwards, device.force_limit, hand.stiffness);
    return hand;
}

/// Returns a function that gives the force of a model at a position, as an object that can be mounted on the handle of
/// the simulated device. The object is at rest at the position `start`.
[[nodiscard]] inline std::function<double(double)> object_of(const ForceModel& model, const TestRig& rig,
                                                             double start) {
    SchemeChoices direct;
    direct.structure = StructureKind::Direct;
    AnyStructure structure =
        make_structure(model, rig.scheme(model, direct), rig.device.period_s, rig.device.force_limit);
    structure.reset(start);
    return [structure](double position) mutable { return structure.step(position).force; };
}

/// Returns the metadata about the simulated device and hand for a flight record.
[[nodiscard]] inline Metadata simulated_metadata(const TestRig& rig) {
    return {
        {"simulated", "yes: the device and the hand are simulated, and no value was measured on hardware"},
        {"device", rig.device.id},
        {"hand", "spring " + readable(rig.hand.stiffness) + ", damper " + readable(rig.hand.damping) +
                     ", to a point between " + readable(rig.hand.lower) + " and " + readable(rig.hand.upper) +
                     " at " + readable(rig.hand.frequency_hz) + " Hz"}};
}

}  // namespace palpate
