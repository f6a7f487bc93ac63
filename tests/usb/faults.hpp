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
    StallIn,          ///< The IN endpoint halts, once for each count.
    StallOut,         ///< The OUT endpoint halts, once for each count.
    Short,            ///< IN packets have half the length.
    Freeze,           ///< Every transfer is refused with NAK; the time of the device continues.
    Unplug,           ///< The device is unplugged after this many frames.
    Skip,             ///< Sequence numbers of IN packets are skipped.
    Repeat,           ///< The last IN packet is sent again.
    Magic,            ///< The first byte of IN packets is wrong.
    Version,          ///< The version is 2.
    Long,             ///< IN packets have 64 bytes.
    Deaf,             ///< OUT packets are accepted and ignored.
    Mute,             ///< IN packets are not sent; OUT packets are accepted.
    OldEcho,          ///< The packet echoes an earlier OUT packet.
    Encoder,          ///< Status encoder fault, torque off.
    OverTemperature,  ///< Status over-temperature, torque off.
    EmergencyStop,    ///< Status emergency stop, torque off until CLEAR.
    Reset,            ///< The device restarts: disabled, torque off.
    Saturate,         ///< Half the torque, with the status bit for it.
    Jump,             ///< The encoder count has an error of a quarter revolution.
    FrozenEncoder,    ///< The count repeats.
    Slow,             ///< Frames last three times longer.
    Busy,             ///< OUT packets are refused with NAK and arrive one frame late; IN packets continue.
};

inline constexpr std::array<std::string_view, 22> fault_names{
    "stall-in",       "stall-out", "short",    "freeze",  "unplug",
    "skip",           "repeat",    "magic",    "version", "long",
    "deaf",           "mute",      "old-echo", "encoder", "over-temperature",
    "emergency-stop", "reset",     "saturate", "jump",    "frozen-encoder",
    "slow",           "busy"};

/// Fault with its duration (in packets or frames) and its first frame.
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

    /// Begins a USB frame; the frame number of the fault script increases if `counts`.
    void frame(bool counts) {
        started_ += counts ? 1 : 0;
        for (const Fault& fault : script_) {
            if (counts && fault.frame == started_) {
                inject(fault.kind, fault.count);
            }
        }
    }
    /// Returns the number of frames that the fault script has counted.
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
