// SPDX-License-Identifier: Apache-2.0
// Searches for muscles that take more energy out of an admittance display than the certificate allows. Three forces for
// each random scene: noise, a sine at the frequency that needs the most damping, and a force against the motion.
//
//     admittance_search [SCENES [SEED]]
//
// Prints the scenes with more energy than allowed at several shares of the certified object damping, and the largest
// share at which a scene gives more energy than allowed: measured over certified damping. Exit code 1 if there is one
// at a share of 1.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "admittance/scenes.hpp"

namespace {

using palpate::bench::Muscles;

constexpr Muscles forces[]{Muscles::Noise, Muscles::Sine, Muscles::AgainstMotion};

/// Returns true if one of the forces takes more energy out of the scene of a seed than the certificate allows, with
/// `share` times the certified damping.
bool gives_energy(std::uint64_t seed, double share) {
    std::mt19937_64 random{seed};
    const palpate::bench::Scene scene = palpate::bench::random_scene(random, share);
    return std::any_of(std::begin(forces), std::end(forces), [&](Muscles muscles) {
        const palpate::bench::Taken taken = palpate::bench::take(scene, muscles, 4000, random);
        return taken.energy > taken.allowed;
    });
}

/// Returns the largest share of the certified damping at which a scene gives energy, in steps of 1/32; 0: none.
double largest_share(std::uint64_t seed) {
    constexpr int steps = 32;
    for (int k = steps; k > 0; --k) {
        if (gives_energy(seed, static_cast<double>(k) / steps)) {
            return static_cast<double>(k) / steps;
        }
    }
    return 0.0;
}

/// Prints median and maximum of the largest share by structure, servo and delay.
void print_measured(int scenes, std::uint64_t seed) {
    constexpr const char* delays[]{"0", "0 to 1", "1", "1 to 2", "2"};
    std::map<std::pair<std::string, std::string>, std::vector<double>> found;
    for (int k = 0; k < scenes; ++k) {
        std::mt19937_64 random{seed + static_cast<std::uint64_t>(k)};
        const palpate::bench::Scene scene = palpate::bench::random_scene(random, 1.0);
        const palpate::AdmittanceDisplay& display = *scene.device.admittance;
        const bool limited = display.rate_limit || display.position_step > 0.0;
        const char* servo = !display.servo_bandwidth_hz ? "no lag"
                            : display.servo_damping     ? "second order"
                                                        : "first order";
        const std::string row = limited ? std::string{"all with rate limit or steps"}
                                        : std::string{palpate::name_of(scene.structure)} + ", " + servo;
        const int whole = scene.device.whole_delay_samples();
        const bool between = scene.device.delay_fraction() > 0.0;
        found[{row, delays[2 * whole + (between ? 1 : 0)]}].push_back(
            largest_share(seed + static_cast<std::uint64_t>(k)));
    }
    std::vector<std::string> rows;
    for (const auto& [key, shares] : found) {
        if (rows.empty() || rows.back() != key.first) {
            rows.push_back(key.first);
        }
    }
    std::printf("| structure, servo |");
    for (const char* delay : delays) {
        std::printf(" delay %s |", delay);
    }
    std::printf("\n| --- | ---: | ---: | ---: | ---: | ---: |\n");
    for (const std::string& row : rows) {
        std::printf("| %s |", row.c_str());
        for (const char* delay : delays) {
            std::vector<double>& shares = found[{row, delay}];
            std::sort(shares.begin(), shares.end());
            shares.empty() ? std::printf(" – |")
                           : std::printf(" %.2f / %.2f |", shares[shares.size() / 2], shares.back());
        }
        std::printf("\n");
    }
}

}  // namespace

int main(int argc, char** argv) {
    const int scenes = argc > 1 ? std::atoi(argv[1]) : 10'000;
    const std::uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
    std::printf(
        "| B_o over the certificate | scenes | more energy taken out than allowed |\n| ---: | ---: | ---: "
        "|\n");
    int wrong = 0;
    for (const double share : {1.0, 0.97, 0.9, 0.7, 0.5}) {
        const int searched = share == 1.0 ? scenes : std::max(1, scenes / 10);
        int taken = 0;
        for (int k = 0; k < searched; ++k) {
            taken += gives_energy(seed + static_cast<std::uint64_t>(k), share) ? 1 : 0;
        }
        std::printf("| %g | %d | %d |\n", share, searched, taken);
        std::fflush(stdout);
        wrong += share == 1.0 ? taken : 0;
    }
    std::printf("\n");
    print_measured(std::max(1, scenes / 10), seed);
    return wrong > 0 ? 1 : 0;
}
