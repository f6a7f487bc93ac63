// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <optional>
#include <string_view>

#include "palpate/inline.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/rendering/any_structure.hpp"
#include "palpate/rendering/scheme.hpp"

namespace palpate {

/// Builds the structure of a scheme for a model. Only this function prepares a model for the control loop, in a few
/// milliseconds: it replaces the model's force by polynomials and the solution of load lines by tables, where the error
/// is proved to be small enough.
///
/// `force_limit` is the force limit of the device [N or N*m], infinity without a limit. The massless, implicit and
/// energy-consistent structures include the limit in their solution, so that object and device receive the same force.
/// A force with memory keeps the limit itself. The direct and the explicit structure otherwise ignore `force_limit`: the
/// guards clip their force, and the stability bound of the explicit structure holds only for forces below the limit.
[[nodiscard]] PALPATE_INLINE AnyStructure make_structure(const ForceModel& given, const Scheme& scheme,
                                                         double period_s, double force_limit);

/// Returns the method that solves the load line of a scheme: "table" if a table of solutions is used for at least a
/// part of the positions, else "newton"; nothing if the structure has no load line. The energy-consistent structure
/// uses its table only in steps in which the model's force does not generate energy, and Newton's method in the others.
[[nodiscard]] inline std::optional<std::string_view> solver_name(const ForceModel& model,
                                                                 const Scheme& scheme, double period_s) {
    const std::optional<bool> tabulated =
        make_structure(model, scheme, period_s, std::numeric_limits<double>::infinity()).tabulated();
    return tabulated ? std::optional{*tabulated ? "table" : "newton"} : std::nullopt;
}

}  // namespace palpate

#ifndef PALPATE_COMPILED
#include "palpate/rendering/detail/make_structure.hpp"
#endif
