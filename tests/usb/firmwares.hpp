// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>
#include <memory>
#include <string>

#include "arm_firmware.hpp"
#include "c_firmware.hpp"
#include "firmware.hpp"
#include "motor_firmware.hpp"

namespace emulator {

/// Returns the name of the firmware that the environment variable PALPATE_USB_FIRMWARE chooses; cpp without it.
[[nodiscard]] inline std::string default_firmware() {
    const char* chosen = std::getenv("PALPATE_USB_FIRMWARE");
    return chosen == nullptr || *chosen == '\0' ? "cpp" : chosen;
}

/// Returns the firmware with this name: "cpp" is the second implementation, "c" the device side of cpp/firmware. Any
/// other name is the path of a program for `ArmFirmware`.
[[nodiscard]] inline std::unique_ptr<Firmware> make_firmware(const std::string& name,
                                                             const Identity& identity) {
    if (name == "cpp") {
        return std::make_unique<MotorFirmware>(identity);
    }
    if (name == "c") {
        return std::make_unique<CFirmware>(identity);
    }
    return std::make_unique<ArmFirmware>(name, identity);
}

}  // namespace emulator
