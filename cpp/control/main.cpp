// SPDX-License-Identifier: Apache-2.0
// palpate-control: a model rendered on a device in real time. The exit codes stand in --help.
#include <atomic>
#include <cmath>
#include <csignal>
#include <exception>
#include <filesystem>
#include <iostream>
#include <stdexcept>
#include <string>
#include <vector>

#include "options.hpp"
#include "palpate/bench.hpp"
#include "palpate/device/faulty.hpp"
#include "palpate/device/simulated.hpp"
#include "palpate/io/model_file.hpp"
#include "palpate/session.hpp"
#include "palpate/session_text.hpp"
#include "telling.hpp"

namespace palpate::control {

namespace {

std::atomic<bool> asked{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler sets it");

void ask_to_stop(int /*signal*/) {
    asked.store(true, std::memory_order_relaxed);
}

/// Ctrl-C and a request to terminate end the loop; a reader that is gone or a file that is full end nothing.
void handle_signals() {
    struct sigaction stop{};
    stop.sa_handler = ask_to_stop;
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
        sigaction(signal, &stop, nullptr);
    }
    struct sigaction ignore{};
    ignore.sa_handler = SIG_IGN;
    for (const int signal : {SIGPIPE, SIGXFSZ}) {
        sigaction(signal, &ignore, nullptr);
    }
}

void refuse(const std::string& sentence) {
    throw std::invalid_argument(sentence);
}

Scheme scheme_of(const Options& options, const ForceModel& model, const Bench& bench) {
    SchemeChoices chosen = options.scheme;
    chosen.structure = structure_named(options.structure);
    const Scheme scheme = bench.scheme(model, chosen);
    validate(scheme, model, bench.device.period_s);
    return scheme;
}

GuardSettings guards_of(const Options& options, const Bench& bench) {
    GuardSettings guards = bench.guards();
    guards.force_limit = options.force_limit.value_or(guards.force_limit);
    guards.largest_speed = options.largest_speed.value_or(guards.largest_speed);
    guards.slew_s = options.slew_s;
    guards.ramp_s = options.ramp_s;
    guards.frozen_s = options.frozen_s;
    validate(guards);
    if (guards.force_limit > bench.device.force_limit) {
        refuse("--force-limit is " + readable(guards.force_limit) + ", the device makes " +
               readable(bench.device.force_limit));
    }
    return guards;
}

RecordUnits units_of(const ModelFile& file) {
    if (file.force_unit == "A") {
        refuse(
            "the model's force is a motor current in A; identify it again with --torque-constant-Nm-per-A");
    }
    return {file.position_unit, file.force_unit == "N*m" ? "Nm" : file.force_unit};
}

void open_outlets(const Options& options, const Metadata& metadata, const RecordUnits& units,
                  Outlets& outlets) {
    if (options.telemetry_port) {
        if (const std::string reason =
                outlets.telemetry.open(*options.telemetry_port, options.telemetry_hz, units);
            !reason.empty()) {
            refuse(reason);
        }
    }
    if (!options.record.empty()) {
        std::error_code ignored;
        if (std::filesystem::equivalent(options.record, options.model, ignored)) {
            refuse("--record " + options.record + " is the model; writing there would destroy it");
        }
        if (const std::string reason = outlets.file.open(options.record, units, metadata); !reason.empty()) {
            refuse("--record " + reason);
        }
        if (const std::string& aside = outlets.file.file().set_aside_as(); !aside.empty()) {
            std::cerr << "a recording that was cut off earlier is kept as " << aside << "\n";
        }
    }
}

int run(const Options& options) {
    if (options.device.rfind("usb", 0) == 0) {
        refuse("--device " + options.device + ": this build has no USB device; use --device simulated");
    }
    if (options.device != "simulated") {
        refuse("--device is '" + options.device + "', must be simulated or usb[:SERIAL]");
    }
    const ModelFile file = load_model_file(options.model);
    const RecordUnits units = units_of(file);
    if (file.inputs.size() != 1) {
        refuse(options.model + " has " + std::to_string(file.inputs.size()) +
               " inputs: a model of the position alone can be rendered");
    }
    const double period_s = 1.0 / options.loop.rate_hz;
    const Bench bench = bench_for(file.model, file.position_unit == "rad", period_s);
    const Scheme scheme = scheme_of(options, file.model, bench);
    const GuardSettings guards = guards_of(options, bench);
    SessionSettings settings;
    settings.loop = options.loop;
    settings.real_time = options.real_time;
    validate(settings.loop);
    std::vector<Fault> faults;
    for (const std::string& fault : options.faults) {
        faults.push_back(parse_fault(fault, period_s));
    }
    Faulty device{SimulatedDevice{bench.device, bench.hand, simulated_substeps(period_s)}, faults,
                  3.0 * guards.largest_speed * period_s};

    const Metadata metadata = flight_metadata(std::string("palpate-control ") + PALPATE_VERSION,
                                              options.model, scheme, bench, guards, options.loop.rate_hz);
    Outlets outlets;
    if (const Opened opened = device.open(); !opened) {
        refuse(opened.reason);
    }
    try {
        open_outlets(options, metadata, units, outlets);
    } catch (...) {
        device.close();
        throw;
    }
    std::cerr << options.model << ": " << file.model.parameters().weight.size() << " wavelets, "
              << describe(scheme) << "; " << bench.device.id << " (simulated: nothing moves) at "
              << readable(options.loop.rate_hz) << " Hz "
              << (std::isfinite(options.loop.duration_s) ? "for " + readable(options.loop.duration_s) + " s"
                                                         : "until Ctrl-C")
              << "\n";

    handle_signals();
    LiveView view{settings.loop, units};
    const SessionReport report = render_live(file.model, scheme, device, guards, settings, outlets, asked,
                                             [&](const SessionView& now) { view.show(now); });
    view.end();

    std::string record = options.record;
    if (!record.empty()) {
        for (const std::string& warning : finish_record(outlets.file, report, settings.loop, record)) {
            std::cerr << "warning: " << warning << "\n";
        }
    }
    if (!is_orderly(report.loop.ending)) {
        std::cerr << "error: " << ending_text(report.loop, settings.loop)
                  << "; zero force sent, device closed\n";
        tell_last_ticks(report, units);
        if (!options.record.empty()) {
            std::cerr << write_last_ticks(options.record, units, metadata, report, settings.loop) << "\n";
        }
    }
    tell_summary(report, settings, outlets, record, options.as_json);
    return is_orderly(report.loop.ending) ? 0 : 1;
}

}  // namespace

}  // namespace palpate::control

int main(int count, char** words) {
    palpate::control::Options options;
    try {
        if (const auto code = palpate::control::read_options(count, words, options)) {
            return *code;
        }
        return palpate::control::run(options);
    } catch (const std::exception& error) {
        std::cerr << "error: " << error.what() << "\n";
        return 2;
    }
}
