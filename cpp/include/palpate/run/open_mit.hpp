// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <charconv>
#include <cmath>
#include <memory>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "palpate/fields/readable.hpp"
#include "palpate/run/live_device.hpp"
#include "palpate/run/measure.hpp"
#include "palpate/run/render.hpp"

#ifdef __linux__
#include "palpate/device/mit_device.hpp"
#endif

namespace palpate {

#ifdef __linux__

namespace detail {

/// Returns the settings of a drive named mit:BUS:NUMBER:KIND. Throws std::invalid_argument with the valid form.
[[nodiscard]] inline MitSettings mit_settings(const RunOptions& options) {
    std::vector<std::string> parts{""};
    for (const char letter : options.device) {
        if (letter == ':') {
            parts.emplace_back();
        } else {
            parts.back() += letter;
        }
    }
    std::string kinds;
    for (const mit::Preset& preset : mit::presets) {
        kinds += (kinds.empty() ? "" : ", ") + std::string(preset.name);
    }
    if (parts.size() != 4 || parts[1].empty()) {
        refuse("device is '" + options.device + "', must be mit:BUS:NUMBER:KIND, such as mit:can0:1:" +
               std::string(mit::presets.front().name) + "; KIND is one of " + kinds);
    }
    MitSettings settings;
    settings.interface = parts[1];
    bool known = false;
    for (const mit::Preset& preset : mit::presets) {
        if (preset.name == parts[3]) {
            settings.preset = preset;
            known = true;
        }
    }
    if (!known) {
        refuse("device is '" + options.device + "', the kind must be one of " + kinds);
    }
    const int most = settings.preset.maker == mit::Maker::Damiao ? 15 : 127;
    int number = 0;
    const char* end = parts[2].data() + parts[2].size();
    const auto found = std::from_chars(parts[2].data(), end, number);
    if (found.ec != std::errc{} || found.ptr != end || number < 1 || number > most) {
        refuse("device is '" + options.device + "', the number must be from 1 to " + std::to_string(most));
    }
    settings.number = static_cast<std::uint8_t>(number);
    if (options.wait_s) {
        settings.wait = std::llround(1e9 * *options.wait_s);
    }
    return settings;
}

/// Returns the counters of a drive for the summary of a run.
[[nodiscard]] inline DeviceReport mit_report(const MitDevice<>& device) {
    const MitHealth& health = device.health();
    const auto number = [](std::uint64_t count) { return std::to_string(count); };
    return {"mit",
            {{"answers", health.answers},
             {"timeouts", health.timeouts},
             {"late", health.late},
             {"repeated", health.repeated},
             {"malformed", health.malformed},
             {"unsent", health.unsent}},
            {{"bus", number(health.answers) + " answers, " + number(health.late) + " late, " +
                         number(health.repeated) + " repeated, " + number(health.malformed) +
                         " malformed; " + number(health.timeouts) + " timeouts, " + number(health.unsent) +
                         " commands not sent"}}};
}

/// Returns a drive as a live device, not open yet.
[[nodiscard]] inline std::unique_ptr<LiveDeviceOf<MitDevice<>>> live_mit(MitSettings settings,
                                                                         double rate_hz) {
    auto live = std::make_unique<LiveDeviceOf<MitDevice<>>>(MitDevice<>{std::move(settings)}, mit_report);
    const MitDevice<>& device = live->device();
    live->title = "drive " + std::to_string(device.settings().number) + " on " +
                  device.settings().interface + " (" + std::string(device.settings().preset.name) + ")";
    live->profile = device.profile(rate_hz);
    live->rate_hz = rate_hz;
    live->transducer = false;
    live->metadata = {{"device", live->title}};
    return live;
}

}  // namespace detail

/// Opens an MIT-mode drive for rendering. Throws std::invalid_argument with the reason if that is not possible.
[[nodiscard]] inline std::unique_ptr<LiveDevice> open_mit(const RenderOptions& options,
                                                          const PlannedModel& model) {
    MitSettings settings = detail::mit_settings(options);
    if (model.position_unit != "rad" || model.force_unit != "N*m") {
        refuse(model.units_text() + "; a drive rotates and needs a model in rad and N*m");
    }
    validate(options.loop);
    auto live = detail::live_mit(std::move(settings), options.loop.rate_hz);
    if (!options.uncertified && model.certificate) {
        // A drive reports neither inertia, damping, friction nor delay: those of the certificate are used
        const DeviceProfile of_drive = std::exchange(live->profile, model.certificate->device);
        live->profile.id = of_drive.id;
        live->profile.period_s = of_drive.period_s;
        live->profile.encoder_step = of_drive.encoder_step;
        live->profile.force_limit = of_drive.force_limit;
    }
    if (const Opened opened = live->open(); !opened) {
        refuse("device " + options.device + ": " + opened.reason);
    }
    live->title += options.uncertified ? ", uncertified," : "";
    return live;
}

/// Returns a drive for a measurement, not open yet. It is enabled only if `probe` or `push` is set.
[[nodiscard]] inline std::unique_ptr<LiveDevice> mit_to_measure(MeasureOptions& options) {
    MitSettings settings = detail::mit_settings(options);
    settings.makes_force = options.moves();
    detail::require(!options.device_renders, "device_renders needs a USB device that contains a model");
    detail::require(!options.probe || options.upper,
                    "a probe on a real device needs upper, the largest position of its target from the zero "
                    "of the encoder");
    validate(options.loop);
    auto live = detail::live_mit(std::move(settings), options.loop.rate_hz);
    options.force_limit =
        options.force_limit.value_or(std::min(ProbeSettings{}.force_limit, live->profile.force_limit));
    return live;
}

#else

/// Throws std::invalid_argument, because CAN needs Linux.
[[nodiscard]] inline std::unique_ptr<LiveDevice> open_mit(const RenderOptions& options,
                                                          const PlannedModel& /*model*/) {
    refuse("device " + options.device + ": CAN needs Linux");
}

[[nodiscard]] inline std::unique_ptr<LiveDevice> mit_to_measure(MeasureOptions& options) {
    refuse("device " + options.device + ": CAN needs Linux");
}

#endif

}  // namespace palpate
