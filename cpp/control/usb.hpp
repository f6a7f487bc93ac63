// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "options.hpp"
#include "palpate/io/model_file.hpp"
#include "palpate/io/tick_record.hpp"

namespace palpate::control {

/// Whether libusb was at hand when this was built.
[[nodiscard]] bool has_usb() noexcept;

/// Renders on a USB device; returns the exit code. Refuses without libusb.
int run_on_usb(const Options& options, ModelFile file, RecordUnits units);

}  // namespace palpate::control
