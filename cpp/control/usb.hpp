// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "options.hpp"
#include "palpate/io/model_file.hpp"
#include "palpate/io/tick_record.hpp"

namespace palpate::control {

/// Renders on a USB device; returns the exit code. Without libusb at hand when this was built it refuses.
int run_on_usb(const Options& options, ModelFile file, RecordUnits units);

}  // namespace palpate::control
