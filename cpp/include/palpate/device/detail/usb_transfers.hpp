// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <libusb-1.0/libusb.h>
#include <pthread.h>
#include <sched.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <thread>

#include "palpate/device/wire.hpp"
#include "palpate/realtime/periodic.hpp"
#include "palpate/realtime/ring_buffer.hpp"
#include "palpate/realtime/wake_up.hpp"

namespace palpate::detail {

/// One received packet, unchanged, with the time of its arrival.
struct UsbArrival {
    std::array<std::uint8_t, wire::largest_packet> bytes{};
    std::uint32_t size = 0;
    Nanoseconds time = 0;

    [[nodiscard]] std::span<const std::uint8_t> packet() const noexcept {
        return std::span{bytes}.first(size);
    }
};

/// The USB transfers between a device and this program: two queued reads, at most one unfinished write, at most one
/// unfinished request, and one thread for libusb's events. Except within libusb, all memory is allocated at the start.
///
/// The control loop's thread writes commands and takes received packets; the event thread runs the callbacks of libusb.
/// Counters and flags that both threads use are atomic. A transfer counts as in flight until the end of its callback, a
/// stalled command until the halt of its endpoint is cleared.
class UsbTransfers {
  public:
    UsbTransfers(libusb_context* context, libusb_device_handle* handle)
        : context_{context}, handle_{handle}, arrivals_{queued_packets} {
        for (Read& read : reads_) {
            read.owner = this;
            read.transfer.reset(libusb_alloc_transfer(0));
        }
        write_.reset(libusb_alloc_transfer(0));
        request_.reset(libusb_alloc_transfer(0));
    }
    ~UsbTransfers() { stop(); }
    UsbTransfers(const UsbTransfers&) = delete;
    UsbTransfers& operator=(const UsbTransfers&) = delete;

    /// Starts the reads and the event thread. Returns 0 or an error code of libusb.
    [[nodiscard]] int start() {
        if (write_ == nullptr || request_ == nullptr ||
            std::any_of(reads_.begin(), reads_.end(),
                        [](const Read& read) { return read.transfer == nullptr; })) {
            return LIBUSB_ERROR_NO_MEM;
        }
        // Before the event thread starts, because it submits all reads again if the first one finds a halted endpoint
        for (Read& read : reads_) {
            submit(read);
        }
        runs_.store(true, std::memory_order_release);
        events_ = std::thread{[this] { handle_events(); }};
        return error_.load(std::memory_order_acquire);
    }

    /// Cancels every transfer and waits until all transfers have ended, at most 5 s. Errors of the device are ignored.
    void stop() noexcept {
        if (!events_.joinable()) {
            return;
        }
        stopping_.store(true, std::memory_order_release);
        cancel_all();
        const Nanoseconds last = monotonic_now() + longest_stop;
        while (in_flight() > 0 && monotonic_now() < last) {
            const std::uint32_t known_events = changes_.events();
            if (in_flight() > 0) {
                (void)changes_.wait(known_events, std::min(last, monotonic_now() + cancel_interval));
                cancel_all();
            }
        }
        runs_.store(false, std::memory_order_release);
        libusb_interrupt_event_handler(context_);
        events_.join();
    }

    /// Sends a command, unless the previous command is still in flight. Returns 0, LIBUSB_ERROR_BUSY or another error
    /// code of libusb.
    [[nodiscard]] int write(const wire::OutPacket& command) noexcept {
        if (is_unplugged()) {
            return LIBUSB_ERROR_NO_DEVICE;
        }
        if (writes()) {
            return LIBUSB_ERROR_BUSY;
        }
        out_bytes_ = wire::encode(command);
        constexpr unsigned no_timeout =
            0;  // libusb waits without a time limit: the device's watchdog ends the torque of an old command
        libusb_fill_interrupt_transfer(write_.get(), handle_, wire::out_endpoint, out_bytes_.data(),
                                       static_cast<int>(out_bytes_.size()), &UsbTransfers::write_callback,
                                       this, no_timeout);
        writes_in_flight_.store(1, std::memory_order_relaxed);
        const int code = libusb_submit_transfer(write_.get());
        if (code != 0) {
            writes_in_flight_.store(0, std::memory_order_relaxed);
            store_error(code);
        }
        return code;
    }

