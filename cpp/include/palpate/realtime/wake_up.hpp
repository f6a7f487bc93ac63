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

/// Lets one thread wait for an event in another thread, until a deadline. It neither locks nor allocates. It is the
/// timed wait that the atomics of the standard library lack.
class WakeUp {
  public:
    /// Reports an event. The waiting thread sees all memory writes before it.
    void notify() noexcept {
        events_.fetch_add(1, std::memory_order_seq_cst);
        if (waits_.load(std::memory_order_seq_cst)) {
            ::syscall(SYS_futex, word(), FUTEX_WAKE_PRIVATE, 1, nullptr, nullptr, 0);
        }
    }

    /// Returns the number of events; read it before checking the condition to wait for.
    [[nodiscard]] std::uint32_t events() const noexcept { return events_.load(std::memory_order_seq_cst); }

    /// Waits until there were more than `known` events. Returns false if the deadline passed.
    [[nodiscard]] bool wait(std::uint32_t known, Nanoseconds deadline) noexcept {
        const timespec until{deadline / nanoseconds_a_second, deadline % nanoseconds_a_second};
        waits_.store(true, std::memory_order_seq_cst);
        while (events_.load(std::memory_order_seq_cst) == known && monotonic_now() < deadline) {
            // Returns at once if an event has happened meanwhile, because the kernel compares again.
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
