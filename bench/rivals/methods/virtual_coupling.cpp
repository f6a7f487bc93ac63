// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include "../method.hpp"
#include "palpate/rendering/massless.hpp"

namespace palpate::rivals {

/// Passive object behind the stiffest coupling with b >= K_c T / 2 + B_c (Colgate, Stanley and Brown; Adams and
/// Hannaford). With delay the coupling satisfies the generalised inequality of the certificate.
struct Coupled {
    static constexpr Method about{.name = "virtual coupling",
                                  .source = "Colgate, Stanley and Brown 1995; Adams and Hannaford 1999",
                                  .proved = "every passive object and hand; no encoder steps",
                                  .knows = "b, T, delay",
                                  .in_package = true};
    static double bound(const Scene& /*scene*/) { return every_object; }
    static Rendering make(const Scene& scene) {
        return rendered_by(scene, [&](auto object) -> AnyStructure {
            return Massless{std::move(object), stiffest_coupling_of(scene), scene.period()};
        });
    }
};
const Registered<Coupled> virtual_coupling;

}  // namespace palpate::rivals
