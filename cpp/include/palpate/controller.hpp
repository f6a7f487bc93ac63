// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>

#include "palpate/device/device.hpp"
#include "palpate/guard/limits.hpp"
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
    Controller(D& device, S structure, ForceLimit limit)
        : device_{device}, structure_{std::move(structure)}, limit_{limit} {}

    /// Takes a first sample with zero force and puts the virtual object at rest there.
    [[nodiscard]] Status start() noexcept {
        reading_ = device_.exchange({});
        structure_.reset(reading_.position);
        return reading_.status;
    }

    /// Computes the force for the last reading, sends it and takes the next one.
    [[nodiscard]] Tick tick() noexcept {
        Tick tick{reading_, {}, {}, reading_.status};
        if (reading_.status == Status::Ok) {
            tick.rendered = structure_.step(reading_.position);
            tick.status = tick.rendered.status;
            tick.command.force = tick.rendered.force;
            const Status limited = limit_.apply(tick.command.force);
            tick.status = tick.status == Status::Ok ? limited : tick.status;
        }
        reading_ = device_.exchange(tick.command);
        return tick;
    }

    [[nodiscard]] S& structure() noexcept { return structure_; }

  private:
    D& device_;
    S structure_;
    ForceLimit limit_;
    Reading reading_;
};

}  // namespace palpate
