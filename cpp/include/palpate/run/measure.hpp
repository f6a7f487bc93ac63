// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <optional>
#include <string>
#include <utility>

#include "palpate/device/device.hpp"
#include "palpate/guard/guard_settings.hpp"
#include "palpate/io/recording_file.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/rendering/measuring.hpp"
#include "palpate/rendering/scale.hpp"
#include "palpate/rendering/structure.hpp"
#include "palpate/run/controller.hpp"
#include "palpate/run/record_sinks.hpp"
#include "palpate/run/session.hpp"
#include "palpate/run/session_text.hpp"

namespace palpate {

/// A real object measured on an open device: somebody moves the handle (FreeMotion), or the device does so by
/// itself (Probe, Pulses). Everything else is as in a rendering. Throws std::invalid_argument before anything moves.
template <Device D, Structure S, class Watch>
[[nodiscard]] SessionReport measure_live(D& device, S moves, const GuardSettings& guards,
                                         const SessionSettings& settings, RecordSinks& sinks,
                                         const std::atomic<bool>& asked, Watch watch) {
    validate(settings.loop);
    validate(guards);
    const double period_s = 1.0 / settings.loop.rate_hz;
    Controller controller{device, std::move(moves),
                          Guards{.reading = reading_guard(guards, period_s),
                                 .limit = force_limit(guards),
                                 .ramp = force_ramp(guards, period_s),
                                 .slew = slew_limit(guards, period_s)}};
    return run_session(controller, settings, sinks, asked, watch);
}

/// Returns the default probe of a range for a device, at a model's scale.
[[nodiscard]] inline ProbeSettings probe_for(const ModelScale& scale, const DeviceProfile& device,
                                             double lower, double upper) {
    ProbeSettings probe;
    probe.lower = lower;
    probe.upper = upper;
    probe.speed *= scale.length;
    probe.stiffness *= scale.stiffness();
    probe.damping *= scale.stiffness();
    probe.force_limit = device.force_limit;
    return probe;
}

/// The head of a recording of a real object.
[[nodiscard]] inline Metadata measured_metadata(const std::string& created_by, const std::string& device,
                                                const std::optional<ProbeSettings>& probe, bool transducer,
                                                double rate_hz) {
    return {
        {"created_by", created_by},
        {"device", device},
        {"force", transducer ? "of the object against the handle, from the device's force transducer"
                             : "what the motor held against the object: the friction of the device is in it"},
        {"moved_by", probe ? "the device itself: a sweep from " + readable(probe->lower) + " to " +
                                 readable(probe->upper) + " at " + readable(probe->speed) +
                                 " a second, no force above " + readable(probe->force_limit)
                           : "a hand"},
        {"rate_hz", readable(rate_hz)}};
}

}  // namespace palpate
