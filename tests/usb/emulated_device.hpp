// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "faults.hpp"
#include "identity.hpp"
#include "little_endian.hpp"
#include "plant.hpp"

namespace emulator {

/// How a transaction ends on the bus.
enum class Handshake : std::uint8_t { Ack, Nak, Stall };

/// The device of protocol version 1: its memory and its mechanics, one millisecond a frame. It knows no transport
/// and shares no code with the library that it tests.
class EmulatedDevice {
  public:
    struct Answer {
        int status = 0;  ///< 0, or -EPIPE for a stall
        Bytes data;
    };

    EmulatedDevice(Identity identity, Plant plant, std::vector<Fault> script)
        : identity_{std::move(identity)}, plant_{plant}, script_{std::move(script)} {
        start_anew();
        sequence_ = identity_.first_sequence;
        clock_us_ = identity_.first_us;
        latch();
        fresh_ = false;
    }

    [[nodiscard]] const Identity& identity() const { return identity_; }

    // ---------------------------------------------------------------------------------------- control requests

    /// `setup`: the 8 bytes; `data`: what follows on the way out.
    Answer control(const Bytes& setup, const Bytes& data) {
        const auto type = setup.at(0);
        const auto request = setup.at(1);
        const auto value = get<std::uint16_t>(setup, 2);
        const auto index = get<std::uint16_t>(setup, 4);
        const auto length = get<std::uint16_t>(setup, 6);
        Answer answer = stalled();
        if ((type & 0x60U) == 0) {
            answer = standard(request, value, index);
        } else if (type == 0xC1) {
            answer = request == 1 ? Answer{0, info()} : stalled();
        } else if (type == 0x41) {
            answer = command(request, value, data);
        }
        if (answer.data.size() > length) {
            answer.data.resize(length);
        }
        return answer;
    }

    /// Bus reset, suspend and SET_CONFIGURATION end every torque.
    void disarm() {
        enabled_ = false;
        torque_uNm_ = 0;
        halted_in_ = halted_out_ = false;
    }
    void clear_halt(std::uint8_t endpoint) { (endpoint == 0x81 ? halted_in_ : halted_out_) = false; }

    // ------------------------------------------------------------------------------------------------- frames

    /// A millisecond passes: the mechanics move, the watchdog looks, the encoder is latched.
    void frame() {
        started_ += out_seen_ ? 1 : 0;
        for (const Fault& fault : script_) {
            if (out_seen_ && fault.frame == started_) {
                inject(fault.kind, fault.count);
            }
        }
        if (used(FaultKind::Unplug) && remaining(FaultKind::Unplug) == 0) {
            unplugged_ = true;
        }
        naks_ = used(FaultKind::Freeze);
        mute_ = used(FaultKind::Mute);
        slow_ = used(FaultKind::Slow);
        if (used(FaultKind::Reset)) {
            start_anew();
        }
        status_faults_ |= used(FaultKind::Encoder) ? encoder_fault : 0;
        status_faults_ |= used(FaultKind::OverTemperature) ? over_temperature : 0;
        if (used(FaultKind::EmergencyStop)) {
            status_faults_ |= emergency_stop;
            enabled_ = false;
        }
        saturates_ = used(FaultKind::Saturate);
        const std::uint32_t skipped = std::exchange(remaining_.at(number(FaultKind::Skip)), 0);

        plant_.advance(1e-6 * applied_uNm() * (identity_.flipped ? -1.0 : 1.0), 1e-3);
        ++frames_;
        clock_us_ += 1000;
        sequence_ = static_cast<std::uint16_t>(sequence_ + 1 + skipped);
        if (out_seen_ && clock_us_ - out_us_ >= 1000U * std::min<std::uint32_t>(watchdog_ms_, ttl_ms_)) {
            tripped_ = true;
            torque_uNm_ = 0;
        }
        latch();
    }

