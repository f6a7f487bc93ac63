// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "palpate/device/device_profile.hpp"
#include "palpate/guard/guard_settings.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/simulation/hand.hpp"
#include "palpate/simulation/virtual_time.hpp"

namespace palpate {

/// The fields of a scheme that somebody chose, in the model's own units; the others follow the model.
struct SchemeChoices {
    std::optional<StructureKind> structure;
    std::optional<bool> compensated;
    std::optional<double> coupling_stiffness;
    std::optional<double> coupling_damping;
    std::optional<double> mass;
    std::optional<double> damping;
    std::optional<double> play_radius;
    std::optional<int> predict;
};

/// A simulated device with a hand on it that suits a model, and the rendering's numbers in its scale.
///
/// An angle is tried on the default knob. For any other unit (millimetres of a keyswitch, micrometres under an
/// AFM tip) it is the same knob as a scale model: lengths and forces are multiplied so that travel and largest
/// force stand to the device as in the knob's own scene; times stay as they are.
struct Bench {
    DeviceProfile device;
    Hand hand;
    double length = 1.0;     ///< positions, over those of the knob
    double stiffness = 1.0;  ///< force per position, over that of the knob

    /// What was chosen, and the default scheme in this bench's scale where nothing was. A model with hysteresis
    /// and no play radius of its own gets one that the hand switches, not the encoder's noise: 1 % of the
    /// travel, but at least four encoder steps.
    [[nodiscard]] Scheme scheme(const ForceModel& model, const SchemeChoices& chosen = {}) const {
        double play_radius = 0.0;
        if (model.hysteresis() != nullptr && !model.play_radius()) {
            const double travel = model.domain().upper[0] - model.domain().lower[0];
            play_radius = std::max(4.0 * device.encoder_step, 0.01 * travel);
        }
        const Scheme standard;
        const bool directly = model.velocity() != nullptr || chosen.predict.value_or(0) > 0;
        return {chosen.structure.value_or(directly ? StructureKind::Direct : standard.structure),
                {chosen.coupling_stiffness.value_or(standard.coupling.stiffness * stiffness),
                 chosen.coupling_damping.value_or(standard.coupling.damping * stiffness)},
                {chosen.mass.value_or(standard.inertia.mass * stiffness),
                 chosen.damping.value_or(standard.inertia.damping * stiffness)},
                chosen.compensated.value_or(standard.compensated),
                chosen.play_radius.value_or(play_radius),
                chosen.predict.value_or(standard.predict)};
    }

    /// The default guards in this bench's scale. A speed that the encoder hardly resolves says nothing of it.
    [[nodiscard]] GuardSettings guards() const noexcept {
        GuardSettings guards;
        guards.force_limit = device.force_limit;
        guards.largest_speed *= length;
        guards.frozen_speed =
            std::max(guards.frozen_speed * length, 3.0 * device.encoder_step / device.period_s);
        guards.buzz_force *= length * stiffness;
        guards.device_damping = device.viscous_damping;
        guards.device_friction = device.coulomb_friction;
        guards.encoder_step = device.encoder_step;
        return guards;
    }
};

namespace detail {

/// The force while sliding in a direction, +1 pressing and -1 releasing; of velocity, as fast as the data are.
[[nodiscard]] inline double sliding_force(const ForceModel& model, double position,
                                          double direction) noexcept {
    if (const VelocityNetwork* force = model.velocity()) {
        const Domain& box = model.domain();
        return force->force(position, direction > 0.0 ? box.upper[1] : box.lower[1]);
    }
    return model.hysteresis() != nullptr ? model.hysteresis()->sliding(position, direction).force
                                         : model.network()->at(position, {}).force;
}

[[nodiscard]] inline double largest_force(const ForceModel& model) noexcept {
    const double lower = model.domain().lower[0];
    const double step = (model.domain().upper[0] - lower) / 1000.0;
    double largest = 0.0;
    for (int k = 0; k <= 1000; ++k) {
        for (const double direction : {-1.0, 1.0}) {
            largest = std::max(largest, std::abs(sliding_force(model, lower + k * step, direction)));
        }
    }
    return largest > 0.0 ? largest : 1.0;
}

/// Where a hand must aim for the handle to come to rest at the end of a slow motion, or before it where the
/// device could not hold the force: harder structures and damping need a part of its limit for themselves.
[[nodiscard]] inline double aim(const std::vector<Rendered>& felt, const std::vector<double>& motion,
                                double force_limit, double hand_stiffness) {
    constexpr double held_share = 0.8;
    std::size_t last = motion.size() - 1;
    while (last > 0 && std::abs(felt[last].force) > held_share * force_limit) {
        --last;
    }
    return motion[last] + felt[last].force / hand_stiffness;
}

/// A hand that leads the handle through the whole domain but for 1 % at either end, and not beyond, whatever the
/// structure.
///
/// The hand is a spring to a moving point, which has to run ahead of the handle by the felt force over the
/// hand's stiffness. Behind a coupling less force is felt, so the point runs ahead by what is felt there: a
/// harder structure is pressed a little less far, and none is extrapolated.
[[nodiscard]] inline Hand sweeping_hand(const ForceModel& model, const Bench& bench) {
    constexpr int steps = 1000;
    const double lower = model.domain().lower[0];
    const double travel = model.domain().upper[0] - lower;
    const double pressed = std::min(largest_force(model), bench.device.force_limit);
    Hand hand;
    hand.stiffness = std::max(hand.stiffness * bench.stiffness, 2.0 * pressed / travel);
    hand.damping *= bench.stiffness;

    SchemeChoices soft;
    soft.coupling_damping = 0.0;
    const Scheme scheme = bench.scheme(model, soft);
    std::vector<double> inwards;
    for (int k = 0; k <= steps; ++k) {
        inwards.push_back(lower + travel * (0.01 + 0.98 * k / steps));
    }
    const std::vector<double> outwards{inwards.rbegin(), inwards.rend()};
    const auto end_of = [&](const std::vector<double>& motion) {
        const std::vector<Rendered> felt = motion_driven(model, scheme, motion, bench.device.period_s);
        return aim(felt, motion, bench.device.force_limit, hand.stiffness);
    };
    const double first = end_of(outwards);
    const double last = end_of(inwards);
    hand.lower = std::min(first, last);
    hand.upper = std::max(first, last);
    return hand;
}

}  // namespace detail

/// The bench for a model of one position, or of position and velocity; `is_angle`: its positions are in rad.
[[nodiscard]] inline Bench bench_for(const ForceModel& model, bool is_angle, double period_s) {
    require_renderable(model);
    constexpr double knob_travel = 0.5;  // of a scene that suits the default knob [rad]
    Bench bench;
    bench.device.period_s = period_s;
    if (!is_angle) {
        const double force = 1.05 * detail::largest_force(model) / bench.device.force_limit;
        bench.length = (model.domain().upper[0] - model.domain().lower[0]) / knob_travel;
        bench.stiffness = force / bench.length;
        bench.device.id += ", scaled";
        bench.device.position_unit = "m";
        bench.device.inertia *= bench.stiffness;
        bench.device.viscous_damping *= bench.stiffness;
        bench.device.coulomb_friction *= force;
        bench.device.encoder_step *= bench.length;
        bench.device.force_step *= force;
        bench.device.force_limit *= force;
    }
    bench.hand = detail::sweeping_hand(model, bench);
    return bench;
}

}  // namespace palpate
