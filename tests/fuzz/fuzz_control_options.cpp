// SPDX-License-Identifier: Apache-2.0
// The command line of palpate-control: one argument in each line of the input. The arguments are refused with exit code
// 2, print the help (exit code 0), or give options within their bounds. Nothing is opened.
#include <cmath>
#include <iostream>
#include <optional>
#include <stdexcept>
#include <streambuf>
#include <string>
#include <vector>

#include "control/options.hpp"
#include "fuzzing.hpp"
#include "palpate/simulation/faulty_device.hpp"

namespace palpate::fuzz {
namespace {

/// Discards the help and the messages.
class Silence : public std::streambuf {
    int overflow(int letter) override { return letter; }
};

std::vector<std::string> lines_of(std::string_view text) {
    std::vector<std::string> lines{"palpate-control"};
    for (std::size_t begin = 0; begin < text.size();) {
        const std::size_t end = std::min(text.find('\n', begin), text.size());
        std::string line{text.substr(begin, end - begin)};
        lines.push_back(line.substr(0, line.find('\0')));  // an argument ends at its first NUL
        begin = end + 1;
    }
    return lines;
}

void check(const RenderOptions& options) {
    const auto positive = [](const auto& value) { return !value || *value > 0.0; };
    require(options.loop.rate_hz >= lowest_rate_hz && options.loop.rate_hz <= highest_rate_hz,
            "the rate is within its bounds");
    require(options.loop.duration_s > 0.0, "the duration is > 0");
    require(positive(options.force_limit) && positive(options.largest_speed) &&
                positive(options.scheme.coupling_stiffness) && positive(options.scheme.mass) &&
                positive(options.scheme.play_radius) && positive(options.wait_s),
            "limits are > 0");
    require(options.ramp_s >= 0.0 && options.frozen_s >= 0.0 && options.slew_s.value_or(0.0) >= 0.0,
            "times are >= 0");
    require(options.loop.lowest_rate_share >= 0.0 && options.loop.lowest_rate_share <= 1.0,
            "the lowest share of the rate is within its bounds");
    require(options.telemetry_port.value_or(1) > 0 && options.telemetry_hz >= 0.1,
            "the telemetry is within its bounds");
    for (const std::string& fault : options.faults) {
        try {
            require(parse_fault(fault, 1e-3).samples > 0, "a fault lasts for a sample");
        } catch (const std::invalid_argument&) {  // refused when the device is opened
        }
    }
}

}  // namespace
}  // namespace palpate::fuzz

FUZZ_TARGET(control_options) {
    using namespace palpate;
    static fuzz::Silence silence;
    std::cout.rdbuf(&silence);
    std::cerr.rdbuf(&silence);
    fuzz::Input input{data, size};
    std::vector<std::string> lines = fuzz::lines_of(input.take_text());
    std::vector<char*> arguments;
    for (std::string& line : lines) {
        arguments.push_back(line.data());
    }
    arguments.push_back(nullptr);
    control::Options options;
    const std::optional<int> code =
        control::read_options(static_cast<int>(lines.size()), arguments.data(), options);
    fuzz::require(!code || *code == 0 || *code == 2, "the exit code is 0 or 2");
    if (!code) {
        fuzz::check(options.render);
    }
    return 0;
}
