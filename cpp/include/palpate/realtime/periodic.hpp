// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <time.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>

namespace palpate {

using Nanoseconds = std::int64_t;

inline constexpr Nanoseconds nanoseconds_a_second = 1'000'000'000;

/// The clock of every deadline: it never jumps.
[[nodiscard]] inline Nanoseconds monotonic_now() noexcept {
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * nanoseconds_a_second + now.tv_nsec;
}

/// One return from sleep.
struct Wake {
    Nanoseconds deadline = 0;   ///< when it should have been
    Nanoseconds now = 0;        ///< when it was
    std::uint64_t skipped = 0;  ///< later deadlines that had passed as well: they get no tick
};

/// Wakes up at absolute deadlines t_0 + k T, so that a late tick delays no later one. Deadlines that passed
/// meanwhile are skipped and counted: ticks are never made up for in a burst.
class Periodic {
  public:
    explicit Periodic(Nanoseconds period) noexcept : period_{period} {}

    /// The first deadline is one period from now.
    void start() noexcept { next_ = monotonic_now() + period_; }

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

/// The clock of a loop whose device paces it: a tick is due one period after the last one and waits for its sample
/// in the device. There is nothing to skip; what the device did not deliver is missing in its sequence.
class PacedByDevice {
  public:
    explicit PacedByDevice(Nanoseconds period) noexcept : period_{period} {}

    void start() noexcept { last_ = monotonic_now() - period_; }

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