    /// Whether an IN packet is one of this protocol, which a host can make sense of.
    [[nodiscard]] static bool is_whole(const Bytes& packet) {
        return packet.size() == 32 && packet[0] == 'H' && packet[1] == 1;
    }

    /// The IN endpoint is polled.
    Handshake in(Bytes& packet) {
        if (naks_ || mute_ || !fresh_) {
            return Handshake::Nak;
        }
        if (halted_in_ || used(FaultKind::StallIn)) {
            halted_in_ = true;
            return Handshake::Stall;
        }
        fresh_ = false;
        packet = used(FaultKind::Repeat) ? last_sent_ : packet_;
        last_sent_ = packet;
        if (used(FaultKind::Short)) {
            packet.resize(packet.size() / 2);
        }
        if (used(FaultKind::Magic)) {
            packet.at(0) = 'X';
        }
        if (used(FaultKind::Version)) {
            packet.at(1) = 2;
        }
        if (used(FaultKind::Long)) {
            packet.resize(64);
        }
        return Handshake::Ack;
    }

    /// The OUT endpoint is written to.
    Handshake out(const Bytes& packet) {
        if (naks_ || used(FaultKind::Busy)) {
            return Handshake::Nak;
        }
        if (halted_out_ || used(FaultKind::StallOut)) {
            halted_out_ = true;
            return Handshake::Stall;
        }
        if (used(FaultKind::Deaf)) {
            return Handshake::Ack;
        }
        take(packet);
        return Handshake::Ack;
    }

    // -------------------------------------------------------------------------------------------------- faults

    void inject(FaultKind kind, std::uint32_t count) { remaining_.at(number(kind)) = std::max(count, 1U); }
    [[nodiscard]] bool is_unplugged() const { return unplugged_; }
    /// Refuses transfers for now: such frames take their time, since the host's timeouts do. One that
    /// halted is no such device: the host is told, and clears it when it comes to it.
    [[nodiscard]] bool takes_its_time() const { return naks_ || mute_; }
    [[nodiscard]] bool is_slow() const { return slow_; }

    // ----------------------------------------------------------------------------- what a test wants to know

    [[nodiscard]] std::uint64_t frames() const { return frames_; }
    [[nodiscard]] std::uint16_t sequence() const { return sequence_; }
    [[nodiscard]] std::uint64_t outs() const { return outs_; }
    [[nodiscard]] std::uint64_t bad_outs() const { return bad_outs_; }
    [[nodiscard]] bool is_enabled() const { return enabled_; }
    [[nodiscard]] std::int32_t applied_uNm() const {
        const std::int32_t torque = enabled_ && status_faults_ == 0 ? torque_uNm_ : 0;
        return saturates_ ? torque / 2 : torque;
    }
    [[nodiscard]] const Plant& plant() const { return plant_; }

    [[nodiscard]] static std::string trace_header() {
        return "frame,started,clock_us,sequence,position_rad,velocity_radps,torque_Nm,status,out_sequence,"
               "unplugged\n";
    }
    [[nodiscard]] std::string trace_row() const {
        return std::to_string(frames_) + "," + std::to_string(started_) + "," + std::to_string(clock_us_) +
               "," + std::to_string(sequence_) + "," + std::to_string(plant_.position) + "," +
               std::to_string(plant_.velocity) + "," + std::to_string(1e-6 * applied_uNm()) + "," +
               std::to_string(status()) + "," + std::to_string(out_sequence_) + "," +
               (unplugged_ ? "1\n" : "0\n");
    }

  private:
    static constexpr std::uint16_t enabled_bit = 1;
    static constexpr std::uint16_t watchdog_bit = 2;
    static constexpr std::uint16_t saturated_bit = 4;
    static constexpr std::uint16_t bad_packet_bit = 8;
    static constexpr std::uint16_t encoder_fault = 16;
    static constexpr std::uint16_t over_temperature = 32;
    static constexpr std::uint16_t emergency_stop = 64;

