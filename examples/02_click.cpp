// SPDX-License-Identifier: Apache-2.0
//
// Story 2: a knob with the click of a real key switch. The same story is told in 02_click.py.
//
//     c++ -std=c++20 -O2 -I cpp/include examples/02_click.cpp -o click && ./click examples/02_click.json
//
// 02_click.json was identified from a measured Cherry MX Blue (ThereminGoat's force curves); a millimetre of the key is
// 0.1 rad of the knob, and a newton is 1 N*m. To feel it, on a device that `palpate check-device` found fit for it:
//
//     palpate-control examples/02_click.json --device usb --uncertified --force-limit 1

#include <algorithm>
#include <array>
#include <cstdio>
#include <limits>
#include <string>
#include <vector>

#include "palpate/io/model_file.hpp"
#include "palpate/palpate.hpp"

namespace {

/// How far a force falls at most below what it had reached before: a click.
double largest_fall(const std::vector<double>& force) {
    double highest = -std::numeric_limits<double>::infinity();
    double fall = 0.0;
    for (const double value : force) {
        highest = std::max(highest, value);
        fall = std::max(fall, highest - value);
    }
    return fall;
}

}  // namespace

int main(int count, char** words) {
    using namespace palpate;

    // 1. The object. Pressed, its force falls all at once; released, it comes back elsewhere.
    const ForceModel click = load_model_file(count > 1 ? words[1] : "examples/02_click.json").model;
    const double lower = click.domain().lower[0];
    const double upper = click.domain().upper[0];
    std::vector<double> press;
    std::vector<double> release;
    for (int k = 0; k <= 1000; ++k) {
        const double position = lower + (upper - lower) * k / 1000;
        press.push_back(click.hysteresis()->sliding(position, +1).force);
        release.push_back(click.hysteresis()->sliding(position, -1).force);
    }
    std::printf("the switch: the press falls by %.3f N*m, the release by %.3f N*m\n", largest_fall(press),
                largest_fall(release));

    // 2. A knob that suits it, and a hand that presses for a second. Simulated.
    const TestRig rig = rig_for(click, true, DeviceProfile{}.period_s);

    // 3. Is the click still there when the knob renders it? An inertia behind the coupling rings.
    for (const StructureKind structure :
         {StructureKind::Direct, StructureKind::Massless, StructureKind::Implicit}) {
        SchemeChoices chosen;
        chosen.structure = structure;
        const Scheme scheme = rig.scheme(click, chosen);
        const Trace felt = simulate(click, scheme, rig.device, rig.hand, 1000, 20, lower);
        const auto turn = std::max_element(felt.position.begin(), felt.position.end());
        const std::vector<double> pressed(felt.applied.begin(),
                                          felt.applied.begin() + (turn - felt.position.begin()) + 1);
        std::printf("%s: the press falls by %.3f N*m\n",
                    std::string(structure_names[static_cast<std::size_t>(structure)]).c_str(),
                    largest_fall(pressed));
    }
}
