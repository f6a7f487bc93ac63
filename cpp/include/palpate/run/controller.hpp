// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <utility>

#include "palpate/device/device.hpp"
#include "palpate/guard/guards.hpp"
#include "palpate/realtime/nonblocking.hpp"
#include "palpate/rendering/any_structure.hpp"
#include "palpate/rendering/structure.hpp"
#include "palpate/status.hpp"

namespace palpate {

/// A rendering, live or simulated, is not good if the ticks whose force was changed in one way, divided by all ticks,
/// exceed this limit [-]
inline constexpr double tolerated_change = 0.01;
/// A rendering is not good if the handle's travel divided by the length of the domain is below this limit [-]
inline constexpr double smallest_domain_share = 0.1;

/// Reading, computed force, sent force and status of one tick of the control loop.
struct Tick {
    Reading reading;             ///< reading from which the force was computed
    Rendered rendered;           ///< force that the structure computed
    Command command;             ///< force sent to the device, after all guards
    Status status = Status::Ok;  ///< status of the tick; `limit_force` states the order
};

/// Runs the ticks of the control loop: check the reading, compute the force, limit the force, exchange force and next
/// reading with the device. Apart from the device's `exchange`, a tick does not allocate, lock, throw, log or make a
/// system call. After an invalid reading a tick sends zero force.
template <Device D>
class Controller {
  public:
    Controller(D& device, AnyStructure structure, Guards guards)
        : device_{device}, structure_{std::move(structure)}, guards_{guards} {}

    Controller(D& device, AnyStructure structure, ForceLimit limit)
        : Controller{device, std::move(structure), Guards{.limit = limit}} {}

    /// Sends zero force and takes the first sample.
    [[nodiscard]] Status start() noexcept {
        reading_ = device_.exchange({});
        return reading_.status;
    }

    /// Computes the force for the last reading, sends the force and takes the next reading. The first valid reading sets
    /// the virtual object at rest at the position of the handle.
    [[nodiscard]] Tick tick() noexcept PALPATE_NONBLOCKING {
        const Status reading_status = guards_.reading.check(reading_);
        const bool sends = sends_force(reading_status);
        if (sends && !std::exchange(is_placed_, true)) {
            structure_.reset(reading_.position);
        }
        // The structure writes its result into the tick; a copy would take ten nanoseconds
        Tick tick{reading_, sends ? structure_.step(reading_.position) : Rendered{}, {}, reading_status};
        if (sends) {
            observe(tick.rendered.environment_position);
            tick.status = limit_force(tick.rendered, tick.command, reading_status);
        } else {
            guards_.motion.interrupt();
            guards_.account.interrupt();
        }
        guards_.slew.sent(tick.command.force);
        guards_.account.sent(tick.command.force);
        if (guards_.line_work) {
            guards_.line_work->sent(tick.command.stiffness);
        }
        reading_ = device_.exchange(tick.command);
        return tick;
    }

    /// Sends zero force and closes the device. Returns what is known about its force.
    ZeroForce stop() noexcept {
        (void)device_.exchange({});
        return closed(device_);
    }

    /// Returns true if the device's clock sets the rate of the control loop.
    [[nodiscard]] bool paced_by_device() const noexcept { return sets_pace(device_); }
    [[nodiscard]] const ReadingGuard& reading_guard() const noexcept { return guards_.reading; }
    [[nodiscard]] const Guards& guards() const noexcept { return guards_; }

  private:
    /// Adds the last tick to the energy account, and its work to the sums of energy if the positions before and after
    /// the tick are valid. The start ramp can give energy once, so a separate sum counts the ticks of the ramp.
    void observe(double object) noexcept {
        const double moved = guards_.motion.to(reading_.position);
        guards_.account.visit(reading_.position, object);
        double applied = reading_.applied;
        if (guards_.line_work) {
            applied = guards_.line_work->mean(applied, moved);
        }
        guards_.account.book(applied, moved);
        if (std::isfinite(moved * applied)) {
            (guards_.ramp.is_over() ? guards_.observer : guards_.ramp_observer).book(applied, moved);
        }
    }

    /// Applies the guards to the force in this order: force limit, scaling after a limit cycle, start ramp, slew limit,
    /// energy account. The force limit comes first: a force that is clipped and then scaled is passive, but a force of a
    /// periodic model that is scaled and then clipped can be active. The force limit also replaces numbers that are not
    /// finite. A failed step sends zero force at once: the limits of its change do not apply. The last two guards limit a constant force, so a force that they change is held.
    [[nodiscard]] Status limit_force(const Rendered& rendered, Command& line,
                                     Status reading_status) noexcept {
        line.force = rendered.force;
        const bool is_line = rendered.stiffness != 0.0;
        const Status limited = is_line ? limit_line(rendered, line) : guards_.limit.apply(line.force);
        for (const Status failed : {rendered.status, limited}) {
            if (!sends_force(failed)) {
                line = {};
                return failed;
            }
        }
        const Status cycle_scaled = guards_.limit_cycle.apply(line.force);
        const Status ramped = guards_.ramp.apply(line.force);
        const Status slewed = guards_.slew.apply(line.force);
        const Status energy_limited = guards_.account.apply(line.force);
        if (is_line && (slewed != Status::Ok || energy_limited != Status::Ok || line.stiffness == 0.0)) {
            line.position = line.stiffness = 0.0;
        }
        guards_.limit_cycle.watch(reading_.position, line.force);
        // The first status in this list that is not Ok is reported; the energy account comes before the force limit.
        for (const Status status : {rendered.status, ramped, energy_limited, cycle_scaled, limited, slewed}) {
            if (status != Status::Ok) {
                return status;
            }
        }
        return reading_status;
    }

    /// Makes the line of a structure the command, within the force limit; factors of the force also multiply its slope.
    [[nodiscard]] Status limit_line(const Rendered& rendered, Command& line) const noexcept {
        line = {rendered.force, rendered.environment_position, rendered.stiffness};
        const Status limited = guards_.limit.apply(line);
        line.stiffness *= guards_.limit_cycle.scale();
        line.stiffness *= guards_.ramp.factor();
        return limited;
    }

    D& device_;
    AnyStructure structure_;
    Guards guards_;
    Reading reading_;
    bool is_placed_ = false;  ///< true after the virtual object was placed at the handle
};

}  // namespace palpate
