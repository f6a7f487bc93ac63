// SPDX-License-Identifier: Apache-2.0
// palpate-control renders a model on a device in real time. --help lists the exit codes.
#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <exception>
#include <iostream>
#include <string>
#include <system_error>
#include <utility>

#include "options.hpp"
#include "palpate/io/model_file.hpp"
#include "palpate/run/render.hpp"
#include "palpate/run/session_text.hpp"
#include "palpate/simulation/open_device.hpp"
#include "printing.hpp"

namespace palpate::control {

namespace {

std::atomic<bool> stop_requested{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler sets stop_requested");

void request_stop(int /*signal*/) {
    stop_requested.store(true, std::memory_order_relaxed);
}

/// Installs signal handlers: Ctrl-C and a termination request end the control loop; a closed output pipe and the file
/// size limit do not.
void handle_signals() {
    struct sigaction stop{};
    stop.sa_handler = request_stop;
    stop.sa_flags = SA_RESTART;  // an interrupted write would end all later output of std::cerr
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
        sigaction(signal, &stop, nullptr);
    }
    struct sigaction ignore{};
    ignore.sa_handler = SIG_IGN;
    for (const int signal : {SIGPIPE, SIGXFSZ}) {
        sigaction(signal, &ignore, nullptr);
    }
}

/// Opens /dev/null in place of each closed standard stream. Otherwise the recording could get the file number of
/// standard output, and the summary would be written into the recording.
void occupy_closed_streams() {
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
        if (fcntl(stream, F_GETFD) < 0) {
            (void)!open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY);
        }
    }
}

/// Writes all buffered text to standard output. Returns `code`, or 1 if standard output could not be written.
int exit_code_after_output(int code) {
    errno = 0;
    if (std::cout.flush()) {
        return code;
    }
    std::cerr << "error: standard output could not be written"
              << (errno == 0 ? "" : ": " + std::generic_category().message(errno)) << "\n";
    return 1;
}

[[nodiscard]] PlannedModel read_model(const std::string& name) {
    ModelFile file = load_model_file(name);
    if (file.inputs.size() != 1 && file.model.velocity() == nullptr) {
        refuse(name + " has " + std::to_string(file.inputs.size()) +
               " inputs: only a model of position, or of position and velocity, can be rendered");
    }
    return {name,
            std::move(file.model),
            std::move(file.position_unit),
            std::move(file.force_unit),
            std::move(file.plan),
            std::move(file.limited),
            std::move(file.certificate),
            std::move(file.findings),
            std::move(file.refusal)};
}

int run(const Options& options) {
    const PlannedModel model = read_model(options.model);
    const auto device = open_device(options.render, model);
    RecordSinks sinks;
    const RenderJob job = prepare_rendering(options.render, model, *device, sinks);
    const LoopSettings& loop = job.session.loop;
    std::cerr << model.name << ": " << job.model.parameters().weight.size() << " wavelets, "
              << describe(job.scheme) << "; " << device->title << " at " << readable(loop.rate_hz) << " Hz "
              << (std::isfinite(loop.duration_s) ? "for " + readable(loop.duration_s) + " s" : "until Ctrl-C")
              << "\n";
    for (const std::string& note : job.notes) {
        std::cerr << note << "\n";
    }
    handle_signals();
    LiveView view{loop, model.units(),
                  rendered_by_device(options.render, model) ? &LoopProgress::applied : &LoopProgress::force};
    const Summary summary = render(options.render, model, job, *device, sinks, stop_requested,
                                   [&](const SessionView& now) { view.show(now); });
    view.end();
    print_summary(summary, options.as_json);
    // The exit code states how the loop ended; the verdict in the summary judges the rendering.
    return summary.orderly() ? 0 : 1;
}

}  // namespace

}  // namespace palpate::control

int main(int count, char** arguments) {
    using namespace palpate::control;
    occupy_closed_streams();
    Options options;
    try {
        const auto code = read_options(count, arguments, options);
        return exit_code_after_output(code ? *code : run(options));
    } catch (const std::exception& error) {
        std::cerr << "error: " << error.what() << "\n";
        return 2;
    }
}
