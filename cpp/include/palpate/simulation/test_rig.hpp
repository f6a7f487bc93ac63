// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <tuple>
#include <vector>

#include "palpate/device/device_profile.hpp"
#include "palpate/fields/readable.hpp"
#include "palpate/io/recording_file.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/rendering/scale.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/simulation/closed_loop.hpp"
#include "palpate/simulation/hand.hpp"

namespace palpate {

/// Simulated device and hand scaled to a model. An angle is rendered on the default knob. For any other unit the
/// model's scale multiplies lengths and forces of the knob and its hand.
struct TestRig {
    DeviceProfile device;
    Hand hand;
    ModelScale scale;

    /// Returns the scheme with the chosen fields; the others have the defaults at the model's scale.
    [[nodiscard]] Scheme scheme(const ForceModel& model, const SchemeChoices& chosen = {}) const {
        return scheme_for(model, scale, device, chosen);
    }
};

template <>
inline constexpr auto fields_of<TestRig> = std::tuple{
    Field<&TestRig::device>{"device"}, Field<&TestRig::hand>{"hand"},
    Field<&TestRig::scale, &ModelScale::length>{"length",
                                                "Positions, relative to those of the default knob."},
    Field<&TestRig::scale, &ModelScale::force>{"force", "Forces, relative to those of the default knob."}};

namespace detail {

/// Returns the target at which the handle rests at the end of a slow motion, or before it if the rendered force exceeds
/// 80 % of the force limit. The remaining 20 % are for coupling and damping.
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

/// Returns a hand that moves the handle through the domain, except 1 % at either end.
///
/// The hand is a spring to a moving target, which leads the handle by the rendered force divided by the hand's stiffness. A
/// coupling reduces this force, so the target is computed for the default coupling. Stiffer
/// structures are pressed less far, and the handle never leaves the domain.
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

/// Returns the test rig for a model of position, or of position and velocity. If `is_angle`, its positions are in rad.
[[nodiscard]] inline TestRig rig_for(const ForceModel& model, bool is_angle, double period_s) {
    TestRig rig;
    rig.scale = scale_of(model, is_angle);
    rig.device = scaled_knob(rig.scale, is_angle, period_s);
    rig.hand = detail::sweeping_hand(model, rig);
    return rig;
}

/// Returns the force of a model over position, as an object that can be mounted on the simulated device of its rig. The
/// object is at rest at `start`.
[[nodiscard]] inline std::function<double(double)> object_of(const ForceModel& model, const TestRig& rig,
                                                             double start) {
    SchemeChoices direct;
    direct.structure = StructureKind::Direct;
    return with_structure(model, rig.scheme(model, direct), rig.device.period_s, rig.device.force_limit,
                          [start](auto structure) -> std::function<double(double)> {
                              structure.reset(start);
                              return [structure](double position) mutable {
                                  return structure.step(position).force;
                              };
                          });
}

/// Returns the metadata of a flight record on a simulated device.
[[nodiscard]] inline Metadata simulated_metadata(const TestRig& rig) {
    return {{"simulated", "yes: device and hand; no value was measured"},
            {"device", rig.device.id},
            {"hand", "spring " + readable(rig.hand.stiffness) + ", damper " + readable(rig.hand.damping) +
                         ", to a point between " + readable(rig.hand.lower) + " and " +
                         readable(rig.hand.upper) + " at " + readable(rig.hand.frequency_hz) + " Hz"}};
}

}  // namespace palpate
