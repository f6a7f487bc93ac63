// SPDX-License-Identifier: Apache-2.0

// Renders a detent, identifies the flight record of the rendering, and compares both models.
// 12_flight_record_to_model.py explains each step and does the same in Python.

//     c++ -std=c++20 -O2 -I cpp/include examples/12_flight_record_to_model.cpp -o back && ./back

// The program calls `palpate identify`, which must be on the PATH.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "palpate/io/model_file.hpp"
#include "palpate/palpate.hpp"

using namespace palpate;

/// Writes a rendering as a recording with force steps of 10 mN*m, calls `palpate identify`, and returns the model.
static ForceModel identified(const std::filesystem::path& folder, const Trace& trace) {
    const std::string recording = folder / "rendered.csv";
    const std::string model = folder / "again.json";
    std::ofstream file{recording};
    file.precision(17);
    file << "time_s,position_rad,torque_Nm\n";
    for (std::size_t k = 0; k < trace.time.size(); ++k) {
        file << trace.time[k] << ',' << trace.position[k] << ','
             << std::nearbyint(100.0 * trace.applied[k]) / 100.0 << '\n';
    }
    file.close();
    const std::string verb =
        "palpate identify --quiet '" + recording + "' --inputs position -o '" + model + "'";
    if (std::system((verb + " >/dev/null").c_str()) != 0) {
        std::exit(EXIT_FAILURE);  // palpate has printed the reason
    }
    return load_model_file(model).model;
}

int main() {
    std::string name = std::filesystem::temp_directory_path() / "palpate-XXXXXX";
    const std::filesystem::path folder = mkdtemp(name.data());
    const NetworkParameters detent{.alpha = {30.0}, .beta = {0.2}, .weight = {-0.3}, .linear = {2.0}};
    const ForceModel first{detent, {.lower = {0.0}, .upper = {0.5}}};
    double share = 0.0;
    for (const auto structure : {StructureKind::Massless, StructureKind::Direct}) {
        const Scheme scheme{.structure = structure};
        const ForceModel second = identified(folder, simulate(first, scheme, DeviceProfile{}, Hand{}, 8000));
        const double lower = std::max(0.0, second.domain().lower[0]);
        const double upper = std::min(0.5, second.domain().upper[0]);
        double difference = 0.0;
        std::vector<double> force;
        for (int k = 0; k <= 2000; ++k) {
            const double x = lower + (upper - lower) * k / 2000;
            force.push_back(first.network()->at(x, {}).force);
            difference = std::max(difference, std::abs(second.network()->at(x, {}).force - force.back()));
        }
        share = difference / (std::ranges::max(force) - std::ranges::min(force));
        std::printf("%s: %zu wavelets, largest difference %.4f N*m\n",
                    std::string{name_of(structure)}.c_str(), second.parameters().weight.size(), difference);
    }
    std::printf("direct rendering returns the model within %.1f %% of its force range\n", 100.0 * share);
    std::filesystem::remove_all(folder);
}
