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
    /// Times from sending a command to the packet that confirms it, by the host's clock [ns]
    DurationHistogram round_trip;
    /// Times from a sample until the device applies the force computed from it, by the device's clock [ns]
    DurationHistogram delay;
};

/// Converts the packets of one device to readings. Counters no longer restart at 0, encoder counts become SI units, and
/// status bits become a Status. Each packet contains the number of the last accepted command (its echo), which gives
/// the delay of the force.
///
/// The delay is computed from the device's clock and sample numbers only. A command is computed from the last sample k
/// that was read. Its force is late from the time t_{k+1} of the next sample on. A packet of time t_m states that the
/// device accepted a newer command `out_age` before t_m; the old force was then late by t_m - out_age - t_{k+1}.
/// Otherwise the force is late by t_m - t_{k+1} so far. `Reading::delay` is the largest of these times since the last
/// packet. It includes commands that the device ignores, commands that the host skips, and lost samples. The numbers
/// of the samples show a delay of m - k - 1 periods also if the clock of the device has stopped.
class PacketStream {
  public:
    PacketStream() = default;
    explicit PacketStream(const wire::Info& info) noexcept : info_{info} {}

    /// Reads a packet that arrived at the time `now` of the host's clock. Returns false if it is not a packet of this
    /// protocol.
    [[nodiscard]] bool take(std::span<const std::uint8_t> bytes, Nanoseconds now) noexcept {
        wire::InPacket packet;
        if (!wire::decode(bytes, packet)) {
            ++health_.malformed;
            return false;
        }
        const bool first = !sequence_.started();
        const SampleTime before = newest();
        const std::int64_t step = sequence_.follow(packet.sequence);
        clock_us_.follow(packet.clock_us);
        count_.follow(packet.count);
        ++health_.packets;
        health_.lost += follows_ ? static_cast<std::uint64_t>(std::max<std::int64_t>(step - 1, 0)) : 0;
        health_.repeated += !first && step <= 0 ? 1 : 0;
        read(packet, first, step);
        if (has_sent_) {
            end_sample_of_last_command(before, step);
            reading_.delay = follow_echo(packet, before, now);
        } else {
            sent_ = echoed_ = packet.out_sequence;
        }
        reading_.status = status_of(packet.status);
        status_bits_ = packet.status;
        follows_ = true;
        return true;
    }

    /// Marks that packets were discarded. The step to the next packet then does not count lost samples.
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
        const SampleTime sample = newest();
        if (!std::exchange(has_sent_, true)) {
            late_from_ = sample;  // the device made zero force until this sample
        }
        sent_ = command.sequence;
        sent_commands_[sent_ % sent_commands_.size()] = {
            sent_, now, {sample.number + 1, sample.us + period_us()}};
        awaits_next_sample_ = true;
    }

    [[nodiscard]] const Reading& reading() const noexcept { return reading_; }
    [[nodiscard]] const StreamHealth& health() const noexcept { return health_; }
    /// Returns the status bits of the last packet.
    [[nodiscard]] std::uint16_t status_bits() const noexcept { return status_bits_; }

  private:
    /// Number of a sample, and its time by the device's clock [us].
    struct SampleTime {
        std::int64_t number = 0;
        std::int64_t us = 0;
    };
    /// A command that was sent, with the first sample that its force does not take into account.
    struct SentCommand {
        std::uint16_t sequence = 0;
        Nanoseconds sent = 0;
        SampleTime late_from{};
    };

    [[nodiscard]] SampleTime newest() const noexcept { return {sequence_.value(), clock_us_.value()}; }
    [[nodiscard]] std::int64_t period_us() const noexcept {
        return std::int64_t{1'000'000} / std::max<std::int64_t>(info_.rate_hz, 1);
    }

    /// Stores the time of the sample after that of the last command, when the first packet after it is read. The
    /// packet comes `step` samples after the one `before`; if samples between them were lost, the time is interpolated.
    void end_sample_of_last_command(const SampleTime& before, std::int64_t step) noexcept {
        if (step > 0 && std::exchange(awaits_next_sample_, false)) {
            sent_commands_[sent_ % sent_commands_.size()].late_from.us =
                before.us + (clock_us_.value() - before.us) / step;
        }
    }

    /// Finds the command that a packet confirms, and returns the delay of the force since the packet `before` [s]. The
    /// numbers of commands start after the last number confirmed before the first command, so that a confirmation of an
    /// earlier session's command is recognised.
    [[nodiscard]] double follow_echo(const wire::InPacket& packet, const SampleTime& before,
                                     Nanoseconds now) noexcept {
        const auto seconds = [](std::int64_t us) { return 1e-6 * static_cast<double>(us); };
        const SampleTime sample = newest();
        const auto ahead = static_cast<std::int16_t>(packet.out_sequence - echoed_);
        const auto unsent = static_cast<std::int16_t>(packet.out_sequence - sent_);
        double delay = 0.0;
        if (ahead > 0 && unsent <= 0) {
            // The packet before did not confirm this command, so it was accepted later
            const std::int64_t accepted_us =
                std::min(std::max(sample.us - packet.out_age_us, before.us), sample.us);
            delay = seconds(accepted_us - late_from_.us);
            health_.delay.add(static_cast<Nanoseconds>(1e9 * delay));
            echoed_ = packet.out_sequence;
            is_acknowledged_ = true;
            if (const SentCommand& command = sent_commands_[echoed_ % sent_commands_.size()];
                command.sequence == echoed_) {
                health_.round_trip.add(now - command.sent);
                late_from_ = command.late_from;
            }
        } else if (ahead != 0) {
            ++health_.late_echoes;
        }
        return std::max({delay, seconds(sample.us - late_from_.us),
                         seconds((sample.number - late_from_.number) * period_us())});
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
        if (tripped) {
            return Status::Timeout;
        }
        if (refused) {
            return Status::Lost;
        }
        return (bits & wire::torque_saturated) != 0 ? Status::Limited : Status::Ok;
    }

    wire::Info info_;
    wire::Unwrapped<std::uint16_t> sequence_;
    wire::Unwrapped<std::uint32_t> clock_us_;
    wire::Unwrapped<std::int32_t> count_;
    bool has_sent_ = false;
    std::uint16_t sent_ = 0;
    std::uint16_t echoed_ = 0;
    bool is_acknowledged_ = false;
    SampleTime late_from_;             ///< first sample that the applied force does not take into account
    bool awaits_next_sample_ = false;  ///< true if no packet was read after the last command was sent
    bool was_enabled_ = false;
    bool follows_ = false;  ///< true if a packet was read after the last pause()
    std::uint16_t status_bits_ = 0;
    std::array<SentCommand, 64> sent_commands_{};
    Reading reading_;
    StreamHealth health_;
};

}  // namespace palpate
