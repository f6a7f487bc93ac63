// SPDX-License-Identifier: Apache-2.0
// Renders random models on random devices with random hands and faults, in virtual time through the real controller and
// loop, and checks every tick (campaign.hpp, invariants.hpp):
//
//     PALPATE_TEST_SCALE=3400 build/release/tests/cpp/test_run --gtest_filter=Campaign.*
//
// renders 1e9 ticks. A failure prints the seed of its scene; PALPATE_CAMPAIGN_SEED=N repeats this scene alone.
#include "campaign.hpp"

#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <string>

#include <gtest/gtest.h>

namespace palpate {
namespace {

TEST(Campaign, EveryTickOfRandomScenesKeepsItsPromises) {
    const char* alone = std::getenv("PALPATE_CAMPAIGN_SEED");
    const std::uint64_t first_seed = alone == nullptr ? 1 : std::stoull(alone);
    const double wanted_ticks = alone == nullptr ? 300e3 * test::cases(1) : 1.0;
    test::Totals totals;
    int failures = 0;
    const auto start = std::chrono::steady_clock::now();
    double next_report = 1e8;
    for (std::uint64_t seed = first_seed; static_cast<double>(totals.ticks) < wanted_ticks && failures < 10;
         ++seed) {
        const std::string broken = test::run_scene(seed, totals);
        if (!broken.empty()) {
            ++failures;
            ADD_FAILURE() << broken << "\nrepeat: PALPATE_CAMPAIGN_SEED=" << seed;
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
