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

/// A function of position with its slope and the antiderivatives that energy accounts use.
struct Curve {
    double value = 0.0;            ///< f(x)
    double slope = 0.0;            ///< f'(x)
    double integral = 0.0;         ///< an antiderivative of f
    double double_integral = 0.0;  ///< an antiderivative of `integral`
};

/// Continuation of a force outside the data. A fitted network changes direction just outside its last sample, so it is
/// never evaluated there.
enum class Continuation : std::uint8_t {
    Linear,  ///< a straight line of non-negative slope through the edge
    Free,    ///< the same line until the force is zero, then zero: contact is lost
};

template <>
inline constexpr auto words_of<Continuation> = std::array<std::string_view, 2>{"linear", "free"};

/// A curve beyond one edge of its domain: a straight line through the edge that ends `reach` away from it. The force is
/// continuous at the edge and at the end; the slope is not.
struct EdgeLine {
    double edge = 0.0;                                       ///< position of the edge [m]
    Curve at_edge;                                           ///< value at the edge, and slope of the line
    double reach = std::numeric_limits<double>::infinity();  ///< distance from the edge to zero force [m]

    /// Returns value, slope and antiderivatives at x, beyond the edge.
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

/// Properties of a whole curve on which its edge lines depend.
struct CurveExtent {
    double travel = 0.0;         ///< upper - lower [m]
    double largest_force = 0.0;  ///< max |f| over the domain [N]
    double slope_cap = 0.0;      ///< max f' over the domain without its outer 2 %, at least 0 [N/m]
};

/// Returns the line that continues a force beyond `edge`. `outward` is -1 below the domain and +1 above it.
///
/// The slope is clip(f'(edge), 0, slope_cap). If the force at the edge pushes the tool outward, the slope is at least
/// max|f| / travel, so that the stored energy stays bounded below. With `Free`, a force that pulls the tool back at the
/// edge decreases to zero with that same slope max|f| / travel.
[[nodiscard]] inline EdgeLine continue_force(double edge, const Curve& at_edge, double outward,
                                             Continuation continuation, const CurveExtent& extent) noexcept {
    EdgeLine line{edge, at_edge};
    const double mean_slope = extent.largest_force / extent.travel;
    const double outward_force = -outward * at_edge.value;  // > 0: pushes the tool out of the domain
    line.at_edge.slope = std::clamp(at_edge.slope, 0.0, extent.slope_cap);
    if (outward_force > 0.0) {
        line.at_edge.slope = std::max(line.at_edge.slope, mean_slope);
    }
    if (continuation == Continuation::Free) {
        if (outward_force < 0.0) {
            line.at_edge.slope = -mean_slope;
        }
        line.reach = at_edge.value == 0.0 ? 0.0 : std::abs(at_edge.value / line.at_edge.slope);
    }
    return line;
}

/// Returns the line that continues a dissipated force h >= 0 beyond an edge. It is constant, or with `Free` it falls to
/// zero over `reach`. It never becomes negative, so no loop beyond the edge generates energy.
[[nodiscard]] inline EdgeLine continue_hysteresis(double edge, const Curve& at_edge, double outward,
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
