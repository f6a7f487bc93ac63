// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "palpate/rendering/admittance.hpp"
#include "palpate/rendering/explicit.hpp"
#include "palpate/rendering/implicit.hpp"
#include "palpate/simulation/simulated_display.hpp"
#include "palpate/stability/admittance_inequalities.hpp"

// Admittance displays with known limits: linear springs, a clutch pedal with a force peak, a mass between two stops.
namespace palpate::bench {

/// Linear spring.
struct LinearSpring {
    using State = Stateless;
    double stiffness = 0.0;

    [[nodiscard]] EnvironmentSample at(double y, const State& /*stateless*/) const noexcept {
        return {stiffness * y, stiffness, 0.5 * stiffness * y * y, false};
    }
    void advance(double /*y*/, State& /*stateless*/) const noexcept {}
    [[nodiscard]] State start(double /*y*/) const noexcept { return {}; }
};

/// Clutch pedal: the force rises to 120 N at 15 mm, falls to 80 N and rises again, with slopes from -7.5 to 13.4 N/mm. It
/// is a sum of terms (h / 2)(1 + tanh((y - c) / w)), minus its value at 0.
struct Clutch {
    using State = Stateless;
    struct Rise {
        double height, centre, width;
    };
    static constexpr std::array<Rise, 4> rises{{{261.376, 0.0, 10.3043e-3},
                                                {-70.1857, 19.2097e-3, 3.68766e-3},
                                                {620.0, 68e-3, 23e-3},
                                                {620.0, -52e-3, 23e-3}}};

    [[nodiscard]] EnvironmentSample at(double y, const State& /*stateless*/) const noexcept {
        EnvironmentSample sample;
        for (const auto& [height, centre, width] : rises) {
            const double u = (y - centre) / width;
            const double t = std::tanh(u);
            const double start = std::tanh(-centre / width);
            sample.force += 0.5 * height * (t - start);
            sample.slope += 0.5 * height / width * (1.0 - t * t);
            // ln cosh u without overflow
            const double log_cosh = std::abs(u) + std::log1p(std::exp(-2.0 * std::abs(u))) - std::log(2.0);
            sample.energy += 0.5 * height * (width * log_cosh - start * y);
        }
        return sample;
    }
    void advance(double /*y*/, State& /*stateless*/) const noexcept {}
    [[nodiscard]] State start(double /*y*/) const noexcept { return {}; }

    /// Returns bounds of the force from its largest slopes at distances of 1 um, with a margin of 1e-4.
    [[nodiscard]] static ForceBounds bounds() {
        ForceBounds found;
        for (int k = 0; k <= 80'000; ++k) {
            const double slope = Clutch{}.at(1e-6 * k, {}).slope;
            found.slope = found.slope.with({slope, slope});
        }
        found.slope = {1.0001 * found.slope.lower, 1.0001 * found.slope.upper};
        found.steepest = found.sliding = found.slope.largest();
        return found;
    }
};

/// Free motion between two stops of stiffness K at -1 and 1.
struct TwoStops {
    using State = Stateless;
    double stiffness = 1.0;

    [[nodiscard]] EnvironmentSample at(double y, const State& /*stateless*/) const noexcept {
        const double depth = y - std::clamp(y, -1.0, 1.0);
        return {stiffness * depth, depth != 0.0 ? stiffness : 0.0, 0.5 * stiffness * depth * depth, false};
    }
    void advance(double /*y*/, State& /*stateless*/) const noexcept {}
    [[nodiscard]] State start(double /*y*/) const noexcept { return {}; }
};

/// Returns a pedal at 4 kHz with one period of delay and a servo of 60 Hz, for a foot of up to 20 N/mm.
[[nodiscard]] inline DeviceProfile clutch_pedal() {
    DeviceProfile device;
    device.position_unit = "m";
    device.period_s = 2.5e-4;
    device.delay_s = 2.5e-4;
    AdmittanceDisplay display;
    display.hand_stiffness = 2e4;
    display.servo_bandwidth_hz = 60.0;
    display.servo_damping = 0.8;
    device.admittance = display;
    return device;
}

/// Half the range of the handle's motion [m] in the last tenth of `samples`, with a constant push. `next` returns the
/// command for a measured force.
template <class Next>
[[nodiscard]] double final_oscillation(const DeviceProfile& device, const Grip& hand, double start,
                                       int samples, const Next& next) {
    SimulatedDisplay display{device, start};
    double low = start;
    double high = start;
    for (int k = 0; k < samples; ++k) {
        display.move(next(display.measured(display.force(hand))));
        const double x = display.handle().position;
        if (!(std::abs(x) < 1e3)) {
            return std::numeric_limits<double>::infinity();
        }
        if (k == samples - samples / 10) {
            low = high = x;
        }
        low = std::min(low, x);
        high = std::max(high, x);
    }
    return 0.5 * (high - low);
}

/// Returns the largest oscillation of the clutch pedal at the end of 10 s [m], over pushes that end on the peak and on
/// the drop of the force. `share` is the object damping over that of the certificate.
[[nodiscard]] inline double clutch_oscillation(double share, double mass = 1.0, double hand_damping = 0.0) {
    const DeviceProfile device = clutch_pedal();
    Inertia object = admittance_object(StructureKind::Implicit, Clutch::bounds(), {mass, 0.0}, device, mass);
    object.damping *= share;
    double largest = 0.0;
    for (double rest = 14e-3; rest < 27e-3; rest += 2e-3) {
        const double stiffness = device.admittance->hand_stiffness;
        const Grip hand{.stiffness = stiffness,
                        .damping = hand_damping,
                        .target = rest,
                        .push = Clutch{}.at(rest, {}).force};
        Admittance source{Implicit{Clutch{}, object, {0.0, 0.0}, device.period_s}, device};
        const double start = rest + 1e-3;
        source.reset(start);
        largest = std::max(largest, final_oscillation(device, hand, start, 40'000, [&](double force) {
                               return source.step(force).position;
                           }));
    }
    return largest;
}

