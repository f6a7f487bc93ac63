// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <utility>

#include "../method.hpp"

namespace palpate::rivals {

/// Energy tank of the two-layer approach: the work of a held force is exactly F (x_{k+1} - x_k) (Stramigioli et al.
/// 2005). The tank starts with the budget. An empty tank sends no force; otherwise |F| <= E / |x_k - x_{k-1}|, so that
/// the next tick at this speed does not empty it.
struct Tank {
    static constexpr Method about{.name = "energy tank",
                                  .source = "Stramigioli et al. 2005; Franken et al. 2011",
                                  .proved = "energy up to the work of the last tick",
                                  .knows = "delay, energy that may be given"};
    static double bound(const Scene& /*scene*/) { return no_bound; }
    static Rendering make(const Scene& scene) {
        return {Limited{scene.object.held(scene.period()), scene.budget, scene.delay()}, scene.profile(),
                scene.object};
    }

    struct Limited {
        AnyStructure object;
        double budget;
        int delay;
        double energy = 0.0;
        double last = 0.0;
        Sent<double> sent{};

        void reset(double position) noexcept {
            object.reset(position);
            energy = budget;
            last = position;
            sent.reset();
        }
        [[nodiscard]] Rendered step(double position) noexcept {
            Rendered rendered = object.step(position);
            const double moved = position - std::exchange(last, position);
            energy += sent[delay] * moved;
            const double most = energy > 0.0 ? energy / std::max(std::abs(moved), 1e-300) : 0.0;
            rendered.force = std::clamp(rendered.force, -most, most);
            sent.add(rendered.force);
            return rendered;
        }
    };
};
const Registered<Tank> energy_tank;

}  // namespace palpate::rivals
