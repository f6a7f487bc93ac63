// SPDX-License-Identifier: Apache-2.0
// Searches for muscles that take more energy out of an admittance display than the certificate allows. Three forces for
// each random scene: noise, a sine at the frequency that needs the most damping, and a force against the motion.
//
//     admittance_search [SCENES [SEED]]
//
// Prints the scenes with more energy than allowed at several shares of the certified object damping. Exit code 1 if
// there is one at a share of 1.

#include <cstdio>
#include <cstdlib>
#include <random>

#include "admittance/scenes.hpp"

namespace {

/// Counts of the searched scenes, and of those in which more energy than allowed was taken out.
struct Counts {
    int scenes = 0;
    int taken = 0;
};

Counts search(int scenes, std::uint64_t seed, double share) {
    using palpate::bench::Muscles;
    Counts counts;
    for (int k = 0; k < scenes; ++k) {
        std::mt19937_64 random{seed + static_cast<std::uint64_t>(k)};
        const palpate::bench::Scene scene = palpate::bench::random_scene(random, share);
        bool is_taken = false;
        for (const Muscles muscles : {Muscles::Noise, Muscles::Sine, Muscles::AgainstMotion}) {
            const palpate::bench::Taken taken = palpate::bench::take(scene, muscles, 4000, random);
            is_taken = is_taken || taken.energy > taken.allowed;
        }
        ++counts.scenes;
        counts.taken += is_taken ? 1 : 0;
    }
    return counts;
}

}  // namespace

int main(int argc, char** argv) {
    const int scenes = argc > 1 ? std::atoi(argv[1]) : 10'000;
    const std::uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
    std::printf(
        "| B_o over the certificate | scenes | more energy taken out than allowed |\n|---|---|---|\n");
    int wrong = 0;
    for (const double share : {1.0, 0.97, 0.9, 0.7, 0.5}) {
        const Counts counts = search(share == 1.0 ? scenes : std::max(1, scenes / 10), seed, share);
        std::printf("| %g | %d | %d |\n", share, counts.scenes, counts.taken);
        std::fflush(stdout);
        wrong += share == 1.0 ? counts.taken : 0;
    }
    return wrong > 0 ? 1 : 0;
}
