// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <bit>
#include <cstddef>
#include <span>
#include <type_traits>
#include <vector>

namespace palpate {

/// A queue between one writing and one reading thread. No thread waits for the other thread: push() and pop() end after
/// a bounded number of steps. A full queue refuses new elements.
template <class T>
    requires std::is_trivially_copyable_v<T>
// NOLINTNEXTLINE(clang-analyzer-optin.performance.Padding): the padding keeps two cores off one cache line
class RingBuffer {
  public:
    /// Allocates the memory of the queue, for at least `capacity` elements.
    explicit RingBuffer(std::size_t capacity) : slots_(std::bit_ceil(capacity)), mask_{slots_.size() - 1} {}

    /// Adds an element to the queue; only the writing thread calls it. Returns false if the queue is full.
    [[nodiscard]] bool push(const T& value) noexcept {
        const std::size_t head = head_.load(std::memory_order_relaxed);
        if (head - tail_.load(std::memory_order_acquire) == slots_.size()) {
            return false;
        }
        slots_[head & mask_] = value;
        head_.store(head + 1, std::memory_order_release);
        return true;
    }

    /// Moves elements from the queue to `out`, oldest first, and returns their number; only the reading thread calls
    /// it.
    [[nodiscard]] std::size_t pop(std::span<T> out) noexcept {
        const std::size_t tail = tail_.load(std::memory_order_relaxed);
        const std::size_t available = head_.load(std::memory_order_acquire) - tail;
        const std::size_t count = available < out.size() ? available : out.size();
        for (std::size_t k = 0; k < count; ++k) {
            out[k] = slots_[(tail + k) & mask_];
        }
        tail_.store(tail + count, std::memory_order_release);
        return count;
    }

    /// Returns the number of elements in the queue; only the reading thread calls it.
    [[nodiscard]] std::size_t size() const noexcept {
        return head_.load(std::memory_order_acquire) - tail_.load(std::memory_order_relaxed);
    }

  private:
    /// Size of a cache line; data changed by different processor cores are at least this far apart [bytes]
    static constexpr std::size_t cache_line = 64;

    std::vector<T> slots_;
    std::size_t mask_;
    alignas(cache_line) std::atomic<std::size_t> head_{0};  ///< number of elements written so far
    alignas(cache_line) std::atomic<std::size_t> tail_{0};  ///< number of elements read so far
};

}  // namespace palpate
