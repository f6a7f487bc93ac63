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
    explicit Motor(Identity identity)
        : identity_{std::move(identity)}, out_sequence_{identity_.first_out_sequence} {}

    /// Restarts with the state after power-up, except for the first values of the counters.
    void restart() {
        const Identity identity = identity_;
        const std::uint64_t outs = outs_;
        const std::uint64_t bad_outs = bad_outs_;
        *this = Motor{identity};
        out_sequence_ = 0;
        outs_ = outs;
        bad_outs_ = bad_outs;
    }
    /// Sets the torque to zero, as bus reset, suspend and SET_CONFIGURATION do.
    void disarm() {
        enabled_ = false;
        torque_uNm_ = 0;
    }

    Answer enable(std::uint16_t value) {
        torque_uNm_ = 0;
        if (value > 1) {
            return stalled();
        }
        if (value == 1 && (faults_ & emergency_stop) != 0) {
            return identity_.refuses_by_stall ? stalled() : Answer{};
        }
        enabled_ = value == 1;
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
        faults_ = 0;
        return {};
    }

    /// Sets a fault bit of the status; the bit stays set until the request CLEAR.
    void fail(std::uint16_t bit) {
        faults_ |= bit;
        torque_uNm_ = 0;
        enabled_ = enabled_ && !(bit == emergency_stop && identity_.stop_disables);
    }
    /// If `now` is true, the motor gives half the commanded torque and the status contains the saturation bit.
    void saturate(bool now) { saturates_ = now; }

    void take(const Bytes& packet, std::uint32_t clock_us) {
        if (packet.size() != 16 || packet[0] != 'T' || packet[1] != 1 || get<std::uint16_t>(packet, 8) != 0) {
            bad_packet_ = true;
            ++bad_outs_;
            return;
        }
        bad_packet_ = tripped_ = false;
        if (!enabled_ && !identity_.accepts_while_disabled) {
            return;
        }
        out_sequence_ = get<std::uint16_t>(packet, 2);
        life_ms_ = get<std::uint16_t>(packet, 10);
        command_us_ = clock_us;
        has_command_ = true;
        ++outs_;
        const auto wanted = get<std::int32_t>(packet, 4);
        torque_uNm_ = std::clamp(wanted, -identity_.max_torque_uNm, identity_.max_torque_uNm);
        saturated_ = torque_uNm_ != wanted;
        if (!enabled_) {
            torque_uNm_ = 0;
        }
    }
    /// Runs the watchdog, which sets the torque to zero if no command arrives in time.
    void look(std::uint32_t clock_us) {
        if (has_command_ &&
            clock_us - command_us_ >= 1000U * std::min<std::uint32_t>(watchdog_ms_, life_ms_)) {
            tripped_ = true;
            torque_uNm_ = 0;
        }
    }

    [[nodiscard]] bool is_enabled() const { return enabled_; }
    [[nodiscard]] std::int32_t applied_uNm() const {
        const std::int32_t wanted = enabled_ && faults_ == 0 ? torque_uNm_ : 0;
        const std::int32_t torque = wanted / identity_.torque_step_uNm * identity_.torque_step_uNm;
        return saturates_ ? torque / 2 : torque;
    }
    [[nodiscard]] std::uint16_t status() const {
        const auto bit = [](bool set, std::uint16_t mask) { return set ? mask : std::uint16_t{0}; };
        return static_cast<std::uint16_t>(bit(enabled_, enabled_bit) | bit(tripped_, watchdog_bit) |
                                          bit(saturated_ || saturates_, saturated_bit) |
                                          bit(bad_packet_, bad_packet_bit) | faults_ |
                                          identity_.spare_status);
    }
    [[nodiscard]] std::uint16_t watchdog_ms() const { return watchdog_ms_; }
    /// Returns the sequence number of the last accepted OUT packet.
    [[nodiscard]] std::uint16_t out_sequence() const { return out_sequence_; }
    [[nodiscard]] std::uint16_t out_age_us(std::uint32_t clock_us) const {
        const std::uint32_t age = std::min<std::uint32_t>(clock_us - command_us_, 0xFFFF);
        return has_command_ ? static_cast<std::uint16_t>(age) : identity_.first_out_age_us;
    }
    [[nodiscard]] std::uint64_t outs() const { return outs_; }
    [[nodiscard]] std::uint64_t bad_outs() const { return bad_outs_; }

  private:
    Identity identity_;
    bool enabled_ = false;
    bool tripped_ = false;
    bool saturated_ = false;
    bool saturates_ = false;
    bool bad_packet_ = false;
    std::uint16_t faults_ = 0;
    std::uint16_t watchdog_ms_ = identity_.watchdog_ms;
    std::uint16_t life_ms_ = 0xFFFF;
    std::int32_t torque_uNm_ = 0;
    std::uint16_t out_sequence_ = 0;
    std::uint32_t command_us_ = 0;
    bool has_command_ = false;  ///< the device has received a command since its start
    std::uint64_t outs_ = 0;
    std::uint64_t bad_outs_ = 0;
};

}  // namespace emulator
