// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <utility>
#include <vector>

#include "palpate/device/device_profile.hpp"
#include "palpate/rendering/scale.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/stability/certificate.hpp"
#include "palpate/stability/coupled_inequalities.hpp"
#include "palpate/stability/direct_inequalities.hpp"
#include "palpate/stability/force_bounds.hpp"
#include "palpate/stability/held_force.hpp"
#include "palpate/stability/inequality.hpp"

namespace palpate {

namespace detail {

/// Returns the largest value v between 0 and `most` for which holds(v) is true. If holds(v) is true, it must also be
/// true for all values from 0 to v.
template <class Holds>
[[nodiscard]] double largest_that_holds(double most, Holds holds) {
    if (holds(most)) {
        return most;
    }
    double low = 0.0;
    double high = most;
    // The first loop finds the result within a factor of eight, the second loop finds the 50 leading bits of the
    // result.
    constexpr int eighths = 20;
    for (int k = 1; k < eighths && low == 0.0; ++k) {
        const double guess = std::ldexp(most, -3 * k);
        (holds(guess) ? low : high) = guess;
    }
    for (int k = 0; k < 50; ++k) {
        const double middle = 0.5 * (low + high);
        (holds(middle) ? low : high) = middle;
    }
    return low;
}

/// Returns true if direct rendering of a force with these slopes is certified on a device. `stick` is the slope h / r
/// (hysteresis / play radius) that sticking adds; 0 without hysteresis [N/m].
[[nodiscard]] inline bool holds_directly(const DeviceProfile& device, SlopeRange sliding, double stick) {
    ForceBounds bounds;
    bounds.slope = {-sliding.falling, sliding.rising + stick};
    bounds.sliding = sliding.steepest();
    bounds.steepest = bounds.sliding + stick;
    bounds.hysteresis_per_play = stick;
    return all_hold(hysteresis_inequalities(bounds, device));
}

/// Returns the upper end of the slopes in which the largest renderable slope is searched [N/m]. It is larger than any
/// realistic slope, and far below the largest double.
[[nodiscard]] inline double slope_search_limit(const DeviceProfile& device) noexcept {
    return 1e9 * (1.0 + device.viscous_damping / device.period_s);
}

}  // namespace detail

/// Returns the most negative and the largest slope of a force for which direct rendering on a device is certified
/// [N/m].
///
/// First finds the largest k for which a force with slopes from -k to k is certified, both slopes limited to `wanted`.
/// Then finds the steepest falling slope, and after that the steepest rising slope, because falling slopes need less
/// damping. With hysteresis these are the slopes while the play operator moves; while it sticks, h / r = `stick` adds
/// to the slope. A slope that the device does not limit is infinite.
[[nodiscard]] inline Interval renderable_slopes(const DeviceProfile& device, double stick = 0.0,
                                                SlopeRange wanted = {
                                                    std::numeric_limits<double>::infinity(),
                                                    std::numeric_limits<double>::infinity()}) {
    constexpr double inside = 1.0 - 1e-5;
    const double most = detail::slope_search_limit(device);
    const auto holds = [&](double rising, double falling) {
        return detail::holds_directly(device, {rising, falling}, stick);
    };
    const double both = detail::largest_that_holds(
        most, [&](double k) { return holds(std::min(k, wanted.rising), std::min(k, wanted.falling)); });
    // Slightly smaller slopes than the certified ones, because at the certified slopes rounding would hide the margin
    // that remains for a steeper falling or rising slope.
    double rising = inside * std::min(both, wanted.rising);
    double falling = inside * std::min(both, wanted.falling);
    falling = std::max(falling, inside * detail::largest_that_holds(most, [&](double k) {
                                    return holds(rising, std::max(k, falling));
                                }));
    rising = std::max(rising, detail::largest_that_holds(
                                  most, [&](double k) { return holds(std::max(k, rising), falling); }));
    const auto end = [&](double slope) {
        return slope < inside * inside * most ? slope : std::numeric_limits<double>::infinity();
    };
    return {-end(falling), end(rising)};
}

/// Returns the largest slope h / r (hysteresis / play radius) for which a force with hysteresis is certified on a
/// device, if the slopes of its press force and release force are as large as h / r [N/m].
[[nodiscard]] inline double steepest_stick(const DeviceProfile& device) {
    return detail::largest_that_holds(detail::slope_search_limit(device), [&](double stick) {
        return detail::holds_directly(device, {stick, stick}, stick);
    });
}

/// Returns the smallest play radius between `least` and `most` for which a force with hysteresis is certified on a
/// device [m]; infinity if `most` is not certified. `sliding` has the bounds of the force for a play radius so large
/// that h / r adds nothing to the slope.
[[nodiscard]] inline double narrowest_play(const ForceBounds& sliding, const DeviceProfile& device,
                                           double least, double most) {
    const auto holds = [&](double radius) {
        ForceBounds bounds = sliding;
        bounds.hysteresis_per_play = std::max(0.0, sliding.hysteresis_force.upper) / radius;
        bounds.slope.upper += bounds.hysteresis_per_play;
        bounds.steepest = sliding.sliding + bounds.hysteresis_per_play;
        const std::vector<Inequality> lines = hysteresis_inequalities(bounds, device);
        return all_hold(lines);
    };
    if (least > 0.0 && holds(least)) {
        return least;
    }
    if (!holds(most)) {
        return std::numeric_limits<double>::infinity();
    }
    double wide = most;
    double narrow = least;
    for (int k = 0; k < 60; ++k) {
        const double middle = narrow > 0.0 ? std::sqrt(narrow * wide) : 0.5 * wide;
        (holds(middle) ? wide : narrow) = middle;
    }
    return wide;
}

/// Returns the virtual object and the virtual coupling for the explicit structure: those with the stiffest coupling,
/// then with the smallest object damping, for which every inequality of the certificate holds. If there is none,
/// returns the last combination tried. `chosen` contains the values that the user sets: object mass, object damping,
/// coupling, play radius.
[[nodiscard]] inline Scheme explicit_scheme(const ForceBounds& bounds, const DeviceProfile& device,
                                            const SchemeChoices& chosen) {
    // Tried values of the coupling stiffness divided by the largest certified stiffness
    constexpr std::array shares{0.9, 0.75, 0.6, 0.45, 0.3, 0.15};
    // Tried values of B_o T / m (object damping B_o, object mass m); the paper uses 0.5
    constexpr std::array ratios{0.1, 0.25, 0.5, 1.0};
    // Tried values of (largest stable model slope + K_c) / (steepest slope of the model + K_c), coupling stiffness K_c
    constexpr std::array reserves{1.1, 1.5, 2.5, 5.0};
    const double T = device.period_s;
    const double stiffest = stiffest_coupling(0.0, 0.0, device);
    Scheme scheme;
    scheme.structure = StructureKind::Explicit;
    scheme.play_radius = chosen.play_radius.value_or(0.0);
    scheme.coupling.damping = chosen.coupling_damping.value_or(0.1 * device.viscous_damping);
    for (const double share : shares) {
        const double stiffness = chosen.coupling_stiffness.value_or(std::max(share * stiffest, 1e-9));
        scheme.coupling.stiffness = stiffness;
        std::set<std::pair<double, double>> objects;  // damping and mass
        for (const double ratio : ratios) {
            for (const double reserve : reserves) {
                const double limit = reserve * (std::max(0.0, bounds.slope.upper) + stiffness) - stiffness;
                const Inertia object = explicit_object(limit, scheme.coupling, ratio, T);
                const double mass = chosen.mass.value_or(0.0) > 0.0 ? *chosen.mass : object.mass;
                objects.emplace(chosen.object_damping.value_or(ratio * mass / T), mass);
            }
        }
        for (const auto& [damping, mass] : objects) {
            scheme.inertia = {mass, damping};
            if (finite(bounds) && all_hold(inequalities_of(bounds, scheme, device))) {
                return scheme;
            }
        }
        if (chosen.coupling_stiffness) {
            break;
        }
    }
    return scheme;
}

}  // namespace palpate
