// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace emulator {

/// Kind of a fault of the emulated device. The first six have numbers in the USB protocol (request 0x7F, wValue 1 to
/// 6).
enum class FaultKind : std::uint8_t {
    StallIn,   ///< The IN endpoint halts `count` times.
    StallOut,  ///< The OUT endpoint halts `count` times.
    Short,     ///< The device sends IN packets of half the correct length.
    /// The device refuses every transfer with NAK (not ready), but its clock and its watchdog continue.
    Freeze,
    Unplug,           ///< The device is unplugged after `count` frames.
    Skip,             ///< The device skips sequence numbers of IN packets.
    Repeat,           ///< The device sends the previous IN packet again.
    Magic,            ///< The first byte of each IN packet, which identifies the protocol, is wrong.
    Version,          ///< IN packets state the protocol version 2 instead of 1.
    Long,             ///< The device sends IN packets of 64 bytes, which is too long.
    Deaf,             ///< The device acknowledges OUT packets but ignores them.
    Mute,             ///< The device sends no IN packets, but accepts OUT packets.
    OldEcho,          ///< The number of the last OUT packet that IN packets report is too low by 3.
    Encoder,          ///< The device reports an encoder fault in its status and sets the torque to zero.
    OverTemperature,  ///< The device reports over-temperature in its status and sets the torque to zero.
    EmergencyStop,    ///< The device reports an emergency stop; the torque is zero until the request CLEAR.
    Reset,            ///< The device restarts and is then disabled, with zero torque.
    Saturate,  ///< The motor gives half the torque, and the device sets the saturation bit of its status.
    Jump,      ///< The encoder count of the device has an error of a quarter revolution.
    FrozenEncoder,  ///< The device sends the same encoder count again and again.
    Slow,           ///< Each frame of the device lasts three times longer than normal.
    /// The device refuses OUT packets with NAK, so they arrive one frame late; IN packets are not late.
    Busy,
    StuckEcho,   ///< IN packets report no newer OUT packet, although OUT packets act.
    StuckClock,  ///< The clock in IN packets does not advance.
    ClockJump,   ///< The clock in IN packets jumps by 50 ms; it goes on from there.
    Drop,        ///< An IN packet is lost.
    Swap,        ///< An IN packet arrives after the next one.
    Burst,       ///< IN packets are held back, and arrive together afterwards.
    /// The watchdog does not act: the last OUT packet counts as repeated in each frame.
    NoWatchdog,
    ErrorIn,  ///< IN transfers end with an error of the bus.
    Refuse,   ///< The device refuses `count` requests to disable its torque.
};

inline constexpr std::array<std::string_view, 31> fault_names{
    "stall-in",       "stall-out", "short",      "freeze",      "unplug",
    "skip",           "repeat",    "magic",      "version",     "long",
    "deaf",           "mute",      "old-echo",   "encoder",     "over-temperature",
    "emergency-stop", "reset",     "saturate",   "jump",        "frozen-encoder",
    "slow",           "busy",      "stuck-echo", "stuck-clock", "clock-jump",
    "drop",           "swap",      "burst",      "no-watchdog", "error-in",
    "refuse"};

/// A fault with its duration `count` (in packets or frames) and the number `frame` of the frame in which it begins.
struct Fault {
    FaultKind kind = FaultKind::StallIn;
    std::uint32_t count = 1;
    std::uint64_t frame = 0;
};

[[nodiscard]] inline FaultKind fault_named(std::string_view name) {
    const auto found = std::find(fault_names.begin(), fault_names.end(), name);
    if (found == fault_names.end()) {
        throw std::invalid_argument("unknown fault '" + std::string(name) + "'");
    }
    return static_cast<FaultKind>(found - fault_names.begin());
}

/// Reads "KIND@FRAME" or "KIND@FRAMExCOUNT". Frames are counted from the first OUT packet.
[[nodiscard]] inline Fault parse_fault(const std::string& text) {
    const std::size_t at = text.find('@');
    if (at == std::string::npos) {
        throw std::invalid_argument("fault is '" + text + "', must be KIND@FRAME or KIND@FRAMExCOUNT");
    }
    const std::size_t times = text.find('x', at);
    Fault fault;
    fault.kind = fault_named(std::string_view{text}.substr(0, at));
    fault.frame = std::stoull(text.substr(at + 1));
    fault.count =
        times == std::string::npos ? 1 : static_cast<std::uint32_t>(std::stoul(text.substr(times + 1)));
    return fault;
}

/// Faults that are active now, and the faults of the script with their first frames.
class Faults {
  public:
    explicit Faults(std::vector<Fault> script) : script_{std::move(script)} {}

    void inject(FaultKind kind, std::uint32_t count) { remaining(kind) = std::max(count, 1U); }
    /// Ends all active faults.
    void end() { remaining_ = {}; }

    /// Begins a USB frame. If `counts` is true, the frame number increases and the faults of the script with this
    /// number begin.
    void frame(bool counts) {
        started_ += counts ? 1 : 0;
        for (const Fault& fault : script_) {
            if (counts && fault.frame == started_) {
                inject(fault.kind, fault.count);
            }
        }
    }
    /// Returns the number of frames since the count for the fault script began.
    [[nodiscard]] std::uint64_t started() const { return started_; }

    /// Returns true if a fault is active, and reduces the remaining count of this fault by one.
    bool used(FaultKind kind) {
        if (remaining(kind) == 0) {
            return false;
        }
        --remaining(kind);
        return true;
    }
    /// Returns the remaining count of a fault and sets it to zero.
    std::uint32_t used_up(FaultKind kind) { return std::exchange(remaining(kind), 0); }
    /// Reduces the remaining count of an active fault by one; returns true if the count becomes zero.
    bool used_last(FaultKind kind) { return used(kind) && remaining(kind) == 0; }

  private:
    [[nodiscard]] std::uint32_t& remaining(FaultKind kind) {
        return remaining_.at(static_cast<std::size_t>(kind));
    }

    std::vector<Fault> script_;
    std::array<std::uint32_t, fault_names.size()> remaining_{};
    std::uint64_t started_ = 0;
};

}  // namespace emulator
