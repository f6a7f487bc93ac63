// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string_view>

#include <nlohmann/json.hpp>

#include "coupled_maps.hpp"
#include "failure_map.hpp"
#include "guard_maps.hpp"
#include "held_maps.hpp"
#include "solver_maps.hpp"

namespace palpate::bench {

struct NamedFailureMap {
    std::string_view name;
    FailureMap (*measure)(int points);
};

/// All failure maps (figures of stability limits), in the order of the documentation page.
inline constexpr auto failure_maps = std::to_array<NamedFailureMap>({
    {"explicit", explicit_map},
    {"damping", damping_map},
    {"prediction", prediction_map},
    {"period", period_map},
    {"encoder", encoder_map},
    {"play", play_map},
    {"memory", memory_map},
    {"coupling", coupling_map},
    {"falling", falling_map},
    {"limit", limit_map},
    {"coupled-encoder", coupled_encoder_map},
    {"hand", hand_map},
    {"solver", solver_map},
    {"pole", pole_map},
    {"guard", guard_map},
});

[[nodiscard]] inline nlohmann::ordered_json as_json(const GuardEffect& effect) {
    return {{"guard", effect.guard},
            {"cost", effect.cost},
            {"wrong", effect.wrong},
            {"without", effect.without},
            {"with", effect.with}};
}

}  // namespace palpate::bench
