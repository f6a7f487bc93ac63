// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "palpate/device/device.hpp"
#include "palpate/status.hpp"

namespace palpate {

/// Replaces a force that is not finite by zero, and limits any other force to +-`largest`. This guard is applied before
/// the guards that scale the force, because the stored energy of an object is computed from its limited, unscaled
/// force.
struct ForceLimit {
    double largest = 5.0;  ///< force limit [N or N*m], > 0

    /// Limits the force of a held line: moves the line's position to the limit, so that the line does not change. A device
    /// that limits the force of the line itself then applies the same force as with the unlimited one. A line that is
    /// not finite becomes zero force.
    [[nodiscard]] Status apply(Command& line) const noexcept {
        if (!std::isfinite(line.force) || !std::isfinite(line.position) || !std::isfinite(line.stiffness)) {
            line = {};
            return Status::NonFinite;
        }
        const double unlimited = line.force;
        const Status status = apply(line.force);
        if (status == Status::Limited && line.stiffness > 0.0) {
            line.position += (line.force - unlimited) / line.stiffness;
        }
        return status;
    }

    /// Limits the force to the range from -`largest` to `largest`; returns `Limited` if the force was clipped,
    /// `NonFinite` if it was not finite.
    [[nodiscard]] Status apply(double& force) const noexcept {
        if (!std::isfinite(force)) {
            force = 0.0;
            return Status::NonFinite;
        }
        const double unlimited = force;
        force = std::clamp(force, -largest, largest);
        return force == unlimited ? Status::Ok : Status::Limited;
    }
};

/// Limits the change of the force between two ticks. The zero force after a fault or a failed step does not pass
/// through this limit.
struct SlewLimit {
    double largest_step =
        std::numeric_limits<double>::infinity();  ///< largest change of force in a tick [N or N*m], > 0
    double last = 0.0;                            ///< force that was sent in the last tick [N or N*m]

    /// Limits the change of the force since the last tick to `largest_step`; returns `Limited` if the force was
    /// changed.
    [[nodiscard]] Status apply(double& force) noexcept {
        const double unlimited = force;
        force = std::clamp(force, last - largest_step, last + largest_step);
        return force == unlimited ? Status::Ok : Status::Limited;
    }

    /// Stores the force that was sent to the device, after all guards, for the next tick.
    void sent(double force) noexcept { last = force; }
};

/// Increases the force from zero after the start: multiplies the first `ticks` forces by 0, 1/ticks, 2/ticks, ...
struct ForceRamp {
    std::uint64_t ticks = 0;  ///< length of the start ramp [ticks]
    std::uint64_t done = 0;   ///< number of forces multiplied so far, at most `ticks`

    /// Returns true if the start ramp has ended, so that forces are not scaled.
    [[nodiscard]] bool is_over() const noexcept { return done >= ticks; }

    /// Returns the share of the start ramp that has passed.
    [[nodiscard]] double passed() const noexcept {
        return static_cast<double>(done) / static_cast<double>(ticks);
    }
    /// Returns the factor of the start ramp for this tick, from 0 to 1.
    [[nodiscard]] double factor() const noexcept { return is_over() ? 1.0 : passed(); }

    /// Multiplies the force by the factor of the start ramp for this tick.
    [[nodiscard]] Status apply(double& force) noexcept {
        if (is_over()) {
            return Status::Ok;
        }
        force *= passed();
        ++done;
        return Status::Ramp;
    }
};

}  // namespace palpate
