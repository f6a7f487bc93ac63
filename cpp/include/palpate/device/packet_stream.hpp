// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "palpate/device/device.hpp"
#include "palpate/device/wire.hpp"
#include "palpate/realtime/timing.hpp"

namespace palpate {

/// Counters of the packets from and to a device since the device was opened.
struct StreamHealth {
    std::uint64_t packets = 0;    ///< valid packets
    std::uint64_t lost = 0;       ///< samples that the device sent and that did not arrive
    std::uint64_t repeated = 0;   ///< samples that arrived twice or out of order
    std::uint64_t malformed = 0;  ///< packets of a wrong size, first byte or version
    /// Packets that confirm a command older than the last confirmed one, or not sent by this program
    std::uint64_t late_echoes = 0;
    std::uint64_t watchdog_trips = 0;  ///< number of times the watchdog ended a torque

    std::uint64_t refused_commands = 0;  ///< packets in which the device reports an invalid command
    std::uint64_t late_commands = 0;     ///< commands with a delay longer than allowed
    /// Times from sending a command to the packet that confirms it, by the host's clock [ns]
    DurationHistogram round_trip;
    /// Times from a sample until the device applies the force computed from it, by the device's clock [ns]
    DurationHistogram delay;
};

/// Converts the packets of one device to readings. Counters no longer restart at 0, encoder counts become SI units, and
/// status bits become a Status. Each packet contains the number of the last accepted command (its echo), which gives
/// the delay of commands.
///
/// The delay is computed from the device's clock only. A command is computed from the sample of time t_k. A packet of
/// time t_m states that the command was accepted `out_age` before t_m. The delay is then t_m - out_age - t_k.
class PacketStream {
  public:
    PacketStream() = default;
    explicit PacketStream(const wire::Info& info, Nanoseconds longest_delay) noexcept
        : info_{info}, longest_delay_{longest_delay} {}

    /// Reads a packet that arrived at the time `now` of the host's clock. Returns false if it is not a packet of this
    /// protocol.
    [[nodiscard]] bool take(std::span<const std::uint8_t> bytes, Nanoseconds now) noexcept {
        wire::InPacket packet;
        if (!wire::decode(bytes, packet)) {
            ++health_.malformed;
            return false;
        }
        const bool first = !sequence_.started();
        const std::int64_t step = sequence_.follow(packet.sequence);
        clock_us_.follow(packet.clock_us);
        count_.follow(packet.count);
        ++health_.packets;
        health_.lost += follows_ ? static_cast<std::uint64_t>(std::max<std::int64_t>(step - 1, 0)) : 0;
        health_.repeated += !first && step <= 0 ? 1 : 0;
        is_late_ = false;
        if (!has_sent_) {
            sent_ = echoed_ = packet.out_sequence;
        } else {
            follow_echo(packet, now);
        }
        read(packet, first, step);
        status_bits_ = packet.status;
        follows_ = true;
        return true;
    }

    /// Marks that packets were discarded. The step to the next packet then does not count lost samples, and the delay
    /// of commands sent before the next packet is not measured.
    void pause() noexcept { follows_ = false; }
    /// Returns true if a packet was read after the last pause().
    [[nodiscard]] bool follows() const noexcept { return follows_; }

    /// Returns the packet of the next command, to be sent at the time `now`.
    [[nodiscard]] wire::OutPacket next_command(double force, std::uint16_t time_to_live_ms,
                                               Nanoseconds now) const noexcept {
        return {static_cast<std::uint16_t>(sent_ + 1), wire::torque_of(force, info_.max_torque_uNm),
                time_to_live_ms, static_cast<std::uint32_t>(now / 1000)};
    }
    /// Stores a command that was sent, to compute its delay later.
    void sent(const wire::OutPacket& command, Nanoseconds now) noexcept {
        has_sent_ = true;
        sent_ = command.sequence;
        sent_commands_[sent_ % sent_commands_.size()] = {
            sent_, now, follows_ ? clock_us_.value() : SentCommand{}.sample_us};
    }

    [[nodiscard]] const Reading& reading() const noexcept { return reading_; }
    [[nodiscard]] const StreamHealth& health() const noexcept { return health_; }
    /// Returns the status bits of the last packet.
    [[nodiscard]] std::uint16_t status_bits() const noexcept { return status_bits_; }

  private:
    /// A command that was sent, with the time of the sample from which it was computed.
    struct SentCommand {
        std::uint16_t sequence = 0;
        Nanoseconds sent = 0;
        /// Time of the sample by the device's clock [us]; the smallest integer for a command without a sample.
        std::int64_t sample_us = std::numeric_limits<std::int64_t>::min();
    };

