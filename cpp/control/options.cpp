// SPDX-License-Identifier: Apache-2.0
#include "options.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iostream>
#include <limits>
#include <memory>
#include <sstream>
#include <string>
#include <string_view>

#include <CLI/CLI.hpp>

#include "palpate/device/device_profile.hpp"
#include "palpate/fields/readable.hpp"
#include "palpate/run/transports.hpp"
#include "palpate/version.hpp"

namespace palpate::control {

namespace {

constexpr const char* epilogue =
    "Ctrl-C ends a run normally. Exit code: 0 the duration ended, or Ctrl-C;\n"
    "1 a guard, a fault of the device or a low rate ended the run;\n"
    "2 the run was refused before the device moved.\n\n"
    "[...]: default value. \"scaled\": multiplied by the model's travel and force,\n"
    "relative to those of the default knob.\n\n"
    "Example: palpate-control press.json --duration-s 10 --record felt.csv";

constexpr double least_positive = std::numeric_limits<double>::min();
constexpr double infinite = std::numeric_limits<double>::infinity();

/// Returns a check that the value of an option is a number from `low` to `high`. The error message of the check states
/// the allowed values.
CLI::Validator number_between(double low, double high) {
    CLI::Validator validator;
    validator.operation([low, high](std::string& text) -> std::string {
        double value = 0.0;
        if (CLI::detail::lexical_cast(text, value) && value >= low && value <= high) {
            return "";
        }
        const std::string within = std::isfinite(high) ? "from " + readable(low) + " to " + readable(high)
                                   : low > 0.0         ? "above 0"
                                                       : "of " + readable(low) + " or more";
        return "must be a number " + within + ", not " + text;
    });
    return validator;
}

CLI::Validator positive() {
    return number_between(least_positive, infinite);
}

CLI::Validator not_negative() {
    return number_between(0.0, infinite);
}

CLI::Validator structure_word() {
    CLI::Validator validator;
    validator.operation([](std::string& text) -> std::string {
        const bool known =
            std::find(structure_names.begin(), structure_names.end(), text) != structure_names.end();
        return known ? "" : "must be one of " + either(structure_names) + ", not " + text;
    });
    return validator;
}

/// Formats the help text for a terminal of 80 columns; shows NUMBER instead of type names such as FLOAT.
class Help : public CLI::Formatter {
  public:
    Help() {
        column_width(options_width);
        for (const char* type : {"FLOAT", "INT", "UINT"}) {
            label(type, "NUMBER");
        }
    }

    std::string make_option_desc(const CLI::Option* option) const override {
        std::istringstream arguments{option->get_description()};
        std::string text;
        std::size_t line = 0;
        for (std::string word; arguments >> word;) {
            const bool fits = line + 1 + word.size() <= 80 - options_width;
            text += (text.empty() ? "" : fits ? " " : "\n") + word;
            line = fits ? line + 1 + word.size() : word.size();
        }
        return text;
    }

