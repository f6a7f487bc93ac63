// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <vector>

#include "../method.hpp"
#include "palpate/stability/held_force.hpp"

namespace palpate::rivals {

/// Packets of force and slope: the motor controller applies F_k + kappa_k (x - x_k) at its own rate. Without delay, kappa
/// puts the potential of each packet above the object's for motions up to v T, and only the controller needs damping.
/// With n samples of delay, kappa = max(f', 0) needs the damping T B(M, M + s_, n) too. If that is too much, the constant
/// kappa = M - (M + s_) (1/2 - 1/4 / sqrt(n^2 - 1/4)) needs T sqrt(n^2 - 1/4) (M + s_) / 2. A controller that only holds
/// forces gets the held force.
struct Tangent {
    static constexpr Method about{.name = "tangent",
                                  .source = "this project",
                                  .proved = "every object within the bound; without delay up to a speed",
                                  .knows = "b, T, f_c, encoder step, delay, controller, largest speed",
                                  .ours = true};
    /// Returns the bound for packets of the largest slope `kappa` that need the damping T `late`.
    static double allowed(const Scene& scene, double kappa, double late) {
        const DeviceProfile& device = scene.profile();
        const double inner = 1.5 * device.period_s / scene.device.controller_steps * kappa;
        const double steepest = scene.object.rising() + scene.object.bounds().falling();
        return std::min(device.viscous_damping / (inner + device.period_s * late),
                        2.0 * device.coulomb_friction / device.encoder_step / steepest);
    }
    static double falling(const Scene& scene) { return scene.object.bounds().falling(); }
    static double root(const Scene& scene) { return std::sqrt(scene.delay() * scene.delay() - 0.25); }
    static double with_slopes(const Scene& scene) {
        const double M = scene.object.rising();
        const bool late = scene.delay() > 0;
        return allowed(scene, M, late ? delayed_need(scene.delay(), 0.0, {M, M + falling(scene)}) : 0.0);
    }
    static double constant(const Scene& scene) {
        const double M = scene.object.rising();
        return M - (M + falling(scene)) * (0.5 - 0.25 / root(scene));
    }
    static double bound(const Scene& scene) {
        if (scene.device.controller_steps == 1) {
            return certified_scale(scene.object, scene.profile());
        }
        const double total = scene.object.rising() + falling(scene);
        return scene.delay() == 0
                   ? with_slopes(scene)
                   : std::max(with_slopes(scene), allowed(scene, constant(scene), 0.5 * root(scene) * total));
    }
    static Rendering make(const Scene& scene) {
        if (scene.device.controller_steps == 1) {
            return held(scene);
        }
        const TableCurve& force = scene.object.force;
        DeviceProfile controller = scene.profile();
        controller.period_s /= scene.device.controller_steps;
        controller.delay_s = controller.period_s;  // of the controller; the packets have their own delay
        const double reach =
            scene.delay() > 0 ? force.step() : scene.device.speed * scene.period() + controller.encoder_step;
        const double more = scene.object.hysteresis / scene.object.play_radius + scene.object.branch;
        const TableCurve slopes = scene.delay() == 0 || with_slopes(scene) >= 1.0 - 1e-9
                                      ? force.majorant_slopes(reach, more)
                                      : force.with(std::vector<double>(force.size(), constant(scene)));
        return {LineController{scene.object.held(scene.period()), slopes, scene.device.controller_steps,
                               scene.delay()},
                controller, scene.object};
    }
};
const Registered<Tangent> tangent;

}  // namespace palpate::rivals
