// SPDX-License-Identifier: Apache-2.0
// Searches motions that take energy out of a compensated cogging: none at the largest certified scale.
#include "limits/cogging_scenes.hpp"

#include <cstdint>

#include <gtest/gtest.h>

namespace palpate::bench {
namespace {

constexpr double rounding_error = 1e-9;

TEST(CoggingSearch, TakesNoEnergyAtTheCertifiedScaleAndSomeAbove) {
    int found_above = 0;
    for (int k = 0; k < test::cases(6); ++k) {
        test::Random random{static_cast<std::uint64_t>(k)};
        const CoggingScene scene = random_cogging_scene(random, k % 3);
        EXPECT_GT(scene.scale, 0.05);
        EXPECT_LT(scene.scale, 0.95);
        EXPECT_FALSE(scene.is_certified(1.001 * scene.scale));
        test::Random same = random;
        EXPECT_LE(search_compensation(scene, random, scene.scale), rounding_error) << k;
        found_above += search_compensation(scene, same, 1.2 * scene.scale) > rounding_error ? 1 : 0;
    }
    EXPECT_GE(found_above, test::cases(6) / 4) << "the search must find energy above the certified scale";
}

}  // namespace
}  // namespace palpate::bench
