// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "../limits/coupled_maps.hpp"
#include "../limits/failure_map.hpp"
#include "../limits/held_maps.hpp"
#include "../limits/trials.hpp"
#include "table_curve.hpp"
#include "trial.hpp"

namespace palpate::rivals {

/// A limit with a published formula, and the limit that the simulation finds.
struct PublishedLimit {
    std::string_view limit;
    std::string_view source;
    std::string_view formula;
    double published = 0.0;  ///< value of the formula [N*m/rad]
    double found = 0.0;      ///< boundary of the simulation [N*m/rad]
};

/// Spring and damper, F = K x_k + B (x_k - x_{k-1}) / T.
struct SpringDamper {
    double stiffness = 0.0;
    double damping = 0.0;
    double period_s = 1e-3;
    double last = 0.0;

    void reset(double position) noexcept { last = position; }
    [[nodiscard]] Rendered step(double position) noexcept {
        const double velocity = (position - std::exchange(last, position)) / period_s;
        return {stiffness * position + damping * velocity, position, 1, Status::Ok, false};
    }
};

/// Measures every limit whose formula is public, on a knob without encoder steps (b = 0.06 N*m*s/rad, T = 1 ms).
[[nodiscard]] inline std::vector<PublishedLimit> published_limits() {
    const auto knob = [](int delay) {
        DeviceProfile device = bench::smooth_knob();
        device.delay_s = delay * device.period_s;
        return device;
    };
    const DeviceProfile plain = knob(0);
    const double b = plain.viscous_damping;
    const double T = plain.period_s;
    std::vector<PublishedLimit> all;
    const auto add = [&](std::string_view limit, std::string_view source, std::string_view formula,
                         double value, auto fails) {
        all.push_back(
            {limit, source, formula, value, bench::failure_boundary(0.2 * value, 5.0 * value, fails)});
    };
    const auto passive = [](const DeviceProfile& device, double damping) {
        return [=, any = bench::AnyCase{}](double stiffness) mutable {
            return bench::generates_energy([&] { return SpringDamper{stiffness, damping, device.period_s}; },
                                           device, 0.1, any);
        };
    };
    const std::string_view criterion = "Colgate and Schenkel 1997";
    add("spring", criterion, "b = K T / 2", 2.0 * b / T, passive(plain, 0.0));
    add("spring and damper B = 0.3 b", criterion, "b = K T / 2 + B", 2.0 * 0.7 * b / T,
        passive(plain, 0.3 * b));
    add("spring and damper B = -0.3 b", criterion, "b = K T / 2 - B", 2.0 * 0.7 * b / T,
        passive(plain, -0.3 * b));
    add("spring, 1 sample of delay", criterion, "b = 3 K T / 2, from H = K / z", 2.0 * b / (3.0 * T),
        passive(knob(1), 0.0));
    add("spring, 2 samples of delay", criterion, "b = 5 K T / 2, from H = K / z^2", 2.0 * b / (5.0 * T),
        passive(knob(2), 0.0));
    for (const int delay : {1, 2}) {
        const double B = 0.5 * b;
        const double value = (b + B) / (T * (0.5 + delay));
        add(delay == 1 ? "oscillation, B = 0.5 b, t_d = T" : "oscillation, B = 0.5 b, t_d = 2 T",
            "Gil et al. 2009", "K = (b + B) / (T / 2 + t_d)", value, [&, B](double stiffness) {
                constexpr double late_phase = 0.03;  // oscillation phase during the mean force delay [rad]
                const double late = (0.5 + delay) * T;
                const double mass = stiffness * late * late / (late_phase * late_phase);
                const auto ticks = static_cast<std::size_t>(1000.0 / late_phase * late / T);
                return bench::oscillates_with(SpringDamper{stiffness, B, T}, knob(delay),
                                              {0.0, 0.0, mass - plain.inertia, 0.0}, stiffness, ticks);
            });
    }
    const bench::FailureLine encoder = bench::encoder_map(2).lines.back();
    all.push_back({"spring, encoder step 0.02 rad", "Abbott and Okamura 2005", "K = 2 f_c / Delta",
                   encoder.theory.back(), encoder.measured.back()});
    const double speed = 1.0;      // [rad/s]
    const double friction = 0.02;  // [N*m]
    add("spring, hands up to 1 rad/s", "Diolaiti et al. 2006", "f_c + b v = K T v / 2",
        2.0 * (b + friction / speed) / T, [&](double stiffness) {
            std::vector<double> steps(20, speed * T);
            std::fill(steps.begin() + 10, steps.end(), -speed * T);
            DeviceProfile device = plain;
            device.coulomb_friction = friction;
            const TrialHand hand{{}, 0.0, std::make_shared<const std::vector<double>>(steps), 1e6 * b, T};
            double half = 0.0;
            double whole = 0.0;
            int tick = 0;
            (void)closed_loop(
                SpringDamper{stiffness, 0.0, T}, device, hand, 404, {2, 0.0, 0.0, bench::unguarded},
                [&](const Tick& /*tick*/, const Motion& /*handle*/, const palpate::EnergyBalance& account) {
                    whole = account.motor + account.dissipated;
                    half = ++tick == 204 ? whole : half;
                    return true;
                });
            return whole < half;
        });
    const double coupled = bench::coupling_limit(plain);
    add("coupling, every passive object", "Colgate, Stanley and Brown 1995", "b = K_c T / 2 + B_c", coupled,
        [&, any = bench::AnyCase{}](double stiffness) mutable {
            return bench::coupling_generates_energy({stiffness, bench::coupling_time * stiffness}, plain,
                                                    any);
        });
    const double mass = 1e-3;  // [kg*m^2]
    add("explicit step of a mass of 1e-3 kg*m^2", "Hairer, Lubich and Wanner 2006", "K = 4 m / T^2",
        4.0 * mass / (T * T), [&](double stiffness) {
            return bench::oscillates_force_driven(
                Explicit{bench::LinearObject{stiffness}, {mass, 1e-3}, {0.0, 0.0}, T}, 40'000);
        });
    std::vector<double> cubes;
    for (int k = -1000; k <= 1000; ++k) {
        cubes.push_back((1e-9 * k * k * k - 0.985) / 3.0);  // no force where the hand moves
    }
    const StaticForce cubic{TableCurve{-1.0, 1.0, cubes}};
    add("force of third order, largest slope K", "Mahvash and Hayward 2005", "b = K T / 2", 2.0 * b / T,
        [&, any = bench::AnyCase{}](double slope) mutable {
            return any(bench::paces.size(), [&](std::size_t k) {
                return bench::work_of_pacing(Direct{StaticForce{cubic.curve.scaled(slope)}}, plain,
                                             {0.01, bench::paces.at(k), 1e6 * b, T}, 0.99)
                    .negative();
            });
        });
    const double tau = T;  // of a branch, which relaxes within a sample
    add("branch of a standard linear solid, tau = T", criterion, "b = K T / (2 + T / tau), backward Euler",
        b * (2.0 + T / tau) / T, [&, any = bench::AnyCase{}](double stiffness) mutable {
            const ForceModel model = bench::relaxing_branch(stiffness, tau);
            const MemoryForce<NetworkCurve> object{model.network()->curve(), model.memory()->ratio(),
                                                   *model.memory(), T};
            return bench::generates_energy([&] { return Direct{object}; }, plain, 0.01, any);
        });
    return all;
}

[[nodiscard]] inline nlohmann::ordered_json published_as_json() {
    nlohmann::ordered_json rows = nlohmann::ordered_json::array();
    for (const PublishedLimit& each : published_limits()) {
        rows.push_back({{"limit", each.limit},
                        {"source", each.source},
                        {"formula", each.formula},
                        {"published", each.published},
                        {"found", each.found}});
    }
    return rows;
}

}  // namespace palpate::rivals