/// Returns the oscillation of the same pedal without a virtual object, which moves to the first position where the
/// clutch has the measured force [m]. `filter_s` is the time constant of a low-pass filter of the force [s].
[[nodiscard]] inline double inverse_oscillation(double rest, double filter_s, double hand_damping = 0.0) {
    const DeviceProfile device = clutch_pedal();
    std::vector<double> highest;  // largest force up to each position, in steps of 1 um
    for (int k = 0; k <= 80'000; ++k) {
        const double force = Clutch{}.at(1e-6 * k, {}).force;
        highest.push_back(highest.empty() ? force : std::max(highest.back(), force));
    }
    const Grip hand{.stiffness = device.admittance->hand_stiffness,
                    .damping = hand_damping,
                    .target = rest,
                    .push = Clutch{}.at(rest, {}).force};
    const double share = 1.0 - std::exp(-device.period_s / std::max(filter_s, 1e-9));
    double filtered = hand.push;
    return final_oscillation(device, hand, rest, 40'000, [&](double force) {
        filtered += share * (force - filtered);
        const auto at = std::lower_bound(highest.begin(), highest.end(), filtered);
        return 1e-6 * static_cast<double>(at - highest.begin());
    });
}

/// Returns the largest energy of a free mass between two stops, divided by its energy at the start, over `starts` random
/// starts of 20 000 steps without damping. `step` is K T^2 / m.
template <class Structure>
[[nodiscard]] double energy_gain(double step, int starts, Structure make) {
    std::mt19937_64 random{1};
    double gain = 0.0;
    for (int k = 0; k < starts; ++k) {
        const TwoStops object{step};  // T = 1 s and m = 1 kg
        auto structure = make(object);
        double y = std::uniform_real_distribution{-0.9, 0.9}(random);
        const double speed = std::uniform_real_distribution{0.003, 0.3}(random);
        structure.reset(y);
        double before = y;
        y = structure.drive(speed).environment_position;  // a push of one period
        const double start = 0.5 * (y - before) * (y - before) + object.at(y, {}).energy;
        for (int j = 0; j < 20'000; ++j) {
            before = std::exchange(y, structure.drive(0.0).environment_position);
            const double energy = 0.5 * (y - before) * (y - before) + object.at(y, {}).energy;
            gain = std::max(gain, energy / start);
        }
    }
    return gain;
}

/// Returns the value between `stable` and `unstable` at which a linear display becomes unstable, to 1e-5 of the value.
/// `grows(value)` simulates the display.
template <class Grows>
[[nodiscard]] double limit_between(double stable, double unstable, const Grows& grows) {
    while (std::abs(unstable - stable) > 1e-5 * std::abs(unstable)) {
        const double middle = 0.5 * (stable + unstable);
        (grows(middle) ? unstable : stable) = middle;
    }
    return 0.5 * (stable + unstable);
}

/// Returns true if a motion of the object grows without a push of the hand: if its range in the second half of the
/// samples is larger than in the first half after the start.
[[nodiscard]] inline bool grows(Admittance source, const DeviceProfile& device, const Grip& hand,
                                int samples) {
    SimulatedDisplay display{device, 1e-3};
    source.reset(1e-3);
    double first = 0.0;
    double second = 0.0;
    for (int k = 0; k < samples; ++k) {
        const PositionCommand command = source.step(display.force(hand));
        display.move(command.position);
        const double size = std::abs(command.position);
        if (size > 1e3) {
            return true;
        }
        (k < samples / 2 ? first : second) =
            std::max(k < samples / 2 ? (k < samples / 10 ? 0.0 : first) : second, size);
    }
    return second > first;
}

}  // namespace palpate::bench
