// SPDX-License-Identifier: Apache-2.0
//
// Story 3: a switch is recorded, identified, rendered, recorded again. Also told in 03_there_and_back.py.
//
//     c++ -std=c++20 -O2 -I cpp/include examples/03_there_and_back.cpp -o back && ./back examples/02_click.json
//
// Everything here is simulated; the text of the Python file has the commands for a real switch on a real knob.
// Identification is the verb `palpate identify`, which must be on the PATH.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "palpate/io/model_file.hpp"
#include "palpate/palpate.hpp"

namespace {

using namespace palpate;
namespace fs = std::filesystem;

/// Writes a recording as a transducer reads it, in steps of 0.1 mN*m.
void write(const fs::path& recording, const std::vector<double>& position, const std::vector<double>& force,
           double period_s) {
    std::ofstream file{recording};
    file << std::setprecision(17) << "time_s,position_rad,torque_Nm\n";
    for (std::size_t k = 0; k < position.size(); ++k) {
        file << static_cast<double>(k) * period_s << "," << position[k] << ","
             << std::nearbyint(1e4 * force[k]) / 1e4 << "\n";
    }
}

ForceModel identify(const fs::path& recording) {
    const std::string model = fs::path{recording}.replace_extension(".json").string();
    const std::string verb =
        "palpate identify '" + recording.string() + "' -o '" + model + "' >/dev/null 2>&1";
    if (std::system(verb.c_str()) != 0) {
        throw std::runtime_error(verb + " failed");
    }
    return load_model_file(model).model;
}

double force_of(const ForceModel& model, double position, double direction) {
    return model.hysteresis() != nullptr ? model.hysteresis()->sliding(position, direction).force
                                         : model.network()->at(position, {}).force;
}

/// The largest difference between two models along a stroke, over the positions that both know.
void compare(const char* name, const ForceModel& real, const ForceModel& again, double direction) {
    const double lower = std::max(real.domain().lower[0], again.domain().lower[0]);
    const double upper = std::min(real.domain().upper[0], again.domain().upper[0]);
    double difference = 0.0;
    double largest = 0.0;
    for (int k = 0; k <= 2000; ++k) {
        const double position = lower + (upper - lower) * k / 2000;
        const double force = force_of(real, position, direction);
        difference = std::max(difference, std::abs(force_of(again, position, direction) - force));
        largest = std::max(largest, std::abs(force));
    }
    std::printf("%s: %.3f N*m apart, of %.2f N*m\n", name, difference, largest);
}

}  // namespace

int main(int count, char** words) {
    std::string made = (fs::temp_directory_path() / "palpate-XXXXXX").string();
    const fs::path folder = mkdtemp(made.data());

    // 1. Obtain data: the switch of story 2 is pressed and let go four times, slowly, under a 16-bit encoder.
    const ForceModel click = load_model_file(count > 1 ? words[1] : "examples/02_click.json").model;
    const double period_s = DeviceProfile{}.period_s;
    TestRig rig = rig_for(click, true, period_s);
    const double lower = click.domain().lower[0];
    const double travel = click.domain().upper[0] - lower;
    const double step = rig.device.encoder_step;
    SchemeChoices direct;
    direct.structure = StructureKind::Direct;
    std::vector<double> position;
    for (int k = 0; k < 8000; ++k) {
        const double pressed = lower + travel * (0.5 - 0.5 * std::cos(std::numbers::pi * k * period_s));
        position.push_back(step * std::floor(pressed / step + 0.5));
    }
    std::vector<double> force;
    for (const Rendered& felt : motion_driven(click, rig.scheme(click, direct), position, period_s)) {
        force.push_back(felt.force);
    }
    write(folder / "real.csv", position, force, period_s);

    // 2. Identify.
    const ForceModel real = identify(folder / "real.csv");
    std::printf("identified: %zu wavelets, %s\n", real.parameters().weight.size(),
                real.hysteresis() != nullptr ? "press and release differ" : "one stroke");

    // 3. Implement: rendered by a knob with nothing on it, in a hand that sweeps. The coupling softens the click.
    rig = rig_for(real, true, period_s);
    const double start = std::clamp(0.0, real.domain().lower[0], real.domain().upper[0]);
    const Trace rendered = simulate(real, rig.scheme(real), rig.device, rig.hand, position.size(), 20, start);
    write(folder / "rendered.csv", rendered.position, rendered.applied, period_s);

    // 4. Once more, from what was felt. 5. Compare: the largest difference, stroke by stroke.
    const ForceModel again = identify(folder / "rendered.csv");
    compare("press", real, again, +1);
    compare("release", real, again, -1);
    fs::remove_all(folder);
}
