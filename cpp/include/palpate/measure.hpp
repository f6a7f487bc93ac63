// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <optional>

#include "palpate/controller.hpp"
#include "palpate/device/device.hpp"
#include "palpate/device/simulated.hpp"
#include "palpate/guard/guard_settings.hpp"
#include "palpate/io/outlets.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/rendering/free_motion.hpp"
#include "palpate/rendering/probe.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/session.hpp"

namespace palpate {

/// A real object measured on an open device: somebody moves the handle, which is free, or with `probe` the device
/// does so by itself. Everything else is as in a rendering. Throws std::invalid_argument before anything moves.
template <Device D, class Watch>
[[nodiscard]] SessionReport measure_live(D& device, const std::optional<ProbeSettings>& probe,
                                         const GuardSettings& guards, const SessionSettings& settings,
                                         Outlets& outlets, const std::atomic<bool>& asked, Watch watch) {
    validate(settings.loop);
    validate(guards);
    const double period_s = 1.0 / settings.loop.rate_hz;
    const auto measured_with = [&](auto structure) {
        Controller controller{device, structure,
                              Guards{force_limit(guards), slew_limit(guards, period_s),
                                     force_ramp(guards, period_s), reading_guard(guards, period_s)}};
        return run_session(controller, settings, outlets, asked, watch);
    };
    return probe ? measured_with(Probe{*probe, period_s}) : measured_with(FreeMotion{});
}

/// A model as a thing that can be mounted on a simulated device, at rest at `start`.
[[nodiscard]] inline std::function<double(double)> object_of(const ForceModel& model, double start) {
    Scheme direct;
    direct.structure = StructureKind::Direct;
    return with_structure(model, direct, 1.0, [start](auto structure) -> std::function<double(double)> {
        structure.reset(start);
        return [structure](double position) mutable { return structure.step(position).force; };
    });
}

}  // namespace palpate
