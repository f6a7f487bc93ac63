// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <limits>
#include <string>
#include <system_error>
#include <utility>

#include "palpate/fields/readable.hpp"
#include "palpate/guard/guard_settings.hpp"
#include "palpate/guard/guards.hpp"
#include "palpate/rendering/admittance.hpp"
#include "palpate/rendering/any_structure.hpp"
#include "palpate/rendering/make_structure.hpp"
#include "palpate/rendering/measuring.hpp"
#include "palpate/run/admittance_controller.hpp"
#include "palpate/run/controller.hpp"
#include "palpate/run/live_device.hpp"
#include "palpate/run/record_sinks.hpp"
#include "palpate/run/render.hpp"
#include "palpate/run/session.hpp"
#include "palpate/run/session_text.hpp"
#include "palpate/run/session_verdict.hpp"
#include "palpate/run/summary.hpp"
#include "palpate/stability/certificate.hpp"

// Definitions of prepare_rendering and render, which contain the control loop.
namespace palpate {

namespace detail {

/// Returns the reason why a model must not move a device; empty if its certificate holds for the device, its rate and
/// the options. Reading the model file has already checked that the certificate belongs to the model.
[[nodiscard]] inline std::string certificate_mismatch(const RenderOptions& options, const PlannedModel& model,
                                                      const DeviceProfile& device) {
    const auto differs = [](double certified, double measured) {
        // Two numbers of the profiles count as equal if their relative difference is at most this limit [-]
        constexpr double rounding = 1e-6;
        return std::abs(certified - measured) > rounding * std::abs(measured);
    };
    if (!model.certificate) {
        return "has no certificate";
    }
    const DeviceProfile& certified = model.certificate->device;
    if (!proves_energy(*model.certificate)) {
        return "is not certified: " + model.certificate->reason;
    }
    if (const std::string reason = account_reason(options, *model.certificate); !reason.empty()) {
        return "cannot be rendered: " + reason;
    }
    if (certified.id != device.id) {
        return "is certified for the device " + certified.id + ", not for " + device.id;
    }
    // The period of a device that renders the plan itself was compared with that of its model when it was opened
    const bool on_device = rendered_by_device(options, model);
    if (on_device && differs(certified.encoder_step, device.encoder_step)) {
        return "is exported for an encoder step of " + readable(certified.encoder_step) +
               " rad, the device has " + readable(device.encoder_step) + " rad";
    }
    if (!on_device && differs(certified.period_s, device.period_s)) {
        return "is certified for a period of " + readable(1e3 * certified.period_s) + " ms, the device has " +
               readable(1e3 * device.period_s) + " ms";
    }
    if (certified.encoder_step < device.encoder_step &&
        differs(certified.encoder_step, device.encoder_step)) {
        return "is certified for an encoder step of " + readable(certified.encoder_step) +
               " rad, the device has " + readable(device.encoder_step) + " rad";
    }
    if (certified.force_limit > device.force_limit && differs(certified.force_limit, device.force_limit)) {
        return "is certified for a force limit of " + readable(certified.force_limit) +
               " N*m, the device makes at most " + readable(device.force_limit) + " N*m";
    }
    if (holds_line(model.certificate->scheme.structure) && !device.held_line) {
        return "is certified for a controller that holds a line between two commands, the device does not "
               "hold one";
    }
    if (changes_plan(options)) {
        return "is certified for its plan only: do not set structure, its numbers, force_limit, slew_s or "
               "tolerated_samples";
    }
    return "";
}

/// Returns the settings of the guards: the values of the options, otherwise the defaults for the device.
[[nodiscard]] inline GuardSettings chosen_guards(const RenderOptions& options, const LiveDevice& device) {
    GuardSettings guards = guards_for(device.scale, device.profile);
    guards.force_limit = options.force_limit.value_or(guards.force_limit);
    guards.largest_speed = options.largest_speed.value_or(guards.largest_speed);
    guards.slew_s = options.slew_s.value_or(guards.slew_s);
    guards.ramp_s = options.ramp_s;
    guards.frozen_s = options.frozen_s;
    guards.energy_account = options.energy_account;
    validate(guards);
    if (!device.profile.makes(guards.force_limit)) {
        refuse("force_limit is " + readable(guards.force_limit) + ": must be at most " +
               readable(device.profile.force_limit) + ", the force limit of the device");
    }
    guards.force_limit = std::min(guards.force_limit, device.profile.force_limit);
    return guards;
}

/// A certificate holds only if the measured rate is at least this factor times the certified rate [-].
inline constexpr double certified_rate_share = 0.99;

/// Sets guards and control loop to the values of the certificate: force limit, least rate, longest time between two
/// ticks, longest delay of a force, and the numbers of the device for the energy account. Disables the slew limit, and
/// lets the loop end after the first tick without a force, because the proofs of the certificate include neither.
inline void apply_certificate(const Certificate& certificate, GuardSettings& guards, LoopSettings& loop) {
    guards.certified = certificate.certified();
    guards.slew_s = 0.0;
    // The device may have finer encoder steps than the certificate
    const double encoder_step = guards.encoder_step;
    use_device(guards, certificate.device);
    guards.encoder_step = encoder_step;
    loop.tolerated = 0;
    loop.lowest_rate_share = std::max(loop.lowest_rate_share, certified_rate_share);
    loop.longest_period_s = certificate.longest_period_s;
    guards.longest_delay_s = certificate.device.delay_s;
}

/// Opens telemetry and recording. Returns a note if it renamed an earlier interrupted recording, otherwise "".
inline std::string open_sinks(const RunOptions& options, const RecordUnits& units, const Metadata& metadata,
                              RecordSinks& sinks) {
    if (options.telemetry_port) {
        const std::string reason = sinks.telemetry.open(*options.telemetry_port, options.telemetry_hz, units);
        require(reason.empty(), reason);
    }
    if (options.record.empty()) {
        return "";
    }
    const std::string reason = sinks.file.open(options.record, units, metadata, options.force);
    require(reason.empty(), reason);
    const std::string& interrupted = sinks.file.file().interrupted_name();
    return interrupted.empty() ? "" : "an earlier recording that was interrupted is kept as " + interrupted;
}

/// Finishes the recording of a run and returns the summary with the verdict.
[[nodiscard]] inline Summary finish(const RunOptions& options, const LoopSettings& loop,
                                    const RecordUnits& units, const Metadata& metadata, RecordSinks& sinks,
                                    SessionReport report, SessionExpectation expected,
                                    const LiveDevice& device) {
    Summary summary;
    summary.report = std::move(report);
    summary.loop = loop;
    summary.units = units;
    summary.record = options.record;
    if (!options.record.empty()) {
        expected.recorded = true;
        summary.warnings = finish_record(sinks.file, summary.report, loop, summary.record);
        if (!summary.orderly()) {
            summary.last_ticks =
                write_last_ticks(options.record, options.force, units, metadata, summary.report, loop);
        }
    }
    expected.warnings.insert(expected.warnings.end(), summary.warnings.begin(), summary.warnings.end());
    summary.findings = judge_session(summary.report, loop, sinks, expected);
    summary.recorded = sinks.file.written();
    summary.lost_records = summary.report.lost_records + sinks.file.refused();
    summary.telemetry_sent = sinks.telemetry.sent();
    summary.telemetry_dropped = sinks.telemetry.dropped();
    summary.positions = sinks.positions;
    summary.forces = sinks.forces;
    summary.kept = std::move(sinks.kept);
    summary.device = device.title;
    summary.device_report = device.report();
    return summary;
}

}  // namespace detail

PALPATE_INLINE RenderJob prepare_rendering(const RenderOptions& options, const PlannedModel& model,
                                           const LiveDevice& device, RecordSinks& sinks) {
    if (model.refusal && !options.accept_model) {
        refuse("the verdict of " + model.name + " is no: " + *model.refusal +
               ". Identify a better model, or give --accept-model to use this one");
    }
    std::string reason = uncertified_reason(options, model);
    if (!device.simulated && !options.uncertified) {
        reason = detail::certificate_mismatch(options, model, device.profile);
        if (!reason.empty()) {
            refuse(model.name + " " + reason +
                   "; make a certificate with 'palpate plan', or set uncertified to render without a "
                   "certificate");
        }
    }
    const bool follows_plan = model.plan && !options.scheme.any();
    RenderJob job{
        follows_plan ? model.planned() : model.model,
        follows_plan ? *model.plan : scheme_for(model.model, device.scale, device.profile, options.scheme),
        detail::chosen_guards(options, device),
        {.loop = options.loop, .real_time = options.real_time},
        {},
        {}};
    LoopSettings& loop = job.session.loop;
    loop.rate_hz = device.rate_hz;
    loop.tolerated = options.tolerated.value_or(loop.tolerated);
    const bool on_device = rendered_by_device(options, model);
    if (device.profile.admittance) {
        sinks.force = RecordedForce::Applied;
        job.guards.ramp_s = 0.0;
        job.notes.emplace_back("the force of the handle moves the object; the recorded force is that force");
    }
    if (on_device) {
        sinks.force = RecordedForce::Applied;
        job.notes.emplace_back(
            "the device renders the model; the host watches and records the force of its motor");
    } else if (reason.empty()) {
        detail::apply_certificate(*model.certificate, job.guards, loop);
        if (device.simulated && device.profile.admittance) {
            // The certificate needs a constant period. The simulated time has it, the time of the host never has
            loop.lowest_rate_share = options.loop.lowest_rate_share;
            loop.longest_period_s = std::numeric_limits<double>::infinity();
        }
    } else if (model.certificate && device.simulated) {
        job.notes.push_back("uncertified: " + reason);
    }
    validate(loop);
    validate(job.guards);
    if (device.profile.admittance) {
        validate(job.scheme, job.model);
    } else {
        validate(job.scheme, job.model, on_device ? model.certificate->device.period_s : 1.0 / loop.rate_hz);
    }
    if (!model.plan && !options.scheme.any() && has_coupling(job.scheme.structure)) {
        job.notes.emplace_back(
            "the model has no plan: rendered behind the default coupling, which makes the object softer; "
            "'palpate plan' chooses a structure");
    }
    job.metadata = device.metadata;
    job.metadata.emplace_back("certified", !reason.empty() ? "no: " + reason
                                           : device.simulated || model.certificate->held_by_account()
                                               ? std::string(name_of(model.certificate->verdict))
                                               : "yes");
    if (on_device) {
        job.metadata.emplace_back("force", "of the motor, from the model that the device renders");
    }
    job.metadata =
        flight_metadata(options.created_by, job.metadata, model.name, job.scheme, job.guards, loop.rate_hz);
    if (std::error_code ignored;
        !options.record.empty() && std::filesystem::equivalent(options.record, model.name, ignored)) {
        refuse("record is " + options.record + ", the model file: choose another name");
    }
    if (std::string note = detail::open_sinks(options, model.units(), job.metadata, sinks); !note.empty()) {
        job.notes.push_back(std::move(note));
    }
    return job;
}

namespace detail {

/// Returns the controller of a rendering on an open admittance display.
[[nodiscard]] inline AdmittanceController<LiveDevice> admittance_controller(const RenderJob& job,
                                                                            LiveDevice& device,
                                                                            double period_s) {
    require(
        is_uncoupled(job.scheme),
        "structure is " + std::string(name_of(job.scheme.structure)) +
            ": an admittance display renders an object with mass and without a coupling; make a plan with "
            "'palpate plan'");
    constexpr double infinite = std::numeric_limits<double>::infinity();
    Guards guards = guards_of(job.guards, job.model, job.scheme, period_s);
    // A position servo may stop within a period, so a position that stays constant does not show a fault
    guards.reading = ReadingGuard{
        {.largest_step = job.guards.largest_speed * period_s, .longest_delay = job.guards.longest_delay_s}};
    return {device,
            {make_structure(job.model, job.scheme, period_s, infinite), device.profile},
            guards,
            device.profile.force_limit,
            device.profile.admittance->drive_stiffness.value_or(1.0)};
}

}  // namespace detail

PALPATE_INLINE Summary render(const RenderOptions& options, const PlannedModel& model, const RenderJob& job,
                              LiveDevice& device, RecordSinks& sinks, const std::atomic<bool>& stop_requested,
                              const Watch& watch) {
    const double period_s = 1.0 / job.session.loop.rate_hz;
    const auto session = [&](auto controller) {
        return run_session(controller, job.session, sinks, stop_requested, watch);
    };
    const auto run = [&](AnyStructure structure, const Guards& guards) {
        return session(Controller<LiveDevice>{device, std::move(structure), guards});
    };
    const Domain& domain = model.model.domain();
    SessionReport report = device.profile.admittance
                               ? session(detail::admittance_controller(job, device, period_s))
                           : rendered_by_device(options, model)
                               ? run(Watching{domain}, Guards{.reading = reading_guard(job.guards, period_s),
                                                              .limit = force_limit(job.guards),
                                                              .ramp = force_ramp(job.guards, period_s)})
                               : run(make_structure(job.model, job.scheme, period_s, job.guards.force_limit),
                                     guards_of(job.guards, job.model, job.scheme, period_s));
    Summary summary =
        detail::finish(options, job.session.loop, model.units(), job.metadata, sinks, std::move(report),
                       {.encoder_step = job.guards.encoder_step,
                        .domain = {domain.lower[0], domain.upper[0]},
                        .position_unit = model.position_unit,
                        .warnings = model.findings},
                       device);
    summary.notes = job.notes;
    return summary;
}

}  // namespace palpate
