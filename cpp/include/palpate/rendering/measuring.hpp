// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>

#include "palpate/fields/field_table.hpp"
#include "palpate/model/parameters.hpp"
#include "palpate/rendering/structure.hpp"

// Structures that compute the device's force while a real object or the device itself is measured.
namespace palpate {

/// Renders zero force: the handle moves freely while its motion is recorded.
class FreeMotion {
  public:
    /// Does nothing, because free motion has no state.
    void reset(double /*position*/) noexcept {}

    /// Returns zero force; with the status NonFinite if the position is not finite.
    [[nodiscard]] Rendered step(double position) noexcept {
        return std::isfinite(position) ? Rendered{0.0, position, 0, Status::Ok, false}
                                       : detail::refused(position);
    }
};

/// Renders zero force while the device renders a model itself; marks positions outside of the model's domain.
class Watching {
  public:
    explicit Watching(const Domain& domain)
        : lower_{domain.period ? -infinity : domain.lower[0]},
          upper_{domain.period ? infinity : domain.upper[0]} {}

    /// Does nothing, because the device has the state of the object.
    void reset(double /*position*/) noexcept {}

    /// Returns zero force; with the status NonFinite if the position is not finite.
    [[nodiscard]] Rendered step(double position) noexcept {
        return std::isfinite(position)
                   ? Rendered{0.0, position, 0, Status::Ok, position < lower_ || position > upper_}
                   : detail::refused(position);
    }

  private:
    static constexpr double infinity = std::numeric_limits<double>::infinity();
    double lower_;
    double upper_;
};

/// Settings of an automatic slow motion over a real object: the device moves the handle from `lower` to `upper` and
/// back.
struct ProbeSettings {
    double lower = 0.0;
    double upper = 0.5;
    double speed = 0.2;
    double stiffness = 50.0;
    double damping = 0.02;
    double force_limit = 1.0;
};

template <>
inline constexpr auto fields_of<ProbeSettings> = FieldTable{
    Field<&ProbeSettings::lower>{
        "lower", "Lowest position of the spring's target, where its motion reverses [m or rad].",
        Rule::Finite},
    Field<&ProbeSettings::upper>{
        "upper", "Highest position of the spring's target, where its motion reverses [m or rad].",
        Rule::Finite},
    Field<&ProbeSettings::speed>{"speed", "Speed of the spring's target [m/s or rad/s].", Rule::Positive},
    Field<&ProbeSettings::stiffness>{
        "stiffness", "Stiffness of the spring that moves the handle [N/m or N*m/rad].", Rule::Positive},
    Field<&ProbeSettings::damping>{
        "damping", "Damping of the handle's motion relative to the spring's target [N*s/m or N*m*s/rad].",
        Rule::NotNegative},
    Field<&ProbeSettings::force_limit>{
        "force_limit",
        "Largest force on the handle; at this force the motion of the spring's target reverses [N or N*m].",
        Rule::Positive}};

/// Checks the settings of a probe. Throws std::invalid_argument with the wrong field, its value and the rule.
inline void validate(const ProbeSettings& settings) {
    check_fields(settings, "probe: ");
    if (!(settings.upper > settings.lower)) {
        throw std::invalid_argument("probe: upper is " + readable(settings.upper) + ", must be above lower");
    }
}

/// Moves the handle slowly back and forth: a spring pulls the handle to a moving target s(t). The force of a
/// real object is measured at every position, also where the force falls steeply (the "Haptic Camera" of MacLean,
/// 1996):
///
///     F = K (x - s(t)) + B (v - ds/dt),  |F| <= force_limit,  s a triangle between lower and upper.
///
/// If the spring's force reaches force_limit, because the object stops the handle, the target reverses its motion at
/// once. The object can therefore shorten the travel.
class Probe {
  public:
    Probe(const ProbeSettings& settings, double period_s) : settings_{settings}, period_{period_s} {
        validate(settings_);
    }

    /// Starts the motion of the spring's target at a position.
    void reset(double position) noexcept {
        sweep_ = last_ = position;
        direction_ = 1.0;
    }

    /// Returns the force of the spring for the measured position.
    [[nodiscard]] Rendered step(double position) noexcept {
        if (!std::isfinite(position)) {
            return detail::refused(sweep_);
        }
        if (sweep_ >= settings_.upper) {
            direction_ = -1.0;
        } else if (sweep_ <= settings_.lower) {
            direction_ = 1.0;
        }
        sweep_ += direction_ * settings_.speed * period_;
        const double velocity = (position - last_) / period_ - direction_ * settings_.speed;
        last_ = position;
        const double spring = settings_.stiffness * (position - sweep_);
        // The spring's force has reached its limit: the object stops the handle, so the motion reverses
        if (std::abs(spring) > settings_.force_limit) {
            const double held = std::copysign(settings_.force_limit, spring);
            sweep_ = position - held / settings_.stiffness;
            direction_ = std::copysign(1.0, spring);
        }
        const double force = settings_.stiffness * (position - sweep_) + settings_.damping * velocity;
        return {std::clamp(force, -settings_.force_limit, settings_.force_limit), sweep_, 0, Status::Ok,
                false};
    }

  private:
    ProbeSettings settings_;
    double period_;
    double sweep_ = 0.0;
    double last_ = 0.0;
    double direction_ = 1.0;
};

/// Settings of short weak pushes of the device on its handle, in alternating directions. The motion after a push shows
/// the sign of the device's force, its delay, inertia, damping and friction. Pushes of two sizes are needed to separate
/// friction from damping: both reduce the motion, but only the damping force grows with speed.
struct PulseSettings {
    double force = 0.02;    ///< force of a push [N or N*m]; the sign alternates
    double smaller = 0.6;   ///< every second group of three pushes has `force` times this factor [-]
    double push_s = 0.03;   ///< duration of a push [s]
    double rest_s = 0.17;   ///< pause before a push [s]
    double farthest = 0.2;  ///< distance from the start position beyond which pushes have no force [m or rad]
};

/// Renders short pushes on the handle, alternately to either side.
class Pulses {
  public:
    Pulses(const PulseSettings& settings, double period_s) : settings_{settings} {
        if (!(std::isfinite(settings.force) && settings.force > 0.0)) {
            throw std::invalid_argument("push is " + std::to_string(settings.force) + ", must be > 0");
        }
        push_ = static_cast<std::uint64_t>(std::llround(settings.push_s / period_s));
        rest_ = static_cast<std::uint64_t>(std::llround(settings.rest_s / period_s));
    }

    /// Starts the sequence of pushes with the handle at this position.
    void reset(double position) noexcept {
        start_ = position;
        tick_ = 0;
    }

    /// Returns the force of the current push, or zero.
    [[nodiscard]] Rendered step(double position) noexcept {
        if (!std::isfinite(position)) {
            return detail::refused(start_);
        }
        const std::uint64_t cycle = tick_ / (rest_ + push_);
        const bool pushes =
            tick_++ % (rest_ + push_) >= rest_ && std::abs(position - start_) < settings_.farthest;
        const double size = settings_.force * (cycle / 3 % 2 == 0 ? 1.0 : settings_.smaller);
        const double force = cycle % 2 == 0 ? size : -size;
        return {pushes ? force : 0.0, position, 0, Status::Ok, false};
    }

  private:
    PulseSettings settings_;
    std::uint64_t push_;
    std::uint64_t rest_;
    std::uint64_t tick_ = 0;
    double start_ = 0.0;
};

}  // namespace palpate
