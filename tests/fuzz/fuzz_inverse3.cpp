// SPDX-License-Identifier: Apache-2.0
// Messages of the service of an Inverse3. A message gives finite numbers or is refused with an exception that the device
// catches. A command to a device with any identifier is valid JSON with a finite force.
#include <cmath>
#include <exception>
#include <stdexcept>
#include <string>

#include "fuzzing.hpp"
#include "palpate/device/inverse3_messages.hpp"

FUZZ_TARGET(inverse3) {
    using palpate::fuzz::require;
    palpate::fuzz::Input input{data, size};
    const int axis = input.take<std::uint8_t>() % 3;
    const auto force = input.take<double>();
    const std::string message{input.take_text()};
    palpate::Inverse3Info info;
    info.id = "049D";
    try {
        info = palpate::read_inverse3_inventory(message, "127.0.0.1:10001");
        palpate::read_inverse3_filters(message, info);
        require(std::isfinite(info.force_gate.value_or(0.0)) && std::isfinite(info.damping.value_or(0.0)),
                "the settings are finite");
    } catch (const nlohmann::json::exception&) {
    } catch (const std::runtime_error&) {
    }
    for (const char* settings : {"", palpate::inverse3_without_filters}) {
        std::string command;
        palpate::write_inverse3_command(command, "{", palpate::inverse3_command_head(info.id, settings), axis,
                                        std::isfinite(force) ? force : 0.0);
        const auto written = nlohmann::json::parse(command, nullptr, false);
        require(!written.is_discarded() && written["inverse3"][0]["device_id"] == info.id,
                "a command is JSON that names the device");
    }
    try {
        const palpate::Inverse3State state = palpate::read_inverse3_state(message, info.id, axis);
        require(std::isfinite(state.position) && std::isfinite(state.velocity) && std::isfinite(state.force),
                "a state is finite");
    } catch (const nlohmann::json::exception&) {
    } catch (const std::runtime_error&) {
    }
    return 0;
}
