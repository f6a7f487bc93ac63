// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "palpate/run/render.hpp"

namespace palpate::control {

/// Values of the command line options of palpate-control.
struct Options {
    std::string model;
    RenderOptions render;
    bool as_json = false;
};

/// Reads the command line into `options`. After --help, --version or a wrong option prints a text and returns the exit
/// code with which the program must end; otherwise returns nothing.
[[nodiscard]] std::optional<int> read_options(int count, char** arguments, Options& options);

}  // namespace palpate::control
