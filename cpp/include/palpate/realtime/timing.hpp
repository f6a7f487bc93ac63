// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace palpate {

/// Time or duration [ns].
using Nanoseconds = std::int64_t;

/// Nanoseconds in a second.
inline constexpr Nanoseconds nanoseconds_a_second = 1'000'000'000;

/// One wake-up of a control loop.
struct Wake {
    Nanoseconds deadline = 0;  ///< planned time of the wake-up
    Nanoseconds now = 0;       ///< actual time of the wake-up
    /// Number of ticks that are skipped, because their planned times had also passed at this wake-up
    std::uint64_t skipped = 0;
};

/// A histogram of durations from 0 ns to 18 minutes, with fixed size and without allocation. Its durations are exact to
/// 1/256 of their value. From 256 ns on, the durations between two powers of two are divided into 128 equal cells;
/// below 256 ns each nanosecond has one cell.
class DurationHistogram {
  public:
    /// Counts a duration.
    void add(Nanoseconds duration) noexcept {
        const auto value = static_cast<std::uint64_t>(std::clamp<Nanoseconds>(duration, 0, longest));
        ++cells_[cell_of(value)];
        ++count_;
        largest_ = std::max(largest_, static_cast<Nanoseconds>(value));
    }

    /// Returns the duration [ns] that the given share of all counted durations does not exceed, for example the median
    /// for share 0.5: the middle of a cell, or the exact largest duration for share 1.
    [[nodiscard]] double quantile(double share) const noexcept {
        const auto rank = static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(count_)));
        if (rank >= count_) {
            return static_cast<double>(largest_);
        }
        std::uint64_t counted = 0;
        for (std::size_t cell = 0; cell < cells; ++cell) {
            counted += cells_[cell];
            if (counted >= std::max<std::uint64_t>(rank, 1)) {
                return std::min(middle_of(cell), static_cast<double>(largest_));
            }
        }
        return static_cast<double>(largest_);
    }

    [[nodiscard]] std::uint64_t count() const noexcept { return count_; }
    [[nodiscard]] Nanoseconds largest() const noexcept { return largest_; }

  private:
    static constexpr unsigned bits = 7;
    static constexpr std::size_t in_octave = std::size_t{1} << bits;
    static constexpr unsigned octaves = 40 - bits;
    static constexpr std::size_t cells = in_octave * (octaves + 1);
    static constexpr Nanoseconds longest = 1'099'511'627'775;  ///< longest duration, 2^40 - 1 [ns]

    [[nodiscard]] static std::size_t cell_of(std::uint64_t value) noexcept {
        const auto width = static_cast<unsigned>(std::bit_width(value));
        const unsigned shift = width > bits + 1 ? width - bits - 1 : 0;
        return static_cast<std::size_t>(shift) * in_octave + static_cast<std::size_t>(value >> shift);
    }

    [[nodiscard]] static double middle_of(std::size_t cell) noexcept {
        const std::size_t shift = cell < 2 * in_octave ? 0 : cell / in_octave - 1;
        const auto low = static_cast<double>((cell - shift * in_octave) << shift);
        return low + 0.5 * (static_cast<double>(std::uint64_t{1} << shift) - 1.0);
    }

    std::array<std::uint64_t, cells> cells_{};
    std::uint64_t count_ = 0;
    Nanoseconds largest_ = 0;
};

/// Times between the wake-ups of a control loop, and how late the wake-ups were.
struct LoopTiming {
    DurationHistogram period;    ///< time between two wake-ups
    DurationHistogram lateness;  ///< time from the planned to the actual wake-up
    std::uint64_t missed = 0;    ///< number of planned ticks that were skipped because the loop was late
    Nanoseconds first = 0;       ///< time of the first wake-up
    Nanoseconds last = 0;        ///< time of the last wake-up

    /// Adds a wake-up to the histograms and counters.
    void add(const Wake& wake) noexcept {
        if (lateness.count() == 0) {
            first = wake.now;
        } else {
            period.add(wake.now - last);
        }
        last = wake.now;
        lateness.add(wake.now - wake.deadline);
        missed += wake.skipped;
    }

    /// Returns the number of wake-ups. The last one has no tick if it ended the loop.
    [[nodiscard]] std::uint64_t wakes() const noexcept { return lateness.count(); }
    /// Returns the mean number of wake-ups a second over the whole run [Hz].
    [[nodiscard]] double rate_hz() const noexcept {
        return last > first ? static_cast<double>(wakes() - 1) * 1e9 / static_cast<double>(last - first)
                            : 0.0;
    }
};

/// Measures the rate of a loop over consecutive windows of half a second, so that a low rate is noticed within a
/// second.
class RateCheck {
  public:
    explicit RateCheck(Nanoseconds window = nanoseconds_a_second / 2) noexcept : window_{window} {}

    /// Counts a tick. Returns true at the end of each time window; `rate_hz` then returns the rate in that window.
    [[nodiscard]] bool add(Nanoseconds now) noexcept {
        if (start_ == 0) {
            start_ = now;
            return false;
        }
        ++ticks_;
        if (now - start_ < window_) {
            return false;
        }
        rate_hz_.store(static_cast<double>(ticks_) * 1e9 / static_cast<double>(now - start_),
                       std::memory_order_relaxed);
        start_ = now;
        ticks_ = 0;
        return true;
    }

    /// Returns the rate of the loop in the last window of time [Hz]; 0 before the first window has ended. Any thread
    /// may call this function.
    [[nodiscard]] double rate_hz() const noexcept { return rate_hz_.load(std::memory_order_relaxed); }

  private:
    Nanoseconds window_;
    Nanoseconds start_ = 0;
    std::uint64_t ticks_ = 0;
    std::atomic<double> rate_hz_{0.0};
};

}  // namespace palpate
