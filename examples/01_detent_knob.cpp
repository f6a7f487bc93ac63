// SPDX-License-Identifier: Apache-2.0
//
// Renders a detent with five structures. 01_detent_knob.py explains each step and does the same in Python.
//
//     c++ -std=c++20 -O2 -I cpp/include examples/01_detent_knob.cpp -o detent && ./detent

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <utility>

#include "palpate/palpate.hpp"

int main() {
    using namespace palpate;

    // 1. Define the object: a soft spring of 2 N*m/rad with a detent at 0.2 rad, as a network with one wavelet.
    const NetworkParameters network{
        .dimension = 1, .alpha = {30.0}, .beta = {0.2}, .weight = {-0.3}, .linear = {2.0}, .bias = 0.0};
    Domain range;
    range.lower = {0.0};
    range.upper = {0.5};
    const ForceModel detent{network, range};
    const WaveletNetwork object{network, range};

    // 2. Choose a simulated device and hand: a knob with a 16-bit encoder at 1 kHz, moved through the detent.
    const DeviceProfile device;
    const Hand hand;

    // 3. List the structures, from direct rendering to the explicit one, which the paper uses.
    Scheme direct;
    Scheme compensated;
    Scheme massless;
    Scheme implicit;
    Scheme explicit_one;
    direct.structure = StructureKind::Direct;
    compensated.structure = StructureKind::Massless;
    compensated.compensated = true;
    compensated.coupling.damping = 0.005;
    massless.structure = StructureKind::Massless;
    implicit.structure = StructureKind::Implicit;
    explicit_one.structure = StructureKind::Explicit;
    const std::array<std::pair<const char*, Scheme>, 5> schemes{{{"direct", direct},
                                                                 {"massless, compensated", compensated},
                                                                 {"massless", massless},
                                                                 {"implicit", implicit},
                                                                 {"explicit", explicit_one}}};

    // 4. Render the object with each structure for four seconds and print the force error at the handle.
    double first = 0.0;
    double last = 0.0;
    for (const auto& [name, scheme] : schemes) {
        const Trace trace = simulate(detent, scheme, device, hand, 4000);
        double sum = 0.0;
        for (std::size_t k = 0; k < trace.force.size(); ++k) {
            const double error = trace.applied[k] - object.at(trace.handle_end[k], {}).force;
            sum += error * error;
        }
        last = std::sqrt(sum / static_cast<double>(trace.force.size()));
        first = first > 0.0 ? first : last;
        std::printf("%-22s force error %.5f N*m RMS\n", name, last);
    }
    std::printf("the error of explicit is %.0f times that of direct\n", last / first);
}
