// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <deque>
#include <utility>

#include "emulated_device.hpp"

namespace emulator {

/// USB transfer that the host has submitted; the names are those of the Linux kernel.
struct Transfer {
    /// Number with which the transport (umockdev or USB/IP) identifies the transfer
    std::uint64_t id = 0;
    const void* owner = nullptr;
    bool is_control = false;
    std::uint8_t endpoint = 0;
    Bytes setup;
    Bytes data;              ///< data that the host sends or has received
    std::size_t length = 0;  ///< largest number of bytes that the host accepts
    std::size_t actual = 0;  ///< transferred bytes
    int status = 0;          ///< result of the transfer: 0 or a negative error number of Linux (errno)
};

/// USB port of the emulated device: transfers wait here until a frame executes them. The port is independent of the
/// transport.
class Port {
  public:
    explicit Port(EmulatedDevice device) : device_{std::move(device)} {}

    [[nodiscard]] EmulatedDevice& device() { return device_; }
    [[nodiscard]] const EmulatedDevice& device() const { return device_; }

    /// Submits a transfer; returns 0 or a negative error number of Linux (errno). Control transfers complete
    /// immediately.
    int submit(Transfer transfer) {
        if (device_.is_unplugged()) {
            return -ENODEV;
        }
        if (transfer.is_control) {
            Answer answer = device_.control(transfer.setup, transfer.data);
            transfer.status = answer.status;
            const bool in = (transfer.setup.at(0) & 0x80U) != 0;
            transfer.actual = answer.status != 0 ? 0 : in ? answer.data.size() : transfer.data.size();
            if (in) {
                transfer.data = std::move(answer.data);
            }
            done_.push_back(std::move(transfer));
            return 0;
        }
        if (transfer.endpoint != 0x81 && transfer.endpoint != 0x01) {
            return -ENOENT;
        }
        (transfer.endpoint == 0x81 ? in_ : out_).push_back(std::move(transfer));
        return 0;
    }

    /// Cancels a waiting transfer, which completes with `status`. Returns false if the transfer is not waiting.
    bool cancel(std::uint64_t id, const void* owner, int status) {
        for (std::deque<Transfer>* queue : {&in_, &out_}) {
            const auto found = std::find_if(queue->begin(), queue->end(), [&](const Transfer& transfer) {
                return transfer.id == id && transfer.owner == owner;
            });
            if (found != queue->end()) {
                found->status = status;
                done_.push_back(std::move(*found));
                queue->erase(found);
                return true;
            }
        }
        return false;
    }

    /// Forgets how the last host made its transfers, because this host has closed the device. An endpoint that the
    /// device has halted answers the first transfer of the next host with a stall.
    void reset_host() {
        in_held_ = false;
        out_held_ = false;
    }

    /// Removes the transfers of a client process that has ended.
    void remove_client(const void* owner) {
        for (std::deque<Transfer>* queue : {&in_, &out_, &done_}) {
            std::erase_if(*queue, [&](const Transfer& transfer) { return transfer.owner == owner; });
        }
    }

    void clear_halt(std::uint8_t endpoint) {
        device_.clear_halt(endpoint);
        (endpoint == 0x81 ? in_held_ : out_held_) = false;
    }

    /// Executes the transfers of one USB frame.
    void frame() {
        if (device_.is_unplugged()) {
            return;
        }
        if (device_.identity().applies_out_first) {
            serve_out();
        }
        device_.frame();
        if (device_.is_unplugged()) {
            for (std::deque<Transfer>* queue : {&in_, &out_}) {
                for (Transfer& transfer : *queue) {
                    transfer.status = -ESHUTDOWN;
                    done_.push_back(std::move(transfer));
                }
                queue->clear();
            }
            return;
        }
        Bytes packet;
        const Handshake answer = polled(packet);
        if (device_.identity().ends_in_transfer_first) {
            serve_in(answer, packet);
        }
        if (!device_.identity().applies_out_first) {
            serve_out();
        }
        if (!device_.identity().ends_in_transfer_first) {
            serve_in(answer, packet);
        }
    }

    [[nodiscard]] std::deque<Transfer>& done() { return done_; }
    [[nodiscard]] std::size_t waiting() const { return in_.size() + out_.size(); }

  private:
    Handshake polled(Bytes& packet) { return in_.empty() || in_held_ ? Handshake::Nak : device_.in(packet); }

    void serve_in(Handshake answer, Bytes& packet) {
        if (answer == Handshake::Nak) {
            return;
        }
        Transfer transfer = std::move(in_.front());
        in_.pop_front();
        if (answer == Handshake::Stall) {
            transfer.status = -EPIPE;
            in_held_ = true;
        } else if (answer == Handshake::Error) {
            transfer.status = -EPROTO;
        } else {
            transfer.status = packet.size() > transfer.length ? -EOVERFLOW : 0;
            packet.resize(std::min(packet.size(), transfer.length));
            transfer.actual = packet.size();
            transfer.data = std::move(packet);
        }
        done_.push_back(std::move(transfer));
    }

    void serve_out() {
        if (out_.empty() || out_held_) {
            return;
        }
        const Handshake answer = device_.out(out_.front().data);
        if (answer == Handshake::Nak) {
            return;
        }
        Transfer transfer = std::move(out_.front());
        out_.pop_front();
        transfer.status = answer == Handshake::Stall ? -EPIPE : 0;
        transfer.actual = answer == Handshake::Stall ? 0 : transfer.data.size();
        out_held_ = answer == Handshake::Stall;
        done_.push_back(std::move(transfer));
    }

    EmulatedDevice device_;
    std::deque<Transfer> in_;
    std::deque<Transfer> out_;
    std::deque<Transfer> done_;
    /// True: the IN endpoint has halted and serves no transfer until the host clears the halt
    bool in_held_ = false;
    bool out_held_ = false;
};

/// Decides in real time when a frame begins: every millisecond; up to three late frames follow immediately.
class FrameClock {
  public:
    using Clock = std::chrono::steady_clock;

    explicit FrameClock(double rate_hz)
        : period_{std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1.0 / rate_hz))} {
    }

    /// Returns the duration of a frame.
    [[nodiscard]] Clock::duration frame(bool is_slow) const { return (is_slow ? 3 : 1) * period_; }

    /// Returns true if a frame begins now; otherwise sets `until` to the time of the next frame.
    [[nodiscard]] bool is_due(bool is_slow, Clock::time_point now, Clock::time_point& until) {
        until = last_ + frame(is_slow);
        if (now < until) {
            return false;
        }
        last_ = now - until > 3 * period_ ? now : until;
        return true;
    }

  private:
    Clock::duration period_;
    Clock::time_point last_ = Clock::now();
};

}  // namespace emulator
