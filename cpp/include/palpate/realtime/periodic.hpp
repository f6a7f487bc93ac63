// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <time.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>

namespace palpate {

/// Time or duration [ns].
using Nanoseconds = std::int64_t;

inline constexpr Nanoseconds nanoseconds_a_second = 1'000'000'000;

/// Returns the time of the clock of all deadlines, which never jumps.
[[nodiscard]] inline Nanoseconds monotonic_now() noexcept {
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * nanoseconds_a_second + now.tv_nsec;
}

/// One wake-up.
struct Wake {
    Nanoseconds deadline = 0;   ///< planned time
    Nanoseconds now = 0;        ///< actual time
    std::uint64_t skipped = 0;  ///< later deadlines that had also passed; they are without a tick
};

/// Wakes up at absolute deadlines t_0 + k T, so that a late tick does not delay later ones. Deadlines that have passed
/// are skipped and counted; missed ticks are not repeated.
class Periodic {
  public:
    explicit Periodic(Nanoseconds period) noexcept : period_{period} {}

    /// Sets the first deadline one period from now.
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

/// Clock of a loop that its device paces. A tick is due one period after the last one, and waits in the device for its
/// sample. It does not skip deadlines; a sample that the device did not deliver is missing in its sequence.
class PacedByDevice {
  public:
    explicit PacedByDevice(Nanoseconds period) noexcept : period_{period} {}

    /// Sets the first tick to now.
    void start() noexcept { last_ = monotonic_now() - period_; }

    /// Returns at once; the device exchange waits.
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
