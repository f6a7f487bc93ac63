// SPDX-License-Identifier: Apache-2.0
//
// Renders a detent, identifies the flight record of the rendering, and compares both models.
// 12_flight_record_to_model.py explains each step and does the same in Python.
//
//     c++ -std=c++20 -O2 -I cpp/include examples/12_flight_record_to_model.cpp -o back && ./back
//
// The program calls `palpate identify`, which must be on the PATH.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <stdexcept>
#include <string>

#include "palpate/io/model_file.hpp"
#include "palpate/palpate.hpp"

namespace {

using namespace palpate;
namespace fs = std::filesystem;

/// Writes a rendering as a recording with force steps of 10 mN*m, calls `palpate identify`, and returns the model.
ForceModel identified(const fs::path& folder, const Trace& trace) {
    const std::string recording = (folder / "rendered.csv").string();
    const std::string model = (folder / "again.json").string();
    std::ofstream file{recording};
    file << std::setprecision(17) << "time_s,position_rad,torque_Nm\n";
    for (std::size_t k = 0; k < trace.time.size(); ++k) {
        file << trace.time[k] << ',' << trace.position[k] << ','
             << std::nearbyint(100.0 * trace.applied[k]) / 100.0 << '\n';
    }
    file.close();
    const std::string verb =
        "palpate identify '" + recording + "' --inputs position -o '" + model + "' >/dev/null 2>&1";
    if (std::system(verb.c_str()) != 0) {
        throw std::runtime_error(verb + " failed");
    }
    return load_model_file(model).model;
}

}  // namespace

int main() {
    std::string name = (fs::temp_directory_path() / "palpate-XXXXXX").string();
    const fs::path folder = mkdtemp(name.data());
    const NetworkParameters network{
        .dimension = 1, .alpha = {30.0}, .beta = {0.2}, .weight = {-0.3}, .linear = {2.0}, .bias = 0.0};
    Domain range;
    range.lower = {0.0};
    range.upper = {0.5};
    const ForceModel first{network, range};
    double share = 0.0;
    for (const StructureKind structure : {StructureKind::Massless, StructureKind::Direct}) {
        Scheme scheme;
        scheme.structure = structure;
        const ForceModel second = identified(folder, simulate(first, scheme, DeviceProfile{}, Hand{}, 8000));
        const double lower = std::max(0.0, second.domain().lower[0]);
        const double upper = std::min(0.5, second.domain().upper[0]);
        double difference = 0.0;
        double least = 0.0;
        double most = 0.0;
        for (int k = 0; k <= 2000; ++k) {
            const double position = lower + (upper - lower) * k / 2000;
            const double force = first.network()->at(position, {}).force;
            difference = std::max(difference, std::abs(second.network()->at(position, {}).force - force));
            least = k == 0 ? force : std::min(least, force);
            most = std::max(most, force);
        }
        share = difference / (most - least);
        std::printf("%s: %zu wavelets, largest difference %.4f N*m\n",
                    std::string(name_of(structure)).c_str(), second.parameters().weight.size(), difference);
    }
    std::printf("direct rendering returns the model within %.1f %% of its force range\n", 100.0 * share);
    fs::remove_all(folder);
}
