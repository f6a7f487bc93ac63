// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace palpate {

/// What a virtual object resists motion with besides its force over position. The paper needs a mass to give
/// the environment a position as output, and chose these two values for its spring and wall.
struct Inertia {
    double mass = 0.001;   ///< m [kg or kg*m^2], > 0
    double damping = 0.5;  ///< B_o [N*s/m or N*m*s/rad], >= 0
};

}  // namespace palpate
