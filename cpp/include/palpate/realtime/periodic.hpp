// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <time.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>

#include "palpate/realtime/timing.hpp"

namespace palpate {

/// Returns the time of the monotonic system clock, which never jumps [ns]. All deadlines are times of this clock.
[[nodiscard]] inline Nanoseconds monotonic_now() noexcept {
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * nanoseconds_a_second + now.tv_nsec;
}

/// Wakes up a loop at the fixed times (deadlines) t_0 + k T, with period T, so that a late tick does not delay later
/// ticks. Deadlines that have already passed are skipped and counted; their ticks are not run later.
class Periodic {
  public:
    explicit Periodic(Nanoseconds period) noexcept : period_{period} {}

    /// Sets the first deadline to one period after the present time.
    void start() noexcept { next_ = monotonic_now() + period_; }

    /// Sleeps until the next deadline.
    [[nodiscard]] Wake wait() noexcept {
        const timespec until{next_ / nanoseconds_a_second, next_ % nanoseconds_a_second};
        while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
        }
        Wake wake{next_, monotonic_now(), 0};
        wake.skipped =
            static_cast<std::uint64_t>(std::max<Nanoseconds>(0, wake.now - wake.deadline) / period_);
        next_ += static_cast<Nanoseconds>(wake.skipped + 1) * period_;
        return wake;
    }

  private:
    Nanoseconds period_;
    Nanoseconds next_ = 0;
};

/// Clock of a control loop whose rate the device sets. Each tick is planned one period after the previous tick, and
/// waits for the device's sample in `exchange`. Deadlines are not skipped; a lost sample shows as a gap in the numbers
/// of the device's samples.
class PacedByDevice {
  public:
    explicit PacedByDevice(Nanoseconds period) noexcept : period_{period} {}

    /// Sets the planned time of the control loop's first tick to the present time.
    void start() noexcept { last_ = monotonic_now() - period_; }

    /// Returns at once: the control loop waits for the device's sample in `exchange`, not here.
    [[nodiscard]] Wake wait() noexcept {
        const Nanoseconds deadline = last_ + period_;
        last_ = monotonic_now();
        return {std::min(deadline, last_), last_, 0};
    }

  private:
    Nanoseconds period_;
    Nanoseconds last_ = 0;
};

}  // namespace palpate
