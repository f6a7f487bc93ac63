// SPDX-License-Identifier: Apache-2.0
// Searches random scenes of held lines for motions that take energy out, with the certified damping and friction and with
// smaller ones: first controllers that take lines, then controllers that take springs.
#include <array>
#include <cstdlib>
#include <iostream>
#include <optional>

#include "tangent_scenes.hpp"

namespace palpate::bench {
namespace {

/// Searches `scenes` scenes of each kind of controller and prints a row for each delay and search. Returns the number of
/// scenes in which energy is found with the certified damping and friction.
int search(Takes takes, int scenes) {
    constexpr double rounding = 1e-7;
    constexpr std::array shares{1.0, 0.7, 0.5, 0.3};
    int violations = 0;
    for (const double delay : {0.0, 1.0, 2.0}) {
        for (const bool simple : {true, false}) {
            std::array<int, shares.size()> found{};
            const int number = scenes / 6 + 1;
            for (int k = 0; k < number; ++k) {
                test::Random random{static_cast<std::uint64_t>(k) * 7919 +
                                    static_cast<std::uint64_t>(delay) * 31 + (simple ? 1U : 0U)};
                std::optional<TangentScene> scene;
                while (!scene) {
                    // Half of the chains with a delay have a fraction of a sample
                    const double fraction = !simple && delay > 0.0 && k % 2 == 1 ? 0.6 : 0.0;
                    scene = random_tangent_scene(random, delay - fraction, simple, takes);
                }
                // Smaller damping and friction than certified are searched in every fourth scene
                for (std::size_t j = 0; j < (k % 4 == 0 ? shares.size() : 1); ++j) {
                    test::Random same = random;
                    const double taken = simple ? search_by_value(*scene, same, shares[j], shares[j])
                                                : search_by_motions(*scene, same, shares[j], shares[j]);
                    if (taken > rounding) {
                        ++found[j];
                        if (j == 0) {
                            std::cout << "takes " << taken << ": " << *scene << "\n";
                        }
                    }
                }
            }
            violations += found[0];
            std::cout << (takes == Takes::Lines ? "lines" : "springs") << "  " << delay << "  "
                      << (simple ? "grid" : "chain") << "  " << number << " (" << (number + 3) / 4 << ")";
            for (const int each : found) {
                std::cout << "  " << each;
            }
            std::cout << std::endl;
        }
    }
    return violations;
}

}  // namespace
}  // namespace palpate::bench

int main(int count, char** arguments) {
    using palpate::bench::Takes;
    const int scenes = count > 1 ? std::atoi(arguments[1]) : 10'000;
    std::cout << "controller takes  delay  search  scenes  energy found at 1.0 of b and f_c, in a quarter of "
                 "the scenes at 0.7, 0.5, 0.3\n";
    int violations = 0;
    for (const Takes takes : {Takes::Lines, Takes::Springs}) {
        violations += palpate::bench::search(takes, scenes);
    }
    return violations == 0 ? 0 : 1;
}
