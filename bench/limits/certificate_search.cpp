// SPDX-License-Identifier: Apache-2.0
// Searches motions that take energy out, for each inequality of the certificate. Prints the largest damping or
// friction at which such a motion exists, divided by the certified value; one row for each inequality and delay.
//
//     certificate_search [scenes of each inequality] [part of an inequality's name]

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "energy_search/all_lines.hpp"

int main(int count, char** words) {
    using namespace palpate::energy_search;
    const std::size_t scenes = count > 1 ? static_cast<std::size_t>(std::atoi(words[1])) : 100;
    const std::string only = count > 2 ? words[2] : "";
    std::printf("%-17s %-32s %5s %7s %8s %8s %10s %9s %6s\n", "line", "scenes", "delay", "number", "median",
                "worst", "at 0.95", "violated", "s");
    std::size_t violated = 0;
    for (const Line& line : all_lines()) {
        if (line.name.find(only) == std::string::npos) {
            continue;
        }
        const auto start = std::chrono::steady_clock::now();
        std::vector<double> measured;
        std::size_t failures = 0;
        std::size_t violations = 0;
        for (std::size_t index = 0; index < scenes; ++index) {
            const Trial trial = scene_of(line, index);
            const auto fails = [&](double factor) { return line.fails(trial, factor); };
            if (fails(1.0 + 1e-9)) {
                ++violations;
                std::printf("scene %zu gives energy: %s\n", index, trial.text.c_str());
            }
            failures += fails(0.95) ? 1 : 0;
            measured.push_back(largest_violating(fails, 0.05, 1.0 + 1e-9, 0.001));
        }
        std::sort(measured.begin(), measured.end());
        const double seconds =
            std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        std::printf("%-17s %-32s %5.2f %7zu %8.3f %8.3f %6zu%s %9zu %6.1f\n", line.id.c_str(),
                    line.name.c_str(), line.delay, scenes, measured.at(scenes / 2), measured.back(), failures,
                    line.tight ? " (t)" : "    ", violations, seconds);
        std::fflush(stdout);
        violated += violations;
    }
    std::printf("%zu give energy\n", violated);
    return violated == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
