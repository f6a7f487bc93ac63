// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "palpate/device/mit_device.hpp"
#include "palpate/device/moteus_device.hpp"
#include "palpate/fields/readable.hpp"
#include "palpate/rendering/measuring.hpp"
#include "palpate/run/live_device.hpp"
#include "palpate/run/measure.hpp"
#include "palpate/run/render.hpp"
#include "palpate/run/transports.hpp"

namespace palpate {

namespace detail {

/// Returns the parts of the name of a device on a CAN bus. Throws std::invalid_argument with the valid form.
[[nodiscard]] inline std::vector<std::string> can_parts(const std::string& device, const std::string& form) {
    std::vector<std::string> parts = device_parts(device);
    if (parts.size() != 4 || parts[1].empty()) {
        refuse("device is '" + device + "', must be " + form);
    }
    return parts;
}

/// Returns the CAN number of a device. Throws std::invalid_argument with the allowed numbers.
[[nodiscard]] inline std::uint8_t can_number(const std::string& device, const std::string& text, int most) {
    int number = 0;
    const char* end = text.data() + text.size();
    const auto found = std::from_chars(text.data(), end, number);
    if (found.ec != std::errc{} || found.ptr != end || number < 1 || number > most) {
        refuse("device is '" + device + "', the number must be from 1 to " + std::to_string(most));
    }
    return static_cast<std::uint8_t>(number);
}

/// Sets what all motors on a CAN bus have in common.
template <class Settings>
[[nodiscard]] Settings with_run_options(Settings settings, const RunOptions& options) {
    if (options.wait_s) {
        settings.wait = std::llround(1e9 * *options.wait_s);
    }
    return settings;
}

/// Returns the settings of a drive named mit:BUS:NUMBER:KIND. Throws std::invalid_argument with the valid form.
[[nodiscard]] inline MitSettings settings_in(MitSettings settings, const RunOptions& options) {
    std::string kinds;
    for (const mit::Preset& preset : mit::presets) {
        kinds += (kinds.empty() ? "" : ", ") + std::string(preset.name);
    }
    const std::vector<std::string> parts = can_parts(
        options.device, "mit:BUS:NUMBER:KIND, such as mit:can0:1:" + std::string(mit::presets.front().name) +
                            "; KIND is one of " + kinds);
    settings.interface = parts[1];
    const auto* const kind = std::find_if(mit::presets.begin(), mit::presets.end(),
                                          [&](const mit::Preset& preset) { return preset.name == parts[3]; });
    if (kind == mit::presets.end()) {
        refuse("device is '" + options.device + "', the kind must be one of " + kinds);
    }
    settings.preset = *kind;
    settings.number = can_number(options.device, parts[2], kind->maker == mit::Maker::Damiao ? 15 : 127);
    return with_run_options(std::move(settings), options);
}

/// Returns the settings of a controller named moteus:BUS:NUMBER:KP. Throws std::invalid_argument with the valid form.
[[nodiscard]] inline MoteusSettings settings_in(MoteusSettings settings, const RunOptions& options) {
    const std::vector<std::string> parts = can_parts(
        options.device,
        "moteus:BUS:NUMBER:KP, such as moteus:can0:1:4; KP is servo.pid_position.kp of the controller");
    settings.interface = parts[1];
    settings.number = can_number(options.device, parts[2], 126);
    settings.kp = positive_part(options.device, parts[3], "KP", "N*m/rev");
    return with_run_options(std::move(settings), options);
}

/// Returns the kind of a motor for messages.
[[nodiscard]] inline std::string kind_of(const MitSettings& settings) {
    return std::string(settings.preset.name);
}
[[nodiscard]] inline std::string kind_of(const MoteusSettings& /*settings*/) {
    return "moteus";
}

/// Returns the counters of a motor for the summary of a run.
[[nodiscard]] inline DeviceReport can_report(const CanHealth& health) {
    const auto number = [](std::uint64_t count) { return std::to_string(count); };
    return {"can",
            {{"answers", health.answers},
             {"timeouts", health.timeouts},
             {"late", health.late},
             {"repeated", health.repeated},
             {"malformed", health.malformed},
             {"unsent", health.unsent}},
            {{"bus", number(health.answers) + " answers, " + number(health.late) + " late, " +
                         number(health.repeated) + " repeated, " + number(health.malformed) + " malformed; " +
                         number(health.timeouts) + " timeouts, " + number(health.unsent) +
                         " commands not sent"}}};
}

/// Returns a motor as a live device, not open yet.
template <class Protocol>
[[nodiscard]] std::unique_ptr<LiveDevice> live_motor(typename Protocol::Settings settings, double rate_hz) {
    using Motor = CanMotor<Protocol>;
    const std::string title = "drive " + std::to_string(settings.number) + " on " + settings.interface +
                              " (" + kind_of(settings) + ")";
    const DeviceProfile profile = Protocol::profile(settings, rate_hz);
    auto live = std::make_unique<LiveDeviceOf<Motor>>(
        Motor{std::move(settings)}, [](const Motor& motor) { return can_report(motor.health()); });
    live->title = title;
    live->profile = profile;
    live->rate_hz = rate_hz;
    live->transducer = false;
    live->metadata = {{"device", title}};
    return live;
}

/// Refuses an admittance display whose profile does not describe a drive: without a stiffness, or with finer steps of
/// command or force than the drive has.
inline void require_steps(const DeviceProfile& certified, const DeviceProfile& drive) {
    const AdmittanceDisplay& display = *certified.admittance;
    if (!display.drive_stiffness) {
        refuse("the profile " + certified.id +
               " has no admittance.drive_stiffness: a drive needs the stiffness of its position control in "
               "each command");
    }
    if (display.position_step < drive.encoder_step * (1.0 - 1e-6)) {
        refuse("admittance.position_step of the profile is " + readable(display.position_step) +
               ": must be at least " + readable(drive.encoder_step) + " rad, the step of the drive");
    }
    if (certified.force_step < drive.force_step * (1.0 - 1e-6)) {
        refuse("force_step of the profile is " + readable(certified.force_step) + ": must be at least " +
               readable(drive.force_step) + " N*m, the step of the torque that the drive reports");
    }
}

}  // namespace detail

/// Opens a motor on a CAN bus for rendering. Throws std::invalid_argument with the reason if that is not possible.
template <class Protocol>
[[nodiscard]] std::unique_ptr<LiveDevice> open_can(const RenderOptions& options, const PlannedModel& model) {
    typename Protocol::Settings settings = detail::settings_in(typename Protocol::Settings{}, options);
    if (model.position_unit != "rad" || model.force_unit != "N*m") {
        refuse(model.units_text() + "; a drive rotates and needs a model in rad and N*m");
    }
    validate(options.loop);
    const bool positions = is_for_display(model);
    const bool planned = positions || (!options.uncertified && model.certificate);
    if constexpr (requires { settings.torque_limit; }) {
        settings.torque_limit = options.force_limit.value_or(planned ? model.certificate->device.force_limit
                                                                     : settings.torque_limit);
    }
    if (planned && model.certificate->device.held_line) {
        settings.watchdog_s = model.certificate->device.held_line->watchdog_s.value_or(settings.watchdog_s);
    }
    if (positions) {
        settings.damping = model.certificate->device.admittance->drive_damping.value_or(0.0);
    }
    auto live = detail::live_motor<Protocol>(std::move(settings), options.loop.rate_hz);
    if (positions) {
        detail::require_steps(model.certificate->device, live->profile);
    }
    if (planned) {
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

/// Returns a motor on a CAN bus for a measurement, not open yet. It is enabled only if `probe` or `push` is set.
template <class Protocol>
[[nodiscard]] std::unique_ptr<LiveDevice> can_to_measure(MeasureOptions& options) {
    typename Protocol::Settings settings = detail::settings_in(typename Protocol::Settings{}, options);
    settings.makes_force = options.moves();
    detail::require(!options.device_renders, "device_renders needs a USB device that contains a model");
    detail::require(!options.probe || options.upper,
                    "a probe on a real device needs upper, the largest position of its target from the zero "
                    "of the encoder");
    validate(options.loop);
    auto live = detail::live_motor<Protocol>(std::move(settings), options.loop.rate_hz);
    options.force_limit =
        options.force_limit.value_or(std::min(ProbeSettings{}.force_limit, live->profile.force_limit));
    return live;
}

}  // namespace palpate
