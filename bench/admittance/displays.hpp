// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <limits>
#include <numbers>
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

/// Returns the positions of the handle after each of `samples` periods with a constant push [m], until it leaves every
/// travel. `next` returns the command for a measured force.
template <class Next>
[[nodiscard]] std::vector<double> handle_motion(const DeviceProfile& device, const Grip& hand, double start,
                                                int samples, const Next& next) {
    SimulatedDisplay display{device, start};
    std::vector<double> motion;
    for (int k = 0; k < samples && (motion.empty() || std::abs(motion.back()) < 1e3); ++k) {
        display.move(next(display.measured(display.force(hand))));
        motion.push_back(display.handle().position);
    }
    return motion;
}

/// Returns half the range of a motion of `samples` positions in its last tenth; infinite if the motion ended earlier.
[[nodiscard]] inline double final_oscillation(const std::vector<double>& motion, int samples) {
    if (motion.size() < static_cast<std::size_t>(samples) || !(std::abs(motion.back()) < 1e3)) {
        return std::numeric_limits<double>::infinity();
    }
    const auto [low, high] = std::minmax_element(motion.end() - samples / 10, motion.end());
    return 0.5 * (*high - *low);
}

/// Returns the foot of the profile, whose push holds the clutch at rest at a position.
[[nodiscard]] inline Grip clutch_foot(double rest, double damping) {
    return {.stiffness = clutch_pedal().admittance->hand_stiffness,
            .damping = damping,
            .target = rest,
            .push = Clutch{}.at(rest, {}).force};
}

/// Returns the clutch as virtual object with `share` times the certified damping.
[[nodiscard]] inline Admittance clutch_object(double share, double mass) {
    const DeviceProfile device = clutch_pedal();
    Inertia object = admittance_object(StructureKind::Implicit, Clutch::bounds(), {mass, 0.0}, device, mass);
    object.damping *= share;
    return {Implicit{Clutch{}, object, {0.0, 0.0}, device.period_s}, device};
}

/// Returns the largest oscillation of the clutch pedal at the end of 10 s [m], over pushes that end on the peak and on
/// the drop of the force. `share` is the object damping over that of the certificate.
[[nodiscard]] inline double clutch_oscillation(double share, double mass = 1.0, double hand_damping = 0.0) {
    constexpr int samples = 40'000;
    double largest = 0.0;
    Admittance source = clutch_object(share, mass);
    for (double rest = 14e-3; rest < 27e-3; rest += 2e-3) {
        const double start = rest + 1e-3;
        source.reset(start);
        const auto motion = handle_motion(clutch_pedal(), clutch_foot(rest, hand_damping), start, samples,
                                          [&](double force) { return source.step(force).position; });
        largest = std::max(largest, final_oscillation(motion, samples));
    }
    return largest;
}

/// The clutch pedal without a virtual object: it moves to the first position where the clutch has the measured force.
class InverseClutch {
  public:
    /// `filter_s` is the time constant of a low-pass filter of the force, which starts at `force`.
    explicit InverseClutch(double force, double filter_s = 0.0)
        : share_{1.0 - std::exp(-clutch_pedal().period_s / std::max(filter_s, 1e-9))}, filtered_{force} {
        for (int k = 0; k <= 80'000; ++k) {
            const double now = Clutch{}.at(1e-6 * k, {}).force;
            highest_.push_back(highest_.empty() ? now : std::max(highest_.back(), now));
        }
    }
    /// Returns the command for a measured force [m].
    [[nodiscard]] double command(double force) {
        filtered_ += share_ * (force - filtered_);
        const auto at = std::lower_bound(highest_.begin(), highest_.end(), filtered_);
        return 1e-6 * static_cast<double>(at - highest_.begin());
    }

  private:
    double share_;
    double filtered_;
    std::vector<double> highest_;  ///< largest force up to each position, in steps of 1 um
};

/// Returns the oscillation of the clutch pedal without a virtual object at the end of 10 s [m].
[[nodiscard]] inline double inverse_oscillation(double rest, double filter_s, double hand_damping = 0.0) {
    constexpr int samples = 40'000;
    const Grip foot = clutch_foot(rest, hand_damping);
    InverseClutch inverse{foot.push, filter_s};
    return final_oscillation(handle_motion(clutch_pedal(), foot, rest, samples,
                                           [&](double force) { return inverse.command(force); }),
                             samples);
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

/// Returns the exact least object damping of a linear display [N*s/m]: the largest B_o with a pair of poles on the unit
/// circle. The pole -1, at which the explicit step has its largest B_o, is left out. With z = e^(i theta), the object of slope f' and a spring hand of stiffness k, the pole is at
///
///     (m / T^2)(z - 2 + 1/z) + (B_o / T)(z - 1) + f' z + k (1 - (z - 1) L(z)) = 0
///
/// for the implicit step; the explicit step has 1 - 1/z in place of z - 1, and f' in place of f' z. L is the sum of
/// (1 - sigma_j) z^-j over the step response sigma of the servo. The device has a delay of whole samples.
[[nodiscard]] inline double exact_damping_limit(StructureKind structure, double mass, double slope,
                                                double stiffness, const DeviceProfile& device) {
    using Complex = std::complex<double>;
    const double T = device.period_s;
    const Servo servo = servo_of(*device.admittance);
    const auto passed = servo.transition(T);
    std::vector<double> waiting(static_cast<std::size_t>(device.whole_delay_samples()), 1.0);
    ServoDeviation deviation = servo.moved({}, 1.0);
    for (int j = 0; servo.has_lag() && j < 200'000 && std::abs(deviation.position) > 1e-15; ++j) {
        deviation = {passed[0] * deviation.position + passed[1] * deviation.velocity,
                     passed[2] * deviation.position + passed[3] * deviation.velocity};
        waiting.push_back(deviation.position);
    }
    const bool is_explicit = structure == StructureKind::Explicit;
    // The damping with which e^(i theta) is a pole; it is a real number at some angles only
    const auto damping = [&](double theta) {
        const Complex z = std::polar(1.0, theta);
        Complex lag = 0.0;
        for (auto each = waiting.rbegin(); each != waiting.rend(); ++each) {
            lag = (lag + *each) / z;
        }
        const Complex rest = mass / (T * T) * (z - 2.0 + 1.0 / z) + (is_explicit ? 1.0 : z) * slope +
                             stiffness * (1.0 - (z - 1.0) * lag);
        return -T * rest / (is_explicit ? 1.0 - 1.0 / z : z - 1.0);
    };
    constexpr int angles = 2000;
    double largest = 0.0;
    for (int k = 1; k < angles; ++k) {
        // Slow oscillations are close to 0 on the circle, so the angles are too
        const auto angle = [](int j) { return std::numbers::pi * std::pow(1e-5, 1.0 - j / (angles - 1.0)); };
        double low = angle(k - 1);
        double high = std::min(angle(k), std::numbers::pi - 1e-9);
        const bool rises = damping(low).imag() < 0.0;
        if (rises == (damping(high).imag() < 0.0)) {
            continue;
        }
        for (int j = 0; j < 60; ++j) {
            const double middle = 0.5 * (low + high);
            ((damping(middle).imag() < 0.0) == rises ? low : high) = middle;
        }
        largest = std::max(largest, damping(low).real());
    }
    return largest;
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
    // A motion that has decayed to the rounding error of its start does not grow
    return second > std::max(first, 1e-12);
}

}  // namespace palpate::bench
