// SPDX-License-Identifier: Apache-2.0

// Renders the click of a key switch on a knob. 02_key_switch_click.py explains each step and does the same in
// Python.

//     c++ -std=c++20 -O2 -I cpp/include examples/02_key_switch_click.cpp -o click && ./click

// 02_key_switch_click.json was identified from a measured Cherry MX Blue (ThereminGoat's force curves); 1 mm of the
// key is 0.1 rad of the knob, 1 N is 1 N*m. To render it on a device, run `palpate check-device` first, then:

//     palpate-control examples/02_key_switch_click.json --device usb --uncertified --force-limit 1

#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "palpate/io/model_file.hpp"
#include "palpate/palpate.hpp"

using namespace palpate;

/// Returns the largest drop of a force below its previous maximum, which is felt as a click.
static double largest_drop(const std::vector<double>& force) {
    double maximum = force.front();
    double drop = 0.0;
    for (const double value : force) {
        maximum = std::max(maximum, value);
        drop = std::max(drop, maximum - value);
    }
    return drop;
}

int main() {
    // 1. Load the object. Its press force drops suddenly; its release force rises again at another position.
    const ForceModel click = load_model_file("examples/02_key_switch_click.json").model;
    const double lower = click.domain().lower[0];
    const double upper = click.domain().upper[0];
    std::vector<double> press;
    std::vector<double> release;
    for (int k = 0; k <= 1000; ++k) {
        const double position = lower + (upper - lower) * k / 1000;
        press.push_back(click.hysteresis()->sliding(position, +1).force);
        release.push_back(click.hysteresis()->sliding(position, -1).force);
    }
    std::printf("switch: press force drops by %.3f N*m, release force by %.3f N*m\n", largest_drop(press),
                largest_drop(release));

    // 2. Simulate a knob that is scaled to the model, and a hand that presses for a second.
    const TestRig rig = rig_for(click, true, DeviceProfile{}.period_s);

    // 3. Measure the drop of the rendered force. A mass behind the coupling oscillates.
    double drop = 0.0;
    for (const auto structure : {StructureKind::Implicit, StructureKind::Massless, StructureKind::Direct}) {
        SchemeChoices chosen;
        chosen.structure = structure;
        const Scheme scheme = rig.scheme(click, chosen);
        const Trace rendered = simulate(click, scheme, rig.device, rig.hand, 1000, 20, lower);
        const auto deepest = std::ranges::max_element(rendered.position) - rendered.position.begin();
        drop = largest_drop({rendered.applied.begin(), rendered.applied.begin() + deepest + 1});
        std::printf("%s: press force drops by %.3f N*m\n", std::string{name_of(structure)}.c_str(), drop);
    }
    std::printf("direct rendering keeps %.0f %% of the drop\n", 100.0 * drop / largest_drop(press));
}
