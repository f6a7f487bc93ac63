// SPDX-License-Identifier: Apache-2.0
// A device at positions that a test chooses, whose clock sets the rate, so that a session does not wait.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <utility>

#include "palpate/device/device.hpp"
#include "palpate/device/device_profile.hpp"
#include "palpate/rendering/scale.hpp"
#include "palpate/run/live_device.hpp"

namespace palpate::test {

/// A device whose handle follows a function of the number of the sample, counted from 0. The motor applies its own
/// force, or the command.
struct MovedDevice {
    static constexpr bool paces_host = true;

    std::function<double(std::uint64_t)> position;
    double own_force = std::numeric_limits<double>::quiet_NaN();  ///< NaN: the motor applies the command
    double measured = std::numeric_limits<double>::quiet_NaN();
    std::string refusal{};
    std::uint64_t sequence = 0;

    Opened open() { return {refusal}; }
    [[nodiscard]] Reading exchange(const Command& command) noexcept {
        Reading reading;
        reading.position = position(sequence);
        reading.applied = std::isnan(own_force) ? command.force : own_force;
        reading.measured = measured;
        reading.sequence = ++sequence;
        return reading;
    }
    void close() noexcept {}
};

/// Returns an open device of 1 kHz with a profile.
inline std::unique_ptr<LiveDeviceOf<MovedDevice>> moved_device(MovedDevice device,
                                                               const DeviceProfile& profile = {}) {
    auto live = std::make_unique<LiveDeviceOf<MovedDevice>>(
        std::move(device), [](const MovedDevice&) -> DeviceReport { return {"moved", {}, {{"a", "b"}}}; });
    live->title = "a moved device";
    live->profile = profile;
    live->rate_hz = 1.0 / profile.period_s;
    live->metadata = {{"device", profile.id}};
    return live;
}

}  // namespace palpate::test