    /// Sends a control request without data and waits for its end. Returns 0 or an error code of libusb. One thread
    /// at a time may call this function, but never the event thread of libusb, which completes the request.
    [[nodiscard]] int request(wire::Request request, std::uint16_t value) noexcept {
        if (requests_in_flight_.load(std::memory_order_acquire) != 0) {
            return LIBUSB_ERROR_BUSY;
        }
        libusb_fill_control_setup(setup_.data(), wire::request_to_device, static_cast<std::uint8_t>(request),
                                  value, wire::interface_number, 0);
        libusb_fill_control_transfer(request_.get(), handle_, setup_.data(), &UsbTransfers::request_callback,
                                     this, wire::request_timeout_ms);
        requests_in_flight_.store(1, std::memory_order_relaxed);
        if (const int code = libusb_submit_transfer(request_.get()); code != 0) {
            requests_in_flight_.store(0, std::memory_order_relaxed);
            return code;
        }
        const Nanoseconds last = monotonic_now() + longest_stop;
        const bool ended =
            wait_until([&] { return requests_in_flight_.load(std::memory_order_acquire) == 0; }, last);
        return ended ? answer_.load(std::memory_order_relaxed) : static_cast<int>(LIBUSB_ERROR_TIMEOUT);
    }

    /// Waits until a received packet is available. Returns false if no packet arrived before the deadline.
    [[nodiscard]] bool wait_for_arrival(Nanoseconds deadline) noexcept {
        (void)wait_until([&] { return arrived() > 0 || has_failed(); }, deadline);
        return arrived() > 0;
    }
    /// Returns true if a command is being sent and has not ended.
    [[nodiscard]] bool writes() const noexcept {
        return writes_in_flight_.load(std::memory_order_acquire) != 0;
    }
    /// Waits until the command in flight has ended. Returns false if the command has not ended at the deadline.
    [[nodiscard]] bool wait_for_write(Nanoseconds deadline) noexcept {
        return wait_until([&] { return !writes(); }, deadline);
    }
    /// Waits until the command in flight has ended, a packet has arrived or the connection has failed. Returns false if
    /// none of them happened before the deadline.
    [[nodiscard]] bool wait_for_write_or_arrival(Nanoseconds deadline) noexcept {
        return wait_until([&] { return !writes() || arrived() > 0 || has_failed(); }, deadline);
    }

    /// Returns the number of received packets that the control loop has not taken.
    [[nodiscard]] std::size_t arrived() const noexcept { return arrivals_.size(); }
    /// Takes the oldest received packet from the queue. Returns false if the queue is empty.
    [[nodiscard]] bool take(UsbArrival& arrival) noexcept { return arrivals_.pop({&arrival, 1}) == 1; }

    /// Returns true after an error that ends the connection, such as an unplugged device or repeated errors.
    [[nodiscard]] bool has_failed() const noexcept { return error_.load(std::memory_order_acquire) != 0; }
    /// Returns true if the device is gone. After any other error that ended the connection, commands and requests may
    /// still arrive, so that zero force can be sent.
    [[nodiscard]] bool is_unplugged() const noexcept { return unplugged_.load(std::memory_order_acquire); }
    /// Returns the first libusb error code that ended the connection; 0 without such an error.
    [[nodiscard]] int error() const noexcept { return error_.load(std::memory_order_acquire); }
    [[nodiscard]] std::uint64_t stalls() const noexcept { return stalls_.load(std::memory_order_relaxed); }
    [[nodiscard]] std::uint64_t bus_errors() const noexcept {
        return bus_errors_.load(std::memory_order_relaxed);
    }
    /// Returns the number of commands that were sent and did not arrive at the device.
    [[nodiscard]] std::uint64_t lost_writes() const noexcept {
        return lost_writes_.load(std::memory_order_relaxed);
    }
    /// Returns the number of unfinished USB transfers.
    [[nodiscard]] int in_flight() const noexcept {
        return reads_in_flight_.load(std::memory_order_acquire) +
               writes_in_flight_.load(std::memory_order_acquire) +
               requests_in_flight_.load(std::memory_order_acquire);
    }

  private:
    static constexpr std::size_t queued_packets = 64;  ///< length of the queue of received packets
    static constexpr Nanoseconds longest_stop = 5 * nanoseconds_a_second;
    static constexpr Nanoseconds cancel_interval = nanoseconds_a_second / 10;
    /// The connection ends after this number of consecutive errors of the USB bus
    static constexpr int most_errors_in_a_row = 100;

    struct FreeTransfer {
        void operator()(libusb_transfer* transfer) const noexcept { libusb_free_transfer(transfer); }
    };
    using Transfer = std::unique_ptr<libusb_transfer, FreeTransfer>;

    struct Read {
        UsbTransfers* owner = nullptr;
        Transfer transfer;
        std::array<std::uint8_t, wire::largest_packet> bytes{};
    };

    // ---------------------------------------------------------------------------------------- event thread

