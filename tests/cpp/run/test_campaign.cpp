// SPDX-License-Identifier: Apache-2.0
// Renders random models on random devices with random hands and faults, in virtual time through the real controller and
// loop, and checks every tick (campaign.hpp, invariants.hpp):
//
//     build/release/tests/cpp/test_campaign --ticks=1e9 [--seed=N]
//
// A failure prints the seed of its scene; --ticks=1 --seed=N repeats this scene alone.
#include "campaign.hpp"

#include <chrono>
#include <cstdint>
#include <iostream>
#include <string>

#include <gtest/gtest.h>

namespace palpate {
namespace {

double wanted_ticks = 300e3 * test::cases(1);
std::uint64_t first_seed = 1;

TEST(Campaign, EveryTickOfRandomScenesKeepsItsPromises) {
    test::Totals totals;
    int failures = 0;
    const auto start = std::chrono::steady_clock::now();
    double next_report = 1e8;
    for (std::uint64_t seed = first_seed; static_cast<double>(totals.ticks) < wanted_ticks && failures < 10;
         ++seed) {
        const std::string broken = test::run_scene(seed, totals);
        if (!broken.empty()) {
            ++failures;
            ADD_FAILURE() << broken << "\nrepeat: test_campaign --ticks=1 --seed=" << seed;
        }
        if (static_cast<double>(totals.ticks) >= next_report) {
            next_report += 1e8;
            std::cout << totals.ticks << " ticks, next seed " << seed + 1 << std::endl;
        }
    }
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    std::cout << totals << seconds.count() << " s\n";
}

}  // namespace
}  // namespace palpate

int main(int count, char** words) {
    testing::InitGoogleTest(&count, words);
    for (int k = 1; k < count; ++k) {
        const std::string word = words[k];
        if (word.rfind("--ticks=", 0) == 0) {
            palpate::wanted_ticks = std::stod(word.substr(8));
        } else if (word.rfind("--seed=", 0) == 0) {
            palpate::first_seed = std::stoull(word.substr(7));
        } else {
            std::cerr << "unknown option " << word << ", must be --ticks=N or --seed=N\n";
            return 2;
        }
    }
    return RUN_ALL_TESTS();
}
