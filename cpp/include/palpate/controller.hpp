// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <limits>
#include <utility>

#include "palpate/device/device.hpp"
#include "palpate/guard/guards.hpp"
#include "palpate/rendering/structure.hpp"
#include "palpate/status.hpp"

namespace palpate {

/// Everything that happened in one tick.
struct Tick {
    Reading reading;             ///< what the force was computed from
    Rendered rendered;           ///< what the structure made of it
    Command command;             ///< what was sent, after the guards
    Status status = Status::Ok;  ///< the first thing that was not Ok on the way
};

/// One tick of rendering: read, compute, limit, send. No allocation, lock, exception, log or system call but
/// the device's own. Whatever is wrong with a reading, the force sent is zero.
template <Device D, Structure S>
class Controller {
  public:
    static constexpr bool paced_by_device = paces_host<D>;

    Controller(D& device, S structure, Guards guards)
        : device_{device}, structure_{std::move(structure)}, guards_{guards} {}

    Controller(D& device, S structure, ForceLimit limit)
        : Controller{device, std::move(structure), Guards{.limit = limit}} {}

    /// Takes a first sample with zero force and puts the virtual object at rest there.
    [[nodiscard]] Status start() noexcept {
        reading_ = device_.exchange({});
        structure_.reset(reading_.position);
        return reading_.status;
    }

    /// Computes the force for the last reading, sends it and takes the next one.
    [[nodiscard]] Tick tick() noexcept {
        const Status believed = guards_.reading.check(reading_.position, reading_.sequence, reading_.status);
        Tick tick{reading_, {}, {}, believed};
        if (sends_force(believed)) {
            observe();
            tick.rendered = structure_.step(reading_.position);
            tick.status = guarded(tick.rendered, tick.command.force, believed);
        } else {
            last_position_ = std::numeric_limits<double>::quiet_NaN();
        }
        guards_.slew.sent(tick.command.force);
        reading_ = device_.exchange(tick.command);
        return tick;
    }

    /// Zero force, and the device is let go. What happens afterwards can take its time.
    void stop() noexcept {
        (void)device_.exchange({});
        device_.close();
    }

    [[nodiscard]] S& structure() noexcept { return structure_; }
    [[nodiscard]] const ReadingGuard& reading_guard() const noexcept { return guards_.reading; }
    [[nodiscard]] const Guards& guards() const noexcept { return guards_; }

  private:
    /// What the tick that ended did, where both its ends are known.
    void observe() noexcept {
        const double moved = reading_.position - last_position_;
        last_position_ = reading_.position;
        if (std::isfinite(moved * reading_.applied)) {
            guards_.tank.book(reading_.applied, moved);
            guards_.observer.book(reading_.applied, moved);
        }
    }

    /// The order of every output: ramp and softening, limit, slew, tank. The limit answers for numbers that are
    /// none.
    [[nodiscard]] Status guarded(const Rendered& rendered, double& force, Status believed) noexcept {
        const double scale = guards_.buzz.scale();
        const Status softened = scale < 1.0 ? Status::Softened : Status::Ok;
        force = scale * rendered.force;
        const Status ramped = guards_.ramp.apply(force);
        const Status limited = guards_.limit.apply(force);
        const Status slewed = guards_.slew.apply(force);
        const Status drained = guards_.tank.apply(force);
        guards_.buzz.watch(reading_.position, force);
        for (const Status status : {rendered.status, ramped, limited, slewed, drained, softened}) {
            if (status != Status::Ok) {
                return status;
            }
        }
        return believed;
    }

    D& device_;
    S structure_;
    Guards guards_;
    Reading reading_;
    double last_position_ = std::numeric_limits<double>::quiet_NaN();  ///< that was believed
};

}  // namespace palpate
