// SPDX-License-Identifier: Apache-2.0
// Searches random scenes of a compensated cogging for motions that take energy out, with the largest certified scale and
// with 1.2 times this scale.
#include <cstdint>
#include <cstdlib>
#include <iostream>

#include "cogging_scenes.hpp"

int main(int count, char** arguments) {
    using namespace palpate;
    const int scenes = count > 1 ? std::atoi(arguments[1]) : 10'000;
    constexpr double rounding = 1e-9;
    int violations = 0;
    std::cout << "delay  scenes  energy found at the certified scale, at 1.2 times this scale\n";
    for (int delay = 0; delay <= 2; ++delay) {
        int found = 0;
        int found_above = 0;
        const int number = scenes / 3 + 1;
        for (int k = 0; k < number; ++k) {
            test::Random random{static_cast<std::uint64_t>(k) * 7919 + static_cast<std::uint64_t>(delay)};
            const bench::CoggingScene scene = bench::random_cogging_scene(random, delay);
            test::Random same = random;
            found += bench::search_compensation(scene, random, scene.scale) > rounding ? 1 : 0;
            found_above += bench::search_compensation(scene, same, 1.2 * scene.scale) > rounding ? 1 : 0;
        }
        violations += found;
        std::cout << delay << "  " << number << "  " << found << "  " << found_above << std::endl;
    }
    return violations == 0 ? 0 : 1;
}