    [[nodiscard]] static Answer stalled() { return {-EPIPE, {}}; }
    [[nodiscard]] static std::size_t number(FaultKind kind) { return static_cast<std::size_t>(kind); }
    [[nodiscard]] std::uint32_t remaining(FaultKind kind) const { return remaining_.at(number(kind)); }

    /// Whether a fault is due; one less is left of it.
    bool used(FaultKind kind) {
        std::uint32_t& left = remaining_.at(number(kind));
        if (left == 0) {
            return false;
        }
        --left;
        return true;
    }

    void start_anew() {
        disarm();
        sequence_ = 0;
        clock_us_ = 0;
        out_sequence_ = 0;
        out_us_ = 0;
        out_seen_at_all_ = false;
        watchdog_ms_ = identity_.watchdog_ms;
        ttl_ms_ = 0xFFFF;
        status_faults_ = 0;
        tripped_ = saturated_ = bad_packet_ = false;
    }

    Answer standard(std::uint8_t request, std::uint16_t value, std::uint16_t index) {
        switch (request) {
            case 0:  // GET_STATUS
                return {
                    0,
                    {static_cast<std::uint8_t>((index == 0x81 && halted_in_) || (index == 1 && halted_out_)),
                     0}};
            case 1:  // CLEAR_FEATURE
                if (value == 0) {
                    clear_halt(static_cast<std::uint8_t>(index));
                }
                return {};
            case 6: {  // GET_DESCRIPTOR
                Bytes descriptor;
                switch (value >> 8U) {
                    case 1:
                        descriptor = Identity::device_descriptor();
                        break;
                    case 2:
                        descriptor = Identity::configuration_descriptor();
                        break;
                    case 3:
                        descriptor = identity_.string_descriptor(value & 0xFFU);
                        break;
                    default:
                        break;
                }
                return descriptor.empty() ? stalled() : Answer{0, descriptor};
            }
            case 8:  // GET_CONFIGURATION
                return {0, {1}};
            case 9:   // SET_CONFIGURATION
            case 11:  // SET_INTERFACE
                disarm();
                return {};
            case 10:  // GET_INTERFACE
                return {0, {0}};
            default:
                return stalled();
        }
    }

    Answer command(std::uint8_t request, std::uint16_t value, const Bytes& data) {
        switch (request) {
            case 2:  // ENABLE
                if (value > 1 || (value == 1 && (status_faults_ & emergency_stop) != 0)) {
                    return stalled();
                }
                enabled_ = value == 1;
                torque_uNm_ = 0;
                return {};
            case 3:  // ZERO
                zero_ = plant_.position;
                return {};
            case 4:  // WATCHDOG
                if (value < 2 || value > 1000) {
                    return stalled();
                }
                watchdog_ms_ = value;
                return {};
            case 5:  // CLEAR
                status_faults_ = 0;
                return {};
            case 0x7F:  // FAULT
                if (value < 1 || value > 6 || data.size() != 2) {
                    return stalled();
                }
                inject(static_cast<FaultKind>(value - 1), get<std::uint16_t>(data, 0));
                return {};
            default:
                return stalled();
        }
    }

    [[nodiscard]] Bytes info() const {
        Bytes bytes{identity_.magic, 1};
        put(bytes, identity_.firmware);
        put(bytes, identity_.counts_per_rev);
        put(bytes, identity_.max_torque_uNm);
        put(bytes, identity_.rate_hz);
        put(bytes, watchdog_ms_);
        put(bytes, identity_.capabilities);
        bytes.insert(bytes.end(), {32, 16, 1, 0});
        put(bytes, identity_.uid);
        return bytes;
    }

