// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "../method.hpp"

namespace palpate::rivals {

/// Held force whose slopes are limited to those that the device renders: the nearest such force over the travel.
struct SlopeLimit {
    static constexpr Method about{.name = "slope limit",
                                  .source = "this project; docs/certificate.md",
                                  .proved = "every object, every motion, encoder steps",
                                  .knows = "b, T, f_c, encoder step, delay",
                                  .in_package = true,
                                  .ours = true};
    static double bound(const Scene& /*scene*/) { return every_object; }
    static Rendering make(const Scene& scene) {
        const DeviceProfile& device = scene.profile();
        const double steepest =
            std::min(device.viscous_damping / device.period_s / device_need(device, {1.0, 1.0}),
                     2.0 * device.coulomb_friction / device.encoder_step);
        Object limited = scene.object;
        limited.hysteresis = std::min(limited.hysteresis, 0.25 * steepest * limited.play_radius);
        limited.branch = std::min(limited.branch, 0.25 * steepest);
        const double rest = steepest - 2.0 * limited.hysteresis / limited.play_radius - 2.0 * limited.branch;
        limited.force = limited.force.slope_limited(0.0, limited.travel, rest);
        limited = limited.scaled(std::min(1.0, certified_scale(limited, device)));
        return held({scene.device, limited, scene.budget});
    }
};
const Registered<SlopeLimit> slope_limit;

}  // namespace palpate::rivals
