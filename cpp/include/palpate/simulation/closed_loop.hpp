// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>

#include "palpate/rendering/structure.hpp"
#include "palpate/run/controller.hpp"
#include "palpate/simulation/hands.hpp"
#include "palpate/simulation/plant.hpp"
#include "palpate/simulation/simulated_device.hpp"

namespace palpate {

/// Where a closed loop starts, how finely it is integrated, and what guards it.
struct ClosedLoopSettings {
    int substeps = 20;            ///< of a tick
    double start_position = 0.0;  ///< [m or rad]
    double start_velocity = 0.0;  ///< of handle and hand [m/s or rad/s]
    Guards guards{};              ///< default: the device's force limit and nothing else
};

/// How a closed loop ended.
struct ClosedLoopEnd {
    EnergyAccount energy;
    Motion met;             ///< the handle when the object's first force began to act on it
    Motion handle;          ///< the handle at the end
    std::size_t ticks = 0;  ///< that were watched
};

/// Object, device and hand in virtual time, every joule accounted for. `watch(tick, handle, account)` is called
/// after every tick and says whether to go on.
template <Structure S, SimulatedHand H, class Watch>
[[nodiscard]] ClosedLoopEnd closed_loop(S structure, const DeviceProfile& profile, H hand, std::size_t ticks,
                                        const ClosedLoopSettings& settings, Watch watch) {
    SimulatedHandle<H, Midpoint> device{profile, std::move(hand), settings.substeps, settings.start_position,
                                        settings.start_velocity};
    (void)device.open();
    Controller controller{device, std::move(structure), settings.guards};
    (void)controller.start();
    const auto delay = static_cast<std::size_t>(profile.late_samples());
    ClosedLoopEnd end;
    end.met = device.handle();
    bool goes_on = true;
    for (; end.ticks < ticks && goes_on; ++end.ticks) {
        if (end.ticks == delay) {
            end.met = device.handle();
        }
        const Tick tick = controller.tick();
        goes_on = watch(tick, device.handle(), device.plant().account());
    }
    end.energy = device.plant().account();
    end.handle = device.handle();
    return end;
}

}  // namespace palpate
