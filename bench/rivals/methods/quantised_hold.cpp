// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "../method.hpp"

namespace palpate::rivals {

/// Held force below the bound of Abbott and Okamura for a wall with encoder steps: K <= min(2 b / T, 2 f_c / Delta). It
/// is used as published, also with the delay that the paper leaves out.
struct QuantisedHold {
    static constexpr Method about{.name = "quantised hold",
                                  .source = "Abbott and Okamura 2005",
                                  .proved = "linear wall without delay, every hand",
                                  .knows = "b, T, f_c, encoder step"};
    static double bound(const Scene& scene) {
        return std::min(scene.device.held_stiffness(),
                        2.0 * scene.profile().coulomb_friction / scene.profile().encoder_step) /
               scene.object.rising();
    }
    static Rendering make(const Scene& scene) { return held(scene); }
};
const Registered<QuantisedHold> quantised_hold;

}  // namespace palpate::rivals
