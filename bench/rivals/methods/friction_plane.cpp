// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "../method.hpp"

namespace palpate::rivals {

/// Held force in the stable part of the plane of damping and friction of Diolaiti et al. In one tick at the speed v the
/// wall gives at most K v T (Delta / 2 + v T (1/2 + n)) and the device dissipates (f_c + b v) v T. The balance must hold
/// at rest and at the largest speed of the hand.
struct FrictionPlane {
    static constexpr Method about{.name = "friction plane",
                                  .source = "Diolaiti et al. 2006",
                                  .proved = "linear wall, hands up to a speed",
                                  .knows = "b, T, f_c, encoder step, delay, largest speed"};
    static double bound(const Scene& scene) {
        const DeviceProfile& device = scene.profile();
        const double v = scene.device.speed;
        const double late = device.period_s * (0.5 + scene.delay());
        const double moving =
            (device.coulomb_friction + device.viscous_damping * v) / (0.5 * device.encoder_step + late * v);
        return std::min(moving, 2.0 * device.coulomb_friction / device.encoder_step) / scene.object.rising();
    }
    static Rendering make(const Scene& scene) { return held(scene); }
};
const Registered<FrictionPlane> friction_plane;

}  // namespace palpate::rivals
