// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "faults.hpp"
#include "identity.hpp"
#include "little_endian.hpp"
#include "motor.hpp"
#include "plant.hpp"
#include "requests.hpp"

namespace emulator {

/// Answer of the emulated device to one packet on the USB bus: accepted, not ready (Nak), or refused.
enum class Handshake : std::uint8_t { Ack, Nak, Stall };

/// Emulates the device of protocol version 1: memory and mechanics, one frame for each millisecond. It is independent
/// of the transport and shares no code with the tested library.
class EmulatedDevice {
  public:
    EmulatedDevice(Identity identity, Plant plant, std::vector<Fault> script)
        : identity_{std::move(identity)}, plant_{plant}, motor_{identity_}, faults_{std::move(script)} {
        zero_count_ = identity_.first_count;
        sequence_ = identity_.first_sequence;
        clock_us_ = identity_.first_us;
    }

    [[nodiscard]] const Identity& identity() const { return identity_; }

    // ---------------------------------------------------------------------------------------- control requests

    /// Answers a control transfer; `bytes` are the 8 setup bytes, `data` the outgoing data.
    Answer control(const Bytes& bytes, const Bytes& data) {
        const Setup setup{bytes};
        Answer answer = stalled();
        if ((setup.type & 0x60U) == 0) {
            if (setup.request == 9 || setup.request == 11) {  // requests SET_CONFIGURATION and SET_INTERFACE
                disarm();
                answer = {};
            } else {
                answer = standard_answer(setup, identity_, halts_);
            }
        } else if (setup.type == 0xC1 && setup.request == 1) {
            answer = {0, info()};
        } else if (setup.type == 0x41) {
            answer = command(setup.request, setup.value, data);
        }
        if (answer.data.size() > setup.length) {
            answer.data.resize(setup.length);
        }
        return answer;
    }

    /// Sets the torque to zero, as bus reset, suspend and SET_CONFIGURATION do.
    void disarm() {
        motor_.disarm();
        halts_ = {};
    }
    void clear_halt(std::uint8_t endpoint) { halts_.clear(endpoint); }

    // ------------------------------------------------------------------------------------------------- frames

    /// Advances the device by one millisecond: moves the mechanics, runs the watchdog, stores the encoder count of
    /// this frame.
    void frame() {
        faults_.frame(out_seen_);
        unplugged_ = unplugged_ || faults_.used_last(FaultKind::Unplug);
        naks_ = faults_.used(FaultKind::Freeze);
        mute_ = faults_.used(FaultKind::Mute);
        slow_ = faults_.used(FaultKind::Slow);
        if (faults_.used(FaultKind::Reset)) {
            restart();
        }
        for (const auto& [kind, bit] : {std::pair{FaultKind::Encoder, encoder_fault},
                                        {FaultKind::OverTemperature, over_temperature},
                                        {FaultKind::EmergencyStop, emergency_stop}}) {
            if (faults_.used(kind)) {
                motor_.fail(bit);
            }
        }
        motor_.saturate(faults_.used(FaultKind::Saturate));
        const std::uint32_t skipped = faults_.used_up(FaultKind::Skip);

        plant_.advance(1e-6 * motor_.applied_uNm() * (identity_.reversed ? -1.0 : 1.0), 1e-3);
        ++frames_;
        clock_us_ += 1000;
        sequence_ = static_cast<std::uint16_t>(sequence_ + 1 + skipped);
        motor_.look(clock_us_);
        latch();
    }

    /// Returns true if an IN packet belongs to this version of the protocol.
    [[nodiscard]] static bool is_whole(const Bytes& packet) {
        return packet.size() == 32 && packet[0] == 'H' && packet[1] == 1;
    }

    /// Answers a poll of the IN endpoint.
    Handshake in(Bytes& packet) {
        if (naks_ || mute_ || packets_.empty()) {
            return Handshake::Nak;
        }
        if (halts_.in || faults_.used(FaultKind::StallIn)) {
            halts_.in = true;
            return Handshake::Stall;
        }
        packet = faults_.used(FaultKind::Repeat) ? last_sent_ : packets_.front();
        packets_.pop_front();
        last_sent_ = packet;
        if (faults_.used(FaultKind::Short)) {
            packet.resize(packet.size() / 2);
        }
        if (faults_.used(FaultKind::Magic)) {
            packet.at(0) = 'X';
        }
        if (faults_.used(FaultKind::Version)) {
            packet.at(1) = 2;
        }
        if (faults_.used(FaultKind::Long)) {
            packet.resize(64);
        }
        return Handshake::Ack;
    }

    /// Accepts a packet at the OUT endpoint.
    Handshake out(const Bytes& packet) {
        if (naks_ || faults_.used(FaultKind::Busy)) {
            return Handshake::Nak;
        }
        if (halts_.out || faults_.used(FaultKind::StallOut)) {
            halts_.out = true;
            return Handshake::Stall;
        }
        if (faults_.used(FaultKind::Deaf)) {
            return Handshake::Ack;
        }
        out_seen_ = true;
        motor_.take(packet, clock_us_);
        return Handshake::Ack;
    }

    // -------------------------------------------------------------------------------------------------- faults

