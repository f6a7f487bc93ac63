// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <tuple>

#include "palpate/fields/field_table.hpp"
#include "palpate/rendering/direct.hpp"
#include "palpate/rendering/energy_consistent.hpp"
#include "palpate/rendering/explicit.hpp"
#include "palpate/rendering/implicit.hpp"
#include "palpate/rendering/massless.hpp"
#include "palpate/rendering/tangent.hpp"

namespace palpate {

/// One enumerator for each structure, in the order of the type list `Structures`.
enum class StructureKind : std::uint8_t { Direct, Massless, Implicit, Explicit, EnergyConsistent, Tangent };

/// Types of all structures, in the order of `StructureKind`.
using Structures = std::tuple<DirectStructure, MasslessStructure, ImplicitStructure, ExplicitStructure,
                              EnergyConsistentStructure, TangentStructure>;

/// Properties of all structures, in the order of the list `Structures`.
inline constexpr auto structure_traits =
    std::apply([](auto... structure) { return std::array{structure.traits...}; }, Structures{});

/// Names of all structures, in the order of the list `Structures`.
inline constexpr auto structure_names =
    std::apply([](auto... structure) { return std::array{structure.traits.name...}; }, Structures{});

template <>
inline constexpr auto words_of<StructureKind> = structure_names;

/// Returns the properties of a structure.
[[nodiscard]] constexpr const StructureTraits& traits_of(StructureKind kind) noexcept {
    return structure_traits[static_cast<std::size_t>(kind)];
}
/// Returns true if the structure has a virtual coupling between device and object.
[[nodiscard]] constexpr bool has_coupling(StructureKind kind) noexcept {
    return traits_of(kind).coupling;
}
/// Returns true if the structure sends lines, which the motor controller of the device holds.
[[nodiscard]] constexpr bool holds_line(StructureKind kind) noexcept {
    return traits_of(kind).line;
}
/// Returns true if the virtual object of the structure has mass and damping.
[[nodiscard]] constexpr bool has_mass(StructureKind kind) noexcept {
    return traits_of(kind).mass;
}

/// Calls `visit` with the class that builds the structure `kind`, an element of the type list `Structures`.
template <std::size_t k = 0, class Visit>
decltype(auto) with_kind(StructureKind kind, const Visit& visit) {
    if constexpr (k + 1 < std::tuple_size_v<Structures>) {
        if (static_cast<std::size_t>(kind) != k) {
            return with_kind<k + 1>(kind, visit);
        }
    }
    return visit(std::tuple_element_t<k, Structures>{});
}

}  // namespace palpate
