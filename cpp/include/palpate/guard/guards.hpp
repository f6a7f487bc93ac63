// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include "palpate/guard/energy_account.hpp"
#include "palpate/guard/guard_settings.hpp"
#include "palpate/guard/limit_cycle_detector.hpp"
#include "palpate/guard/limits.hpp"
#include "palpate/guard/line_work.hpp"
#include "palpate/guard/passivity_observer.hpp"
#include "palpate/guard/read_motion.hpp"
#include "palpate/guard/reading_guard.hpp"
#include "palpate/guard/stored_energy.hpp"
#include "palpate/model/energy.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/rendering/scheme.hpp"

namespace palpate {

/// Checks of each position sample before the rendering uses the sample, and limits of each force before it is sent.
/// `simulate` uses only the force limit.
struct Guards {
    ReadingGuard reading{};  ///< checks the position measured in each tick
    /// Limits the computed force to the force limit, before all other limits of the force
    ForceLimit limit{};
    /// Detects limit cycles; after each limit cycle, all forces are multiplied by a smaller factor
    LimitCycleDetector limit_cycle{};
    ForceRamp ramp{};                     ///< start ramp: increases the force from zero
    SlewLimit slew{};                     ///< limits the change of the force from tick to tick
    std::optional<LineWork> line_work{};  ///< computes the work of a held line; absent for held forces
    EnergyAccount account{};              ///< limits the energy that a hand can take out
    ReadMotion motion{};                  ///< computes the motion of the handle for the sums of energy
    PassivityObserver ramp_observer{};  ///< sums the energy that the rendering absorbs during the start ramp
    PassivityObserver observer{};       ///< sums the energy that the rendering absorbs after the start ramp
};

/// Returns the largest force of a model of position inside its domain, limited to the force limit [N or N*m].
[[nodiscard]] inline double largest_resting_force(const ForceModel& model, double force_limit) {
    const HysteresisNetwork* pair = model.hysteresis();
    const double force = pair != nullptr ? pair->force().value_bounds().largest() +
                                               pair->hysteresis_force().value_bounds().largest()
                                         : model.network()->curve().value_bounds().largest();
    return std::min(force, force_limit);
}

/// Returns an upper bound of the energy that a rendering stores while handle and virtual object do not move and are
/// inside the domain of the model [J]. The bound is infinite for a periodic model that gives energy in every period.
///
/// The device receives c(f), the force f of the model limited to the force limit. The virtual object stores C = int
/// c(f) dx, with hysteresis at most r max h / 2 more (`energy_range`). A virtual coupling stores P = K_c e^2 / 2 at a
/// stretch e <= F / K_c, where F is the largest |c(f)|. The coupling's force is c(f), and K_c e_k + (B_c/T) (e_k -
/// e_{k-1}) = c(f) with e_0 = 0 gives |e_k| <= F / K_c in every tick k. A compensated object stores at its position y =
/// x - f/K_c the energy C(x) - c(f)^2 / 2 K_c, so the minimum of this energy can be lower by F^2 / 2 K_c.
/// `StoredEnergy` adds the energy of positions outside the domain and of the object's speed when they occur.
[[nodiscard]] inline double largest_stored_energy(const ForceModel& given, const Scheme& scheme,
                                                  double force_limit) {
    const ForceModel model = scheme.play_radius > 0.0 ? given.with_play_radius(scheme.play_radius) : given;
    const double object_energy = energy_range(model, force_limit).span();
    if (!has_coupling(scheme.structure)) {
        return object_energy;
    }
    const double largest_force = largest_resting_force(model, force_limit);
    const double coupling_energy = 0.5 * largest_force * largest_force / scheme.coupling.stiffness;
    return object_energy + (scheme.compensated ? 2.0 : 1.0) * coupling_energy;
}

/// Returns the numbers that bound the stored energy of a certified rendering at all positions, inside and outside the
/// domain.
[[nodiscard]] inline StoredEnergySettings stored_energy(const ForceModel& model, const Scheme& scheme,
                                                        double force_limit, double period_s) {
    StoredEnergySettings stored;
    stored.within = largest_stored_energy(model, scheme, force_limit);
    const Domain& domain = model.domain();
    if (!domain.period) {
        stored.lower = domain.lower[0];
        stored.upper = domain.upper[0];
    }
    stored.force_limit = force_limit;
    if (has_coupling(scheme.structure)) {
        stored.stiffness = scheme.coupling.stiffness;
        // The stretch of a massless object is in balance with its force
        if (has_mass(scheme.structure)) {
            stored.included_stretch = largest_resting_force(model, force_limit) / stored.stiffness;
        }
    }
    stored.mass = has_mass(scheme.structure) ? scheme.inertia.mass : 0.0;
    stored.period_s = period_s;
    return stored;
}

/// Returns the settings of an energy account without a bound of the stored energy. The inequalities of a certificate
/// include the steps of encoder and force.
[[nodiscard]] inline AccountSettings account_settings(const GuardSettings& settings,
                                                      double period_s) noexcept {
    DeviceProfile device;
    device.period_s = period_s;
    device.delay_s = settings.delay_s;
    const double longest_period = period_s + settings.jitter_s;
    const double share = settings.certified ? 1.0 : uncertified_credit;
    return {.includes_start_outside = settings.certified,
            .device_damping = share * settings.device_damping,
            .device_friction = share * settings.device_friction,
            .encoder_step = settings.certified ? 0.0 : settings.encoder_step,
            .force_step = settings.certified ? 0.0 : settings.force_step,
            .longest_step = settings.largest_speed * longest_period + settings.encoder_step,
            .whole_delay = device.whole_delay_samples(),
            .delay_fraction = device.delay_fraction() * period_s / longest_period,
            .period_s = longest_period};
}

/// Returns all guards for the rendering of a model on a device.
[[nodiscard]] inline Guards guards_of(const GuardSettings& settings, const ForceModel& model,
                                      const Scheme& scheme, double period_s) {
    const auto longest_swing =
        static_cast<std::uint64_t>(std::llround(0.5 / (lowest_limit_cycle_hz * period_s)));
    Guards guards;
    guards.reading = reading_guard(settings, period_s);
    guards.limit = force_limit(settings);
    guards.ramp = force_ramp(settings, period_s);
    guards.slew = slew_limit(settings, period_s);
    guards.motion = ReadMotion{settings.certified ? settings.encoder_step : 0.0};
    if (holds_line(scheme.structure)) {
        guards.line_work = LineWork{whole_periods(settings.delay_s, period_s)};
        if (scheme.line && scheme.line->motion) {
            // The motion of the handle can be larger than that of the readings by an encoder step
            guards.reading = reading_guard(settings, period_s, *scheme.line->motion - settings.encoder_step);
        }
    }
    // The account limits forces that are held for a period. It has no rule for a line
    if (settings.energy_account && !holds_line(scheme.structure)) {
        AccountSettings account = account_settings(settings, period_s);
        account.stored = stored_energy(model, scheme, settings.force_limit, period_s);
        if (!settings.certified && settings.device_damping == 0.0 && settings.device_friction == 0.0) {
            // No bound can hold without known losses. The errors of the readings would use up the account, so only the
            // work of the motor counts, and the force falls with the last quarter of E0
            account.encoder_step = account.force_step = 0.0;
            account.longest_step = 0.25 * account.stored.within / settings.force_limit;
        }
        guards.account = EnergyAccount{account};
    }
    if (settings.limit_cycle_force > 0.0) {
        guards.limit_cycle =
            LimitCycleDetector{{settings.limit_cycle_force, longest_swing, settings.encoder_step}};
    }
    return guards;
}

}  // namespace palpate
