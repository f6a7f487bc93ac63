// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "palpate/rendering/structure.hpp"

namespace palpate {

/// How a device feels its way over a real object by itself.
struct ProbeSettings {
    double lower = 0.0;        ///< where a sweep turns round [m or rad]
    double upper = 0.5;        ///< [m or rad]
    double speed = 0.2;        ///< of the sweep [m/s or rad/s]
    double stiffness = 50.0;   ///< of the spring that draws the handle along [N/m or N*m/rad]
    double damping = 0.02;     ///< of the handle's motion against the sweep's [N*s/m or N*m*s/rad]
    double force_limit = 1.0;  ///< where an object holds this much, the sweep turns round [N or N*m]
};

/// Throws std::invalid_argument: the field, its value, what would be right.
inline void validate(const ProbeSettings& settings) {
    const auto require = [](bool holds, const char* field, double value, const char* right) {
        if (!holds) {
            throw std::invalid_argument("probe: " + std::string(field) + " is " + std::to_string(value) +
                                        ", must be " + right);
        }
    };
    const auto positive = [](double value) { return std::isfinite(value) && value > 0.0; };
    require(std::isfinite(settings.lower), "lower", settings.lower, "a finite number");
    require(std::isfinite(settings.upper) && settings.upper > settings.lower, "upper", settings.upper,
            "above lower");
    require(positive(settings.speed), "speed", settings.speed, "> 0");
    require(positive(settings.stiffness), "stiffness", settings.stiffness, "> 0");
    require(std::isfinite(settings.damping) && settings.damping >= 0.0, "damping", settings.damping, ">= 0");
    require(positive(settings.force_limit), "force_limit", settings.force_limit, "> 0");
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

}  // namespace palpate