    /// Processes libusb's events until stop() is called.
    void handle_events() noexcept {
        // The event thread has a higher priority than the default of the control loop, because an unprocessed packet
        // makes the loop late.
        const sched_param priority{90};
        (void)pthread_setschedparam(
            pthread_self(), SCHED_FIFO,
            &priority);  // an error is ignored here: the control loop's thread reports it
        while (runs_.load(std::memory_order_acquire)) {
            timeval wait{0, 100'000};
            const int code = libusb_handle_events_timeout_completed(context_, &wait, nullptr);
            if (code != 0 && code != LIBUSB_ERROR_INTERRUPTED && code != LIBUSB_ERROR_TIMEOUT) {
                store_error(code);
                std::this_thread::yield();
            }
            recover();
        }
    }

    /// Restarts a halted USB endpoint. For packets: cancels all reads, clears the halt, and submits the reads again.
    /// For commands: clears the halt and allows the next command.
    void recover() noexcept {
        if (stopping_.load(std::memory_order_acquire) || is_unplugged()) {
            return;
        }
        if (reads_halted_ && !has_failed()) {
            if (reads_in_flight_.load(std::memory_order_acquire) > 0) {
                cancel_reads();
                return;
            }
            store_error(libusb_clear_halt(handle_, wire::in_endpoint));
            reads_halted_ = false;
            for (Read& read : reads_) {
                submit(read);
            }
        }
        if (writes_halted_) {
            store_error(libusb_clear_halt(handle_, wire::out_endpoint));
            writes_halted_ = false;
            writes_in_flight_.store(0, std::memory_order_release);
            changes_.notify();
        }
    }

    /// Submits a read to libusb. start() submits each read once; after that only the event thread submits it.
    void submit(Read& read) noexcept {
        constexpr unsigned no_timeout = 0;
        libusb_fill_interrupt_transfer(read.transfer.get(), handle_, wire::in_endpoint, read.bytes.data(),
                                       static_cast<int>(read.bytes.size()), &UsbTransfers::read_callback,
                                       &read, no_timeout);
        reads_in_flight_.fetch_add(1, std::memory_order_acq_rel);
        if (const int code = libusb_submit_transfer(read.transfer.get()); code != 0) {
            store_error(code);
            end_read();
        }
    }

    static void LIBUSB_CALL read_callback(libusb_transfer* transfer) {
        auto& read = *static_cast<Read*>(transfer->user_data);
        read.owner->read_ended(read);
    }

    /// Handles the end of a read: passes the received packet to the control loop and submits the read again.
    void read_ended(Read& read) noexcept {
        const libusb_transfer& transfer = *read.transfer;
        switch (transfer.status) {
            case LIBUSB_TRANSFER_COMPLETED:
                errors_in_a_row_ = 0;
                deliver(read);
                break;
            case LIBUSB_TRANSFER_STALL:
                stalls_.fetch_add(1, std::memory_order_relaxed);
                reads_halted_ = true;
                break;
            case LIBUSB_TRANSFER_TIMED_OUT:
            case LIBUSB_TRANSFER_CANCELLED:
                break;
            case LIBUSB_TRANSFER_NO_DEVICE:
                store_error(LIBUSB_ERROR_NO_DEVICE);
                break;
            default:
                count_bus_error();
        }
        const bool again = !has_failed() && !stopping_.load(std::memory_order_acquire) && !reads_halted_;
        if (!again) {
            end_read();
        } else if (const int code = libusb_submit_transfer(read.transfer.get()); code != 0) {
            store_error(code);
            end_read();
        }
    }

    /// Passes a received packet to the control loop's thread.
    void deliver(const Read& read) noexcept {
        UsbArrival arrival;
        arrival.time = monotonic_now();
        arrival.size = static_cast<std::uint32_t>(read.transfer->actual_length);
        std::copy_n(read.bytes.begin(), arrival.size, arrival.bytes.begin());
        (void)arrivals_.push(
            arrival);  // a full queue drops the packet; the control loop then discards all old packets
        changes_.notify();
    }

    void end_read() noexcept {
        reads_in_flight_.fetch_sub(1, std::memory_order_acq_rel);
        changes_.notify();
    }

    static void LIBUSB_CALL write_callback(libusb_transfer* transfer) {
        static_cast<UsbTransfers*>(transfer->user_data)->write_ended(*transfer);
    }

    /// Called when libusb has sent a command or failed to send it: counts a failure, and allows the next command.
    /// After a stall the next command waits until the halt of the endpoint is cleared.
    void write_ended(const libusb_transfer& transfer) noexcept {
        if (transfer.status != LIBUSB_TRANSFER_COMPLETED) {
            lost_writes_.fetch_add(1, std::memory_order_relaxed);
        }
        switch (transfer.status) {
            case LIBUSB_TRANSFER_STALL:
                stalls_.fetch_add(1, std::memory_order_relaxed);
                if (!stopping_.load(std::memory_order_acquire)) {
                    // No command can be sent until the halt of the USB endpoint is cleared
                    writes_halted_ = true;
                    return;
                }
                break;
            case LIBUSB_TRANSFER_NO_DEVICE:
                store_error(LIBUSB_ERROR_NO_DEVICE);
                break;
            case LIBUSB_TRANSFER_ERROR:
            case LIBUSB_TRANSFER_OVERFLOW:
                count_bus_error();
                break;
            default:
                break;
        }
        writes_in_flight_.store(0, std::memory_order_release);
        changes_.notify();
    }

    static void LIBUSB_CALL request_callback(libusb_transfer* transfer) {
        auto& self = *static_cast<UsbTransfers*>(transfer->user_data);
        self.answer_.store(error_of(transfer->status), std::memory_order_relaxed);
        self.requests_in_flight_.store(0, std::memory_order_release);
        self.changes_.notify();
    }

    /// Returns the libusb error code that corresponds to the status of a transfer.
    [[nodiscard]] static int error_of(libusb_transfer_status status) noexcept {
        switch (status) {
            case LIBUSB_TRANSFER_COMPLETED:
                return 0;
            case LIBUSB_TRANSFER_STALL:
                return LIBUSB_ERROR_PIPE;
            case LIBUSB_TRANSFER_NO_DEVICE:
                return LIBUSB_ERROR_NO_DEVICE;
            case LIBUSB_TRANSFER_TIMED_OUT:
            case LIBUSB_TRANSFER_CANCELLED:
                return LIBUSB_ERROR_TIMEOUT;
            default:
                return LIBUSB_ERROR_IO;
        }
    }

    // ------------------------------------------------------------------------------------------- both threads

    /// Waits until `condition` is true, and checks it after every event of a transfer. Returns false after the
    /// deadline.
    template <class Condition>
    [[nodiscard]] bool wait_until(Condition condition, Nanoseconds deadline) noexcept {
        while (!condition()) {
            const std::uint32_t known_events = changes_.events();
            if (!condition() && !changes_.wait(known_events, deadline)) {
                return condition();
            }
        }
        return true;
    }

    /// Counts an error of the USB bus. 100 consecutive errors end the connection.
    void count_bus_error() noexcept {
        bus_errors_.fetch_add(1, std::memory_order_relaxed);
        if (++errors_in_a_row_ >= most_errors_in_a_row) {
            store_error(LIBUSB_ERROR_IO);
        }
    }

    /// Stores the libusb error `code` if it is the first error of the connection, which then counts as failed.
    void store_error(int code) noexcept {
        if (code == 0) {
            return;
        }
        if (code == LIBUSB_ERROR_NO_DEVICE) {
            unplugged_.store(true, std::memory_order_release);
        }
        int none = 0;
        (void)error_.compare_exchange_strong(none, code, std::memory_order_acq_rel);
        changes_.notify();
    }

    void cancel_reads() noexcept {
        for (Read& read : reads_) {
            // the result is ignored: canceling fails only if this transfer has already ended
            (void)libusb_cancel_transfer(read.transfer.get());
        }
    }

    void cancel_all() noexcept {
        cancel_reads();
        (void)libusb_cancel_transfer(write_.get());
        (void)libusb_cancel_transfer(request_.get());
    }

    libusb_context* context_;
    libusb_device_handle* handle_;
    std::array<Read, 2> reads_;
    Transfer write_;
    std::array<std::uint8_t, wire::out_size> out_bytes_{};
    Transfer request_;
    std::array<std::uint8_t, LIBUSB_CONTROL_SETUP_SIZE> setup_{};
    std::atomic<int> answer_{0};

    RingBuffer<UsbArrival> arrivals_;
    WakeUp changes_;  ///< wakes the control loop after a packet, or the end or failure of a USB transfer
    std::atomic<int> reads_in_flight_{0};
    std::atomic<int> writes_in_flight_{0};
    std::atomic<int> requests_in_flight_{0};
    std::atomic<bool> stopping_{false};
    std::atomic<bool> runs_{false};
    std::atomic<int> error_{0};
    std::atomic<bool> unplugged_{false};
    std::atomic<std::uint64_t> stalls_{0};
    std::atomic<std::uint64_t> bus_errors_{0};
    std::atomic<std::uint64_t> lost_writes_{0};
    /// True while the endpoint for packets is halted; only the event thread uses it
    bool reads_halted_ = false;
    /// True while the endpoint for commands is halted; only the event thread uses it
    bool writes_halted_ = false;
    int errors_in_a_row_ = 0;  ///< number of USB bus errors in a row; only the event thread uses it

    std::thread events_;
};

}  // namespace palpate::detail
