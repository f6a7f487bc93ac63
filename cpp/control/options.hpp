// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "palpate/run/render.hpp"

namespace palpate::control {

/// The command line.
struct Options {
    std::string model;
    RenderOptions render;
    bool as_json = false;
};

/// Reads the command line. If the program is to end at once (help, version, a wrong option), the text has been printed
/// and the exit code is returned.
[[nodiscard]] std::optional<int> read_options(int count, char** words, Options& options);

}  // namespace palpate::control
