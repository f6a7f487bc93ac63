// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <thread>
#include <vector>

#include "palpate/realtime/ring_buffer.hpp"

namespace palpate {

/// A class that processes records of ticks, for example writes them to a file. Its take() may be slow and must not
/// throw.
template <class C, class Record>
concept RecordConsumer = requires(C& consumer, std::span<const Record> records) {
    { consumer.take(records) } noexcept;
};

/// Moves records out of a real-time loop. The loop adds records to a ring buffer; a separate thread passes the records
/// to the consumer periodically. Records that do not fit into the ring buffer are lost and counted.
template <class Record, RecordConsumer<Record> Consumer>
class FlightRecorder {
  public:
    /// Starts a thread that passes the records in the ring buffer to the consumer once in each interval `every`.
    FlightRecorder(Consumer& consumer, std::size_t capacity, std::chrono::milliseconds every)
        : ring_{capacity}, consumer_{consumer}, every_{every}, batch_(4096) {
        writer_ = std::thread{[this] { write_until_stopped(); }};
    }
    ~FlightRecorder() { stop(); }
    FlightRecorder(const FlightRecorder&) = delete;
    FlightRecorder& operator=(const FlightRecorder&) = delete;

    /// Adds a record to the ring buffer. Only the real-time loop calls this function.
    void push(const Record& record) noexcept {
        if (!ring_.push(record)) {
            lost_.fetch_add(1, std::memory_order_relaxed);
        }
    }

    /// Stops the thread after it has passed all records to the consumer.
    void stop() noexcept {
        if (writer_.joinable()) {
            stopping_.store(true, std::memory_order_release);
            writer_.join();
        }
    }

    /// Returns the number of records lost because the ring buffer was full.
    [[nodiscard]] std::uint64_t lost() const noexcept { return lost_.load(std::memory_order_relaxed); }

  private:
    void write_until_stopped() noexcept {
        while (!stopping_.load(std::memory_order_acquire)) {
            hand_over();
            std::this_thread::sleep_for(every_);
        }
        hand_over();
    }

    void hand_over() noexcept {
        while (const std::size_t count = ring_.pop(batch_)) {
            consumer_.take(std::span<const Record>{batch_.data(), count});
        }
    }

    RingBuffer<Record> ring_;
    Consumer& consumer_;
    std::chrono::milliseconds every_;
    std::vector<Record> batch_;
    std::atomic<std::uint64_t> lost_{0};
    std::atomic<bool> stopping_{false};
    std::thread writer_;
};

/// Keeps the records of the last ticks of a loop in memory, so that they can be saved after a fault.
template <class Record>
class LastRecords {
  public:
    explicit LastRecords(std::size_t capacity) : records_(capacity) {}

    /// Stores a record; if the memory is full, the record replaces the oldest stored record.
    void push(const Record& record) noexcept { records_[count_++ % records_.size()] = record; }

    /// Returns the stored records, oldest first. It allocates memory, so a running real-time loop must not call it.
    [[nodiscard]] std::vector<Record> in_order() const {
        const std::size_t size = records_.size();
        const std::size_t first = count_ > size ? count_ - size : 0;
        std::vector<Record> ordered;
        ordered.reserve(count_ - first);
        for (std::size_t k = first; k < count_; ++k) {
            ordered.push_back(records_[k % size]);
        }
        return ordered;
    }

  private:
    std::vector<Record> records_;
    std::size_t count_ = 0;
};

}  // namespace palpate
