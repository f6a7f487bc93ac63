// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include "../method.hpp"
#include "palpate/rendering/energy_consistent.hpp"

namespace palpate::rivals {

/// Object behind the stiffest coupling, moved by a step that generates no energy for any slope.
struct EnergyConsistentObject {
    static constexpr Method about{.name = "energy-consistent object",
                                  .source = "this project; docs/certificate.md",
                                  .proved = "every object and passive hand; no encoder steps",
                                  .knows = "b, T, delay",
                                  .in_package = true,
                                  .ours = true};
    static double bound(const Scene& /*scene*/) { return every_object; }
    static Rendering make(const Scene& scene) {
        const double T = scene.period();
        const VirtualCoupling coupling = stiffest_coupling_of(scene);
        const Inertia inertia{0.01 * coupling.stiffness * T * T, 0.0};
        return rendered_by(scene, [&](auto object) -> AnyStructure {
            return EnergyConsistent{std::move(object), inertia, coupling, T, 0.01 * scene.object.travel};
        });
    }
};
const Registered<EnergyConsistentObject> energy_consistent_object;

}  // namespace palpate::rivals
