// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "palpate/io/model_file.hpp"

namespace palpate::control {

/// Why a model may not move a real device: empty where its certificate holds. The one place that decides.
[[nodiscard]] inline std::string not_certified(const ModelFile& /*file*/) {
    return "has no certificate";
}

}  // namespace palpate::control
