// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <linux/futex.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>

#include "palpate/realtime/periodic.hpp"

namespace palpate {

/// Lets one thread wait until another thread reports an event, or until a deadline. It neither locks nor allocates. The
/// atomics of the C++ standard library have no wait with a deadline.
class WakeUp {
  public:
    /// Reports an event to the waiting thread, which then sees all memory writes made before the event.
    void notify() noexcept {
        events_.fetch_add(1, std::memory_order_seq_cst);
        if (waits_.load(std::memory_order_seq_cst)) {
            ::syscall(SYS_futex, word(), FUTEX_WAKE_PRIVATE, 1, nullptr, nullptr, 0);
        }
    }

    /// Returns the number of events so far. A thread reads this number, then checks its condition, then calls wait().
    [[nodiscard]] std::uint32_t events() const noexcept { return events_.load(std::memory_order_seq_cst); }

    /// Waits until the number of events differs from `known`. Returns false if the deadline passed without a new event.
    [[nodiscard]] bool wait(std::uint32_t known, Nanoseconds deadline) noexcept {
        const timespec until{deadline / nanoseconds_a_second, deadline % nanoseconds_a_second};
        waits_.store(true, std::memory_order_seq_cst);
        while (events_.load(std::memory_order_seq_cst) == known && monotonic_now() < deadline) {
            // The system call returns at once if the number of events is no longer `known`, so an event just before
            // the call is not missed.
            ::syscall(SYS_futex, word(), FUTEX_WAIT_BITSET_PRIVATE, known, &until, nullptr,
                      FUTEX_BITSET_MATCH_ANY);
        }
        waits_.store(false, std::memory_order_relaxed);
        return events_.load(std::memory_order_acquire) != known;
    }

  private:
    static_assert(std::atomic<std::uint32_t>::is_always_lock_free && sizeof(std::atomic<std::uint32_t>) == 4);
    [[nodiscard]] std::uint32_t* word() noexcept { return reinterpret_cast<std::uint32_t*>(&events_); }

    std::atomic<std::uint32_t> events_{0};
    std::atomic<bool> waits_{false};
};

}  // namespace palpate
