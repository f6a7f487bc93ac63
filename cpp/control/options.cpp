// SPDX-License-Identifier: Apache-2.0
#include "options.hpp"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <string>

#include <CLI/CLI.hpp>

#include "palpate/session_text.hpp"

namespace palpate::control {

namespace {

constexpr const char* epilogue =
    "Ctrl-C ends a run in an orderly way. Exit code: 0 ran its time, or Ctrl-C; 1 stopped by a guard, a "
    "fault or\n"
    "a rate too low; 2 refused before anything moved.\n\n"
    "Example: palpate-control press.json --device simulated --rate-hz 1000 --duration-s 10 --record felt.csv";

/// A number within bounds, said in words.
CLI::Validator number_between(double low, double high) {
    CLI::Validator validator;
    validator.operation([low, high](std::string& text) -> std::string {
        double value = 0.0;
        if (CLI::detail::lexical_cast(text, value) && value >= low && value <= high) {
            return "";
        }
        const std::string most =
            std::isfinite(high) ? "from " + readable(low) + " to " + readable(high) : "above 0";
        return "must be a number " + most + ", not " + text;
    });
    return validator;
}

constexpr double least_positive = std::numeric_limits<double>::min();
constexpr double infinite = std::numeric_limits<double>::infinity();

CLI::Validator structure_word() {
    CLI::Validator validator;
    validator.operation([](std::string& text) -> std::string {
        const bool known =
            std::find(structure_names.begin(), structure_names.end(), text) != structure_names.end();
        return known ? "" : "must be direct, massless, implicit or explicit, not " + text;
    });
    return validator;
}

void add_rendering(CLI::App& app, Options& options) {
    const auto group = [](CLI::Option* option) { return option->group("Rendering"); };
    group(app.add_option("--structure", options.structure, "direct, massless, implicit or explicit"))
        ->check(structure_word())
        ->default_str(std::string(name_of(Scheme{}.structure)));
    group(app.add_flag("--compensated", options.scheme.compensated,
                       "Take the coupling's spring out of the model"));
    group(app.add_option("--coupling-stiffness", options.scheme.coupling_stiffness,
                         "K_c, force per position [100 N*m/rad, scaled to the model]"));
    group(app.add_option("--coupling-damping", options.scheme.coupling_damping,
                         "B_c, force per velocity [0.02 N*m*s/rad, scaled]"));
    group(app.add_option("--mass", options.scheme.mass, "m of implicit and explicit [0.001 kg*m^2, scaled]"));
    group(app.add_option("--damping", options.scheme.damping,
                         "B_o of implicit and explicit [0.5 N*m*s/rad, scaled]"));
    group(app.add_option("--play-radius", options.scheme.play_radius,
                         "r of a model with hysteresis [the model's, or 1 % of its travel]"));
}

void add_guards(CLI::App& app, Options& options) {
    const auto group = [](CLI::Option* option) { return option->group("Guards"); };
    group(app.add_option("--force-limit", options.force_limit,
                         "In the model's unit [the device's: 5 N*m, scaled]"));
    group(app.add_option("--slew-s", options.slew_s, "Least time from no force to the limit, 0 = any"))
        ->capture_default_str();
    group(app.add_option("--ramp-s", options.ramp_s, "From no force to all of it at the start"))
        ->capture_default_str();
    group(app.add_option("--largest-speed", options.largest_speed,
                         "Faster than this the encoder jumped [100 rad/s, scaled]"));
    group(app.add_option(
              "--frozen-s", options.frozen_s,
              "A position that stands this long out of full motion is an encoder that died, 0 = never"))
        ->capture_default_str();
    group(app.add_flag("--no-energy-tank", options.no_energy_tank,
                       "Let the rendering give more energy than the model can hold"));
    group(app.add_option("--tolerated-samples", options.loop.tolerated,
                         "Ticks in a row without a sound sample before the run ends"))
        ->capture_default_str();
    group(app.add_option("--lowest-rate-share", options.loop.lowest_rate_share,
                         "Of the rate: less for half a second ends the run, 0 = never"))
        ->check(number_between(0.0, 1.0))
        ->capture_default_str();
}

void add_running(CLI::App& app, Options& options) {
    app.add_option("--device", options.device,
                   "simulated, usb[:SERIAL], or inverse3[:AXIS[@PORT]] with AXIS of x, y, z, -x, -y, -z")
        ->capture_default_str();
    app.add_option("--rate-hz", options.loop.rate_hz, "Ticks a second")
        ->check(number_between(lowest_rate_hz, highest_rate_hz))
        ->capture_default_str();
    app.add_option("--duration-s", options.loop.duration_s, "How long, or inf")
        ->check(number_between(least_positive, infinite))
        ->capture_default_str();
    app.add_option("--record", options.record, "Write every tick to this CSV file; it grows as OUT.csv.part")
        ->type_name("OUT.csv");
    app.add_option("--telemetry-port", options.telemetry_port,
                   "Send JSON lines over UDP to this port of this machine (PlotJuggler: 9870)")
        ->check(number_between(1, 65535));
    app.add_option("--telemetry-hz", options.telemetry_hz, "Lines a second")
        ->check(number_between(0.1, highest_rate_hz))
        ->capture_default_str();
    app.add_flag("--uncertified", options.uncertified,
                 "Render on a USB device without a certificate: nothing proves that it stays stable");
    app.add_option("--wait-ms", options.wait_ms, "How long to wait for a packet of a USB device")
        ->check(number_between(0.1, 10'000.0))
        ->capture_default_str();
    app.add_option("--priority", options.real_time.priority, "Of SCHED_FIFO, 0 = ordinary scheduling")
        ->check(number_between(0, 99))
        ->capture_default_str();
    app.add_option("--cpu", options.real_time.cpu, "Core of the loop, -1 = the last allowed, -2 = any")
        ->check(number_between(-2, 1023))
        ->capture_default_str();
    app.add_flag("--json", options.as_json, "Print the summary as one JSON object");
    app.add_option(
        "--fault", options.faults,
        "For tests, repeatable: KIND@SECONDS or KIND@SECONDSxSAMPLES of late, lost, repeated, nan, frozen, "
        "jump, saturated, gone");
}

}  // namespace

std::optional<int> read_options(int count, char** words, Options& options) {
    CLI::App app{
        "Render a model on a haptic device, tick by tick.\n\n"
        "What is sent, felt and measured can be recorded, and identified and verified like any recording.",
        "palpate-control"};
    app.get_formatter()->column_width(34);
    app.footer(epilogue);
    app.set_version_flag("--version", std::string("palpate-control ") + PALPATE_VERSION);
    app.add_option("MODEL.json", options.model, "A model file, from palpate identify")->required();
    add_running(app, options);
    add_rendering(app, options);
    add_guards(app, options);
    if (count == 1) {
        std::cerr << app.help();
        return 2;
    }
    try {
        app.parse(count, words);
    } catch (const CLI::CallForHelp&) {
        std::cout << app.help();
        return 0;
    } catch (const CLI::CallForVersion& version) {
        std::cout << version.what() << "\n";
        return 0;
    } catch (const CLI::ParseError& error) {
        std::cerr << "error: " << error.what() << " (see palpate-control --help)\n";
        return 2;
    }
    return std::nullopt;
}

}  // namespace palpate::control
