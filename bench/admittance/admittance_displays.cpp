// SPDX-License-Identifier: Apache-2.0
// Prints known limits of admittance displays next to simulations of them. The argument selects the table.
//
//     line:    object damping of the certificate, of the linear limit, and with a feed-forward
//
//     linear:  exact linear limits against simulated ones
//
//     clutch:  oscillation of a clutch pedal with a force peak, and of the inverse curve
//
//     motion:  motion of the same pedals over time, as CSV
//
//     stops:   energy of a free mass between two stops
//
//     map:     limits of explicit and implicit over stiffness, mass and damping, as JSON: map [POINTS]

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "admittance/displays.hpp"
#include "limits/failure_map.hpp"

namespace {

using palpate::Admittance;
using palpate::AdmittanceDisplay;
using palpate::DeviceProfile;
using palpate::ForceBounds;
using palpate::Grip;
using palpate::Inertia;
using palpate::StructureKind;
using palpate::bench::FailureLine;
using palpate::bench::FailureMap;
using palpate::bench::LinearSpring;

constexpr palpate::VirtualCoupling none{0.0, 0.0};

DeviceProfile display(double period_s, int delay, std::optional<double> bandwidth_hz,
                      std::optional<double> damping, double stiffness, double hand_damping) {
    DeviceProfile device;
    device.position_unit = "m";
    device.period_s = period_s;
    device.delay_s = delay * period_s;
    AdmittanceDisplay servo;
    servo.hand_stiffness = stiffness;
    servo.hand_damping = hand_damping;
    servo.servo_bandwidth_hz = bandwidth_hz;
    servo.servo_damping = damping;
    device.admittance = servo;
    return device;
}

Admittance spring(StructureKind structure, double stiffness, Inertia inertia, const DeviceProfile& device) {
    const LinearSpring object{stiffness};
    if (structure == StructureKind::Explicit) {
        return {palpate::Explicit{object, inertia, none, device.period_s}, device};
    }
    return {palpate::Implicit{object, inertia, none, device.period_s}, device};
}

/// Returns the least stable damping of a linear object, over its slopes [N*s/m].
double linear_limit(StructureKind structure, const ForceBounds& bounds, double mass,
                    const DeviceProfile& device, double above) {
    double largest = 0.0;
    for (const double slope : {bounds.slope.lower, 0.0, bounds.slope.upper}) {
        const Grip hand{.stiffness = device.admittance->hand_stiffness};
        const auto unstable = [&](double damping) {
            return palpate::bench::grows(spring(structure, slope, {mass, damping}, device), device, hand,
                                         100'000);
        };
        // A falling object with a hand that is stiffer than its slope can be stable
        if (slope + hand.stiffness > 0.0 && unstable(1e-3 * above) && !unstable(above)) {
            largest = std::max(largest, palpate::bench::limit_between(above, 1e-3 * above, unstable));
        }
    }
    return largest;
}

void print_line() {
    struct Case {
        const char* text;
        double mass;
        DeviceProfile device;
        palpate::Interval slopes;
    };
    const Case cases[]{
        {"2 kg, 1 ms, first order 20 Hz", 2.0, display(1e-3, 1, 20.0, {}, 5e3, 50.0), {0.0, 5e3}},
        {"2 kg, 1 ms, second order 20 Hz", 2.0, display(1e-3, 1, 20.0, 0.8, 5e3, 50.0), {0.0, 5e3}},
        {"2 kg, 1 ms, second order 20 Hz, falling slopes",
         2.0,
         display(1e-3, 1, 20.0, 0.8, 5e3, 50.0),
         {-3e3, 9e3}},
        {"5 kg, 4 ms, second order 10 Hz", 5.0, display(4e-3, 1, 10.0, 0.8, 5e3, 50.0), {0.0, 5e3}},
        {"pedal 2 kg, 0.25 ms, second order 60 Hz",
         2.0,
         display(2.5e-4, 1, 60.0, 0.8, 3e4, 50.0),
         {-3e3, 9e3}},
        {"pedal 5 kg, same", 5.0, display(2.5e-4, 1, 60.0, 0.8, 3e4, 50.0), {-3e3, 9e3}},
        {"pedal 0.5 kg, 0.25 ms, no lag", 0.5, display(2.5e-4, 1, {}, {}, 3e4, 50.0), {-3e3, 9e3}}};
    std::printf(
        "| display | implicit | explicit | energy-consistent | linear implicit | linear explicit | with "
        "feed-forward |\n|---|---|---|---|---|---|---|\n");
    for (const Case& each : cases) {
        ForceBounds bounds;
        bounds.slope = each.slopes;
        bounds.steepest = bounds.sliding = bounds.slope.largest();
        const auto needed = [&](StructureKind structure, const DeviceProfile& device) {
            return palpate::needed_object_damping(structure, bounds, {each.mass, 0.0}, device);
        };
        DeviceProfile forward = each.device;
        forward.admittance->feed_forward_s = servo_of(*forward.admittance).lag_s();
        const double implicit = needed(StructureKind::Implicit, each.device);
        const double explicit_need = needed(StructureKind::Explicit, each.device);
        std::printf("| %s | %.3g | %.3g | %.3g | %.3g | %.3g | %.3g |\n", each.text, implicit, explicit_need,
                    needed(StructureKind::EnergyConsistent, each.device),
                    linear_limit(StructureKind::Implicit, bounds, each.mass, each.device, explicit_need),
                    linear_limit(StructureKind::Explicit, bounds, each.mass, each.device, explicit_need),
                    needed(StructureKind::Implicit, forward));
        std::fflush(stdout);
    }
}

/// Prints the hand stiffness at which a linear display becomes unstable, and the formula for it.
int print_linear() {
    int wrong = 0;
    const auto row = [&](const char* text, double formula, double simulated) {
        const double error = simulated / formula - 1.0;
        wrong += std::abs(error) < 1e-3 ? 0 : 1;
        std::printf("| %s | %.6g | %.6g | %.2g %% |\n", text, formula, simulated, 100.0 * error);
        std::fflush(stdout);
    };
    std::printf("| display | formula [N/m] | simulated [N/m] | difference |\n|---|---|---|---|\n");
    struct Object {
        double mass, damping, slope;
    };
    for (const auto& [mass, damping, slope] : {Object{0.5, 20.0, 2e3}, Object{2.0, 5.0, -1e3}}) {
        const double T = 1e-3;
        const DeviceProfile device = display(T, 0, {}, {}, 0.0, 0.0);
        const auto simulated = [&](StructureKind structure, double formula) {
            return palpate::bench::limit_between(0.5 * formula, 1.5 * formula, [&](double stiffness) {
                return palpate::bench::grows(spring(structure, slope, {mass, damping}, device), device,
                                             {.stiffness = stiffness}, 100'000);
            });
        };
        const double implicit = 4.0 * mass / (T * T) + 2.0 * damping / T + slope;
        row("no lag, implicit: 4 m / T^2 + 2 B_o / T + f'", implicit,
            simulated(StructureKind::Implicit, implicit));
        const double explicit_limit = 4.0 * mass / (T * T) - 2.0 * damping / T - slope;
        row("no lag, explicit: 4 m / T^2 - 2 B_o / T - f'", explicit_limit,
            simulated(StructureKind::Explicit, explicit_limit));
    }
    for (const auto& [mass, damping, slope] : {Object{2.0, 40.0, 3e3}, Object{1.0, 90.0, 0.0}}) {
        const double T = 4e-6;
        const double bandwidth = 20.0;
        const double w = 2.0 * std::numbers::pi * bandwidth;
        const DeviceProfile device = display(T, 0, bandwidth, {}, 0.0, 0.0);
        // Routh: (m + B_o / w)(B_o + f' / w) > (m / w)(f' + k)
        const double formula = (mass + damping / w) * (damping + slope / w) / (mass / w) - slope;
        row("first-order lag 20 Hz, T = 4 us: Routh", formula,
            palpate::bench::limit_between(0.5 * formula, 1.5 * formula, [&](double stiffness) {
                return palpate::bench::grows(spring(StructureKind::Implicit, slope, {mass, damping}, device),
                                             device, {.stiffness = stiffness}, 400'000);
            }));
    }
    return wrong;
}

void print_clutch() {
    const Inertia object =
        palpate::admittance_object(StructureKind::Implicit, palpate::bench::Clutch::bounds(), {1.0, 0.0},
                                   palpate::bench::clutch_pedal(), 1.0);
    std::printf("certified object damping: %.4g N*s/m\n\n", object.damping);
    std::printf("| rendering | foot without damping [mm] | foot with 50 N*s/m [mm] |\n|---|---:|---:|\n");
    for (const double share : {1.0, 0.9, 0.8, 0.5, 0.3}) {
        std::printf("| virtual object, %g of the certified damping | %.2g | %.2g |\n", share,
                    1e3 * palpate::bench::clutch_oscillation(share, 1.0, 0.0),
                    1e3 * palpate::bench::clutch_oscillation(share, 1.0, 50.0));
    }
    for (const double filter : {0.0, 1e-2}) {
        std::printf("| position over force, filter of %g ms |", 1e3 * filter);
        for (const double damping : {0.0, 50.0}) {
            std::array<double, 3> found{17e-3, 19e-3, 22e-3};
            for (double& each : found) {
                each = 1e3 * palpate::bench::inverse_oscillation(each, filter, damping);
            }
            const auto [low, high] = std::minmax_element(found.begin(), found.end());
            std::printf(" %.2g to %.2g |", *low, *high);
        }
        std::printf("\n");
    }
}

/// Prints the motion of the clutch pedal at rest on the drop of its force, in mm, with a foot without damping.
void print_motion() {
    constexpr double rest = 19e-3;
    constexpr double start = 1e-4;  // distance from the rest position [m]
    constexpr int samples = 800;
    const DeviceProfile device = palpate::bench::clutch_pedal();
    const Grip hand = palpate::bench::clutch_foot(rest, 0.0);
    std::vector<std::vector<double>> columns;
    for (const double share : {1.0, 0.9}) {
        Admittance source = palpate::bench::clutch_object(share, 1.0);
        source.reset(rest + start);
        columns.push_back(palpate::bench::handle_motion(
            device, hand, rest + start, samples, [&](double force) { return source.step(force).position; }));
    }
    palpate::bench::InverseClutch inverse{hand.push};
    columns.push_back(palpate::bench::handle_motion(device, hand, rest + start, samples,
                                                    [&](double force) { return inverse.command(force); }));
    std::printf("time_s,certified_mm,nine_tenths_mm,inverse_mm\n");
    for (std::size_t k = 0; k < columns.front().size(); ++k) {
        std::printf("%.6g", device.period_s * static_cast<double>(k + 1));
        for (const std::vector<double>& column : columns) {
            std::printf(",%.5g", 1e3 * column[k]);
        }
        std::printf("\n");
    }
}

void print_stops() {
    std::printf("| K T^2 / m | explicit | implicit | explicit, B_o = M T / 2 |\n|---|---|---|---|\n");
    for (const double step : {0.1, 0.5, 1.0, 3.5}) {
        const auto explicit_of = [](double damping) {
            return [damping](palpate::bench::TwoStops object) {
                // Damping at the new velocity is damping at the old one with a mass that is larger by B_o T
                return palpate::Explicit{object, {1.0 + damping, damping}, none, 1.0};
            };
        };
        const auto implicit = [](palpate::bench::TwoStops object) {
            return palpate::Implicit{object, {1.0, 0.0}, none, 1.0};
        };
        std::printf("| %g | %.4g | %.4g | %.4g |\n", step,
                    palpate::bench::energy_gain(step, 300, explicit_of(0.0)),
                    palpate::bench::energy_gain(step, 300, implicit),
                    palpate::bench::energy_gain(step, 300, explicit_of(0.5 * step)));
    }
}

/// Kinds of the maps, with their words.
constexpr std::pair<StructureKind, const char*> steps[]{{StructureKind::Implicit, "implicit"},
                                                        {StructureKind::Explicit, "explicit"}};
constexpr double map_masses[]{0.3, 1.0};

/// Stiffest spring hand of a display without lag, whose object is a spring: 4 m / T^2 + 2 B_o / T + f' with the implicit
/// step, 4 m / T^2 - 2 B_o / T - f' with the explicit one.
FailureMap stiffness_map(const char* name, const char* along, const std::vector<double>& at,
                         bool over_damping) {
    constexpr double T = 1e-3;
    constexpr double other = 10.0;  // damping [N*s/m] or slope [N/m] that the axis does not show
    FailureMap map{name, along, "stiffness of the hand [N/m]", {}};
    const DeviceProfile device = display(T, 0, {}, {}, 0.0, 0.0);
    for (const auto& [structure, word] : steps) {
        for (const double mass : map_masses) {
            const double sign = structure == StructureKind::Implicit ? 1.0 : -1.0;
            const auto damping = [&](double value) { return over_damping ? value : other; };
            const auto slope = [&](double value) { return over_damping ? other : value; };
            map.lines.push_back(palpate::bench::failure_line(
                std::string(word) + ", " + palpate::readable(mass) + " kg", at,
                [&](double value) {
                    return 4.0 * mass / (T * T) + sign * (2.0 * damping(value) / T + slope(value));
                },
                [&](double value, double stiffness) {
                    return palpate::bench::grows(
                        spring(structure, slope(value), {mass, damping(value)}, device), device,
                        {.stiffness = stiffness}, 20'000);
                },
                1.5));
        }
    }
    return map;
}

/// Least object damping of a pedal with a servo, over the mass: simulated, exact for a spring, and certified.
FailureMap damping_map(int points) {
    constexpr double stiffness = 2e4;
    constexpr double slope = 5e3;
    FailureMap map{"servo", "mass m [kg]", "least damping B_o [N*s/m]", {}};
    const DeviceProfile device = display(2.5e-4, 1, 60.0, 0.8, stiffness, 0.0);
    ForceBounds bounds;
    bounds.slope = {0.0, slope};
    bounds.steepest = bounds.sliding = slope;
    const std::vector<double> masses = palpate::bench::logarithmic(0.05, 5.0, points);
    for (const auto& [structure, word] : steps) {
        FailureLine line{word, masses, {}, {}};
        FailureLine certified{std::string(word) + ", certified", masses, {}, {}};
        for (const double mass : masses) {
            const double exact =
                palpate::bench::exact_damping_limit(structure, mass, slope, stiffness, device);
            line.theory.push_back(exact);
            line.measured.push_back(
                palpate::bench::limit_between(2.0 * exact, 0.5 * exact, [&](double damping) {
                    return palpate::bench::grows(spring(structure, slope, {mass, damping}, device), device,
                                                 {.stiffness = stiffness}, 40'000);
                }));
            const double needed =
                palpate::admittance_object(structure, bounds, {mass, 0.0}, device, mass).damping;
            certified.measured.push_back(needed);
            certified.theory.push_back(exact);
        }
        map.lines.push_back(line);
        map.lines.push_back(certified);
    }
    return map;
}

void print_map(int points) {
    const auto json = nlohmann::ordered_json::array(
        {as_json(stiffness_map("damping", "object damping B_o [N*s/m]",
                               palpate::bench::logarithmic(3.0, 500.0, points), true)),
         as_json(stiffness_map("slope", "slope of the object f' [N/m]",
                               palpate::bench::logarithmic(1e4, 1e6, points), false)),
         as_json(damping_map(points))});
    std::puts(json.dump(1).c_str());
}

}  // namespace

int main(int argc, char** argv) {
    const std::string which = argc > 1 ? argv[1] : "";
    if (which == "line") {
        print_line();
    } else if (which == "linear") {
        return print_linear() > 0 ? 1 : 0;
    } else if (which == "clutch") {
        print_clutch();
    } else if (which == "stops") {
        print_stops();
    } else if (which == "motion") {
        print_motion();
    } else if (which == "map") {
        print_map(argc > 2 ? std::max(2, std::atoi(argv[2])) : 9);
    } else {
        std::fprintf(stderr, "usage: admittance_displays line|linear|clutch|motion|stops|map [POINTS]\n");
        return 2;
    }
    return 0;
}