    void inject(FaultKind kind, std::uint32_t count) { faults_.inject(kind, count); }
    [[nodiscard]] bool is_unplugged() const { return unplugged_; }
    /// Returns true while the device refuses transfers. Frames in this state last a real millisecond, because the
    /// timeouts of the host are in real time. A halted endpoint does not count: the host receives the halt and clears
    /// it.
    [[nodiscard]] bool withholds_packets() const { return naks_ || mute_; }
    [[nodiscard]] bool is_slow() const { return slow_; }

    // ----------------------------------------------------------------------------- state that the tests read

    [[nodiscard]] std::uint64_t frames() const { return frames_; }
    [[nodiscard]] std::uint16_t sequence() const { return sequence_; }
    /// Sequence number of the last packet that a host has read.
    [[nodiscard]] std::uint16_t last_read_sequence() const {
        return last_sent_.empty() ? 0 : get<std::uint16_t>(last_sent_, 2);
    }
    [[nodiscard]] const Motor& motor() const { return motor_; }
    [[nodiscard]] const Plant& plant() const { return plant_; }

    [[nodiscard]] static std::string trace_header() {
        return "frame,started,clock_us,sequence,position_rad,velocity_radps,torque_Nm,status,out_sequence,"
               "unplugged\n";
    }
    [[nodiscard]] std::string trace_row() const {
        return std::to_string(frames_) + "," + std::to_string(faults_.started()) + "," +
               std::to_string(clock_us_) + "," + std::to_string(sequence_) + "," +
               std::to_string(plant_.position) + "," + std::to_string(plant_.velocity) + "," +
               std::to_string(1e-6 * motor_.applied_uNm()) + "," + std::to_string(motor_.status()) + "," +
               std::to_string(motor_.out_sequence()) + "," + (unplugged_ ? "1\n" : "0\n");
    }

  private:
    void restart() {
        motor_.restart();
        halts_ = {};
        sequence_ = 0;
        clock_us_ = 0;
        zero_count_ = 0;
        packets_.clear();
    }

    Answer command(std::uint8_t request, std::uint16_t value, const Bytes& data) {
        switch (request) {
            case 2:
                return motor_.enable(value);
            case 3:  // ZERO
                zero_ = plant_.position;
                zero_count_ = 0;
                return {};
            case 4:
                return motor_.set_watchdog(value);
            case 5:
                return motor_.clear();
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
        put(bytes, identity_.reports_current_watchdog ? motor_.watchdog_ms() : identity_.watchdog_ms);
        put(bytes, identity_.capabilities);
        bytes.insert(bytes.end(), {32, 16, 1, 0});
        put(bytes, identity_.uid);
        bytes.resize(identity_.info_size);
        return bytes;
    }

    void latch() {
        const double counts = identity_.counts_per_rev / (2.0 * std::numbers::pi);
        const double moved = std::floor((plant_.position - zero_) * counts + 0.5);
        // The 32-bit encoder count wraps around after its largest value.
        const std::int64_t jump = faults_.used(FaultKind::Jump) ? identity_.counts_per_rev / 4 : 0;
        const auto count = static_cast<std::int32_t>(zero_count_ + static_cast<std::int64_t>(moved) + jump);
        const bool frozen = faults_.used(FaultKind::FrozenEncoder);
        last_count_ = frozen ? last_count_ : count;
        const bool measures_speed = (identity_.capabilities & 2U) != 0;
        const bool has_transducer = (identity_.capabilities & 1U) != 0;
        const double object = plant_.spring > 0.0 ? plant_.object_torque() : 1e-6 * motor_.applied_uNm();
        Bytes packet{'H', 1};
        put(packet, sequence_);
        put(packet,
            clock_us_ + (identity_.latch_jitter_us == 0 ? 0 : sequence_ * 7919U % identity_.latch_jitter_us));
        put(packet, last_count_);
        put(packet,
            static_cast<std::int32_t>(measures_speed && !frozen ? std::lround(plant_.velocity * counts) : 0));
        put(packet, motor_.applied_uNm());
        put(packet, motor_.status());
        put(packet,
            static_cast<std::uint16_t>(motor_.out_sequence() - (faults_.used(FaultKind::OldEcho) ? 3 : 0)));
        put(packet, motor_.out_age_us(clock_us_));
        put(packet, identity_.temperature_dC);
        put(packet, static_cast<std::int32_t>(has_transducer ? std::lround(1e6 * object) : 0));
        if (packets_.size() < std::max<std::size_t>(1, identity_.held_packets)) {
            packets_.push_back(packet);
        } else if (identity_.held_packets == 0) {
            packets_.back() = packet;
        }
    }

    Identity identity_;
    Plant plant_;
    Motor motor_;
    Faults faults_;
    Halts halts_;

    double zero_ = 0.0;
    std::int64_t zero_count_ = 0;

    std::uint64_t frames_ = 0;
    std::uint16_t sequence_ = 0;
    std::uint32_t clock_us_ = 0;
    /// The host has sent an OUT packet, so the frames of the fault script are counted
    bool out_seen_ = false;

    std::deque<Bytes> packets_;  ///< IN packets that the host has not yet read
    Bytes last_sent_;
    std::int32_t last_count_ = 0;
    bool naks_ = false;
    bool mute_ = false;
    bool slow_ = false;
    bool unplugged_ = false;
};

}  // namespace emulator
