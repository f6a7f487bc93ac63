// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cmath>
#include <iostream>
#include <string>
#include <vector>

#include "options.hpp"
#include "palpate/io/model_file.hpp"
#include "palpate/run/session.hpp"
#include "palpate/run/session_text.hpp"
#include "palpate/run/session_verdict.hpp"
#include "palpate/simulation/test_rig.hpp"
#include "telling.hpp"

namespace palpate::control {

[[noreturn]] void refuse(const std::string& sentence);

/// A model and how it is rendered: settled before anything moves.
struct Job {
    ModelFile file;
    RecordUnits units;
    Scheme scheme;
    GuardSettings guards;
    SessionSettings settings;
};

/// True if the model is rendered as it was planned; false if the options choose another rendering.
[[nodiscard]] bool follows_plan(const Options& options, const ModelFile& file);
/// The model that is rendered: that of the plan where the plan is followed, else the identified one.
[[nodiscard]] const ForceModel& rendered(const Options& options, const ModelFile& file);
/// The rendering that the options ask for, else the model's plan, else the default one.
[[nodiscard]] Scheme scheme_of(const Options& options, const ModelFile& file, const TestRig& rig);
/// Throws where the device of the rig cannot make the force that is asked for.
[[nodiscard]] GuardSettings guards_of(const Options& options, const TestRig& rig);

/// Throws where the loop cannot be run as it is set.
[[nodiscard]] Job job_of(const Options& options, ModelFile file, RecordUnits units, const Scheme& scheme,
                         const GuardSettings& guards, const LoopSettings& loop);

void open_sinks(const Options& options, const Metadata& metadata, const RecordUnits& units,
                RecordSinks& sinks);

/// Set by the signals that end a run.
[[nodiscard]] const std::atomic<bool>& asked_to_stop();
void handle_signals();

/// Renders on an open device until it ends, and tells of it. `story` is asked for afterwards: what the device has to
/// add. Returns the exit code.
template <Device D, class Story>
int render_on(D& device, const std::string& called, const Options& options, const Job& job,
              const Metadata& about_device, Story story) {
    const Metadata metadata =
        flight_metadata(std::string("palpate-control ") + PALPATE_VERSION, about_device, options.model,
                        job.scheme, job.guards, job.settings.loop.rate_hz);
    RecordSinks sinks;
    try {
        open_sinks(options, metadata, job.units, sinks);
    } catch (...) {
        device.close();
        throw;
    }
    const double seconds = job.settings.loop.duration_s;
    const ForceModel& model = rendered(options, job.file);
    std::cerr << options.model << ": " << model.parameters().weight.size() << " wavelets, "
              << describe(job.scheme) << "; " << called << " at " << readable(job.settings.loop.rate_hz)
              << " Hz " << (std::isfinite(seconds) ? "for " + readable(seconds) + " s" : "until Ctrl-C")
              << "\n";
    if (!job.file.plan && !chooses_scheme(options) && job.scheme.structure != StructureKind::Direct) {
        std::cerr
            << "no plan in the model: rendered behind the default coupling, which is felt; 'palpate plan' "
               "finds the simplest rendering that is not\n";
    }

    handle_signals();
    LiveView view{job.settings.loop, job.units};
    const SessionReport report =
        render_live(model, job.scheme, device, job.guards, job.settings, sinks, asked_to_stop(),
                    [&](const SessionView& now) { view.show(now); });
    view.end();

    std::string record = options.record;
    const Domain& domain = job.file.model.domain();
    SessionExpectation expected{
        !record.empty(), job.guards.encoder_step, {domain.lower[0], domain.upper[0]}, job.units.position};
    if (!record.empty()) {
        expected.warnings = finish_record(sinks.file, report, job.settings.loop, record);
    }
    for (const std::string& warning : expected.warnings) {
        std::cerr << "warning: " << warning << "\n";
    }
    if (!is_orderly(report.loop.ending)) {
        std::cerr << "error: " << ending_text(report.loop, job.settings.loop)
                  << "; zero force sent, device closed\n";
        tell_last_ticks(report, job.units);
        if (!options.record.empty()) {
            std::cerr << write_last_ticks(options.record, options.force, job.units, metadata, report,
                                          job.settings.loop)
                      << "\n";
        }
    }
    const std::vector<SessionFinding> findings = judge_session(report, job.settings.loop, sinks, expected);
    tell_summary(report, job.settings, sinks, record, findings, story(), options.as_json);
    // The exit code states how the loop ended; the verdict in the summary judges what was rendered.
    return is_orderly(report.loop.ending) ? 0 : 1;
}

}  // namespace palpate::control
