// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <tuple>

#include "palpate/fields/field_table.hpp"

namespace palpate {

/// The spring and damper between the device and the virtual object (paper figure 7),
///
///     F = K_c (x_device - x_environment) + B_c (v_device - v_environment),
///
/// F > 0 pushes the device back and drives the environment on.
struct VirtualCoupling {
    double stiffness = 100.0;
    double damping = 0.02;

    [[nodiscard]] constexpr double force(double position_error, double velocity_error) const noexcept {
        return stiffness * position_error + damping * velocity_error;
    }

    /// K_c + B_c / T: its part of the slope of a load line.
    [[nodiscard]] constexpr double load_line_slope(double period_s) const noexcept {
        return stiffness + damping / period_s;
    }
};

template <>
inline constexpr auto fields_of<VirtualCoupling> =
    std::tuple{Field<&VirtualCoupling::stiffness>{
                   "stiffness", "K_c, stiffness of the coupling [N/m or N*m/rad].", Rule::Positive},
               Field<&VirtualCoupling::damping>{
                   "damping", "B_c, damping of the coupling [N*s/m or N*m*s/rad].", Rule::NotNegative}};

/// Mass and damping of the virtual object. The paper needs a mass to give the environment a position as output, and
/// chose these two values for its spring and wall.
struct Inertia {
    double mass = 0.001;
    double damping = 0.5;

    /// m / T^2 + B_o / T: their part of the slope of a load line, by backward Euler.
    [[nodiscard]] constexpr double load_line_slope(double period_s) const noexcept {
        return mass / (period_s * period_s) + damping / period_s;
    }

    /// The same by the midpoint rule: 2 m / T^2 + B_o / T.
    [[nodiscard]] constexpr double midpoint_slope(double period_s) const noexcept {
        return 2.0 * mass / (period_s * period_s) + damping / period_s;
    }
};

template <>
inline constexpr auto fields_of<Inertia> =
    std::tuple{Field<&Inertia::mass>{"mass", "m, mass of the object [kg or kg*m^2].", Rule::Positive},
               Field<&Inertia::damping>{"damping", "B_o, damping of the object [N*s/m or N*m*s/rad].",
                                        Rule::NotNegative}};

}  // namespace palpate
