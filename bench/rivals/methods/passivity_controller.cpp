// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include "../method.hpp"

namespace palpate::rivals {

/// Passivity observer and controller in series, impedance causality: E = sum of f v T; if E < 0, the controller adds the
/// damping alpha = -E / (T v^2). alpha is at most m / T, above which a sampled damper on the mass m is unstable.
struct PassivityController {
    static constexpr Method about{.name = "passivity controller",
                                  .source = "Hannaford and Ryu 2002",
                                  .proved = "energy at the samples; not between them",
                                  .knows = "T, inertia"};
    static double bound(const Scene& /*scene*/) { return no_bound; }
    static Rendering make(const Scene& scene) {
        return {Controlled{scene.object.held(scene.period()), scene.profile().inertia / scene.period(),
                           scene.period()},
                scene.profile(), scene.object};
    }

    struct Controlled {
        AnyStructure object;
        double most_damping;
        double period_s;
        double last = 0.0;
        double energy = 0.0;      // that the object absorbed, with the damping of the controller
        double dissipated = 0.0;  // by the controller in the last tick

        void reset(double position) noexcept {
            object.reset(position);
            last = position;
            energy = dissipated = 0.0;
        }
        [[nodiscard]] Rendered step(double position) noexcept {
            Rendered rendered = object.step(position);
            const double velocity = (position - std::exchange(last, position)) / period_s;
            energy += period_s * rendered.force * velocity + dissipated;
            double damping = 0.0;
            if (energy < 0.0 && velocity != 0.0) {
                damping = std::min(most_damping, -energy / (period_s * velocity * velocity));
            }
            dissipated = damping * velocity * velocity * period_s;
            rendered.force += damping * velocity;
            return rendered;
        }
    };
};
const Registered<PassivityController> passivity_controller;

}  // namespace palpate::rivals
