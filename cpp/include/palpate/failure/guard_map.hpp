// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>

#include "palpate/failure/failure_map.hpp"
#include "palpate/failure/held_maps.hpp"
#include "palpate/guard/guards.hpp"
#include "palpate/rendering/direct.hpp"
#include "palpate/simulation/hand.hpp"

namespace palpate {

/// What is left of the buzzing of a wall that is too stiff for its device, over the stiffness as a share of its
/// bound: the handle's speed in the last of three seconds, pressed by a hand that damps nothing. Without guard,
/// with the energy tank, with the limit-cycle detector, with both.
[[nodiscard]] inline FailureMap guard_map(int points) {
    constexpr std::size_t second = 1000;
    FailureMap map{"guard", "stiffness K / (2 b / T)", "RMS speed left [rad/s]", {}};
    const DeviceProfile device;
    struct Guarding {
        const char* name;
        bool tank;
        bool detector;
    };
    Scheme scheme;
    scheme.structure = StructureKind::Direct;
    for (const auto& [name, tank, detector] : {Guarding{"no guard", false, false},
                                               {"energy tank", true, false},
                                               {"limit-cycle detector", false, true},
                                               {"both", true, true}}) {
        FailureLine line{name, logarithmic(0.5, 10.0, points), {}, {}};
        for (const double share : line.at) {
            const double stiffness = share * direct_limit(device);
            const ForceModel wall{NetworkParameters{1, {}, {}, {}, {stiffness}, 0.0},
                                  {{0.0}, {0.1}, Continuation::Linear, Continuation::Linear, std::nullopt}};
            GuardSettings settings;
            settings.energy_tank = tank;
            settings.buzz_force = detector ? settings.buzz_force : 0.0;
            settings.device_damping = device.viscous_damping;
            settings.encoder_step = device.encoder_step;
            double squares = 0.0;
            std::size_t tick = 0;
            const ClosedLoopSettings start{20, 0.0, 0.0, guards_of(settings, wall, scheme, device.period_s)};
            (void)closed_loop(
                Direct{*wall.network()}, device, PassiveHand{15.0, 0.0, 0.0, 0.1}, 3 * second, start,
                [&](const Tick& /*tick*/, const Motion& handle, const EnergyAccount& /*account*/) {
                    squares += tick++ >= 2 * second ? handle.velocity * handle.velocity : 0.0;
                    return true;
                });
            // Slower than an encoder step a second is at rest.
            line.measured.push_back(
                std::max(std::sqrt(squares / static_cast<double>(second)), device.encoder_step));
            line.theory.push_back(std::numeric_limits<double>::quiet_NaN());
        }
        map.lines.push_back(std::move(line));
    }
    return map;
}

}  // namespace palpate
