// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <atomic>
#include <optional>
#include <string>
#include <utility>

#include "palpate/fields/readable.hpp"
#include "palpate/guard/guard_settings.hpp"
#include "palpate/rendering/measuring.hpp"
#include "palpate/rendering/scale.hpp"
#include "palpate/run/controller.hpp"
#include "palpate/run/detail/render.hpp"
#include "palpate/run/live_device.hpp"
#include "palpate/run/measure.hpp"
#include "palpate/run/summary.hpp"

// Definition of measure, which contains the control loop.
namespace palpate {

namespace detail {

/// Returns the settings of the probe: the given values, otherwise defaults. The default speed and stiffness are
/// multiplied by the scale of the device; the default force limit is that of the device.
[[nodiscard]] inline ProbeSettings chosen_probe(const MeasureOptions& options, const LiveDevice& device) {
    ProbeSettings probe;
    probe.lower = options.lower.value_or(probe.lower);
    probe.upper = options.upper.value_or(probe.upper);
    probe.speed = options.speed.value_or(probe.speed * device.scale.length);
    probe.stiffness = options.stiffness.value_or(probe.stiffness * device.scale.stiffness());
    probe.damping *= device.scale.stiffness();
    probe.force_limit = options.force_limit.value_or(device.profile.force_limit);
    validate(probe);
    require(device.profile.makes(probe.force_limit),
            "force_limit is " + readable(probe.force_limit) + ": must be at most " +
                readable(device.profile.force_limit) + ", the force limit of the device");
    probe.force_limit = std::min(probe.force_limit, device.profile.force_limit);
    return probe;
}

}  // namespace detail

PALPATE_INLINE Summary measure(const MeasureOptions& options, LiveDevice& device,
                               const std::atomic<bool>& stop_requested, const Watch& watch) {
    SessionSettings session{.loop = options.loop, .real_time = options.real_time};
    session.loop.rate_hz = device.rate_hz;
    validate(session.loop);
    detail::require(!options.device_renders || !options.moves(),
                    "device_renders is set: leave out probe and push, because the host makes no force");
    detail::require(device.transducer || options.probe || options.device_renders || options.record.empty(),
                    device.profile.id +
                        " has no force transducer, so it cannot measure a force while a hand moves the "
                        "handle: set probe");
    const double period_s = 1.0 / device.rate_hz;
    GuardSettings guards = guards_for(device.scale, device.profile);
    std::string moved_by = "a hand";
    std::optional<ProbeSettings> probe;
    if (options.probe) {
        probe = detail::chosen_probe(options, device);
        guards.force_limit = probe->force_limit;
        moved_by = "the device: a sweep from " + readable(probe->lower) + " to " + readable(probe->upper) +
                   " at " + readable(probe->speed) + " a second, with a force of at most " +
                   readable(probe->force_limit);
    }
    if (!options.moves()) {
        guards.ramp_s = 0.0;  // no start ramp: without probe and push the device makes no force
    }
    validate(guards);
    Metadata metadata{{"created_by", options.created_by}};
    metadata.insert(metadata.end(), device.metadata.begin(), device.metadata.end());
    metadata.insert(metadata.end(),
                    {{"force", options.device_renders ? "of the motor, from the model that the device renders"
                               : device.transducer
                                   ? "of the object against the handle, from the device's force transducer"
                                   : "of the motor against the object, including the device's friction"},
                     {"moved_by", moved_by},
                     {"rate_hz", readable(device.rate_hz)}});
    const Opened opened = device.open();
    detail::require(static_cast<bool>(opened), opened.reason);
    RecordSinks sinks;
    sinks.force = options.device_renders ? RecordedForce::Applied
                  : options.push         ? RecordedForce::Sent
                                         : RecordedForce::Object;
    sinks.keeps = options.keep;
    const std::string note = detail::open_sinks(options, options.units, metadata, sinks);
    const auto run = [&](AnyStructure structure) {
        Controller controller{device, std::move(structure),
                              Guards{.reading = reading_guard(guards, period_s),
                                     .limit = force_limit(guards),
                                     .ramp = force_ramp(guards, period_s),
                                     .slew = slew_limit(guards, period_s)}};
        return run_session(controller, session, sinks, stop_requested, watch);
    };
    SessionReport report = probe          ? run(Probe{*probe, period_s})
                           : options.push ? run(Pulses{{*options.push}, period_s})
                                          : run(FreeMotion{});
    Summary summary = detail::finish(
        options, session.loop, options.units, metadata, sinks, std::move(report),
        {.encoder_step = guards.encoder_step, .position_unit = options.units.position}, device);
    if (!note.empty()) {
        summary.notes.push_back(note);
    }
    return summary;
}

}  // namespace palpate
