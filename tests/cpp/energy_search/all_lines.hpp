// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "../support.hpp"
#include "coupled_lines.hpp"
#include "guard_lines.hpp"
#include "held_lines.hpp"
#include "line.hpp"

namespace palpate::energy_search {

/// Every line of the certificate that asks for damping or friction, with the scenes that try it.
[[nodiscard]] inline std::vector<Line> all_lines() {
    std::vector<Line> lines;
    for (const double n : {0.0, 1.0, 2.0, 0.25, 0.5, 1.3}) {
        const bool whole = n == std::floor(n);
        const auto damping = [&](const char* name, bool tight, auto draw) {
            lines.push_back(
                {name, n, Part::Damping, tight, [draw, n](test::Random& random) { return draw(random, n); }});
        };
        const auto friction = [&](const char* name, bool tight, auto draw) {
            lines.push_back({name, n, Part::Friction, tight,
                             [draw, n](test::Random& random) { return draw(random, n); }});
        };
        using R = test::Random;
        const auto behind = [](StructureKind kind, Regime regime) {
            return
                [kind, regime](R& random, double delay) { return draw_coupled(random, kind, delay, regime); };
        };
        damping("direct", n == 0.0, draw_direct);
        damping("direct, steep shapes", n < 1.1, draw_direct_steep);
        damping("hysteresis", n == 0.0, draw_hysteresis);
        damping("velocity", false, draw_velocity);
        if (n > 0.0) {
            damping("jitter", false,
                    [](R& random, double delay) { return draw_jitter(random, delay, Shapes::Any); });
            damping("jitter, steep shapes", false,
                    [](R& random, double delay) { return draw_jitter(random, delay, Shapes::Steep); });
        }
        damping("prediction, steep shapes", n == 0.0,
                [](R& random, double delay) { return draw_prediction(random, delay, false, Shapes::Steep); });
        damping("prediction, hysteresis", false, draw_predicted_hysteresis);
        damping("prediction", false,
                [](R& random, double delay) { return draw_prediction(random, delay, false); });
        damping("wheel", false, [](R& random, double delay) { return draw_wheel(random, delay, false); });
        damping("wheel of wavelets", false,
                [](R& random, double delay) { return draw_network_wheel(random, delay, false); });
        damping("softening", false, draw_softening);
        damping("ramp", false, draw_ramp);
        damping("massless, no damper", false, draw_spring_behind_coupling);
        damping("massless", false, behind(StructureKind::Massless, Regime::Usual));
        damping("implicit", false, behind(StructureKind::Implicit, Regime::Usual));
        damping("energy-consistent", false, behind(StructureKind::EnergyConsistent, Regime::Usual));
        damping("massless, firm object", n == 0.0, behind(StructureKind::Massless, Regime::Firm));
        damping("implicit, firm object", n == 0.0, behind(StructureKind::Implicit, Regime::Firm));
        damping("energy-consistent, firm object", n == 0.0,
                behind(StructureKind::EnergyConsistent, Regime::Firm));
        damping("implicit, limited", false, behind(StructureKind::Implicit, Regime::Limited));
        damping("energy-consistent, limited", false,
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
        friction("force step", false, draw_force_step);
    }
    return lines;
}

/// Scene number `index` of a line. The same number gives the same scene.
[[nodiscard]] inline Trial scene_of(const Line& line, std::size_t index) {
    test::Random random{1000003 * (index + 1) + static_cast<std::size_t>(100.0 * line.delay)};
    for (;;) {
        if (std::optional<Trial> trial = line.draw(random)) {
            return *trial;
        }
    }
}

}  // namespace palpate::energy_search
