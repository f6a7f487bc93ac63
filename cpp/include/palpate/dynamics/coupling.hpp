// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "palpate/fields/field_table.hpp"

namespace palpate {

/// The virtual coupling: spring and damper between the device and the virtual object (paper figure 7),
///
///     F = K_c (x_device - x_environment) + B_c (v_device - v_environment).
///
/// F > 0 pushes the device back and moves the virtual object forward.
struct VirtualCoupling {
    double stiffness = 100.0;  ///< stiffness K_c of the virtual coupling [N/m]
    double damping = 0.02;     ///< damping B_c of the virtual coupling [N*s/m]

    /// Returns the force of the virtual coupling [N]. The two arguments are the position and the velocity of the device
    /// minus those of the virtual object.
    [[nodiscard]] constexpr double force(double position_error, double velocity_error) const noexcept {
        return stiffness * position_error + damping * velocity_error;
    }

    /// Returns K_c + B_c / T [N/m], the term of the virtual coupling in the slope p of a load line.
    [[nodiscard]] constexpr double load_line_slope(double period_s) const noexcept {
        return stiffness + damping / period_s;
    }
};

template <>
inline constexpr auto fields_of<VirtualCoupling> =
    FieldTable{Field<&VirtualCoupling::stiffness>{
                   "stiffness", "K_c, stiffness of the coupling [N/m or N*m/rad].", Rule::Positive},
               Field<&VirtualCoupling::damping>{
                   "damping", "B_c, damping of the coupling [N*s/m or N*m*s/rad].", Rule::NotNegative}};

/// Mass and damping of the virtual object. The paper adds a mass so that the virtual object has a position; the paper's
/// spring and wall use the two default values.
struct Inertia {
    double mass = 0.001;   ///< mass m of the virtual object [kg]
    double damping = 0.5;  ///< damping B_o of the virtual object [N*s/m]

    /// Returns m / T^2 + B_o / T [N/m], the part of mass and damping in the slope of a load line with the backward
    /// Euler method.
    [[nodiscard]] constexpr double load_line_slope(double period_s) const noexcept {
        return mass / (period_s * period_s) + damping / period_s;
    }

    /// Returns 2 m / T^2 + B_o / T [N/m], the part of mass and damping in the slope of a load line with the midpoint
    /// rule.
    [[nodiscard]] constexpr double midpoint_slope(double period_s) const noexcept {
        return 2.0 * mass / (period_s * period_s) + damping / period_s;
    }
};

template <>
inline constexpr auto fields_of<Inertia> =
    FieldTable{Field<&Inertia::mass>{"mass", "m, mass of the object [kg or kg*m^2].", Rule::Positive},
               Field<&Inertia::damping>{"damping", "B_o, damping of the object [N*s/m or N*m*s/rad].",
                                        Rule::NotNegative}};

}  // namespace palpate
