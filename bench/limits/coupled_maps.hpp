// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include "held_maps.hpp"
#include "palpate/dynamics/coupling.hpp"
#include "palpate/fields/readable.hpp"
#include "palpate/rendering/any_structure.hpp"
#include "palpate/rendering/energy_consistent.hpp"
#include "palpate/rendering/explicit.hpp"
#include "palpate/rendering/implicit.hpp"
#include "palpate/rendering/massless.hpp"
#include "palpate/stability/coupled_inequalities.hpp"
#include "palpate/stability/coupling_need.hpp"

namespace palpate::bench {

/// Map: stiffness of a spring in the explicit structure, driven by a force, over the object mass. Theory: (4m - 2 B_o
/// T) / T^2.
[[nodiscard]] inline FailureMap explicit_map(int points) {
    constexpr double period = 1e-3;
    constexpr std::size_t ticks = 40'000;
    FailureMap map{"explicit", "mass m [kg*m^2]", "stiffness K [N*m/rad]", {}};
    for (const double damping : {0.001, 0.01, 0.1}) {
        map.lines.push_back(failure_line(
            "B_o = " + readable(damping), logarithmic(1e-4, 1e-2, points),
            [&](double mass) { return (4.0 * mass - 2.0 * damping * period) / (period * period); },
            [&](double mass, double stiffness) {
                return oscillates_force_driven(Explicit{LinearObject{stiffness}, {mass, damping}, {}, period},
                                               ticks);
            },
            3.0));
    }
    return map;
}

/// Returns true if a hand can take energy out of one of several objects behind a coupling in the steady state. Each
/// object responds like a spring whose stiffness is a share of the coupling stiffness, or for a negative share like a
/// mass.
[[nodiscard]] inline bool coupling_generates_energy(VirtualCoupling coupling, const DeviceProfile& device,
                                                    AnyCase& any) {
    constexpr double reach = 0.01;  // [rad]
    constexpr std::array slow{1, 2, 3, 4, 6, 10};
    constexpr std::array shares{1e6, 3.0, 1.0, 0.3, -0.5, -0.8, -1.0, -1.1, -1.2, -1.4, -1.7, -2.0, -4.0};
    const double period = device.period_s;
    return any(slow.size() * shares.size(), [&](std::size_t k) {
        const int pace = slow.at(k / shares.size());
        const double share = shares.at(k % shares.size());
        const auto settled = 400 * static_cast<std::size_t>(pace) * static_cast<std::size_t>(pace);
        const double tangent = std::tan(0.5 * std::numbers::pi / pace);
        const double stiffness = std::max(0.0, share) * coupling.stiffness;
        const double mass =
            std::max(0.0, -share) * coupling.stiffness * period * period / (4.0 * tangent * tangent);
        return work_of_pacing(
                   EnergyConsistent{LinearObject{stiffness}, {mass, 0.0}, coupling, period, 1e-4, false},
                   device, {reach, pace, 1e6 * device.viscous_damping, period}, 0.0,
                   share < 0.0 ? settled : 400)
            .negative();
    });
}

/// Ratio of coupling damping to coupling stiffness in the maps [s].
inline constexpr double coupling_time = 0.2e-3;

/// Map: stiffness of the stiffest coupling that is certified for every passive object behind the coupling. Theory:
/// device damping b > K_c T / 2 + B_c, and the same inequality with delay.
[[nodiscard]] inline double coupling_limit(const DeviceProfile& device) noexcept {
    const double need = coupling_need({1.0, coupling_time}, device.period_s, device.whole_delay_samples(),
                                      device.delay_fraction());
    return device.viscous_damping / (device.period_s * need);
}

/// Failure map: largest coupling stiffness as a function of the device damping.
[[nodiscard]] inline FailureMap coupling_map(int points) {
    return {"coupling", "device damping b [N*m*s/rad]", "coupling stiffness K_c [N*m/rad]",
            lines_over_damping(points, 3.0, coupling_limit,
                               [any = AnyCase{}](const DeviceProfile& device, double stiffness) mutable {
                                   return coupling_generates_energy({stiffness, coupling_time * stiffness},
                                                                    device, any);
                               })};
}

/// Map: steepest falling slope of an object behind a coupling over the coupling stiffness. The device has exactly the
/// damping that the coupling needs, and the force limit of the device is never reached. The theoretical slopes are
/// sufficient: K_c + B_c/T without mass, K_c + (B_c + 2 B_o)/T with mass and backward Euler.
[[nodiscard]] inline FailureMap falling_map(int points) {
    constexpr double width = 0.1;  // object snaps from -width to width [rad]
    const double period = smooth_knob().period_s;
    FailureMap map{"falling", "coupling stiffness K_c [N*m/rad]", "steepest fall s [N*m/rad]", {}};
    const auto gives = [&](auto build, double stiffness, double falling) {
        const VirtualCoupling coupling{stiffness, coupling_time * stiffness};
        DeviceProfile device = smooth_knob();
        device.viscous_damping = period * coupling_need(coupling, period, 0);
        const SnappingObject object{falling, width};
        const double deepest = 0.25 * falling * width * width;
        for (const double reach : {0.02 * width, 0.2 * width, width, 2.0 * width}) {
            for (const double middle : {0.0, 0.5 * width}) {
                for (const int pace : paces) {
                    const double start = middle - 0.5 * reach;
                    const PacedWork work =
                        work_of_pacing(build(object, coupling), device, {reach, pace, 1e6, period}, start);
                    if (work.whole < -(object.at(start, {}).energy + deepest + work.rounding)) {
                        return true;
                    }
                }
            }
        }
        return false;
    };
    map.searched = 10.0;
    const auto add = [&](const char* name, double damping, auto build) {
        map.lines.push_back(failure_line(
            name, logarithmic(10.0, 1000.0, points),
            [&](double stiffness) {
                return stiffness + (coupling_time * stiffness + 2.0 * damping) / period;
            },
            [&](double stiffness, double falling) { return gives(build, stiffness, falling); },
            map.searched));
    };
    const LoadLineSolver solver{.longest_step = 0.1 * width};
    add("massless", 0.0, [&](const auto& object, VirtualCoupling coupling) {
        return Massless{object, coupling, period, solver};
    });
    add("implicit, B_o = 0.02", 0.02, [&](const auto& object, VirtualCoupling coupling) {
        return Implicit{object, Inertia{0.001, 0.02}, coupling, period, solver};
    });
    return map;
}

/// Work of a hand on a free mass [J]. The hand stretches the coupling, waits until the mass has passed the handle,
/// then slows the mass down with a coupling force just below the force limit of the device. The device clips the force
/// of the structure.
[[nodiscard]] inline double work_of_a_throw(AnyStructure structure, VirtualCoupling coupling,
                                            const DeviceProfile& device, double deflection) {
    constexpr int deflecting = 60;  // samples
    constexpr int most_slowing = 4000;
    const double limit = device.force_limit;
    double work = 0.0;
    double x = 0.0;
    structure.reset(x);
    Rendered now = structure.step(x);
    const auto move = [&](double to) {
        const double d = to - x;
        work += std::clamp(now.force, -limit, limit) * d + device.viscous_damping / device.period_s * d * d;
        x = to;
        now = structure.step(x);
    };
    for (int k = 0; k < deflecting; ++k) {
        move(x + deflection / deflecting);
    }
    double before = now.environment_position - 1.0;
    while (now.environment_position < x + limit / coupling.stiffness && now.environment_position > before) {
        before = now.environment_position;
        move(x);
    }
    for (int k = 0; k < most_slowing && now.environment_position >= before; ++k) {
        before = now.environment_position;
        move(std::max(x, before - 0.99 * limit / coupling.stiffness));
    }
    return work;
}

/// Map: work of a hand that accelerates a mass behind a coupling, over the deflection of the coupling. The force limit
/// is applied inside the step to device and object, or outside the step to the device only. Negative work means that
/// the hand takes energy out.
[[nodiscard]] inline FailureMap limit_map(int points) {
    constexpr double infinite = std::numeric_limits<double>::infinity();
    const Inertia mass{0.05, 0.0};
    const VirtualCoupling coupling{90.0, 0.0};
    DeviceProfile device = smooth_knob();
    device.viscous_damping = device.period_s * coupling_need(coupling, device.period_s, 0);
    FailureMap map{"limit", "deflection of the coupling [rad]", "work of the hand [J]", {}};
    map.linear = true;
    const auto add = [&](const char* name, auto build) {
        FailureLine line{name, logarithmic(0.05, 0.6, points), {}, {}};
        for (const double deflection : line.at) {
            line.measured.push_back(work_of_a_throw(build(), coupling, device, deflection));
            line.theory.push_back(std::numeric_limits<double>::quiet_NaN());
        }
        map.lines.push_back(std::move(line));
    };
    const auto implicit = [&](double limit) {
        return Implicit<LinearObject>{LinearObject{}, mass, coupling, device.period_s, {}, limit};
    };
    add("limit outside the step", [&] { return implicit(infinite); });
    add("limit inside, implicit", [&] { return implicit(device.force_limit); });
    add("limit inside, energy-consistent", [&] {
        return EnergyConsistent{LinearObject{}, mass, coupling,          device.period_s,
                                1e-4,           true, device.force_limit};
    });
    return map;
}

/// Failure map: largest stiffness of each structure as a function of the period, for the default knob.
[[nodiscard]] inline FailureMap period_map(int points) {
    constexpr Inertia inertia{0.001, 0.1};
    constexpr std::size_t ticks = 40'000;
    FailureMap map{"period", "sample time T [s]", "stiffness [N*m/rad]", {}};
    const std::vector<double> periods = logarithmic(2e-4, 5e-3, points);
    const auto device = [](double period, int delay) {
        DeviceProfile knob = smooth_knob();
        knob.period_s = period;
        knob.delay_s = delay * knob.period_s;
        return knob;
    };
    for (int delay = 0; delay <= 2; ++delay) {
        map.lines.push_back(failure_line(
            "direct, delay " + std::to_string(delay), periods,
            [&](double period) { return direct_limit(device(period, delay)); },
            [&](double period, double stiffness) {
                return spring_oscillates(device(period, delay), stiffness);
            }));
    }
    map.lines.push_back(failure_line(
        "coupling, delay 0", periods, [&](double period) { return coupling_limit(device(period, 0)); },
        [&, any = AnyCase{}](double period, double stiffness) mutable {
            return coupling_generates_energy({stiffness, coupling_time * stiffness}, device(period, 0), any);
        },
        3.0));
    map.lines.push_back(failure_line(
        "explicit, driven by a force", periods,
        [&](double period) {
            return (4.0 * inertia.mass - 2.0 * inertia.damping * period) / (period * period);
        },
        [&](double period, double stiffness) {
            return oscillates_force_driven(Explicit{LinearObject{stiffness}, inertia, {}, period}, ticks);
        },
        3.0));
    return map;
}

/// Encoder step of a spring behind a coupling over the stiffness of the spring: f_c >= gamma Delta / 2, where gamma
/// is K_c K / (K_c + K) without coupling damping. With damping gamma assumes the worst position of each edge between
/// two counts, so it is sufficient only.
[[nodiscard]] inline FailureMap coupled_encoder_map(int points) {
    constexpr double stiffness = 40.0;  // coupling stiffness K_c [N*m/rad]
    constexpr double friction = 0.002;  // Coulomb friction f_c [N*m]
    FailureMap map{"coupled-encoder", "stiffness K [N*m/rad]", "encoder step [rad]", {}};
    map.searched = 10.0;
    for (const double damping : {0.0, 0.008, 0.02}) {
        const VirtualCoupling coupling{stiffness, damping};
        const auto bound = [&](double spring) {
            ForceBounds bounds;
            bounds.slope = {spring, spring};
            return 2.0 * friction / massless_gain(bounds, coupling, smooth_knob().period_s);
        };
        const auto fails = [&, any = AnyCase{}](double spring, double step) mutable {
            DeviceProfile knob = smooth_knob();
            knob.encoder_step = step;
            knob.coulomb_friction = friction;
            const std::vector<double> motions = motions_over_an_edge(knob);
            return any(3 * motions.size(), [&](std::size_t k) {
                const int pace = std::array{1, 2, 4}.at(k / motions.size());
                const double reach = motions[k % motions.size()];
                return work_of_pacing(Massless{LinearObject{spring}, coupling, knob.period_s}, knob,
                                      {reach, pace, 1e6, knob.period_s}, 0.5 * step - 0.5 * reach, 100)
                    .negative();
            });
        };
        map.lines.push_back(failure_line("B_c = " + readable(damping), logarithmic(4.0, 4000.0, points),
                                         bound, fails, map.searched));
    }
    return map;
}

}  // namespace palpate::bench