    /// Finds the command that a packet confirms, and measures its delay. The numbers of commands start after the last
    /// number confirmed before the first command, so that a confirmation of an earlier session's command is recognised.
    void follow_echo(const wire::InPacket& packet, Nanoseconds now) noexcept {
        const auto ahead = static_cast<std::int16_t>(packet.out_sequence - echoed_);
        const auto unsent = static_cast<std::int16_t>(packet.out_sequence - sent_);
        if (ahead == 0) {
            return;
        }
        if (ahead < 0 || unsent > 0) {
            ++health_.late_echoes;
            return;
        }
        echoed_ = packet.out_sequence;
        is_acknowledged_ = true;
        const SentCommand& command = sent_commands_[echoed_ % sent_commands_.size()];
        if (command.sequence != echoed_) {
            return;
        }
        health_.round_trip.add(now - command.sent);
        if (command.sample_us != SentCommand{}.sample_us &&
            packet.out_age_us < std::numeric_limits<std::uint16_t>::max()) {
            const Nanoseconds delay = 1000 * (clock_us_.value() - packet.out_age_us - command.sample_us);
            health_.delay.add(delay);
            is_late_ = delay > longest_delay_;
            health_.late_commands += is_late_ ? 1 : 0;
        }
    }

    /// Stores the position, velocity, force and time of a packet as the last reading, in SI units.
    void read(const wire::InPacket& packet, bool first, std::int64_t step) noexcept {
        Reading now;
        now.position = wire::position_of(count_.value(), info_.counts_per_rev);
        now.device_time = 1e-6 * static_cast<double>(clock_us_.value());
        now.velocity = velocity(packet, now, first, step);
        now.applied = wire::force_of(packet.torque_uNm);
        if ((info_.capabilities & wire::has_transducer) != 0) {
            now.measured = wire::force_of(packet.sensor_uNm);
        }
        now.sequence = static_cast<std::uint64_t>(sequence_.value());
        now.status = status_of(packet.status);
        reading_ = now;
    }

    /// Returns the velocity that the device measured. If the device does not measure velocity, returns the difference
    /// quotient of the last two positions: 0 for the first packet, the last velocity for a repeated packet.
    [[nodiscard]] double velocity(const wire::InPacket& packet, const Reading& now, bool first,
                                  std::int64_t step) const noexcept {
        if ((info_.capabilities & wire::measures_velocity) != 0) {
            return wire::position_of(packet.velocity_cps, info_.counts_per_rev);
        }
        const double elapsed = now.device_time - reading_.device_time;
        const bool follows = !first && step > 0 && elapsed > 0.0;
        return follows ? (now.position - reading_.position) / elapsed : first ? 0.0 : reading_.velocity;
    }

    /// Returns the status of a packet. A report of the watchdog or of an invalid command counts only after a command of
    /// this session has reached the device, because earlier reports belong to earlier sessions. A torque that is
    /// disabled after it was enabled is a fault.
    [[nodiscard]] Status status_of(std::uint16_t bits) noexcept {
        const bool tripped = (bits & wire::watchdog_tripped) != 0 && is_acknowledged_;
        const bool refused = (bits & wire::bad_packet) != 0 && is_acknowledged_;
        health_.watchdog_trips += tripped && (status_bits_ & wire::watchdog_tripped) == 0 ? 1 : 0;
        health_.refused_commands += refused ? 1 : 0;
        const bool disabled = was_enabled_ && (bits & wire::enabled) == 0;
        was_enabled_ = was_enabled_ || (bits & wire::enabled) != 0;
        if ((bits & wire::fault_bits) != 0 || disabled) {
            return Status::Fault;
        }
        if (tripped || is_late_) {
            return Status::Timeout;
        }
        if (refused) {
            return Status::Lost;
        }
        return (bits & wire::torque_saturated) != 0 ? Status::Limited : Status::Ok;
    }

    wire::Info info_;
    Nanoseconds longest_delay_ = std::numeric_limits<Nanoseconds>::max();
    wire::Unwrapped<std::uint16_t> sequence_;
    wire::Unwrapped<std::uint32_t> clock_us_;
    wire::Unwrapped<std::int32_t> count_;
    bool has_sent_ = false;
    std::uint16_t sent_ = 0;
    std::uint16_t echoed_ = 0;
    bool is_acknowledged_ = false;
    /// True if the delay of the command confirmed by the last packet was longer than allowed
    bool is_late_ = false;
    bool was_enabled_ = false;
    bool follows_ = false;  ///< true if a packet was read after the last pause()
    std::uint16_t status_bits_ = 0;
    std::array<SentCommand, 64> sent_commands_{};
    Reading reading_;
    StreamHealth health_;
};

}  // namespace palpate
