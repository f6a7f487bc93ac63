// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <string_view>

#include "palpate/failure/coupled_maps.hpp"
#include "palpate/failure/failure_map.hpp"
#include "palpate/failure/guard_map.hpp"
#include "palpate/failure/held_maps.hpp"
#include "palpate/failure/period_map.hpp"
#include "palpate/failure/prediction_map.hpp"
#include "palpate/failure/solver_maps.hpp"
#include "palpate/failure/unused_maps.hpp"

namespace palpate {

struct NamedFailureMap {
    std::string_view name;
    FailureMap (*measure)(int points);
};

/// Every map that can be measured.
inline constexpr auto failure_maps = std::to_array<NamedFailureMap>({
    {"explicit", explicit_map},
    {"damping", damping_map},
    {"prediction", prediction_map},
    {"period", period_map},
    {"encoder", encoder_map},
    {"play", play_map},
    {"coupling", coupling_map},
    {"falling", falling_map},
    {"limit", limit_map},
    {"coupled-encoder", coupled_encoder_map},
    {"hand", hand_map},
    {"solver", solver_map},
    {"pole", pole_map},
    {"guard", guard_map},
});

}  // namespace palpate
