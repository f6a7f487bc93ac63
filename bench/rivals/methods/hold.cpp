// SPDX-License-Identifier: Apache-2.0
#include "../method.hpp"

namespace palpate::rivals {

/// Held force below the bound b > K T / 2 of Colgate and Schenkel. With n samples of delay their criterion
/// b > max T / (2 - 2 cos theta) Re{(1 - 1/z) H(z)} gives b > K T (1/2 + n) for H = K z^-n.
struct Hold {
    static constexpr Method about{.name = "hold",
                                  .source = "Colgate and Schenkel 1997",
                                  .proved = "linear wall, every passive hand; no encoder steps",
                                  .knows = "b, T, delay",
                                  .in_package = true};
    static double bound(const Scene& scene) {
        return scene.device.held_stiffness() / (1.0 + 2.0 * scene.delay()) / scene.object.rising();
    }
    static Rendering make(const Scene& scene) { return held(scene); }
};
const Registered<Hold> hold;

}  // namespace palpate::rivals
