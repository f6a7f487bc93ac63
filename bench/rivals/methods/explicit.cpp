// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include "../method.hpp"
#include "palpate/rendering/explicit.hpp"
#include "palpate/stability/explicit_inequalities.hpp"

namespace palpate::rivals {

/// Object with mass behind a coupling, moved by forces that are one sample old. The mass makes the step stable for 2.5
/// times the steepest slope. The coupling is the stiffest of three for which the linearised rendering is certified.
struct ExplicitObject {
    static constexpr Method about{.name = "explicit object",
                                  .source = "Miller, Colgate and Freeman 2000; docs/certificate.md",
                                  .proved = "linearised, every passive hand; no encoder steps",
                                  .knows = "b, T, delay, steepest slope",
                                  .in_package = true};
    static double bound(const Scene& /*scene*/) { return every_object; }
    static Rendering make(const Scene& scene) {
        const DeviceProfile& device = scene.profile();
        Scheme scheme;
        scheme.coupling = stiffest_coupling_of(scene);
        const double stiffest = scheme.coupling.stiffness;
        const ForceBounds bounds = scene.object.bounds();
        for (const double share : {0.75, 0.45, 0.15}) {
            scheme.coupling.stiffness = share * stiffest;
            scheme.inertia =
                explicit_object(2.5 * scene.object.rising(), scheme.coupling, 0.5, scene.period());
            if (all_hold(inequalities(ExplicitStructure{}, bounds, scheme, device))) {
                break;
            }
        }
        return rendered_by(scene, [&](auto object) -> AnyStructure {
            return Explicit{std::move(object), scheme.inertia, scheme.coupling, scene.period()};
        });
    }
};
const Registered<ExplicitObject> explicit_object_method;

}  // namespace palpate::rivals
