// SPDX-License-Identifier: Apache-2.0
// palpate-control: a model rendered on a device in real time. The exit codes stand in --help.
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <exception>
#include <filesystem>
#include <iostream>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "certified.hpp"
#include "inverse3.hpp"
#include "options.hpp"
#include "palpate/io/model_file.hpp"
#include "palpate/run/session.hpp"
#include "palpate/run/session_text.hpp"
#include "palpate/simulation/faulty_device.hpp"
#include "palpate/simulation/simulated_device.hpp"
#include "palpate/simulation/test_rig.hpp"
#include "rendering.hpp"
#include "usb.hpp"

namespace palpate::control {

namespace {

std::atomic<bool> asked{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler sets it");

void ask_to_stop(int /*signal*/) {
    asked.store(true, std::memory_order_relaxed);
}

}  // namespace

const std::atomic<bool>& asked_to_stop() {
    return asked;
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

bool follows_plan(const Options& options, const ModelFile& file) {
    return file.plan && !chooses_scheme(options);
}

const ForceModel& rendered(const Options& options, const ModelFile& file) {
    return follows_plan(options, file) ? file.planned() : file.model;
}

Scheme scheme_of(const Options& options, const ModelFile& file, const TestRig& rig) {
    SchemeChoices choices = options.scheme;
    if (options.structure) {
        choices.structure = named<StructureKind>(*options.structure, "structure");
    }
    const Scheme scheme = follows_plan(options, file) ? *file.plan : rig.scheme(file.model, choices);
    validate(scheme, rendered(options, file), rig.device.period_s);
    return scheme;
}

GuardSettings guards_of(const Options& options, const TestRig& rig) {
    GuardSettings guards = guards_for(rig.scale, rig.device);
    guards.force_limit = options.force_limit.value_or(guards.force_limit);
    guards.largest_speed = options.largest_speed.value_or(guards.largest_speed);
    guards.slew_s = options.slew_s.value_or(guards.slew_s);
    guards.ramp_s = options.ramp_s;
    guards.frozen_s = options.frozen_s;
    guards.energy_tank = !options.no_energy_tank;
    validate(guards);
    if (!rig.device.makes(guards.force_limit)) {
        refuse("--force-limit is " + readable(guards.force_limit) + ", the device makes " +
               readable(rig.device.force_limit));
    }
    guards.force_limit = std::min(guards.force_limit, rig.device.force_limit);
    return guards;
}

Job job_of(const Options& options, ModelFile file, RecordUnits units, const Scheme& scheme,
           const GuardSettings& guards, const LoopSettings& loop) {
    validate(loop);
    Job job{std::move(file), std::move(units), scheme, guards, {}};
    job.settings.loop = loop;
    job.settings.real_time = options.real_time;
    return job;
}

void open_sinks(const Options& options, const Metadata& metadata, const RecordUnits& units,
                RecordSinks& sinks) {
    if (options.telemetry_port) {
        if (const std::string reason =
                sinks.telemetry.open(*options.telemetry_port, options.telemetry_hz, units);
            !reason.empty()) {
            refuse(reason);
        }
    }
    if (!options.record.empty()) {
        std::error_code ignored;
        if (std::filesystem::equivalent(options.record, options.model, ignored)) {
            refuse("--record " + options.record + " is the model; writing there would destroy it");
        }
        if (const std::string reason = sinks.file.open(options.record, units, metadata, options.force);
            !reason.empty()) {
            refuse("--record " + reason);
        }
        if (const std::string& aside = sinks.file.file().set_aside_as(); !aside.empty()) {
            std::cerr << "a recording that was cut off earlier is kept as " << aside << "\n";
        }
    }
}

namespace {

RecordUnits units_of(const ModelFile& file) {
    if (file.force_unit == "A") {
        refuse(
            "the model's force is a motor current in A; identify it again with --torque-constant-Nm-per-A");
    }
    return {file.position_unit, file.force_unit == "N*m" ? "Nm" : file.force_unit};
}

/// Whether the certificate of a model holds for this run on a simulated device, and else why not.
std::string void_because(const Options& options, const ModelFile& file) {
    if (!file.certificate) {
        return "the model has no certificate";
    }
    if (options.uncertified) {
        return "--uncertified was given";
    }
    return chooses_rendering(options) ? "the command line asks for a rendering of its own" : "";
}

/// Ticks a second: those of the certificate where there is one. Another rate is refused.
double rate_of(const Options& options, const ModelFile& file, bool certified) {
    if (!certified) {
        return options.loop.rate_hz;
    }
    const double rate = 1.0 / file.certificate->device.period_s;
    if (options.rate_given && std::abs(options.loop.rate_hz - rate) > 1e-6 * rate) {
        refuse("--rate-hz is " + readable(options.loop.rate_hz) + ", and the certificate is for " +
               readable(rate) + " Hz: plan again for a device of that period, or give --uncertified");
    }
    return rate;
}

/// A simulated device is the one that the certificate is for, where there is one.
int run_on_simulated(const Options& given, ModelFile file, RecordUnits units) {
    const std::string reason = void_because(given, file);
    const bool certified = reason.empty();
    Options options = given;
    options.loop.rate_hz = rate_of(given, file, certified);
    const double period_s = 1.0 / options.loop.rate_hz;
    TestRig rig = rig_for(file.model, file.position_unit == "rad", period_s);
    if (certified) {
        rig.device = file.certificate->device;
    }
    const Scheme scheme = scheme_of(options, file, rig);
    GuardSettings guards = guards_of(options, rig);
    if (certified) {
        keep_to(*file.certificate, guards, options.loop);
    } else if (file.certificate) {
        std::cerr << "uncertified: " << reason << "\n";
    }
    const Job job = job_of(options, std::move(file), std::move(units), scheme, guards, options.loop);
    std::vector<Fault> faults;
    for (const std::string& fault : options.faults) {
        faults.push_back(parse_fault(fault, period_s));
    }
    Faulty device{SimulatedDevice{rig.device, rig.hand, simulated_substeps(period_s)}, faults,
                  3.0 * guards.largest_speed * period_s};
    if (const Opened opened = device.open(); !opened) {
        refuse(opened.reason);
    }
    Metadata about = simulated_metadata(rig);
    about.emplace_back("certified",
                       certified ? std::string(name_of(job.file.certificate->verdict)) : "no: " + reason);
    return render_on(device, rig.device.id + " (simulated: nothing moves)", options, job, about,
                     [] { return Story{}; });
}

/// Gives each closed standard stream a descriptor that cannot be used, so that no file opened later gets its number:
/// the summary would be written into the recording.
void occupy_closed_streams() {
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
        if (fcntl(stream, F_GETFD) < 0) {
            (void)!open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY);
        }
    }
}

/// Flushes standard output and returns the exit code; 1 if the output could not be written.
int exit_code_after_output(int code) {
    errno = 0;
    if (std::cout.flush()) {
        return code;
    }
    std::cerr << "error: standard output could not be written"
              << (errno == 0 ? "" : ": " + std::generic_category().message(errno)) << "\n";
    return 1;
}

int run(const Options& options) {
    const std::string kind = options.device.substr(0, options.device.find(':'));
    const bool has_more = options.device.size() > kind.size() + 1;
    const bool is_whole = options.device == kind;
    if (!(kind == "simulated" && is_whole) &&
        !((kind == "usb" || kind == "inverse3") && (is_whole || has_more))) {
        refuse("--device is '" + options.device +
               "', must be simulated, usb[:SERIAL] or inverse3[:AXIS[@PORT]]");
    }
    if (kind != "simulated" && !options.faults.empty()) {
        refuse("--fault is for the simulated device");
    }
    ModelFile file = load_model_file(options.model);
    const RecordUnits units = units_of(file);
    if (file.inputs.size() != 1 && file.model.velocity() == nullptr) {
        refuse(options.model + " has " + std::to_string(file.inputs.size()) +
               " inputs: a model of the position, or of position and velocity, can be rendered");
    }
    const auto run_on = kind == "usb" ? run_on_usb : kind == "inverse3" ? run_on_inverse3 : run_on_simulated;
    return run_on(options, std::move(file), units);
}

}  // namespace

}  // namespace palpate::control

int main(int count, char** words) {
    palpate::control::occupy_closed_streams();
    palpate::control::Options options;
    try {
        const auto code = palpate::control::read_options(count, words, options);
        return palpate::control::exit_code_after_output(code ? *code : palpate::control::run(options));
    } catch (const std::exception& error) {
        std::cerr << "error: " << error.what() << "\n";
        return 2;
    }
}
