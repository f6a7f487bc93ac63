// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "palpate/guard/energy_tank.hpp"
#include "palpate/guard/guard_settings.hpp"
#include "palpate/guard/limit_cycle_detector.hpp"
#include "palpate/guard/limits.hpp"
#include "palpate/guard/passivity_observer.hpp"
#include "palpate/guard/reading_guard.hpp"
#include "palpate/model/energy.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/rendering/scheme.hpp"

namespace palpate {

/// What a sample passes before it is believed, and a force before it is sent. Made of nothing but a force
/// limit it is the guard of a simulation, where nothing else can go wrong.
struct Guards {
    ForceLimit limit{};
    SlewLimit slew{};
    ForceRamp ramp{};
    ReadingGuard reading{};
    EnergyTank tank{};
    LimitCycleDetector buzz{};
    PassivityObserver observer{};  ///< looks on
};

/// The most energy that a rendering of the model can give: what the object holds between its least and its
/// largest, and the spring of its coupling at the largest force. Infinite for a motor, a model that gains
/// energy with every turn.
[[nodiscard]] inline double most_energy(const ForceModel& given, const Scheme& scheme, double force_limit) {
    const ForceModel model = scheme.play_radius > 0.0 ? given.with_play_radius(scheme.play_radius) : given;
    const double held = energy_range(model).span();
    if (scheme.structure == StructureKind::Direct) {
        return held;
    }
    const HysteresisNetwork* both = model.hysteresis();
    const double force = both != nullptr
                             ? both->force().value_bounds().largest() + both->loss().value_bounds().largest()
                             : model.network()->curve().value_bounds().largest();
    const double felt = std::min(force, force_limit);
    return held + 0.5 * felt * felt / scheme.coupling.stiffness;
}

/// All guards of a live rendering.
[[nodiscard]] inline Guards guards_of(const GuardSettings& settings, const ForceModel& model,
                                      const Scheme& scheme, double period_s) {
    const auto longest_swing = static_cast<std::uint64_t>(std::llround(0.5 / (slowest_buzz_hz * period_s)));
    Guards guards{force_limit(settings),
                  slew_limit(settings, period_s),
                  force_ramp(settings, period_s),
                  reading_guard(settings, period_s),
                  {},
                  {},
                  {}};
    if (settings.energy_tank) {
        guards.tank = EnergyTank{{most_energy(model, scheme, settings.force_limit), settings.device_damping,
                                  settings.device_friction, settings.encoder_step, period_s}};
    }
    if (settings.buzz_force > 0.0) {
        guards.buzz = LimitCycleDetector{{settings.buzz_force, longest_swing, settings.encoder_step}};
    }
    return guards;
}

}  // namespace palpate
