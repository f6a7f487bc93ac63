// SPDX-License-Identifier: Apache-2.0
// Prints the limits of every method and the effect of every guard as one JSON object.
//
//   failure_maps POINTS [MAP ...]      values along each axis, at least 2; only the maps of these names, without guards

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string_view>
#include <vector>

#include "failure_maps.hpp"

int main(int count, char** words) {
    using namespace palpate::bench;
    const int points = count > 1 ? std::atoi(words[1]) : 0;
    const std::vector<std::string_view> only(words + std::min(count, 2), words + count);
    if (points < 2) {
        std::fputs("usage: failure_maps POINTS [MAP ...], POINTS at least 2\n", stderr);
        return 2;
    }
    nlohmann::ordered_json printed{{"maps", nlohmann::ordered_json::array()},
                                   {"guards", nlohmann::ordered_json::array()}};
    for (const NamedFailureMap& map : failure_maps) {
        if (only.empty() || std::find(only.begin(), only.end(), map.name) != only.end()) {
            printed["maps"].push_back(as_json(map.measure(points)));
            std::fprintf(stderr, "%s: measured\n", map.name.data());
        }
    }
    for (const GuardEffect& effect : only.empty() ? guard_effects() : std::vector<GuardEffect>{}) {
        printed["guards"].push_back(as_json(effect));
    }
    std::puts(printed.dump(1).c_str());
    return 0;
}
