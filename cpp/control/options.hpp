// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "palpate/guard/guard_settings.hpp"
#include "palpate/io/telemetry.hpp"
#include "palpate/realtime/privileges.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/run/loop.hpp"
#include "palpate/simulation/test_rig.hpp"

namespace palpate::control {

/// What stands on the command line. What is not given follows the model: its unit and its size.
struct Options {
    std::string model;
    std::string device = "simulated";
    LoopSettings loop;
    std::string record;
    bool force = false;  ///< replace an existing recording
    std::optional<std::uint16_t> telemetry_port;
    double telemetry_hz = Telemetry::usual_hz;

    std::optional<std::string> structure;
    SchemeChoices scheme;  ///< but for the structure, which stands above as a word

    std::optional<double> force_limit;
    std::optional<double> largest_speed;
    std::optional<double> slew_s;
    std::optional<std::uint64_t> tolerated;
    bool rate_given = false;
    double ramp_s = GuardSettings{}.ramp_s;
    double frozen_s = GuardSettings{}.frozen_s;
    bool no_energy_tank = false;

    bool uncertified = false;
    std::optional<double> wait_ms;  ///< the device's own where not given

    RealTimeOptions real_time;
    std::vector<std::string> faults;
    bool as_json = false;
};

/// Reads the command line. Where the program is to end at once (help, version, a wrong option) the text has been
/// printed and the exit code is returned.
[[nodiscard]] std::optional<int> read_options(int count, char** words, Options& options);

/// Whether the command line asks for a structure or numbers of its own.
[[nodiscard]] bool chooses_scheme(const Options& options);

/// Whether it asks for anything that the model's plan does not say: then nothing is certified.
[[nodiscard]] bool chooses_rendering(const Options& options);

}  // namespace palpate::control
