// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <string>

#include "palpate/failure/failure_map.hpp"
#include "palpate/failure/held_maps.hpp"
#include "palpate/failure/objects.hpp"
#include "palpate/failure/prediction_map.hpp"
#include "palpate/failure/trials.hpp"
#include "palpate/fields/readable.hpp"
#include "palpate/rendering/direct.hpp"
#include "palpate/rendering/massless.hpp"
#include "palpate/simulation/hand.hpp"
#include "palpate/stability/coupled_inequalities.hpp"

namespace palpate {

/// What a bound for every hand leaves unused with one that is known: the stiffest spring that does not swing up,
/// over the mass of a hand that holds the handle and does nothing else.
[[nodiscard]] inline FailureMap hand_map(int points) {
    FailureMap map{"hand", "mass of the hand [kg*m^2]", "stiffness K [N*m/rad]", {}};
    map.searched = 40.0;
    const auto add = [&](const std::string& name, int delay, double damping, int predict = 0) {
        DeviceProfile device = smooth_knob();
        device.delay_s = delay * device.period_s;
        const double bound = predict > 0 ? predicted_limit(device, predict) : direct_limit(device);
        map.lines.push_back(failure_line(
            name, logarithmic(1e-5, 1e-1, points), [&](double /*mass*/) { return bound; },
            [&](double mass, double stiffness) {
                constexpr double radians = 1000.0;  // of the swing that are watched
                const double slowness = std::sqrt((mass + device.inertia) / stiffness);
                const auto ticks = static_cast<std::size_t>(radians * slowness / device.period_s);
                const PassiveHand hand{0.0, damping, mass, 0.0};
                return predict > 0
                           ? oscillates_with(PredictedDirect{LinearObject{stiffness}, predict}, device, hand,
                                             stiffness, ticks)
                           : oscillates_with(Direct{LinearObject{stiffness}}, device, hand, stiffness, ticks);
            },
            map.searched));
    };
    for (int delay = 0; delay <= 2; ++delay) {
        add("delay " + std::to_string(delay), delay, 0.0);
    }
    add("delay 0, damping hand", 0, smooth_knob().viscous_damping);
    add("delay 0, predict 4", 0, 0.0, 4);
    return map;
}

/// The coarsest encoder of a spring behind a coupling that friction still pays for, over the spring's stiffness:
/// f_c >= gamma Delta / 2, where gamma is K_c K / (K_c + K) without coupling damping. With it gamma counts every
/// edge between two counts as the worst one, which is sufficient only.
[[nodiscard]] inline FailureMap coupled_encoder_map(int points) {
    constexpr double stiffness = 40.0;  // K_c [N*m/rad]
    constexpr double friction = 0.002;  // [N*m]
    FailureMap map{"coupled-encoder", "stiffness K [N*m/rad]", "encoder step [rad]", {}};
    map.searched = 10.0;
    for (const double damping : {0.0, 0.008, 0.02}) {
        const VirtualCoupling coupling{stiffness, damping};
        const auto bound = [&](double spring) {
            ForceBounds bounds;
            bounds.slope = {spring, spring};
            return 2.0 * friction / massless_gain(bounds, coupling, smooth_knob().period_s);
        };
        const auto fails = [&](double spring, double step) {
            DeviceProfile knob = smooth_knob();
            knob.encoder_step = step;
            knob.coulomb_friction = friction;
            for (const int pace : {1, 2, 4}) {
                for (const double reach : ways_over_an_edge(knob)) {
                    const PacedWork work =
                        work_of_pacing(Massless{LinearObject{spring}, coupling, knob.period_s}, knob,
                                       {reach, pace, 1e6, knob.period_s}, 0.5 * step - 0.5 * reach, 100);
                    if (work.negative()) {
                        return true;
                    }
                }
            }
            return false;
        };
        map.lines.push_back(failure_line("B_c = " + readable(damping), logarithmic(4.0, 4000.0, points),
                                         bound, fails, map.searched));
    }
    return map;
}

}  // namespace palpate
