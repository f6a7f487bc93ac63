// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

#include "palpate/device/device_profile.hpp"
#include "palpate/device/hand.hpp"
#include "palpate/guard/guard_settings.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/rendering/scheme.hpp"

namespace palpate {

/// A simulated device with a hand on it that suits a model, and the rendering's numbers in its scale.
///
/// An angle is tried on the default knob. For any other unit it is the same knob as a scale model: lengths and
/// forces are multiplied so that travel and largest force stand to the device as in the knob's own scene; times
/// stay as they are. The hand is a spring to a moving point, so the point runs ahead of the handle by
/// force / stiffness, as far as the device can hold it.
struct Bench {
    DeviceProfile device;
    Hand hand;
    double length = 1.0;     ///< positions, over those of the knob
    double stiffness = 1.0;  ///< force per position, over that of the knob

    /// The default scheme in this bench's scale.
    [[nodiscard]] Scheme scheme(const ForceModel& model) const {
        Scheme scheme;
        scheme.coupling.stiffness *= stiffness;
        scheme.coupling.damping *= stiffness;
        scheme.inertia.mass *= stiffness;
        scheme.inertia.damping *= stiffness;
        if (model.hysteresis() != nullptr && !model.play_radius()) {
            const double travel = model.domain().upper[0] - model.domain().lower[0];
            scheme.play_radius = std::max(4.0 * device.encoder_step, 0.01 * travel);
        }
        return scheme;
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

/// The force while sliding in a direction, +1 pressing and -1 releasing.
[[nodiscard]] inline double sliding_force(const ForceModel& model, double position,
                                          double direction) noexcept {
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

/// A hand that leads the handle through the whole domain but for 1 % at either end, and not beyond.
[[nodiscard]] inline Hand sweeping_hand(const ForceModel& model, const DeviceProfile& device, double scale) {
    const double lower = model.domain().lower[0];
    const double travel = model.domain().upper[0] - lower;
    Hand hand;
    hand.stiffness = std::max(hand.stiffness * scale, 2.0 * largest_force(model) / travel);
    hand.damping *= scale;
    const auto target = [&](double position, double direction) {
        const double force = sliding_force(model, position, direction);
        return position + std::clamp(force, -device.force_limit, device.force_limit) / hand.stiffness;
    };
    const double first = target(lower + 0.01 * travel, -1.0);
    const double last = target(lower + 0.99 * travel, 1.0);
    hand.lower = std::min(first, last);
    hand.upper = std::max(first, last);
    return hand;
}

}  // namespace detail

/// The bench for a model of one position; `is_angle`: its positions are in rad.
[[nodiscard]] inline Bench bench_for(const ForceModel& model, bool is_angle, double period_s) {
    require_one_input(model.parameters());
    constexpr double knob_travel = 0.5;  // of a scene that suits the default knob [rad]
    Bench bench;
    bench.device.period_s = period_s;
    if (!is_angle) {
        const double force = 1.05 * detail::largest_force(model) / bench.device.force_limit;
        bench.length = (model.domain().upper[0] - model.domain().lower[0]) / knob_travel;
        bench.stiffness = force / bench.length;
        bench.device.id += ", scaled";
        bench.device.inertia *= bench.stiffness;
        bench.device.viscous_damping *= bench.stiffness;
        bench.device.coulomb_friction *= force;
        bench.device.encoder_step *= bench.length;
        bench.device.force_step *= force;
        bench.device.force_limit *= force;
    }
    bench.hand = detail::sweeping_hand(model, bench.device, bench.stiffness);
    return bench;
}

}  // namespace palpate
