// SPDX-License-Identifier: Apache-2.0
//
// Example 3: records, identifies and renders a switch, then records and identifies the rendered one.
// 03_there_and_back.py does the same in Python.
//
//     c++ -std=c++20 -O2 -I cpp/include examples/03_there_and_back.cpp -o back && ./back examples/02_click.json
//
// Everything is simulated; the Python file lists the commands for a real switch and knob. The program calls
// `palpate identify`, which must be on the PATH.

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

/// Writes a recording; the force has the 0.1 mN*m steps of a transducer.
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

/// Prints the largest difference between two models along a stroke, over the common part of their domains.
void compare(const char* name, const ForceModel& real, const ForceModel& second, double direction) {
    const double lower = std::max(real.domain().lower[0], second.domain().lower[0]);
    const double upper = std::min(real.domain().upper[0], second.domain().upper[0]);
    double difference = 0.0;
    double largest = 0.0;
    for (int k = 0; k <= 2000; ++k) {
        const double position = lower + (upper - lower) * k / 2000;
        const double force = force_of(real, position, direction);
        difference = std::max(difference, std::abs(force_of(second, position, direction) - force));
        largest = std::max(largest, std::abs(force));
    }
    std::printf("%s: largest difference %.3f N*m of %.2f N*m\n", name, difference, largest);
}

}  // namespace

int main(int count, char** arguments) {
    std::string name = (fs::temp_directory_path() / "palpate-XXXXXX").string();
    const fs::path folder = mkdtemp(name.data());

    // 1. Record the switch of example 2: press and release it four times, slowly, with a 16-bit encoder.
    const ForceModel click = load_model_file(count > 1 ? arguments[1] : "examples/02_click.json").model;
    const double period_s = DeviceProfile{}.period_s;
    TestRig rig = rig_for(click, true, period_s);
    const double lower = click.domain().lower[0];
    const double travel = click.domain().upper[0] - lower;
    const double step = rig.device.encoder_step;
    SchemeChoices direct;
    direct.structure = StructureKind::Direct;
    std::vector<double> position;
    for (int k = 0; k < 8000; ++k) {
        const double motion = lower + travel * (0.5 - 0.5 * std::cos(std::numbers::pi * k * period_s));
        position.push_back(step * std::floor(motion / step + 0.5));
    }
    std::vector<double> force;
    for (const Rendered& row : motion_driven(click, rig.scheme(click, direct), position, period_s)) {
        force.push_back(row.force);
    }
    write(folder / "real.csv", position, force, period_s);

    // 2. Identify a model from the recording.
    const ForceModel real = identify(folder / "real.csv");
    std::printf("identified: %zu wavelets, %s\n", real.parameters().weight.size(),
                real.hysteresis() != nullptr ? "press and release differ" : "one stroke");

    // 3. Render the model on a free knob that a hand moves through the domain. The coupling softens the click.
    rig = rig_for(real, true, period_s);
    const double start = std::clamp(0.0, real.domain().lower[0], real.domain().upper[0]);
    const Trace rendered = simulate(real, rig.scheme(real), rig.device, rig.hand, position.size(), 20, start);
    write(folder / "rendered.csv", rendered.position, rendered.applied, period_s);

    // 4. Identify the recording of the rendered force. 5. Compare the forces of each stroke.
    const ForceModel second = identify(folder / "rendered.csv");
    compare("press", real, second, +1);
    compare("release", real, second, -1);
    fs::remove_all(folder);
}
