// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "../support.hpp"
#include "coupled_lines.hpp"
#include "exported_lines.hpp"
#include "guard_lines.hpp"
#include "held_lines.hpp"
#include "line.hpp"
#include "memory_lines.hpp"

namespace palpate::energy_search {

/// Returns every inequality of the certificate that requires damping or friction, with the scenes that test this
/// inequality.
[[nodiscard]] inline std::vector<Line> all_lines() {
    std::vector<Line> lines;
    for (const double n : {0.0, 1.0, 2.0, 0.25, 0.5, 1.3}) {
        const bool whole = n == std::floor(n);
        const auto add = [&](const char* id, Part part) {
            return [&lines, id, part, n](const char* name, bool tight, auto draw) {
                lines.push_back(
                    {id, name, n, part, tight, [draw, n](test::Random& random) { return draw(random, n); }});
            };
        };
        const auto hold = add("damping-hold", Part::Damping);
        const auto coupling = add("damping-coupling", Part::Damping);
        const auto friction = add("friction-steps", Part::Friction);
        using R = test::Random;
        const auto behind = [](StructureKind kind, Regime regime) {
            return
                [kind, regime](R& random, double delay) { return draw_coupled(random, kind, delay, regime); };
        };
        hold("direct", n == 0.0, draw_direct);
        hold("direct, steep shapes", n < 1.1, draw_direct_steep);
        hold("hysteresis", n == 0.0, draw_hysteresis);
        hold("velocity", false, draw_velocity);
        hold("memory", false, [](R& random, double delay) { return draw_memory(random, delay, false); });
        if (n > 0.0) {
            hold("jitter", false,
                 [](R& random, double delay) { return draw_jitter(random, delay, Shapes::Any); });
            hold("jitter, steep shapes", false,
                 [](R& random, double delay) { return draw_jitter(random, delay, Shapes::Steep); });
        }
        hold("prediction, steep shapes", n == 0.0,
             [](R& random, double delay) { return draw_prediction(random, delay, false, Shapes::Steep); });
        hold("prediction, hysteresis", false, draw_predicted_hysteresis);
        hold("prediction", false,
             [](R& random, double delay) { return draw_prediction(random, delay, false); });
        hold("wheel", false, [](R& random, double delay) { return draw_wheel(random, delay, false); });
        hold("wheel of wavelets", false,
             [](R& random, double delay) { return draw_network_wheel(random, delay, false); });
        hold("softening", false, draw_softening);
        hold("ramp", false, draw_ramp);
        hold("massless, no damper", false, draw_spring_behind_coupling);
        coupling("massless", false, behind(StructureKind::Massless, Regime::Usual));
        coupling("implicit", false, behind(StructureKind::Implicit, Regime::Usual));
        coupling("energy-consistent", false, behind(StructureKind::EnergyConsistent, Regime::Usual));
        coupling("massless, firm object", n == 0.0, behind(StructureKind::Massless, Regime::Firm));
        coupling("implicit, firm object", n == 0.0, behind(StructureKind::Implicit, Regime::Firm));
        coupling("energy-consistent, firm object", n == 0.0,
                 behind(StructureKind::EnergyConsistent, Regime::Firm));
        coupling("implicit, limited", false, behind(StructureKind::Implicit, Regime::Limited));
        coupling("energy-consistent, limited", false,
                 behind(StructureKind::EnergyConsistent, Regime::Limited));
        if (!whole) {
            continue;
        }
        if (n == 0.0) {
            friction("wheel with hysteresis, mean", false, draw_hysteresis_wheel);
        }
        friction("wheel, mean", false,
                 [](R& random, double delay) { return draw_wheel(random, delay, true); });
        friction("wheel of wavelets, mean", false,
                 [](R& random, double delay) { return draw_network_wheel(random, delay, true); });
        friction("encoder", false,
                 [](R& random, double delay) { return draw_encoder(random, delay, false); });
        friction("encoder, hysteresis", false,
                 [](R& random, double delay) { return draw_encoder(random, delay, true); });
        friction("encoder, massless", false,
                 [](R& random, double delay) { return draw_coupled_encoder(random, delay, false); });
        friction("encoder, mass and spring", false,
                 [](R& random, double delay) { return draw_coupled_encoder(random, delay, true); });
        friction("encoder, prediction", false,
                 [](R& random, double delay) { return draw_prediction(random, delay, true); });
        friction("encoder, memory", false,
                 [](R& random, double delay) { return draw_memory(random, delay, true); });
        friction("force step", false, draw_force_step);
        friction("exported model", false,
                 [](R& random, double delay) { return draw_exported(random, delay, false); });
        friction("exported model, hysteresis", false,
                 [](R& random, double delay) { return draw_exported(random, delay, true); });
    }
    return lines;
}

/// Returns the random scene with the number `index` for an inequality of the certificate. The same `index` gives the
/// same scene.
[[nodiscard]] inline Trial scene_of(const Line& line, std::size_t index) {
    test::Random random{1000003 * (index + 1) + static_cast<std::size_t>(100.0 * line.delay)};
    for (;;) {
        if (std::optional<Trial> trial = line.draw(random)) {
            return *trial;
        }
    }
}

}  // namespace palpate::energy_search
