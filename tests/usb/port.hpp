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

/// One transfer of the host, in the words of the kernel.
struct Transfer {
    std::uint64_t id = 0;  ///< the transport's own name for it
    const void* owner = nullptr;
    bool is_control = false;
    std::uint8_t endpoint = 0;
    Bytes setup;
    Bytes data;              ///< on its way out, or what came in
    std::size_t length = 0;  ///< room for what comes in
    std::size_t actual = 0;  ///< bytes moved
    int status = 0;          ///< 0 or a negative errno
};

/// Where the device is plugged in: transfers wait here until a frame serves them. Knows no transport.
class Port {
  public:
    explicit Port(EmulatedDevice device) : device_{std::move(device)} {}

    [[nodiscard]] EmulatedDevice& device() { return device_; }
    [[nodiscard]] const EmulatedDevice& device() const { return device_; }

    /// 0, or a negative errno. Control transfers are done at once.
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
        owes_answer_ = owes_answer_ && transfer.endpoint == 0x81;
        (transfer.endpoint == 0x81 ? in_ : out_).push_back(std::move(transfer));
        reads_ahead_ = reads_ahead_ || in_.size() >= 2;
        return 0;
    }

    /// Takes a waiting transfer back; false: it is not waiting. It still ends, with `status`.
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

    /// Whoever held the device let it go: the next host begins anew.
    void let_go() {
        reads_ahead_ = false;
        owes_answer_ = true;
    }

    /// The transfers of one that is gone.
    void forget(const void* owner) {
        for (std::deque<Transfer>* queue : {&in_, &out_, &done_}) {
            std::erase_if(*queue, [&](const Transfer& transfer) { return transfer.owner == owner; });
        }
    }

    void clear_halt(std::uint8_t endpoint) {
        device_.clear_halt(endpoint);
        (endpoint == 0x81 ? in_held_ : out_held_) = false;
        owes_answer_ =
            owes_answer_ && endpoint == 0x81;  // the answer was lost, whether the host knows or not
    }

    /// One frame of the bus.
    void frame() {
        if (device_.is_unplugged()) {
            return;
        }
        if (device_.identity().takes_out_first) {
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
        if (device_.identity().tells_in_first) {
            serve_in(answer, packet);
        }
        if (!device_.identity().takes_out_first) {
            serve_out();
        }
        if (!device_.identity().tells_in_first) {
            serve_in(answer, packet);
        }
    }

    /// Whether the host has done its part of a frame: it reads, and has answered every packet that it could.
    [[nodiscard]] bool host_is_ready() const {
        return !in_.empty() && (!out_.empty() || !owes_answer_) && !in_held_ && !out_held_;
    }
    /// Whether the host keeps reads queued, or does one thing after the other.
    [[nodiscard]] bool host_reads_ahead() const { return reads_ahead_; }
    /// Whether such a host has not come to queue the next one.
    [[nodiscard]] bool lacks_reads() const { return reads_ahead_ && in_.empty(); }
    /// Whether an OUT packet waits for a later frame than the one that it was sent for.
    [[nodiscard]] bool is_behind() const { return out_refused_ && !out_.empty(); }
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
        } else {
            transfer.status = packet.size() > transfer.length ? -EOVERFLOW : 0;
            packet.resize(std::min(packet.size(), transfer.length));
            transfer.actual = packet.size();
            owes_answer_ = owes_answer_ || EmulatedDevice::is_whole(packet);
            transfer.data = std::move(packet);
        }
        done_.push_back(std::move(transfer));
    }

    void serve_out() {
        if (out_.empty() || out_held_) {
            return;
        }
        const Handshake answer = device_.out(out_.front().data);
        out_refused_ = answer == Handshake::Nak;
        if (out_refused_) {
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
    bool in_held_ = false;  ///< a halted endpoint serves nothing until it is cleared
    bool out_held_ = false;
    bool out_refused_ = false;
    bool reads_ahead_ = false;
    bool owes_answer_ = true;  ///< the host has a packet, and has sent nothing since
};

/// When frames begin.
///
/// Paced: every millisecond; up to three late ones are made up for. Lock-step: as soon as the host has done its part,
/// so that nothing depends on how fast the machine is. Before the host's first command, and while the device itself
/// takes its time, frames go by the clock in lock-step too, as long as the host reads. A host that does not do its
/// part is waited for; when patience ends it misses one frame. One that does not keep two reads queued does one thing
/// after the other, and is waited for a few milliseconds only.
class FrameClock {
  public:
    using Clock = std::chrono::steady_clock;

    FrameClock(bool lock_step, double rate_hz, std::chrono::milliseconds patience)
        : lock_step_{lock_step},
          period_{std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1.0 / rate_hz))},
          patience_{patience} {}

    void host_wrote() {
        if (!std::exchange(in_conversation_, true)) {
            first_ = Clock::now() + settling;
        }
    }
    void host_left() { in_conversation_ = false; }

    /// Whether a frame begins now; else `until` is when to look again at the latest.
    [[nodiscard]] bool is_due(const Port& port, Clock::time_point now, Clock::time_point& until) {
        const EmulatedDevice& device = port.device();
        const bool in_step = lock_step_ && !device.takes_its_time() && !device.is_slow() && !port.is_behind();
        if (in_step && in_conversation_ && port.host_is_ready()) {
            until = first_;
            last_ = now;
            return now >= until;
        }
        const bool waits_for_host = in_step && (in_conversation_ || port.lacks_reads());
        const Clock::duration waits = !waits_for_host           ? (device.is_slow() ? 3 : 1) * period_
                                      : port.host_reads_ahead() ? patience_
                                                                : 5 * period_;
        until = last_ + waits;
        if (now < until) {
            return false;
        }
        last_ = lock_step_ || now - until > 3 * period_ ? now : until;
        return true;
    }

  private:
    /// What was sent before the conversation arrives before it begins: else the host stays a packet behind in it.
    static constexpr std::chrono::milliseconds settling{20};

    bool lock_step_;
    Clock::duration period_;
    Clock::duration patience_;
    Clock::time_point last_ = Clock::now();
    Clock::time_point first_ = last_;  ///< of the conversation
    bool in_conversation_ = false;
};

}  // namespace emulator
