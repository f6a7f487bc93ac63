// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <vector>

#include "palpate/device/device_profile.hpp"
#include "palpate/fields/field_table.hpp"
#include "palpate/guard/guards.hpp"
#include "palpate/guard/limit_cycle_detector.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/rendering/make_structure.hpp"
#include "palpate/rendering/scale.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/simulation/closed_loop.hpp"
#include "palpate/simulation/hand.hpp"
#include "palpate/simulation/plant.hpp"
#include "palpate/simulation/simulated_device.hpp"
#include "palpate/stability/account_certificate.hpp"

namespace palpate {

/// A fingertip that presses a handle: 10 g behind a pulp of 1500 N/m and 0.3 N*s/m, which is little damping. The base of
/// the pulp moves from `from` to `to` at a constant speed, waits and moves back, or rests there with a tremor.
struct Finger {
    double lever = 1.0;   ///< radius of the knob, or 1 on a linear device [m or -]
    double from = 0.0;    ///< [m or rad]
    double to = 0.0;      ///< [m or rad]
    double speed = 0.0;   ///< speed of the base; 0: it rests at `to` [m/s or rad/s]
    double tremor = 0.0;  ///< amplitude of the base at rest [m or rad]

    static constexpr double mass = 0.01;         ///< [kg]
    static constexpr double stiffness = 1500.0;  ///< [N/m]
    static constexpr double damping = 0.3;       ///< [N*s/m]
    static constexpr double wait_s = 0.1;        ///< time between press and release [s]
    static constexpr double tremor_hz = 10.0;    ///< frequency of a hand's tremor [Hz]

    /// Returns the duration of press, wait and release [s].
    [[nodiscard]] double duration() const noexcept { return 2.0 * (std::abs(to - from) / speed + wait_s); }

    /// Returns position and velocity of the base at a time.
    [[nodiscard]] Motion base(double time) const noexcept {
        if (speed == 0.0) {
            const double rate = 2.0 * std::numbers::pi * tremor_hz;
            return {to + tremor * std::sin(rate * time), tremor * rate * std::cos(rate * time)};
        }
        const double way = std::abs(to - from);
        const double direction = to < from ? -1.0 : 1.0;
        const double back = time - way / speed - wait_s;
        const double gone = std::min(speed * time, way) - std::clamp(speed * back, 0.0, way);
        const bool moves = (speed * time < way) || (back > 0.0 && speed * back < way);
        return {from + direction * gone, moves ? direction * (back > 0.0 ? -speed : speed) : 0.0};
    }

