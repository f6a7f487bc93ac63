// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <system_error>
#include <utility>

#include "palpate/io/tick_record.hpp"

namespace palpate {

/// Sends some of the ticks as JSON lines over UDP to this machine, in the format of PlotJuggler's UDP server. A
/// UDP packet that the operating system does not accept at once is dropped and counted.
class Telemetry {
  public:
    static constexpr double usual_hz = 50.0;  ///< default number of ticks a second that are sent over UDP

    Telemetry() = default;
    ~Telemetry() {
        if (socket_ >= 0) {
            ::close(socket_);
        }
    }
    Telemetry(const Telemetry&) = delete;
    Telemetry& operator=(const Telemetry&) = delete;

    /// Starts to send `rate_hz` ticks a second to a UDP port of this machine. Returns "", or the reason why sending is
    /// not possible.
    [[nodiscard]] std::string open(std::uint16_t port, double rate_hz, RecordUnits units) {
        socket_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
        if (socket_ < 0) {
            return std::string("no telemetry: ") + std::generic_category().message(errno);
        }
        target_.sin_family = AF_INET;
        target_.sin_port = htons(port);
        target_.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        interval_ = 1.0 / rate_hz;
        units_ = std::move(units);
        return "";
    }

    /// Sends one tick for each interval of the send rate: the first tick of the interval; ignores the other ticks.
    void take(std::span<const TickRecord> ticks) noexcept {
        if (socket_ < 0) {
            return;
        }
        for (const TickRecord& tick : ticks) {
            if (tick.time >= due_) {
                due_ = interval_ * (std::floor(tick.time / interval_) + 1.0);
                send(tick);
            }
        }
    }

    [[nodiscard]] std::uint64_t sent() const noexcept { return sent_; }
    [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_; }

  private:
    void send(const TickRecord& tick) noexcept {
        line_.clear();
        append_json(line_, tick, units_);
        const auto* address = reinterpret_cast<const sockaddr*>(&target_);
        const ssize_t sent_bytes = ::sendto(socket_, line_.data(), line_.size(), MSG_DONTWAIT | MSG_NOSIGNAL,
                                            address, sizeof target_);
        ++(sent_bytes == static_cast<ssize_t>(line_.size()) ? sent_ : dropped_);
    }

    int socket_ = -1;
    sockaddr_in target_{};
    double interval_ = 0.0;  ///< time between two sent ticks [s]
    double due_ = 0.0;       ///< time of the next tick to send [s]
    RecordUnits units_;
    std::string line_;
    std::uint64_t sent_ = 0;
    std::uint64_t dropped_ = 0;
};

}  // namespace palpate
