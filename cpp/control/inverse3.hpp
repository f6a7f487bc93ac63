// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "options.hpp"
#include "palpate/io/model_file.hpp"
#include "palpate/io/tick_record.hpp"

namespace palpate::control {

/// Renders on a Haply Inverse3; returns the exit code. Without Boost at hand when this was built it refuses.
int run_on_inverse3(const Options& options, ModelFile file, RecordUnits units);

}  // namespace palpate::control
