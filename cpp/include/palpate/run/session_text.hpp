// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <filesystem>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "palpate/fields/readable.hpp"
#include "palpate/guard/guard_settings.hpp"
#include "palpate/io/recording_file.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/run/loop.hpp"
#include "palpate/run/session.hpp"

namespace palpate {

/// Returns the percentiles of durations as a text such as "p50 1.2 us, p99 3.4 us, p99.9 5.6 us, max 7.8 us".
[[nodiscard]] inline std::string percentiles(const DurationHistogram& histogram) {
    std::string text;
    for (const auto& [name, share] :
         {std::pair{"p50 ", 0.5}, {"p99 ", 0.99}, {"p99.9 ", 0.999}, {"max ", 1.0}}) {
        text += (text.empty() ? "" : ", ") + std::string(name) + readable(1e-3 * histogram.quantile(share)) +
                " us";
    }
    return text;
}

/// Returns one line of text with the rate of a control loop, its periods, and how late its ticks were.
[[nodiscard]] inline std::string timing_text(const LoopReport& report, double wanted_hz) {
    const LoopTiming& timing = report.timing;
    return readable(timing.rate_hz()) + " Hz of " + readable(wanted_hz) + " Hz over " +
           std::to_string(report.ticks()) + " ticks; period " + percentiles(timing.period) + "; late by " +
           percentiles(timing.lateness) + "; missed deadlines " + std::to_string(timing.missed) +
           "; longest gap " + readable(1e-3 * static_cast<double>(timing.period.largest())) + " us";
}

/// Returns what is known about the force of a device after it was closed.
[[nodiscard]] inline std::string closing_text(ZeroForce zero_force) {
    switch (zero_force) {
        case ZeroForce::Commanded:
            return "zero force commanded, device closed";
        case ZeroForce::NotSent:
            return "zero force could not be sent: switch the motor off if it still pushes";
        case ZeroForce::Sent:
            return "zero force sent, but not confirmed by the device: switch the motor off if it still "
                   "pushes";
        case ZeroForce::Held:
            return "position held, device closed";
        case ZeroForce::Confirmed:
            break;
    }
    return "zero force sent and confirmed, device closed";
}

/// Returns the exit reason of a control loop as a sentence.
[[nodiscard]] inline std::string exit_text(const LoopReport& report, const LoopSettings& settings) {
    const StatusText& status = text(report.status);
    switch (report.exit_reason) {
        case ExitReason::TimeUp:
            return "the duration ended";
        case ExitReason::StopRequested:
            return "stopped on request";
        case ExitReason::Guard:
            return std::string("stopped by a guard: ") + status.word + ", " + status.meaning;
        case ExitReason::DeviceFault:
            return std::string("stopped by a fault of the device: ") + status.word + ", " + status.meaning;
        case ExitReason::NotCertified:
            if (report.status == Status::Stale) {
                return "stopped because the device applied a force " + readable(1e3 * report.largest_delay) +
                       " ms after its sample, or not at all: the certificate holds for at most " +
                       readable(1e3 * report.longest_delay) + " ms; plan with a larger delay_s of the device";
            }
            return "stopped because a tick started " +
                   readable(1e-6 * static_cast<double>(report.timing.period.largest())) +
                   " ms after the previous tick: the certificate holds for at most " +
                   readable(1e3 * settings.longest_period_s) + " ms";
        case ExitReason::RateTooLow:
            break;
    }
    return "stopped because the rate was too low: less than " +
           readable(settings.lowest_rate_share * settings.rate_hz) + " Hz of " + readable(settings.rate_hz) +
           " Hz for half a second";
}

/// Returns the largest time from a sample until the device applied its force, and the allowed time, as one line of text.
[[nodiscard]] inline std::string delay_text(const LoopReport& report) {
    const std::string largest = std::isnan(report.largest_delay)
                                    ? "not measured by this device"
                                    : "at most " + readable(1e3 * report.largest_delay) +
                                          " ms from a sample until the device applied its force";
    return largest + (std::isfinite(report.longest_delay)
                          ? "; the certificate holds for " + readable(1e3 * report.longest_delay) + " ms"
                          : "");
}

/// Returns the largest net energy that a rendering gave, as one line of text. The energy during the start ramp is
/// stated separately, because the ramp can give the energy of the object once.
[[nodiscard]] inline std::string energy_text(const LoopReport& report) {
    const std::string stored = std::isfinite(report.most_stored)
                                   ? "the object stored at most " + readable(report.most_stored) + " J"
                                   : "no bound of the stored energy is known";
    return "the motor gave " + readable(report.given_in_ramp) + " J during the start ramp and " +
           readable(report.given) + " J after the ramp; " + stored;
}

/// Returns a scheme as a text such as "massless, compensated, K_c = 100, B_c = 0.02".
[[nodiscard]] inline std::string describe(const Scheme& scheme) {
    std::string text{name_of(scheme.structure)};
    text += scheme.compensated ? ", compensated" : "";
    if (has_coupling(scheme.structure)) {
        text +=
            ", K_c = " + readable(scheme.coupling.stiffness) + ", B_c = " + readable(scheme.coupling.damping);
    }
    if (has_mass(scheme.structure)) {
        text += ", m = " + readable(scheme.inertia.mass) + ", B_o = " + readable(scheme.inertia.damping);
    }
    if (scheme.play_radius > 0.0) {
        text += ", r = " + readable(scheme.play_radius);
    }
    if (scheme.predict > 0) {
        text += ", predict " + std::to_string(scheme.predict);
    }
    return text;
}

/// Returns the metadata of a flight record: program, device, model, structure, guards and rate.
[[nodiscard]] inline Metadata flight_metadata(const std::string& created_by, const Metadata& device,
                                              const std::string& model, const Scheme& scheme,
                                              const GuardSettings& guards, double rate_hz) {
    Metadata metadata{{"created_by", created_by}};
    metadata.insert(metadata.end(), device.begin(), device.end());
    metadata.insert(metadata.end(),
                    {{"model", model},
                     {"structure", describe(scheme)},
                     {"guards", "force limit " + readable(guards.force_limit) +
                                    (guards.slew_s > 0.0 ? ", slew from zero to the limit in " +
                                                               readable(guards.slew_s) + " s"
                                                         : ", no slew limit") +
                                    ", ramp " + readable(guards.ramp_s) + " s"},
                     {"rate_hz", readable(rate_hz)}});
    return metadata;
}

/// Writes the exit reason and the timing into the recording, renames the file, and sets `name` to its final name.
/// Returns a warning if the disk failed, and a warning if the file could not be renamed.
[[nodiscard]] inline std::vector<std::string> finish_record(RecordingFile& file, const SessionReport& report,
                                                            const LoopSettings& settings, std::string& name) {
    std::vector<std::string> warnings;
    const int disk = file.error();
    std::string ended = exit_text(report.loop, settings) + "; " + closing_text(report.loop.zero_force);
    if (disk != 0) {
        ended += std::string("; incomplete, because of the disk: ") + std::generic_category().message(disk);
        warnings.push_back(name + " is incomplete: " + std::generic_category().message(disk) + "; " +
                           std::to_string(file.refused()) + " rows are missing at its end");
    }
    const std::string timing =
        timing_text(report.loop, settings.rate_hz) + "; lost records " + std::to_string(report.lost_records);
    if (std::string reason = file.finish(ended, timing); !reason.empty()) {
        name = file.file().part();
        warnings.push_back(std::move(reason));
    }
    return warnings;
}

/// Writes the last ticks before a fault to a separate recording, NAME.fault.csv. If the file exists, it is replaced
/// with `force`; without `force` the name is NAME.fault-2.csv, NAME.fault-3.csv, ... Returns a message with the name of
/// the file or with the error.
[[nodiscard]] inline std::string write_last_ticks(const std::string& record, bool force,
                                                  const RecordUnits& units, const Metadata& metadata,
                                                  const SessionReport& report, const LoopSettings& settings) {
    const std::string stem = record.substr(0, record.size() - (record.ends_with(".csv") ? 4 : 0)) + ".fault";
    std::string name = stem + ".csv";
    for (int k = 2; !force && std::filesystem::exists(name); ++k) {
        name = stem + "-" + std::to_string(k) + ".csv";
    }
    RecordingFile file;
    if (const std::string reason = file.open(name, units, metadata, force); !reason.empty()) {
        return "the last ticks could not be written: " + reason;
    }
    file.take(report.last_ticks);
    const std::vector<std::string> warnings = finish_record(file, report, settings, name);
    return warnings.empty() ? "the last " + std::to_string(report.last_ticks.size()) + " ticks are in " + name
                            : warnings.front();
}

}  // namespace palpate
