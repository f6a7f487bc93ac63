// SPDX-License-Identifier: Apache-2.0
// Takes the place of inverse3.cpp where Boost was not found.
#include "inverse3.hpp"
#include "rendering.hpp"

namespace palpate::control {

int run_on_inverse3(const Options& options, ModelFile /*file*/, RecordUnits /*units*/) {
    refuse("--device " + options.device +
           ": palpate-control was built without Boost; install libboost-dev and build it again");
}

}  // namespace palpate::control
