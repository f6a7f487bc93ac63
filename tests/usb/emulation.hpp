// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "choices.hpp"
#include "firmwares.hpp"
#include "port.hpp"

namespace emulator {

/// Options of the command line of the two emulator programs, umockdev and USB/IP.
struct Settings {
    std::vector<Identity> devices{Identity{}};
    Plant plant;
    std::vector<Fault> script;
    bool lock_step = false;
    /// Firmware of the devices: see `make_firmware`
    std::string firmware = default_firmware();
    double rate_hz = 1000.0;
    /// Path of a CSV file with one row for each USB frame: the state of the emulated device
    std::string trace;
    std::string preload_first;  ///< library of a sanitizer, which must be loaded before umockdev
    bool denied = false;        ///< true: the tested program may not open the device file
    std::vector<std::string> command;
};

inline constexpr const char* options_text =
    "  --lock-step            A frame begins when every thread of the command waits; the clock of the "
    "command\n"
    "                         shows the time of the device. Otherwise frames begin in real time.\n"
    "  --rate-hz RATE         Frames a second [1000].\n"
    "  --firmware cpp|c|FILE.elf  Firmware of the device: the second implementation, cpp/firmware, or\n"
    "                         cpp/firmware as machine code of a Cortex-M4F in QEMU\n"
    "                         [environment variable PALPATE_USB_FIRMWARE, otherwise cpp].\n"
    "  --model UNM_PER_COUNT  The device has a model: a spring with this stiffness.\n"
    "  --model-fingerprint HEX, --model-certificate HEX  Fingerprints of the model in GET_MODEL.\n"
    "  --loop-hz RATE         Rate of the control loop in the device, also that of its model [10000].\n"
    "  --serial SERIAL        One device with this serial number in Latin-1; repeatable [EMU-1].\n"
    "  --no-device            No device is connected.\n"
    "  --seed SEED            Draws the choices of the firmware; must be before options that change them.\n"
    "  --reported-rate-hz RATE  Rate in GET_INFO [1000].\n"
    "  --no-transducer        Capabilities without bit 0.\n"
    "  --no-velocity          Capabilities without bit 1.\n"
    "  --wrong-magic          Another magic in GET_INFO.\n"
    "  --info-bytes SIZE      Size of the answer to GET_INFO [32].\n"
    "  --reversed             Torque with the wrong sign.\n"
    "  --out-first            OUT packets act before the encoder of their frame is latched.\n"
    "  --from-zero            Counters begin at 0, not close to their ends.\n"
    "  --spring STIFFNESS     A real spring on the handle, N*m/rad [0].\n"
    "  --friction TORQUE      Coulomb friction of the handle, N*m [0].\n"
    "  --max-torque-uNm TORQUE  Largest torque in GET_INFO [5000000].\n"
    "  --no-hand              The handle is free.\n"
    "  --fault KIND@FRAME[xCOUNT]  Repeatable; frames are counted from the first OUT packet.\n"
    "  --trace FILE.csv       True state of the device, one row for each frame.\n"
    "  --denied               The device cannot be opened.\n"
    "  --preload-first FILE   Library of a sanitizer, which must be loaded before umockdev.\n";

/// Returns an emulated device of these settings.
[[nodiscard]] inline EmulatedDevice make_device(const Settings& settings, const Identity& identity,
                                                const std::vector<Fault>& script) {
    return {identity, make_firmware(settings.firmware, identity), settings.plant, script};
}

/// Reads the options of the command line. Throws std::invalid_argument if an option is unknown or its value is not a
/// number, and std::out_of_range if the number is too large.
[[nodiscard]] inline Settings read_settings(int count, char** words) {
    Settings settings;
    Identity common;
    std::vector<std::string> serials;
    bool none = false;
    for (int k = 1; k < count; ++k) {
        const std::string word = words[k];
        const auto value = [&]() -> std::string {
            if (k + 1 >= count) {
                throw std::invalid_argument(word + " needs a value");
            }
            return words[++k];
        };
        if (word == "--") {
            settings.command.assign(words + k + 1, words + count);
            break;
        }
        if (word == "--lock-step") {
            settings.lock_step = true;
        } else if (word == "--rate-hz") {
            settings.rate_hz = std::stod(value());
        } else if (word == "--firmware") {
            settings.firmware = value();
        } else if (word == "--model") {
            common.model_uNm_per_count = std::stoi(value());
        } else if (word == "--model-fingerprint") {
            common.model_fingerprint = std::stoull(value(), nullptr, 16);
        } else if (word == "--model-certificate") {
            common.model_certificate = std::stoull(value(), nullptr, 16);
        } else if (word == "--loop-hz") {
            common.loop_hz = static_cast<std::uint32_t>(std::stoul(value()));
        } else if (word == "--serial") {
            serials.push_back(value());
        } else if (word == "--seed") {
            common = identity_of_seed(static_cast<std::uint32_t>(std::stoul(value())));
        } else if (word == "--reported-rate-hz") {
            common.rate_hz = static_cast<std::uint16_t>(std::stoi(value()));
        } else if (word == "--no-transducer") {
            common.capabilities &= ~1U;
        } else if (word == "--no-velocity") {
            common.capabilities &= ~2U;
        } else if (word == "--no-device") {
            none = true;
        } else if (word == "--wrong-magic") {
            common.magic = 'X';
        } else if (word == "--info-bytes") {
            common.info_size = std::stoul(value());
        } else if (word == "--reversed") {
            common.reversed = true;
        } else if (word == "--out-first") {
            common.applies_out_first = true;
        } else if (word == "--from-zero") {
            common.first_sequence = 0;
            common.first_us = 0;
        } else if (word == "--spring") {
            settings.plant.spring = std::stod(value());
        } else if (word == "--friction") {
            settings.plant.friction = std::stod(value());
        } else if (word == "--max-torque-uNm") {
            common.max_torque_uNm = std::stoi(value());
        } else if (word == "--no-hand") {
            settings.plant.hand_stiffness = 0.0;
        } else if (word == "--fault") {
            settings.script.push_back(parse_fault(value()));
        } else if (word == "--trace") {
            settings.trace = value();
        } else if (word == "--denied") {
            settings.denied = true;
        } else if (word == "--preload-first") {
            settings.preload_first = value();
        } else {
            throw std::invalid_argument("unknown option '" + word + "'");
        }
    }
    settings.devices.assign(none ? 0 : 1, common);
    if (!serials.empty()) {
        settings.devices.clear();
        for (const std::string& serial : serials) {
            settings.devices.push_back(common);
            std::u16string& units = settings.devices.back().serial;
            units.clear();
            for (const char letter : serial) {
                units.push_back(static_cast<unsigned char>(letter));
            }
        }
    }
    return settings;
}

/// Executes an order of a test ("fault KIND COUNT", "heal" to end all faults, or "state") and returns the answer of the emulator.
[[nodiscard]] inline std::string execute_order(Port& port, const std::string& order) {
    const std::size_t space = order.find(' ');
    const std::string verb = order.substr(0, space);
    if (verb == "fault") {
        const std::string rest = order.substr(space + 1);
        const std::size_t second = rest.find(' ');
        const auto times = second == std::string::npos ? 1 : std::stoul(rest.substr(second + 1));
        port.device().inject(fault_named(rest.substr(0, second)), static_cast<std::uint32_t>(times));
        return "ok";
    }
    if (verb == "heal") {
        port.device().end_faults();
        return "ok";
    }
    if (verb == "state") {
        const EmulatedDevice& device = port.device();
        const auto field = [](const char* name, const std::string& value) {
            return std::string("\"") + name + "\": " + value;
        };
        return "{" + field("frames", std::to_string(device.frames())) + ", " +
               field("sequence", std::to_string(device.sequence())) + ", " +
               field("last_read", std::to_string(device.last_read_sequence())) + ", " +
               field("outs", std::to_string(device.outs())) + ", " +
               field("enabled", device.state().is_enabled() ? "true" : "false") + ", " +
               field("commanded_uNm", std::to_string(device.commanded_uNm())) + ", " +
               field("torque_uNm", std::to_string(device.applied_uNm())) + ", " +
               field("position_rad", std::to_string(device.plant().position)) + ", " +
               field("waiting", std::to_string(port.waiting())) + "}";
    }
    throw std::invalid_argument("unknown order '" + verb + "'");
}

}  // namespace emulator
