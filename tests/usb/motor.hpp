// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>

#include "identity.hpp"
#include "little_endian.hpp"
#include "requests.hpp"

namespace emulator {

/// Bits of the status in an IN packet (device to host).
inline constexpr std::uint16_t enabled_bit = 1;
inline constexpr std::uint16_t watchdog_bit = 2;
inline constexpr std::uint16_t saturated_bit = 4;
inline constexpr std::uint16_t bad_packet_bit = 8;
inline constexpr std::uint16_t encoder_fault = 16;
inline constexpr std::uint16_t over_temperature = 32;
inline constexpr std::uint16_t emergency_stop = 64;

/// Motor of an emulated device, with every event that sets the torque to zero. All times are read from the device's
/// clock.
class Motor {
  public:
    explicit Motor(Identity identity) : identity_{std::move(identity)} {}

    /// Sets the torque to zero, as bus reset, suspend and SET_CONFIGURATION do.
    void disarm() {
        rest();
        enabled_ = false;
        renders_itself_ = false;
    }

    Answer enable(std::uint16_t value) {
        rest();
        enabled_ = false;
        if (value > 1 || (value == 1 && (faults_ & emergency_stop) != 0)) {
            return stalled();
        }
        enabled_ = value == 1;
        renders_itself_ = renders_itself_ && enabled_;
        return {};
    }
    Answer set_watchdog(std::uint16_t milliseconds) {
        if (milliseconds < 2 || milliseconds > 1000) {
            return stalled();
        }
        watchdog_ms_ = milliseconds;
        return {};
    }
    Answer clear() {
        rest();
        faults_ = present_faults_;
        return {};
    }
    /// Chooses the source of the torque: 0 the host, 1 the model of the device.
    Answer render(std::uint16_t renderer) {
        if (renderer > 1 || (renderer == 1 && identity_.model_uNm_per_count == 0)) {
            return stalled();
        }
        rest();
        renders_itself_ = renderer == 1;
        return {};
    }
    /// The position of the encoder has changed without motion.
    void shift_position() {
        if (renders_itself_) {
            rest();
        }
    }

    /// States the faults that are present now; a fault bit of the status stays set until the request CLEAR.
    void set_faults(std::uint16_t present) {
        present_faults_ = present;
        faults_ |= present;
        if (present != 0) {
            rest();
        }
        enabled_ = enabled_ && (present & emergency_stop) == 0;
    }

    void take(const Bytes& packet, std::uint32_t clock_us) {
        if (packet.size() != 16 || packet[0] != 'T' || packet[1] != 1 || get<std::uint16_t>(packet, 8) != 0) {
            bad_packet_ = true;
            return;
        }
        bad_packet_ = tripped_ = false;
        out_sequence_ = get<std::uint16_t>(packet, 2);
        life_ms_ = get<std::uint16_t>(packet, 10);
        command_us_ = clock_us;
        has_command_ = may_move_ = true;
        if (!renders_itself_) {
            wanted_uNm_ = limited(get<std::int32_t>(packet, 4));
        }
    }

    /// Runs one tick: the watchdog, then the torque of the host or of the model.
    void tick(std::uint32_t clock_us, std::int32_t count) {
        if (has_command_ &&
            clock_us - command_us_ >= 1000U * std::min<std::uint32_t>(watchdog_ms_, life_ms_)) {
            tripped_ = true;
            rest();
        }
        const bool moves = enabled_ && may_move_ && faults_ == 0;
        if (moves && renders_itself_) {
            model_start_us_ = std::exchange(model_runs_, true) ? model_start_us_ : clock_us;
            torque_uNm_ = ramp(limited(identity_.model_torque_uNm(count)), clock_us - model_start_us_);
        } else {
            model_runs_ = false;
            torque_uNm_ = moves ? wanted_uNm_ : 0;
        }
    }

    [[nodiscard]] std::int32_t torque_uNm() const { return torque_uNm_; }
    [[nodiscard]] bool renders_itself() const { return renders_itself_; }
    [[nodiscard]] std::uint16_t status() const {
        const auto bit = [](bool set, std::uint16_t mask) { return set ? mask : std::uint16_t{0}; };
        return static_cast<std::uint16_t>(bit(enabled_, enabled_bit) | bit(tripped_, watchdog_bit) |
                                          bit(saturated_, saturated_bit) | bit(bad_packet_, bad_packet_bit) |
                                          faults_);
    }
    [[nodiscard]] std::uint16_t watchdog_ms() const { return watchdog_ms_; }
    /// Returns the sequence number of the last accepted OUT packet.
    [[nodiscard]] std::uint16_t out_sequence() const { return out_sequence_; }
    [[nodiscard]] std::uint16_t out_age_us(std::uint32_t clock_us) const {
        const std::uint32_t age = std::min<std::uint32_t>(clock_us - command_us_, 0xFFFF);
        return has_command_ ? static_cast<std::uint16_t>(age) : std::uint16_t{0xFFFF};
    }

  private:
    void rest() {
        torque_uNm_ = 0;
        may_move_ = false;
        model_runs_ = false;
    }
    std::int32_t limited(std::int32_t torque_uNm) {
        const std::int32_t limit = identity_.max_torque_uNm;
        saturated_ = torque_uNm < -limit || torque_uNm > limit;
        return std::clamp(torque_uNm, -limit, limit);
    }
    /// Returns the share of a torque of the model at a time after its start.
    [[nodiscard]] std::int32_t ramp(std::int32_t torque_uNm, std::uint32_t elapsed_us) const {
        const std::int64_t whole_us = 1000 * std::int64_t{identity_.ramp_ms};
        if (elapsed_us >= whole_us) {
            return torque_uNm;
        }
        const std::int64_t share = std::int64_t{elapsed_us / 16} * 4096 / (whole_us / 16);
        return static_cast<std::int32_t>(torque_uNm * share / 4096);
    }

    Identity identity_;
    bool enabled_ = false;
    bool tripped_ = false;
    bool saturated_ = false;
    bool bad_packet_ = false;
    bool renders_itself_ = false;  ///< the device renders its own model
    bool model_runs_ = false;
    bool may_move_ = false;  ///< a command has arrived since the last event that sets the torque to zero
    std::uint32_t model_start_us_ = 0;
    std::uint16_t faults_ = 0;
    std::uint16_t present_faults_ = 0;
    std::uint16_t watchdog_ms_ = identity_.watchdog_ms;
    std::uint16_t life_ms_ = 0xFFFF;
    std::int32_t wanted_uNm_ = 0;
    std::int32_t torque_uNm_ = 0;
    std::uint16_t out_sequence_ = 0;
    std::uint32_t command_us_ = 0;
    bool has_command_ = false;  ///< the device has received a command since its start
};

}  // namespace emulator
