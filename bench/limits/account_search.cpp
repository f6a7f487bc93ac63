// SPDX-License-Identifier: Apache-2.0
// Searches random scenes for motions that take more energy than E0 out of a rendering with an energy account.
#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <iostream>

#include "account_scenes.hpp"

int main(int count, char** arguments) {
    const int scenes = count > 1 ? std::atoi(arguments[1]) : 10'000;
    constexpr int motions = 6;
    palpate::test::Random random{17};
    double deepest = 0.0;
    int above = 0;
    int acting = 0;
    for (int k = 0; k < scenes; ++k) {
        palpate::bench::AccountScene scene = palpate::bench::random_account_scene(random);
        double least = 0.0;
        std::size_t limited = 0;
        for (int motion = 0; motion < motions; ++motion) {
            scene.hand = static_cast<unsigned>(motion);
            const auto found = palpate::bench::move_account(scene, random, 600);
            least = std::min(least, found.deepest);
            limited += found.limited;
        }
        if (least < -1.0 - 1e-9) {
            ++above;
            std::cout << "takes " << -least << " E0: " << scene << "\n";
        }
        acting += limited > 0 ? 1 : 0;
        deepest = std::min(deepest, least);
    }
    std::cout << scenes << " scenes with " << motions << " motions: " << above << " above E0, most "
              << -deepest << " E0; the account acts in " << acting << "\n";
    return above == 0 ? 0 : 1;
}
