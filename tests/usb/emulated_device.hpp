// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "faults.hpp"
#include "firmware.hpp"
#include "identity.hpp"
#include "little_endian.hpp"
#include "motor.hpp"
#include "plant.hpp"
#include "requests.hpp"

namespace emulator {

/// Answer of the emulated device to one packet on the USB bus: accepted, not ready (Nak), refused, or damaged.
enum class Handshake : std::uint8_t { Ack, Nak, Stall, Error };

/// Emulates the device of protocol version 1: a firmware with its mechanics, its USB endpoints and their faults, one
/// frame for each millisecond. It is independent of the transport and shares no code with the tested library.
///
/// Deviations that the protocol permits are made here by changing the packets of the firmware, so that every firmware
/// has them.
class EmulatedDevice {
  public:
    EmulatedDevice(Identity identity, std::unique_ptr<Firmware> firmware, Plant plant,
                   std::vector<Fault> script)
        : identity_{std::move(identity)},
          firmware_{std::move(firmware)},
          plant_{plant},
          faults_{std::move(script)},
          first_count_{identity_.first_count},
          sequence_offset_{identity_.first_sequence},
          clock_us_{identity_.first_us} {
        last_sample_ = sample(first_count_, false);
        firmware_->tick(last_sample_);  // a request may come before the first frame
    }

    [[nodiscard]] const Identity& identity() const { return identity_; }

    // ---------------------------------------------------------------------------------------- control requests

    /// Answers a control transfer; `bytes` are the 8 setup bytes, `data` the outgoing data.
    Answer control(const Bytes& bytes, const Bytes& data) {
        const Setup setup{bytes};
        if ((setup.type & 0x60U) != 0) {
            return vendor_answer(setup, bytes, data);
        }
        if (setup.request == 9 || setup.request == 11) {  // requests SET_CONFIGURATION and SET_INTERFACE
            disarm();
            return {};
        }
        Answer answer = standard_answer(setup, identity_, halts_);
        if (answer.data.size() > setup.length) {
            answer.data.resize(setup.length);
        }
        return answer;
    }

    /// Sets the torque to zero, as bus reset, suspend and SET_CONFIGURATION do.
    void disarm() {
        firmware_->disarm();
        halts_ = {};
    }
    void clear_halt(std::uint8_t endpoint) { halts_.clear(endpoint); }

    // ------------------------------------------------------------------------------------------------- frames