    void take(const Bytes& packet) {
        if (packet.size() != 16 || packet[0] != 'T' || packet[1] != 1 || get<std::uint16_t>(packet, 8) != 0) {
            bad_packet_ = true;
            ++bad_outs_;
            return;
        }
        bad_packet_ = tripped_ = false;
        out_sequence_ = get<std::uint16_t>(packet, 2);
        ttl_ms_ = get<std::uint16_t>(packet, 10);
        out_us_ = clock_us_;
        out_seen_ = out_seen_at_all_ = true;
        ++outs_;
        const auto wanted = get<std::int32_t>(packet, 4);
        torque_uNm_ = std::clamp(wanted, -identity_.max_torque_uNm, identity_.max_torque_uNm);
        saturated_ = torque_uNm_ != wanted;
        if (!enabled_) {
            torque_uNm_ = 0;
        }
    }

    [[nodiscard]] std::uint16_t status() const {
        const auto bit = [](bool set, std::uint16_t mask) { return set ? mask : std::uint16_t{0}; };
        return static_cast<std::uint16_t>(bit(enabled_, enabled_bit) | bit(tripped_, watchdog_bit) |
                                          bit(saturated_ || saturates_, saturated_bit) |
                                          bit(bad_packet_, bad_packet_bit) | status_faults_);
    }

    void latch() {
        const double counts = identity_.counts_per_rev / (2.0 * std::numbers::pi);
        auto count = static_cast<std::int32_t>(std::floor((plant_.position - zero_) * counts + 0.5));
        count += used(FaultKind::Jump) ? static_cast<std::int32_t>(identity_.counts_per_rev / 4) : 0;
        const bool frozen = used(FaultKind::FrozenEncoder);
        last_count_ = frozen ? last_count_ : count;
        const bool measures_speed = (identity_.capabilities & 2U) != 0;
        const bool has_transducer = (identity_.capabilities & 1U) != 0;
        const double object = plant_.spring > 0.0 ? plant_.object_torque() : 1e-6 * applied_uNm();
        packet_ = {'H', 1};
        put(packet_, sequence_);
        put(packet_, clock_us_);
        put(packet_, last_count_);
        put(packet_,
            static_cast<std::int32_t>(measures_speed && !frozen ? std::lround(plant_.velocity * counts) : 0));
        put(packet_, applied_uNm());
        put(packet_, status());
        put(packet_, static_cast<std::uint16_t>(out_sequence_ - (used(FaultKind::OldEcho) ? 3 : 0)));
        put(packet_, static_cast<std::uint16_t>(
                         out_seen_at_all_ ? std::min<std::uint32_t>(clock_us_ - out_us_, 0xFFFF) : 0xFFFF));
        put(packet_, std::uint16_t{253});
        put(packet_, static_cast<std::int32_t>(has_transducer ? std::lround(1e6 * object) : 0));
        fresh_ = true;
    }

    Identity identity_;
    Plant plant_;
    std::vector<Fault> script_;
    std::array<std::uint32_t, fault_names.size()> remaining_{};

    bool enabled_ = false;
    bool tripped_ = false;
    bool saturated_ = false;
    bool bad_packet_ = false;
    std::uint16_t status_faults_ = 0;
    std::uint16_t watchdog_ms_ = 0;
    std::uint16_t ttl_ms_ = 0xFFFF;
    std::int32_t torque_uNm_ = 0;
    double zero_ = 0.0;

    std::uint64_t frames_ = 0;
    std::uint64_t started_ = 0;  ///< frames since the first OUT packet
    std::uint16_t sequence_ = 0;
    std::uint32_t clock_us_ = 0;
    std::uint16_t out_sequence_ = 0;
    std::uint32_t out_us_ = 0;
    bool out_seen_ = false;         ///< the script's clock runs
    bool out_seen_at_all_ = false;  ///< since the device started
    std::uint64_t outs_ = 0;
    std::uint64_t bad_outs_ = 0;

    Bytes packet_;
    Bytes last_sent_;
    std::int32_t last_count_ = 0;
    bool fresh_ = false;
    bool halted_in_ = false;
    bool halted_out_ = false;
    bool naks_ = false;
    bool mute_ = false;
    bool slow_ = false;
    bool saturates_ = false;
    bool unplugged_ = false;
};

}  // namespace emulator
