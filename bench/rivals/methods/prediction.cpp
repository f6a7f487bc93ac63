// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include "../method.hpp"

namespace palpate::rivals {

/// Force at a position predicted half a sample ahead, from the previous 4 samples. A force with memory is held, because
/// nothing is proved for its prediction.
struct Prediction {
    static constexpr Method about{.name = "half-sample prediction",
                                  .source = "this project; docs/certificate.md",
                                  .proved = "every object within the bound, every motion, encoder steps",
                                  .knows = "b, T, f_c, encoder step, delay",
                                  .in_package = true,
                                  .ours = true};
    static constexpr int taps = 4;
    static double bound(const Scene& scene) {
        return certified_scale(scene.object, scene.profile(), scene.object.branch > 0.0 ? 0 : taps);
    }
    static Rendering make(const Scene& scene) {
        if (scene.object.branch > 0.0) {
            return held(scene);
        }
        return rendered_by(
            scene, [](auto object) -> AnyStructure { return PredictedDirect{std::move(object), taps}; });
    }
};
const Registered<Prediction> prediction;

}  // namespace palpate::rivals
