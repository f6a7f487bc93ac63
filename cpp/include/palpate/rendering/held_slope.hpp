// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "palpate/fields/field_table.hpp"
#include "palpate/model/force_model.hpp"

namespace palpate {

/// Rule by which a tangent chooses the slope kappa of its line F + kappa (x - x_k) at the position x_k.
enum class SlopeRule : std::uint8_t {
    Steepest,  ///< the smallest slope for which the line stores at least the energy of the force within one motion
    Raised,    ///< the slope of the force, at least 0, plus `lift`
    Constant,  ///< always `slope`
};

template <>
inline constexpr auto words_of<SlopeRule> = std::array<std::string_view, 3>{"steepest", "raised", "constant"};

/// Rule for the slope of a held line, with its numbers.
struct HeldSlope {
    SlopeRule rule = SlopeRule::Raised;
    double slope = 0.0;
    double lift = 0.0;
    std::optional<double> motion = std::nullopt;

    [[nodiscard]] bool operator==(const HeldSlope&) const = default;
};

template <>
inline constexpr auto fields_of<HeldSlope> = FieldTable{
    Field<&HeldSlope::rule>{"rule", "Rule for the slope: steepest, raised or constant."},
    Field<&HeldSlope::slope>{
        "slope", "Largest slope of the line (steepest), or its slope (constant) [N/m or N*m/rad].",
        Rule::NotNegative},
    Field<&HeldSlope::lift>{
        "lift", "Difference of the line's slope from that of the force (raised) [N/m or N*m/rad].",
        Rule::NotNegative},
    Field<&HeldSlope::motion>{
        "motion",
        "w, largest motion of the handle in one period [m or rad]; absent: any motion. A larger motion ends "
        "a certified run.",
        Rule::Positive}};

/// Largest number of cells of a domain for which the rule `Steepest` stores a slope [-], 8 bytes each.
inline constexpr int most_slope_cells = 65536;
/// Number of these cells in one motion w [-]. The slope is computed for cells, so it is larger than necessary by the
/// change of f' over about three cells.
inline constexpr int cells_in_motion = 16;

/// Checks the slope of a line for a model. Throws std::invalid_argument with the wrong field, its value and the rule.
inline void validate(const HeldSlope& line, const ForceModel& model) {
    check_fields(line, "line.");
    if (line.rule != SlopeRule::Steepest) {
        return;
    }
    const double travel = model.domain().upper[0] - model.domain().lower[0];
    const double least = travel * cells_in_motion / most_slope_cells;
    require_field(line.motion.value_or(0.0) >= least, "line.motion", line.motion.value_or(0.0),
                  "at least " + readable(least) + " for the rule steepest and a domain of this length");
}

}  // namespace palpate
