// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace palpate {

/// The spring and damper between the device and the virtual object (paper figure 7),
///
///     F = K_c (x_device - x_environment) + B_c (v_device - v_environment),
///
/// F > 0 pushes the device back and drives the environment on.
struct VirtualCoupling {
    double stiffness = 100.0;  ///< K_c [N/m or N*m/rad], > 0
    double damping = 0.02;     ///< B_c [N*s/m or N*m*s/rad], >= 0

    [[nodiscard]] constexpr double force(double position_error, double velocity_error) const noexcept {
        return stiffness * position_error + damping * velocity_error;
    }
};

}  // namespace palpate
