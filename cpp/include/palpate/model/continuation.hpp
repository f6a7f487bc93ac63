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

/// Value, slope and two antiderivatives of a function f at one position x. The antiderivatives give stored energy.
struct Curve {
    double value = 0.0;            ///< f(x)
    double slope = 0.0;            ///< f'(x)
    double integral = 0.0;         ///< integral of f over the position up to x, plus a constant
    double double_integral = 0.0;  ///< integral of `integral` over the position up to x, plus a constant
};

/// Kind of force outside the positions of the recording. The network is never evaluated there, because the force of a
/// fitted network can change its direction just outside the last recorded position.
enum class Continuation : std::uint8_t {
    Linear,  ///< a straight line of slope >= 0 that starts with the force at the end of the domain
    /// A straight line from the end of the domain to zero force, then zero: the tool has lost contact
    Free,
};

template <>
inline constexpr auto words_of<Continuation> = std::array<std::string_view, 2>{"linear", "free"};

/// Force outside one edge of the domain: a straight line that starts with the force at the edge and, if `reach` is
/// finite, ends with zero force at the distance `reach` from the edge. The force is continuous at the start and at the
/// end of the line; the slope is not.
struct EdgeLine {
    double edge = 0.0;  ///< end of the domain at which the line starts [m]
    Curve at_edge;      ///< force at the end of the domain, and slope of the straight line
    /// Distance from the end of the domain to zero force [m]
    double reach = std::numeric_limits<double>::infinity();

    /// Returns force, slope and antiderivatives at a position x outside the domain. `edge` must be the end of the
    /// domain that is nearest to x.
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

/// Part of the domain at each end in which the slope of a fitted force is least certain [-]. The largest slope of a
/// continuation is computed without these parts.
inline constexpr double uncertain_end = 0.02;

/// Properties of a force inside its domain, from which the straight lines outside the domain are computed.
struct CurveExtent {
    double travel = 0.0;         ///< length of the domain, upper - lower [m]
    double largest_force = 0.0;  ///< max |f| over the domain [N]
    /// Largest slope that a line may have: bound of max f' over the domain without both `uncertain_end`, at least 0
    /// [N/m]
    double slope_cap = 0.0;
};

/// Returns the straight line that continues a force outside the edge `edge` of the domain. `outward` is -1 for the
/// lower edge and +1 for the upper edge.
///
/// The slope of the line is the slope f'(edge), limited to 0 to slope_cap. If the force at the edge pushes the tool out
/// of the domain, the slope is at least max|f| / travel, so that the stored energy has a minimum. With `Free`, a force
/// that pulls the tool back into the domain decreases to zero with the slope max|f| / travel.
[[nodiscard]] inline EdgeLine continue_force(double edge, const Curve& at_edge, double outward,
                                             Continuation continuation, const CurveExtent& extent) noexcept {
    EdgeLine line{edge, at_edge};
    const double mean_slope = extent.largest_force / extent.travel;
    const double outward_force = -outward * at_edge.value;  // force > 0 pushes the tool out of the domain
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

/// Returns the line that continues the hysteresis h >= 0 outside an edge of the domain. The line is constant, or with
/// `Free` it falls to zero over the distance `reach`. It never becomes negative, so no closed motion of the tool
/// outside the domain generates energy.
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
