// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "palpate/device/wheel_device.hpp"
#include "palpate/fields/readable.hpp"
#include "palpate/model/derivatives.hpp"
#include "palpate/rendering/measuring.hpp"
#include "palpate/run/live_device.hpp"
#include "palpate/run/measure.hpp"
#include "palpate/run/render.hpp"
#include "palpate/run/transports.hpp"

namespace palpate {

namespace detail {

/// Returns the settings of a device named wheel:NODE:DEGREES:TORQUE[:STIFFNESS]. Throws std::invalid_argument with the
/// valid form.
[[nodiscard]] inline WheelSettings wheel_settings(const RunOptions& options) {
    const std::vector<std::string> parts = device_parts(options.device);
    if (parts.size() < 4 || parts.size() > 5 || parts[1].empty()) {
        refuse("device is '" + options.device +
               "', must be wheel:NODE:DEGREES:TORQUE[:STIFFNESS], such as wheel:/dev/hidraw0:900:8:4");
    }
    WheelSettings settings;
    settings.node = parts[1];
    settings.half_range =
        positive_part(options.device, parts[2], "DEGREES", "degrees") * std::numbers::pi / 360.0;
    settings.torque = positive_part(options.device, parts[3], "TORQUE", "N*m");
    settings.torque_limit = settings.torque;
    if (parts.size() == 5) {
        settings.stiffness = positive_part(options.device, parts[4], "STIFFNESS", "N*m/rad");
    }
    if (options.wait_s) {
        settings.wait = std::llround(1e9 * *options.wait_s);
    }
    return settings;
}

/// Returns the counters of a wheel for the summary of a run.
[[nodiscard]] inline DeviceReport wheel_report(const WheelDevice<>& wheel) {
    const WheelHealth& health = wheel.health();
    const auto number = [](std::uint64_t count) { return std::to_string(count); };
    return {"wheel",
            {{"reports", health.reports},
             {"malformed", health.malformed},
             {"unsent", health.unsent},
             {"two_reports", health.two_reports},
             {"longest_gap_s", health.longest_gap_s},
             {"longest_write_s", health.longest_write_s}},
            {{"wheel", number(health.reports) + " positions, " + number(health.malformed) + " malformed, " +
                           number(health.unsent) + " forces not sent, " + number(health.two_reports) +
                           " lines in two reports; longest time between two positions " +
                           readable(1e3 * health.longest_gap_s) + " ms, to send a force " +
                           readable(1e3 * health.longest_write_s) + " ms"}}};
}

/// Returns a wheel as a live device, not open yet.
[[nodiscard]] inline std::unique_ptr<LiveDeviceOf<WheelDevice<>>> live_wheel(WheelSettings settings,
                                                                             double rate_hz) {
    const std::string title = "wheel on " + settings.node;
    auto live =
        std::make_unique<LiveDeviceOf<WheelDevice<>>>(WheelDevice<>{std::move(settings)}, wheel_report);
    live->title = title;
    live->rate_hz = rate_hz;
    live->transducer = false;
    live->metadata = {{"device", title}};
    return live;
}

/// Refuses the plan of a held line whose profile does not describe the springs of a wheel, or whose springs have a
/// center outside of the axis somewhere in the domain of the model.
inline void require_springs(const PlannedModel& model, const WheelDevice<>& wheel) {
    const DeviceProfile& certified = model.certificate->device;
    const HeldLine& loop = *certified.held_line;
    const auto steps = wheel.spring_steps();
    require(steps.has_value(),
            "the plan holds lines, but the name of the device has no stiffness: append it as "
            "in wheel:NODE:DEGREES:TORQUE:STIFFNESS");
    require(loop.largest_center.has_value(),
            "the profile " + certified.id +
                " has no held_line.largest_center: a wheel takes springs, so plan with one that states it");
    const auto at_most = [&](const char* field, double value, double most) {
        require(value <= most * (1.0 + 1e-6), std::string("held_line.") + field + " of the profile is " +
                                                  readable(value) + ": must be at most " + readable(most) +
                                                  ", that of the wheel");
    };
    const auto at_least = [&](const char* field, double value, double least) {
        require(value >= least * (1.0 - 1e-6), std::string("held_line.") + field + " of the profile is " +
                                                   readable(value) + ": must be at least " + readable(least) +
                                                   ", the step of the wheel");
    };
    const WheelSettings& settings = wheel.settings();
    at_most("largest_center", *loop.largest_center, settings.half_range);
    at_most("largest_stiffness", loop.largest_stiffness.value_or(settings.stiffness), settings.stiffness);
    at_least("stiffness_step", loop.stiffness_step, (*steps)[0]);
    at_least("position_step", loop.position_step, (*steps)[1]);
    const double slope = model.certificate->scheme.line.value_or(HeldSlope{}).slope;
    const ForceModel& object = model.planned();
    constexpr int points = 1000;
    for (int k = 0; k <= points && slope > 0.0; ++k) {
        const double low = object.domain().lower[0];
        const double position = low + (object.domain().upper[0] - low) * k / points;
        const double center = position - derivatives(object.parameters(), position)[0] / slope;
        require(std::abs(center) <= *loop.largest_center,
                "at position " + readable(position) + " the spring of the line has its center at " +
                    readable(center) + " rad: must be within held_line.largest_center, " +
                    readable(*loop.largest_center) + "; set a larger rotation of the wheel");
    }
}

}  // namespace detail

/// Opens a force-feedback wheel for rendering. Throws std::invalid_argument with the reason if that is not possible.
[[nodiscard]] inline std::unique_ptr<LiveDevice> open_wheel(const RenderOptions& options,
                                                            const PlannedModel& model) {
    WheelSettings settings = detail::wheel_settings(options);
    if (model.position_unit != "rad" || model.force_unit != "N*m") {
        refuse(model.units_text() + "; a wheel rotates and needs a model in rad and N*m");
    }
    const bool planned = !options.uncertified && model.certificate;
    LoopSettings loop = options.loop;
    if (planned && !options.rate_given) {
        loop.rate_hz = 1.0 / model.certificate->device.period_s;
    }
    validate(loop);
    const double limit =
        options.force_limit.value_or(planned ? model.certificate->device.force_limit : settings.torque);
    detail::require(limit <= settings.torque * (1.0 + 1e-9),
                    "force_limit is " + readable(limit) + ": must be at most " + readable(settings.torque) +
                        ", the torque of the wheel");
    settings.torque_limit = limit;
    const bool lines = planned && model.certificate->device.held_line;
    if (lines) {
        settings.watchdog_s = model.certificate->device.held_line->watchdog_s.value_or(settings.watchdog_s);
    }
    settings.only_springs = lines;
    auto live = detail::live_wheel(std::move(settings), loop.rate_hz);
    if (const Opened opened = live->open(); !opened) {
        refuse("device " + options.device + ": " + opened.reason);
    }
    live->profile = live->device().profile(loop.rate_hz);
    if (lines) {
        detail::require_springs(model, live->device());
    }
    if (planned) {
        // A wheel reports neither inertia, damping, friction nor delay: those of the certificate are used
        const DeviceProfile of_wheel = std::exchange(live->profile, model.certificate->device);
        live->profile.id = of_wheel.id;
        live->profile.period_s = of_wheel.period_s;
        live->profile.encoder_step = of_wheel.encoder_step;
        live->profile.force_step = of_wheel.force_step;
        live->profile.force_limit = of_wheel.force_limit;
    }
    live->title += options.uncertified ? ", uncertified," : "";
    return live;
}

/// Returns a force-feedback wheel for a measurement, not open yet. Its motor is enabled only if `probe` or `push` is
/// set.
[[nodiscard]] inline std::unique_ptr<LiveDevice> wheel_to_measure(MeasureOptions& options) {
    WheelSettings settings = detail::wheel_settings(options);
    settings.makes_force = false;
    detail::require(!options.device_renders, "device_renders needs a USB device that contains a model");
    detail::require(
        !options.probe || options.upper,
        "a probe on a real device needs upper, the largest position of its target from the middle "
        "of the wheel");
    validate(options.loop);
    WheelDevice<> listener{settings};
    const Opened opened = listener.open();
    detail::require(static_cast<bool>(opened), opened.reason);
    const DeviceProfile profile = listener.profile(options.loop.rate_hz);
    (void)listener.close();
    settings.makes_force = options.moves();
    auto live = detail::live_wheel(std::move(settings), options.loop.rate_hz);
    live->profile = profile;
    options.force_limit =
        options.force_limit.value_or(std::min(ProbeSettings{}.force_limit, profile.force_limit));
    return live;
}

}  // namespace palpate