  private:
    static constexpr std::size_t options_width = 34;
};

void add_rendering(CLI::App& app, RenderOptions& options) {
    const auto group = [](CLI::Option* option) { return option->group("Rendering"); };
    SchemeChoices& scheme = options.scheme;
    const Scheme usual;
    const auto scaled = [](double value, const char* unit) {
        return " [" + readable(value) + " " + unit + ", scaled]";
    };
    group(app.add_option_function<std::string>(
              "--structure",
              [&scheme](const std::string& name) {
                  scheme.structure = named<StructureKind>(name, "structure");
              },
              "Structure, one of " + either(structure_names)))
        ->check(structure_word())
        ->type_name("NAME")
        ->default_str(std::string(name_of(Scheme{}.structure)));
    group(
        app.add_flag("--compensated", scheme.compensated,
                     "Make the model stiffer, so that model and coupling in series give the recorded force"));
    group(app.add_option(
              "--coupling-stiffness", scheme.coupling_stiffness,
              "Coupling stiffness K_c, force per position" + scaled(usual.coupling.stiffness, "N*m/rad")))
        ->check(positive());
    group(app.add_option(
              "--coupling-damping", scheme.coupling_damping,
              "Coupling damping B_c, force per velocity" + scaled(usual.coupling.damping, "N*m*s/rad")))
        ->check(not_negative());
    group(app.add_option("--mass", scheme.mass,
                         "Object mass, for structures with mass" + scaled(usual.inertia.mass, "kg*m^2")))
        ->check(positive());
    group(app.add_option(
              "--object-damping", scheme.object_damping,
              "Object damping, for structures with mass" + scaled(usual.inertia.damping, "N*m*s/rad")))
        ->check(not_negative());
    group(app.add_option("--play-radius", scheme.play_radius,
                         "Play radius r of a model with hysteresis [the model's, or 1 % of its travel]"))
        ->check(positive());
    group(
        app.add_option("--predict", scheme.predict,
                       "Samples that predict the position half a period ahead, direct structure only; 0 = no "
                       "prediction"))
        ->check(CLI::Range(0, most_prediction_taps))
        ->type_name("M")
        ->default_str(std::to_string(usual.predict));
}

void add_guards(CLI::App& app, RenderOptions& options) {
    const auto group = [](CLI::Option* option) { return option->group("Guards"); };
    group(app.add_option("--force-limit", options.force_limit,
                         "Largest force, in the model's unit [the device's: " +
                             readable(DeviceProfile{}.force_limit) + " N*m, scaled]"))
        ->check(positive());
    group(app.add_option(
              "--slew-s", options.slew_s,
              "Least time in s in which the force may rise from zero to the force limit, 0 = no slew limit"))
        ->check(not_negative())
        ->default_str(readable(GuardSettings{}.slew_s));
    group(app.add_option("--ramp-s", options.ramp_s,
                         "Time in s in which the force rises from zero to full force after the start"))
        ->check(not_negative())
        ->capture_default_str();
    group(app.add_option("--largest-speed", options.largest_speed,
                         "Largest speed of the handle; a faster motion counts as an encoder fault [" +
                             readable(GuardSettings{}.largest_speed) + " rad/s, scaled]"))
        ->check(positive());
    group(app.add_option(
              "--frozen-s", options.frozen_s,
              "Longest time in s without motion after a sudden stop; a longer time counts as an encoder "
              "fault, 0 = no check"))
        ->check(not_negative())
        ->capture_default_str();
    group(app.add_flag("!--no-energy-account", options.energy_account,
                       "Do not limit the energy that a hand can take out"));
    group(app.add_option("--tolerated-samples", options.tolerated,
                         "Consecutive ticks without a valid sample that are tolerated"))
        ->check(number_between(0, 1e6))
        ->default_str(std::to_string(LoopSettings{}.tolerated));
    group(
        app.add_option("--lowest-rate-share", options.loop.lowest_rate_share,
                       "Least share of --rate-hz; a lower rate for half a second ends the run, 0 = no limit"))
        ->check(number_between(0.0, 1.0))
        ->capture_default_str();
}

void add_running(CLI::App& app, RenderOptions& options) {
    app.add_option("--device", options.device, transport_help(false))
        ->type_name("NAME")
        ->capture_default_str();
    app.add_option("--rate-hz", options.loop.rate_hz, "Ticks of the control loop a second")
        ->check(number_between(lowest_rate_hz, highest_rate_hz))
        ->capture_default_str();
    app.add_option("--duration-s", options.loop.duration_s, "Duration of the run in s, or inf")
        ->check(positive())
        ->capture_default_str();
    app.add_option("--record", options.record, "Write every tick to this CSV file; it grows as OUT.csv.part")
        ->type_name("OUT.csv");
    app.add_flag("--force", options.force, "Replace an existing recording");
    app.add_option("--telemetry-port", options.telemetry_port,
                   "Send ticks as JSON lines over UDP to this port of this machine (PlotJuggler: 9870)")
        ->check(number_between(1, 65535));
    app.add_option("--telemetry-hz", options.telemetry_hz, "Telemetry lines a second")
        ->check(number_between(0.1, highest_rate_hz))
        ->capture_default_str();
    app.add_flag("--uncertified", options.uncertified,
                 "Render without a valid certificate; stability is not proved");
    app.add_flag("--accept-model", options.accept_model, "Render the model although its verdict is no");
    app.add_option_function<double>(
           "--wait-ms", [&options](double wait_ms) { options.wait_s = 1e-3 * wait_ms; },
           "Longest wait in ms for the device [" + transport_waits() + "]")
        ->check(number_between(0.1, 10'000.0));
    app.add_option("--priority", options.real_time.priority,
                   "Real-time priority (SCHED_FIFO) of the loop, 0 = ordinary scheduling")
        ->check(number_between(0, 99))
        ->capture_default_str();
    app.add_option("--cpu", options.real_time.cpu,
                   "Processor core of the loop, -1 = the last allowed core, -2 = any core")
        ->check(number_between(-2, 1023))
        ->capture_default_str();
    app.add_option(
           "--fault", options.faults,
           "Simulated fault for tests, repeatable: KIND@SECONDS or KIND@SECONDSxSAMPLES, with KIND one of "
           "late, lost, repeated, nan, frozen, jump, saturated, gone")
        ->type_name("FAULT");
}

/// Returns the error message of palpate-control for an error that CLI11 found in the command line.
std::string sentence_of(const CLI::ParseError& error) {
    const std::string message = error.what();
    if (error.get_name() == "ArgumentMismatch") {
        return message.substr(0, message.find(':')) + " needs a value";
    }
    if (error.get_name() == "ConversionError") {  // CLI11's message: "Could not convert: --cpu = 0.5"
        const std::size_t name = message.find("--");
        const std::size_t value = message.find(" = ", name);
        if (value != std::string::npos) {
            return message.substr(name, value - name) + ": must be a whole number, not " +
                   message.substr(value + 3);
        }
    }
    return message;
}

}  // namespace

std::optional<int> read_options(int count, char** arguments, Options& options) {
    CLI::App app{
        "Render a model on a haptic device, tick by tick.\n\n"
        "A rendering can be recorded with --record; 'palpate identify' and 'palpate verify' read the "
        "recording.",
        "palpate-control"};
    app.formatter(std::make_shared<Help>());
    app.footer(epilogue);
    app.set_version_flag("--version", std::string("palpate-control ") + library_version);
    app.add_option("MODEL.json", options.model, "Model file, written by palpate identify")
        ->type_name("FILE")
        ->required();
    add_running(app, options.render);
    app.add_flag("--json", options.as_json, "Print the summary as one JSON object");
    add_rendering(app, options.render);
    add_guards(app, options.render);
    if (count == 1) {
        std::cerr << app.help();
        return 2;
    }
    try {
        app.parse(count, arguments);
        options.render.rate_given = app.count("--rate-hz") > 0;
        options.render.created_by = std::string("palpate-control ") + library_version;
    } catch (const CLI::CallForHelp&) {
        std::cout << app.help();
        return 0;
    } catch (const CLI::CallForVersion& version) {
        std::cout << version.what() << "\n";
        return 0;
    } catch (const CLI::ParseError& error) {
        std::cerr << "error: " << sentence_of(error) << " (see palpate-control --help)\n";
        return 2;
    }
    return std::nullopt;
}

}  // namespace palpate::control
