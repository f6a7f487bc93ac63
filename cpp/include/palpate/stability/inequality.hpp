// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "palpate/fields/readable.hpp"

namespace palpate {

/// What an inequality rests on.
enum class Basis : std::uint8_t {
    Proved,  ///< a proof for every motion and every passive hand
    Linear,  ///< the linearised system only: says that it is stable near an equilibrium
    None,    ///< no bound is known beyond this one; what lies beyond is refused
};

inline constexpr std::array<std::string_view, 3> basis_names{"proved", "linear", "none"};

[[nodiscard]] constexpr std::string_view name_of(Basis basis) noexcept {
    return basis_names[static_cast<std::size_t>(basis)];
}

/// One line of a certificate: left >= right, or left > right where it is strict.
struct Inequality {
    std::string id;       ///< stable name, compared when a certificate is checked; texts are not
    std::string name;     ///< subject in words
    std::string formula;  ///< in the symbols of docs/certificate.md
    double left = 0.0;    ///< what there is
    double right = 0.0;   ///< what is needed
    Basis rests_on = Basis::Proved;
    std::string source;
    bool strict = false;

    [[nodiscard]] double margin() const noexcept { return left - right; }

    /// Never for a side that is not a number.
    [[nodiscard]] bool holds() const noexcept {
        return std::isfinite(left) && std::isfinite(right) && (strict ? left > right : left >= right);
    }
};

/// "viscous damping: b >= T M / 2 needs 0.075, there is 0.06, short by 0.015". A line without a known bound has its
/// cure as source.
[[nodiscard]] inline std::string shortfall(const Inequality& line) {
    if (line.rests_on == Basis::None) {
        return line.name + ": " + line.formula + (line.left != 0.0 ? " = " + readable(line.left) : "") +
               ", and it is " + readable(line.right) + "; " + line.source;
    }
    return line.name + ": " + line.formula + " needs " + readable(line.right) + ", there is " +
           readable(line.left) + ", short by " + readable(-line.margin());
}

}  // namespace palpate
