// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "little_endian.hpp"
#include "requests.hpp"

namespace emulator {

/// Readings of the device's sensors in one tick of its control loop.
struct Sample {
    std::uint32_t clock_us = 0;
    std::int32_t count = 0;  ///< encoder count, without the zero that the host sets
    std::int32_t velocity_cps = 0;
    std::int32_t sensor_uNm = 0;
    std::uint16_t temperature_dC = 0;
};

/// State of a firmware that an observer outside of the device can see.
struct FirmwareState {
    std::int32_t torque_uNm = 0;
    std::uint16_t status = 0;
    std::uint16_t out_sequence = 0;

    [[nodiscard]] bool is_enabled() const { return (status & 1U) != 0; }
};

/// Firmware of an emulated device: the device side of the protocol, without USB faults and without mechanics. All
/// implementations behave equally.
class Firmware {
  public:
    Firmware() = default;
    Firmware(const Firmware&) = delete;
    Firmware& operator=(const Firmware&) = delete;
    virtual ~Firmware() = default;

    /// Sets the state after power-up.
    virtual void restart() = 0;
    /// Runs one tick of the control loop.
    virtual void tick(const Sample& sample) = 0;
    /// Takes a packet from the OUT endpoint.
    virtual void out(const Bytes& packet, std::uint32_t clock_us) = 0;
    /// Returns the next packet for the IN endpoint.
    [[nodiscard]] virtual Bytes in() = 0;
    /// Executes a vendor request, given as the eight setup bytes.
    [[nodiscard]] virtual Answer control(const Bytes& setup) = 0;
    /// Sets zero torque, as bus reset, suspend and SET_CONFIGURATION do.
    virtual void disarm() = 0;
    /// States the faults that are present now.
    virtual void fault(std::uint16_t present) = 0;
    [[nodiscard]] virtual FirmwareState state() const = 0;
};

}  // namespace emulator
