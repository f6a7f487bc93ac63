// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "palpate/fields/field_table.hpp"

namespace palpate {

/// Kind of proof of an inequality in a certificate.
enum class Basis : std::uint8_t {
    Proved,  ///< proved for every motion and every passive hand; on an admittance display for the hands of its profile
    Linear,  ///< valid for the linearised system only: stable near an equilibrium
    /// Nothing is proved if the right side exceeds the left side, so the certificate refuses this case
    None,
};

template <>
inline constexpr auto words_of<Basis> = std::array<std::string_view, 3>{"proved", "linear", "none"};

/// One inequality of a certificate: left >= right, or left > right if `strict` is true.
struct Inequality {
    std::string id;
    std::string name;
    std::string formula;
    double left = 0.0;
    double right = 0.0;
    Basis basis = Basis::Proved;
    std::string source;
    bool strict = false;

    /// Returns the left side minus the right side. If it is negative, the inequality does not hold.
    [[nodiscard]] double margin() const noexcept { return left - right; }

    /// Returns the relative reserve of the inequality: (left side - right side) / |left side|.
    [[nodiscard]] double reserve() const noexcept { return margin() / std::abs(left); }

    /// Returns true if the inequality holds; returns false if its left or right side is not finite.
    [[nodiscard]] bool holds() const noexcept {
        return std::isfinite(left) && std::isfinite(right) && (strict ? left > right : left >= right);
    }
};

template <>
inline constexpr auto fields_of<Inequality> =
    FieldTable{Field<&Inequality::id>{
                   "id", "Name that never changes. A check of a certificate compares it, not the texts."},
               Field<&Inequality::left>{"left", "Left side of the inequality: the available value."},
               Field<&Inequality::right>{"right", "Right side of the inequality: the required value."},
               Field<&Inequality::name>{"name", "Subject of the inequality in words.", Rule::Any, false},
               Field<&Inequality::formula>{"formula", "Formula in the symbols of docs/certificate.md.",
                                           Rule::Any, false},
               Field<&Inequality::basis>{
                   "basis", "proved, linear (the linearised system only) or none (no bound is known).",
                   Rule::Any, false},
               Field<&Inequality::source>{"source", "Source of the proof.", Rule::Any, false},
               Field<&Inequality::strict>{
                   "strict", "True if the left side must be larger than the right side.", Rule::Any, false}};

/// Returns true if all inequalities in `lines` hold.
[[nodiscard]] inline bool all_hold(const std::vector<Inequality>& lines) noexcept {
    return std::all_of(lines.begin(), lines.end(), [](const Inequality& line) { return line.holds(); });
}

/// Returns a text about an inequality that does not hold, such as "viscous damping: b >= T M / 2 needs 0.075, there is
/// 0.06, short by 0.015". An inequality for which nothing is proved (`Basis::None`) has the advice to the user in
/// `source`.
[[nodiscard]] inline std::string shortfall(const Inequality& line) {
    if (line.basis == Basis::None) {
        return line.name + ": " + line.formula + (line.left != 0.0 ? " = " + readable(line.left) : "") +
               ", but the value is " + readable(line.right) + "; " + line.source;
    }
    return line.name + ": " + line.formula + " needs " + readable(line.right) + ", there is " +
           readable(line.left) + ", short by " + readable(-line.margin());
}

}  // namespace palpate