    /// Returns the properties of the finger at a time.
    [[nodiscard]] Grip grip(double time, const Motion& /*handle*/) const noexcept {
        const double square = lever * lever;
        const Motion at = base(time);
        return {stiffness * square, damping * square, at.position, damping * square * at.velocity,
                mass * square};
    }
};

static_assert(SimulatedHand<Finger>);

/// Speeds at which a finger presses a key or turns a knob [m/s]
inline constexpr std::array finger_speeds{0.01, 0.03, 0.1, 0.3};
/// Radius of a knob between two fingers [m]
inline constexpr double knob_radius = 0.02;
/// Amplitude of the tremor at the base of the finger [m]
inline constexpr double finger_tremor = 1e-3;

/// Effect of the energy account on simulated presses and rests, and the numbers of its limit.
struct AccountUse {
    double energy = 0.0;         ///< E0 [J]
    double largest_speed = 0.0;  ///< [m/s or rad/s]
    double share = 0.0;          ///< largest share over all motions
    double force_error = 0.0;    ///< largest RMS over all motions [N or N*m]
    std::vector<double> shares;  ///< of each press, of the rest at the largest force, at the steepest slope
};

template <>
inline constexpr auto fields_of<AccountUse> = FieldTable{
    Field<&AccountUse::energy>{"energy", "E0, largest energy that a hand can take out [J]."},
    Field<&AccountUse::largest_speed>{"largest_speed",
                                      "Speed above which a reading ends the run [m/s or rad/s]."},
    Field<&AccountUse::share>{"share",
                              "Largest share, over all motions, of the ticks inside the domain in which the "
                              "account limits the force [-]."},
    Field<&AccountUse::force_error>{
        "force_error",
        "Largest RMS, over all motions, of the change of the force by the account [N or N*m]."},
    Field<&AccountUse::shares>{
        "shares",
        "The share of each press, then of the rest at the largest force and of that at "
        "the steepest slope [-]."}};

namespace detail {

/// Positions of the handle against which a finger presses.
struct Rests {
    double first = 0.0;     ///< start of a press
    double last = 0.0;      ///< end of a press, where the force is largest
    double steepest = 0.0;  ///< position with the steepest rising slope between them
};

/// Returns the positions up to which the press force is at most 80 % of the force limit; the rest is for damping.
[[nodiscard]] inline Rests rests_of(const ForceModel& model, double force_limit) {
    constexpr int steps = 1000;
    constexpr double held_share = 0.8;
    const double lower = model.domain().lower[0];
    const double step = (model.domain().upper[0] - lower) / steps;
    const auto force = [&](int k) { return sliding_force(model, lower + k * step, 1.0); };
    const auto held = [&](int k) { return std::abs(force(k)) <= held_share * force_limit; };
    int first = 0;
    while (first < steps && !held(first)) {
        ++first;
    }
    int last = first;
    int steepest = first;
    double most = 0.0;
    for (; last < steps && held(last + 1); ++last) {
        const double rise = force(last + 1) - force(last);
        if (rise > most) {
            most = rise;
            steepest = last;
        }
    }
    return {lower + first * step, lower + last * step, lower + (steepest + 0.5) * step};
}

}  // namespace detail

/// Presses and holds a model on a simulated device while the energy account limits its force.
[[nodiscard]] inline AccountUse account_use(const ForceModel& model, const Scheme& scheme,
                                            const DeviceProfile& device) {
    const GuardSettings settings = account_guards(model, device);
    const EnergyAccount account = account_of(model, scheme, device);
    AccountUse use{account.stored().within(), settings.largest_speed, 0.0, 0.0, {}};
    Finger finger;
    finger.lever = device.position_unit == "rad" ? knob_radius : 1.0;
    const double stiffness = Finger::stiffness * finger.lever * finger.lever;
    const detail::Rests rests = detail::rests_of(model, device.force_limit);
    const auto base = [&](double position) {
        return position + detail::sliding_force(model, position, 1.0) / stiffness;
    };
    const auto move = [&](const Finger& moved, double start, double duration_s) {
        SimulatedHandle<Finger, SemiImplicitEuler> handle{device, moved, simulated_substeps(device.period_s),
                                                          start};
        Guards guards{.limit = {device.force_limit}};
        guards.account = account;
        std::size_t inside = 0;
        std::size_t limited = 0;
        double squares = 0.0;
        (void)closed_loop(handle, make_structure(model, scheme, device.period_s, device.force_limit), guards,
                          simulated_ticks(duration_s, device.period_s), [&](const SimulatedTick& now) {
                              const double at = now.tick.reading.position;
                              if (at >= model.domain().lower[0] && at <= model.domain().upper[0]) {
                                  ++inside;
                                  limited += now.tick.status == Status::EnergyLimited ? 1 : 0;
                                  const double full = std::clamp(now.tick.rendered.force, -device.force_limit,
                                                                 device.force_limit);
                                  squares += std::pow(now.tick.command.force - full, 2);
                              }
                              return true;
                          });
        const auto ticks = static_cast<double>(std::max<std::size_t>(inside, 1));
        use.shares.push_back(static_cast<double>(limited) / ticks);
        use.share = std::max(use.share, use.shares.back());
        use.force_error = std::max(use.force_error, std::sqrt(squares / ticks));
    };
    finger.from = base(rests.first);
    finger.to = base(rests.last);
    for (const double speed : finger_speeds) {
        finger.speed = speed / finger.lever;
        if (finger.speed < settings.largest_speed) {
            move(finger, rests.first, finger.duration());
        }
    }
    finger.speed = 0.0;
    finger.tremor = finger_tremor / finger.lever;
    for (const double position : {rests.last, rests.steepest}) {
        finger.to = base(position);
        move(finger, position, 1.0);
    }
    return use;
}

/// Oscillation of a handle on which a finger rests, in simulation.
struct RestingOscillation {
    double position = 0.0;      ///< mean position of the handle [m or rad]
    double amplitude = 0.0;     ///< half the distance between its reversals; 0: it comes to rest [m or rad]
    double frequency_hz = 0.0;  ///< [Hz]
};

template <>
inline constexpr auto fields_of<RestingOscillation> = FieldTable{
    Field<&RestingOscillation::position>{"position", "Mean position of the handle [m or rad]."},
    Field<&RestingOscillation::amplitude>{
        "amplitude", "Half the distance between its reversals; 0: it comes to rest [m or rad]."},
    Field<&RestingOscillation::frequency_hz>{"frequency_hz", "Frequency of the oscillation [Hz]."}};

/// Returns the largest limit cycle of a handle on which a finger rests, at the largest force and at the steepest slope,
/// without any guard but the force limit. The handle starts one hundredth of the travel away from its rest.
[[nodiscard]] inline RestingOscillation resting_oscillation(const ForceModel& model, const Scheme& scheme,
                                                            const DeviceProfile& device) {
    const GuardSettings settings = account_guards(model, device);
    const double travel = model.domain().upper[0] - model.domain().lower[0];
    Finger finger;
    finger.lever = device.position_unit == "rad" ? knob_radius : 1.0;
    const double stiffness = Finger::stiffness * finger.lever * finger.lever;
    const detail::Rests rests = detail::rests_of(model, device.force_limit);
    RestingOscillation largest;
    for (const double position : {rests.last, rests.steepest}) {
        finger.to = position + detail::sliding_force(model, position, 1.0) / stiffness;
        SimulatedHandle<Finger, SemiImplicitEuler> handle{device, finger, simulated_substeps(device.period_s),
                                                          position - 0.01 * travel};
        Guards guards{.limit = {device.force_limit}};
        LimitCycleDetector detector = guards_of(settings, model, scheme, device.period_s).limit_cycle;
        constexpr double duration_s = 1.0;
        const std::size_t ticks = simulated_ticks(duration_s, device.period_s);
        double low = std::numeric_limits<double>::infinity();
        double high = -low;
        std::size_t reversals = 0;
        double before = 0.0;
        (void)closed_loop(handle, make_structure(model, scheme, device.period_s, device.force_limit), guards,
                          ticks, [&](const SimulatedTick& now) {
                              detector.watch(now.end.position, now.tick.command.force);
                              if (2 * now.number >= ticks) {
                                  low = std::min(low, now.end.position);
                                  high = std::max(high, now.end.position);
                                  reversals += now.end.velocity * before < 0.0 ? 1 : 0;
                              }
                              before = now.end.velocity;
                              return true;
                          });
        if (detector.limit_cycles() > 0 && high - low > 2.0 * largest.amplitude) {
            largest = {0.5 * (low + high), 0.5 * (high - low), static_cast<double>(reversals) / duration_s};
        }
    }
    return largest;
}

}  // namespace palpate
