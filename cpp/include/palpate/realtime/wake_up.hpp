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

/// Something happens in one thread, and one other waits for it, but not longer than until a deadline. Nothing is
/// locked or allocated; it is the one wait of the standard's atomics that they lack, with a time.
class WakeUp {
  public:
    /// Everything done before this is seen by whoever wakes.
    void happened() noexcept {
        events_.fetch_add(1, std::memory_order_seq_cst);
        if (waits_.load(std::memory_order_seq_cst)) {
            ::syscall(SYS_futex, word(), FUTEX_WAKE_PRIVATE, 1, nullptr, nullptr, 0);
        }
    }

    /// How often it happened; to be read before looking whether a wait is needed.
    [[nodiscard]] std::uint32_t events() const noexcept { return events_.load(std::memory_order_seq_cst); }

    /// Waits until it has happened more than `seen` times. False: the deadline passed.
    [[nodiscard]] bool wait(std::uint32_t seen, Nanoseconds deadline) noexcept {
        const timespec until{deadline / nanoseconds_a_second, deadline % nanoseconds_a_second};
        waits_.store(true, std::memory_order_seq_cst);
        while (events_.load(std::memory_order_seq_cst) == seen && monotonic_now() < deadline) {
            // Returns at once where it has happened meanwhile: the kernel compares again.
            ::syscall(SYS_futex, word(), FUTEX_WAIT_BITSET_PRIVATE, seen, &until, nullptr,
                      FUTEX_BITSET_MATCH_ANY);
        }
        waits_.store(false, std::memory_order_relaxed);
        return events_.load(std::memory_order_acquire) != seen;
    }

  private:
    static_assert(std::atomic<std::uint32_t>::is_always_lock_free && sizeof(std::atomic<std::uint32_t>) == 4);
    [[nodiscard]] std::uint32_t* word() noexcept { return reinterpret_cast<std::uint32_t*>(&events_); }

    std::atomic<std::uint32_t> events_{0};
    std::atomic<bool> waits_{false};
};

}  // namespace palpate
