// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include "../method.hpp"
#include "palpate/rendering/implicit.hpp"

namespace palpate::rivals {

/// Object with mass behind the stiffest coupling, by backward Euler (Brown and Colgate 1997). The object's damping
/// satisfies 2 B_o / T >= s_ for the steepest falling slope s_, so that the certificate of the coupling holds.
struct ImplicitObject {
    static constexpr Method about{.name = "implicit object",
                                  .source = "Brown and Colgate 1997; docs/certificate.md",
                                  .proved = "every object and passive hand; no encoder steps",
                                  .knows = "b, T, delay",
                                  .in_package = true};
    static double bound(const Scene& /*scene*/) { return every_object; }
    static Rendering make(const Scene& scene) {
        const double T = scene.period();
        const VirtualCoupling coupling = stiffest_coupling_of(scene);
        const double mass = 0.01 * coupling.stiffness * T * T;
        const Inertia inertia{mass, std::max(0.5 * mass / T, 0.5 * T * scene.object.bounds().falling())};
        return rendered_by(scene, [&](auto object) -> AnyStructure {
            return Implicit{std::move(object), inertia, coupling, T};
        });
    }
};
const Registered<ImplicitObject> implicit_object;

}  // namespace palpate::rivals
