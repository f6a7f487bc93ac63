// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "palpate/run/render.hpp"

namespace palpate::control {

/// Values of the command line.
struct Options {
    std::string model;
    RenderOptions render;
    bool as_json = false;
};

/// Reads the command line. Returns the exit code if the program must end at once (help, version, a wrong option); the
/// text is then already printed.
[[nodiscard]] std::optional<int> read_options(int count, char** arguments, Options& options);

}  // namespace palpate::control
