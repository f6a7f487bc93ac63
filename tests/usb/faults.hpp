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

/// What can be made to go wrong. The first six have numbers on the wire (request 0x7F, wValue 1 to 6).
enum class FaultKind : std::uint8_t {
    StallIn,          ///< the IN endpoint halts, once for each
    StallOut,         ///< the OUT endpoint halts, once for each
    Short,            ///< IN packets cut to half
    Freeze,           ///< frames in which every transfer is refused for now (NAK); the device's time goes on
    Unplug,           ///< gone, after so many frames
    Skip,             ///< sequence numbers left out
    Repeat,           ///< the last IN packet again
    Magic,            ///< a wrong first byte
    Version,          ///< a version of the future
    Long,             ///< 64 bytes
    Deaf,             ///< OUT packets taken and thrown away
    Mute,             ///< no IN packets; OUT packets are taken
    OldEcho,          ///< the echo of an OUT packet from before
    Encoder,          ///< status: encoder fault, torque off
    OverTemperature,  ///< status: over-temperature, torque off
    EmergencyStop,    ///< status: emergency stop, torque off until CLEAR
    Reset,            ///< the device starts anew: disabled, torque off
    Saturate,         ///< half the torque, and the status that says so
    Jump,             ///< the count is off by a quarter turn
    FrozenEncoder,    ///< the count repeats
    Slow,             ///< frames that take three times as long
    Busy,             ///< OUT packets refused for now (NAK), each a frame late; IN packets go on
};

inline constexpr std::array<std::string_view, 22> fault_names{
    "stall-in",       "stall-out", "short",    "freeze",  "unplug",
    "skip",           "repeat",    "magic",    "version", "long",
    "deaf",           "mute",      "old-echo", "encoder", "over-temperature",
    "emergency-stop", "reset",     "saturate", "jump",    "frozen-encoder",
    "slow",           "busy"};

/// A fault: how many packets or frames it lasts, and from which frame on.
struct Fault {
    FaultKind kind = FaultKind::StallIn;
    std::uint32_t count = 1;
    std::uint64_t frame = 0;
};

[[nodiscard]] inline FaultKind fault_named(std::string_view name) {
    const auto found = std::find(fault_names.begin(), fault_names.end(), name);
    if (found == fault_names.end()) {
        throw std::invalid_argument("no fault is called '" + std::string(name) + "'");
    }
    return static_cast<FaultKind>(found - fault_names.begin());
}

/// Reads "KIND@FRAME" or "KIND@FRAMExCOUNT". Frames are counted from the first OUT packet on.
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

/// What is wrong now, and what will be by the script.
class Faults {
  public:
    explicit Faults(std::vector<Fault> script) : script_{std::move(script)} {}

    void inject(FaultKind kind, std::uint32_t count) { remaining(kind) = std::max(count, 1U); }

    /// A frame begins, the next one of the script or one before it.
    void frame(bool counts) {
        started_ += counts ? 1 : 0;
        for (const Fault& fault : script_) {
            if (counts && fault.frame == started_) {
                inject(fault.kind, fault.count);
            }
        }
    }
    /// Frames of the script.
    [[nodiscard]] std::uint64_t started() const { return started_; }

    /// Whether a fault is due; one less is left of it.
    bool used(FaultKind kind) {
        if (remaining(kind) == 0) {
            return false;
        }
        --remaining(kind);
        return true;
    }
    /// How often a fault is due; nothing is left of it.
    std::uint32_t used_up(FaultKind kind) { return std::exchange(remaining(kind), 0); }
    /// Whether a fault was due for the last time.
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
