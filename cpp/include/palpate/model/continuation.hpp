// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string_view>

#include "palpate/fields/field_table.hpp"

namespace palpate {

/// A force over one position with what energy accounts need of it.
struct Curve {
    double value = 0.0;            ///< f(x)
    double slope = 0.0;            ///< f'(x)
    double integral = 0.0;         ///< an antiderivative of f
    double double_integral = 0.0;  ///< an antiderivative of that
};

/// How a force goes on outside the data. A fitted network turns over just past its last sample, so it is
/// never evaluated there.
enum class Continuation : std::uint8_t {
    Linear,  ///< a line of non-negative slope through the edge
    Free,    ///< the same line until the force is zero, then nothing: contact is lost
};

template <>
inline constexpr auto words_of<Continuation> = std::array<std::string_view, 2>{"linear", "free"};

/// A curve beyond one edge of its domain: a line through the edge, cut off `reach` away from it.
/// The force is continuous at the edge and at the cut; the slope jumps.
struct EdgeLine {
    double edge = 0.0;                                       ///< position of the edge
    Curve at_edge;                                           ///< the curve there; its slope is the line's
    double reach = std::numeric_limits<double>::infinity();  ///< distance after which the force is zero

    [[nodiscard]] Curve at(double x) const noexcept {
        const double distance = x - edge;
        const double inside = std::clamp(distance, -reach, reach);
        const double line = at_edge.value + at_edge.slope * inside;
        const double integral = at_edge.integral + (at_edge.value + 0.5 * at_edge.slope * inside) * inside;
        const double double_integral =
            at_edge.double_integral +
            (at_edge.integral + (0.5 * at_edge.value + at_edge.slope * inside / 6.0) * inside) * inside;
        if (std::abs(distance) < reach || std::isinf(reach)) {
            return {line, at_edge.slope, integral, double_integral};
        }
        return {0.0, 0.0, integral, double_integral + integral * (distance - inside)};
    }
};

/// What the choice of an edge line needs to know of the whole curve.
struct CurveExtent {
    double travel = 0.0;         ///< hi - lo
    double largest_force = 0.0;  ///< max |f| over the domain
    double slope_cap = 0.0;      ///< max f' over the domain less its outer 2 %, at least 0
};

/// The line that continues a force beyond `edge`. `outward` is -1 below the domain and +1 above it.
///
/// The slope is clip(f'(edge), 0, slope_cap). Where the force at the edge drives the tool outward it is at
/// least max|f| / travel, so that the stored energy stays bounded below. A free side that pulls at its edge
/// lets the pull die out with that same gentle slope.
[[nodiscard]] inline EdgeLine continue_force(double edge, const Curve& at_edge, double outward,
                                             Continuation continuation, const CurveExtent& extent) noexcept {
    EdgeLine line{edge, at_edge};
    const double gentle = extent.largest_force / extent.travel;
    const double outward_force = -outward * at_edge.value;  // > 0: pushes the tool out of the domain
    line.at_edge.slope = std::clamp(at_edge.slope, 0.0, extent.slope_cap);
    if (outward_force > 0.0) {
        line.at_edge.slope = std::max(line.at_edge.slope, gentle);
    }
    if (continuation == Continuation::Free) {
        if (outward_force < 0.0) {
            line.at_edge.slope = -gentle;
        }
        line.reach = at_edge.value == 0.0 ? 0.0 : std::abs(at_edge.value / line.at_edge.slope);
    }
    return line;
}

/// The line that continues a dissipated force h >= 0 beyond an edge: constant, or, where contact is lost,
/// falling to zero over `reach`. It never becomes negative, so no loop beyond the edge generates energy.
[[nodiscard]] inline EdgeLine continue_loss(double edge, const Curve& at_edge, double outward,
                                            Continuation continuation, double reach) noexcept {
    EdgeLine line{edge, at_edge};
    line.at_edge.slope = 0.0;
    if (continuation == Continuation::Free) {
        line.at_edge.slope = -outward * at_edge.value / reach;
        line.reach = reach;
    }
    return line;
}

}  // namespace palpate