    /// Advances the device by one millisecond: moves the mechanics, runs the ticks of the control loop, stores the
    /// packet of this frame.
    void frame() {
        faults_.frame(out_seen_);
        unplugged_ = unplugged_ || faults_.used_last(FaultKind::Unplug);
        naks_ = faults_.used(FaultKind::Freeze);
        mute_ = faults_.used(FaultKind::Mute);
        slow_ = faults_.used(FaultKind::Slow);
        if (faults_.used(FaultKind::Reset)) {
            restart();
        }
        if (faults_.used(FaultKind::NoWatchdog) && !last_out_.empty()) {
            firmware_->out(last_out_, clock_us_);
        }
        std::uint16_t present = 0;
        for (const auto& [kind, bit] : {std::pair{FaultKind::Encoder, encoder_fault},
                                        {FaultKind::OverTemperature, over_temperature},
                                        {FaultKind::EmergencyStop, emergency_stop}}) {
            present |= faults_.used(kind) ? bit : std::uint16_t{0};
        }
        if (std::exchange(present_faults_, present) != present) {
            was_enabled_ = firmware_->state().is_enabled();
            firmware_->fault(present);
        }
        saturates_ = faults_.used(FaultKind::Saturate);
        sequence_offset_ = static_cast<std::uint16_t>(sequence_offset_ + faults_.used_up(FaultKind::Skip));
        ++frames_;
        // The 32-bit encoder count wraps around after its largest value.
        const std::int64_t error =
            first_count_ + (faults_.used(FaultKind::Jump) ? identity_.counts_per_rev / 4 : 0);
        const bool frozen = faults_.used(FaultKind::FrozenEncoder);
        const std::uint32_t ticks = std::max(1U, identity_.loop_hz / 1000U);
        for (std::uint32_t k = 0; k < ticks; ++k) {
            plant_.advance(1e-6 * applied_uNm() * (identity_.reversed ? -1.0 : 1.0), 1e-3 / ticks);
            clock_us_ += 1000 / ticks;
            last_sample_ = sample(error, frozen);
            firmware_->tick(last_sample_);
        }
        store(deviating(firmware_->in()));
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
        if (faults_.used(FaultKind::ErrorIn)) {
            return Handshake::Error;
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
        last_bus_out_ = packet;
        if (faults_.used(FaultKind::Deaf)) {
            return Handshake::Ack;
        }
        out_seen_ = true;
        if (identity_.accepts_while_disabled || firmware_->state().is_enabled()) {
            ++outs_;
            last_out_ = packet;
            firmware_->out(packet, clock_us_);
            firmware_->tick(last_sample_);  // the command acts from the beginning of the next frame
        }
        return Handshake::Ack;
    }

    // -------------------------------------------------------------------------------------------------- faults

    void inject(FaultKind kind, std::uint32_t count) { faults_.inject(kind, count); }
    /// Ends all active faults, and drops the packets that they held back.
    void end_faults() {
        faults_.end();
        present_faults_ = 0;
        firmware_->fault(0);
        held_back_.clear();
        packets_.clear();
    }
    [[nodiscard]] bool is_unplugged() const { return unplugged_; }
    [[nodiscard]] bool is_slow() const { return slow_; }

    // ----------------------------------------------------------------------------- state that the tests read

    [[nodiscard]] std::uint64_t frames() const { return frames_; }
    /// Sequence number of the last packet that the device has made.
    [[nodiscard]] std::uint16_t sequence() const { return sequence_; }
    /// Sequence number of the last packet that a host has read.
    [[nodiscard]] std::uint16_t last_read_sequence() const {
        return last_sent_.empty() ? 0 : get<std::uint16_t>(last_sent_, 2);
    }
    [[nodiscard]] FirmwareState state() const { return firmware_->state(); }
    /// Number of OUT packets that the firmware has received.
    [[nodiscard]] std::uint64_t outs() const { return outs_; }
    /// Torque of the last OUT packet that the device has acknowledged [uN*m].
    [[nodiscard]] std::int32_t commanded_uNm() const {
        return last_bus_out_.size() == 16 ? get<std::int32_t>(last_bus_out_, 4) : 0;
    }
    /// Torque that acts on the handle [uN*m].
    [[nodiscard]] std::int32_t applied_uNm() const {
        const std::int32_t step = identity_.torque_step_uNm;
        return firmware_->state().torque_uNm / step * step / (saturates_ ? 2 : 1);
    }
    [[nodiscard]] const Plant& plant() const { return plant_; }

    [[nodiscard]] static std::string trace_header() {
        return "frame,started,clock_us,sequence,position_rad,velocity_radps,torque_Nm,status,out_sequence,"
               "unplugged\n";
    }
    [[nodiscard]] std::string trace_row() const {
        return std::to_string(frames_) + "," + std::to_string(faults_.started()) + "," +
               std::to_string(clock_us_) + "," + std::to_string(sequence_) + "," +
               std::to_string(plant_.position) + "," + std::to_string(plant_.velocity) + "," +
               std::to_string(1e-6 * applied_uNm()) + "," + std::to_string(firmware_->state().status) + "," +
               std::to_string(firmware_->state().out_sequence) + "," + (unplugged_ ? "1\n" : "0\n");
    }

  private:
    void restart() {
        firmware_->restart();
        halts_ = {};
        sequence_offset_ = 0;
        clock_us_ = 0;
        first_count_ = 0;
        present_faults_ = 0;
        restarted_ = true;
        packets_.clear();
    }

    Answer vendor_answer(const Setup& setup, const Bytes& bytes, const Bytes& data) {
        constexpr std::uint8_t get_info = 1;
        constexpr std::uint8_t enable = 2;
        constexpr std::uint8_t fault = 0x7F;
        if (setup.type == 0x41 && setup.request == fault) {
            if (setup.value < 1 || setup.value > 6 || data.size() != 2) {
                return stalled();
            }
            inject(static_cast<FaultKind>(setup.value - 1), get<std::uint16_t>(data, 0));
            return {};
        }
        if (setup.type == 0x41 && setup.request == enable && setup.value == 0 &&
            faults_.used(FaultKind::Refuse)) {
            return stalled();
        }
        last_out_.clear();
        Answer answer = firmware_->control(bytes);
        if (setup.type == 0xC1 && setup.request == get_info && answer.data.size() == 32) {
            answer.data[0] = identity_.magic;
            if (!identity_.reports_current_watchdog) {
                replace(answer.data, 14, identity_.watchdog_ms);
            }
            answer.data.resize(std::min<std::size_t>(identity_.info_size, setup.length));
        }
        const bool stopped = (firmware_->state().status & emergency_stop) != 0;
        if (setup.type == 0x41 && setup.request == enable && stopped && !identity_.refuses_by_stall) {
            return {};
        }
        return answer;
    }

    [[nodiscard]] Sample sample(std::int64_t count_error, bool frozen) const {
        const double counts = identity_.counts_per_rev / (2.0 * std::numbers::pi);
        const bool measures_speed = (identity_.capabilities & 2U) != 0;
        const bool has_transducer = (identity_.capabilities & 1U) != 0;
        const double object = plant_.spring > 0.0 ? plant_.object_torque() : 1e-6 * applied_uNm();
        Sample sample;
        sample.clock_us = clock_us_;
        sample.count = last_sample_.count;
        if (!frozen) {
            sample.count = static_cast<std::int32_t>(
                count_error + static_cast<std::int64_t>(std::floor(plant_.position * counts + 0.5)));
        }
        sample.velocity_cps =
            static_cast<std::int32_t>(measures_speed && !frozen ? std::lround(plant_.velocity * counts) : 0);
        sample.sensor_uNm = static_cast<std::int32_t>(has_transducer ? std::lround(1e6 * object) : 0);
        sample.temperature_dC = identity_.temperature_dC;
        return sample;
    }

    /// Returns a packet of the firmware with the deviations and faults of this device.
    [[nodiscard]] Bytes deviating(Bytes packet) {
        sequence_ = static_cast<std::uint16_t>(get<std::uint16_t>(packet, 2) + sequence_offset_);
        replace(packet, 2, sequence_);
        if (identity_.latch_jitter_us != 0) {
            replace(packet, 4, clock_us_ + sequence_ * 7919U % identity_.latch_jitter_us);
        }
        replace(packet, 16, applied_uNm());
        auto status = get<std::uint16_t>(packet, 20);
        status |= identity_.spare_status;
        status |= saturates_ ? saturated_bit : std::uint16_t{0};
        const bool seems_enabled = !identity_.stop_disables && was_enabled_;
        status |= (status & emergency_stop) != 0 && seems_enabled ? enabled_bit : std::uint16_t{0};
        replace(packet, 20, status);
        auto echo = get<std::uint16_t>(packet, 22);
        if (outs_ == 0 && !restarted_) {
            echo = identity_.first_out_sequence;
            replace(packet, 24, identity_.first_out_age_us);
        }
        echo = static_cast<std::uint16_t>(echo - (faults_.used(FaultKind::OldEcho) ? 3 : 0));
        last_echo_ = faults_.used(FaultKind::StuckEcho) ? last_echo_ : echo;
        replace(packet, 22, last_echo_);
        clock_error_us_ += faults_.used(FaultKind::ClockJump) ? 50'000 : 0;
        last_clock_us_ = faults_.used(FaultKind::StuckClock)
                             ? last_clock_us_
                             : get<std::uint32_t>(packet, 4) + clock_error_us_;
        replace(packet, 4, last_clock_us_);
        return packet;
    }

    void store(Bytes packet) {
        if (faults_.used(FaultKind::Drop)) {
            return;
        }
        if (faults_.used(FaultKind::Burst) || (held_back_.empty() && faults_.used(FaultKind::Swap))) {
            held_back_.push_back(std::move(packet));
            return;
        }
        if (held_back_.size() == 1) {  // the packets of a swap
            packets_ = {std::move(packet), std::move(held_back_.front())};
            held_back_.clear();
            return;
        }
        if (!held_back_.empty()) {
            packets_ = std::exchange(held_back_, {});
            packets_.push_back(std::move(packet));
            return;
        }
        if (packets_.size() < std::max<std::size_t>(1, identity_.held_packets)) {
            packets_.push_back(std::move(packet));
        } else if (identity_.held_packets == 0) {
            packets_.back() = std::move(packet);
        }
    }

    Identity identity_;
    std::unique_ptr<Firmware> firmware_;
    Plant plant_;
    Faults faults_;
    Halts halts_;

    std::int64_t first_count_;       ///< encoder count at the position 0
    std::uint16_t sequence_offset_;  ///< added to the sequence numbers of the firmware
    std::uint32_t clock_us_;
    std::uint64_t frames_ = 0;
    std::uint64_t outs_ = 0;
    std::uint16_t sequence_ = identity_.first_sequence;
    std::uint16_t present_faults_ = 0;
    bool was_enabled_ = false;  ///< the motor was enabled before the last change of the faults
    bool saturates_ = false;    ///< the motor gives half the commanded torque
    bool restarted_ = false;
    /// The host has sent an OUT packet, so the frames of the fault script are counted
    bool out_seen_ = false;

    std::deque<Bytes> packets_;    ///< IN packets that the host has not yet read
    std::deque<Bytes> held_back_;  ///< IN packets of a fault that sends them later
    Bytes last_sent_;
    Bytes last_bus_out_;  ///< last OUT packet that the device has acknowledged
    Bytes last_out_;      ///< last OUT packet that the firmware has received
    std::uint16_t last_echo_ = 0;
    std::uint32_t last_clock_us_ = 0;
    std::uint32_t clock_error_us_ = 0;
    Sample last_sample_;
    bool naks_ = false;
    bool mute_ = false;
    bool slow_ = false;
    bool unplugged_ = false;
};

}  // namespace emulator
