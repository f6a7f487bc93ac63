// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <tuple>

#include "palpate/fields/field_table.hpp"
#include "palpate/rendering/structure.hpp"

// Forces on the device while a real object, or the device itself, is measured.
namespace palpate {

/// No virtual object at all: the handle is free, and what moves it is watched.
class FreeMotion {
  public:
    void reset(double /*position*/) noexcept {}

    [[nodiscard]] Rendered step(double position) noexcept {
        return std::isfinite(position) ? Rendered{0.0, position, 0, Status::Ok, false}
                                       : detail::refused(position);
    }
};

/// How a device feels its way over a real object by itself.
struct ProbeSettings {
    double lower = 0.0;
    double upper = 0.5;
    double speed = 0.2;
    double stiffness = 50.0;
    double damping = 0.02;
    double force_limit = 1.0;
};

template <>
inline constexpr auto fields_of<ProbeSettings> = std::tuple{
    Field<&ProbeSettings::lower>{"lower", "Where a sweep turns round [m or rad].", Rule::Finite},
    Field<&ProbeSettings::upper>{"upper", "Where a sweep turns round [m or rad].", Rule::Finite},
    Field<&ProbeSettings::speed>{"speed", "Of the sweep [m/s or rad/s].", Rule::Positive},
    Field<&ProbeSettings::stiffness>{
        "stiffness", "Of the spring that draws the handle along [N/m or N*m/rad].", Rule::Positive},
    Field<&ProbeSettings::damping>{
        "damping", "Of the handle's motion against the sweep's [N*s/m or N*m*s/rad].", Rule::NotNegative},
    Field<&ProbeSettings::force_limit>{
        "force_limit", "Where an object holds this much, the sweep turns round [N or N*m].", Rule::Positive}};

/// Throws std::invalid_argument: the field, its value, what would be right.
inline void validate(const ProbeSettings& settings) {
    check_fields(settings, "probe: ");
    if (!(settings.upper > settings.lower)) {
        throw std::invalid_argument("probe: upper is " + readable(settings.upper) + ", must be above lower");
    }
}

/// A slow sweep to and fro that a spring draws the handle along, so that the force of a real object shows at every
/// position, where it falls steeply too (the "Haptic Camera" of MacLean, 1996):
///
///     F = K (x - s(t)) + B (v - ds/dt),  |F| <= force_limit,  s a triangle between lower and upper.
///
/// Where the object holds the limit the sweep turns round at once: it ends at what the object allows.
class Probe {
  public:
    Probe(const ProbeSettings& settings, double period_s) : settings_{settings}, period_{period_s} {
        validate(settings_);
    }

    void reset(double position) noexcept {
        sweep_ = last_ = position;
        direction_ = 1.0;
    }

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
        if (std::abs(spring) > settings_.force_limit) {  // the object holds: back, from as far as it let us
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

/// Short small pushes to either side. They show the sign of a device's force, its delay and its mechanics. Two sizes
/// of push separate friction from damping: both take a share of the force, but only damping grows with the speed.
struct PulseSettings {
    double force = 0.02;    ///< of a push, the sign alternates [N or N*m]
    double smaller = 0.6;   ///< size of every second three pushes, over `force` [-]
    double push_s = 0.03;   ///< how long it lasts [s]
    double rest_s = 0.17;   ///< how long nothing follows [s]
    double farthest = 0.2;  ///< a handle that got this far from its start is pushed no more [m or rad]
};

class Pulses {
  public:
    Pulses(const PulseSettings& settings, double period_s) : settings_{settings} {
        if (!(std::isfinite(settings.force) && settings.force > 0.0)) {
            throw std::invalid_argument("push is " + std::to_string(settings.force) + ", must be > 0");
        }
        push_ = static_cast<std::uint64_t>(std::llround(settings.push_s / period_s));
        rest_ = static_cast<std::uint64_t>(std::llround(settings.rest_s / period_s));
    }

    void reset(double position) noexcept {
        start_ = position;
        tick_ = 0;
    }

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
