// SPDX-License-Identifier: Apache-2.0
// Takes the place of usb.cpp where libusb was not found.
#include "rendering.hpp"
#include "usb.hpp"

namespace palpate::control {

bool has_usb() noexcept {
    return false;
}

int run_on_usb(const Options& options, ModelFile /*file*/, RecordUnits /*units*/) {
    refuse("--device " + options.device +
           ": palpate-control was built without libusb; install libusb-1.0-0-dev and build it again");
}

}  // namespace palpate::control
