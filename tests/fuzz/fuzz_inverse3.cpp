// SPDX-License-Identifier: Apache-2.0
// Messages of the service of an Inverse3. A message gives finite numbers or is refused with an exception that the device
// catches. A command to a device with any identifier is valid JSON with a finite force.
#include <cmath>
#include <exception>
#include <stdexcept>
#include <string>

#include "fuzzing.hpp"
#include "palpate/device/inverse3_messages.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using palpate::fuzz::require;
    palpate::fuzz::Input input{data, size};
    const int axis = input.take<std::uint8_t>() % 3;
    const auto force = input.take<double>();
    const std::string message{input.take_text()};
    std::string id = "049D";
    try {
        const palpate::Inverse3Info info = palpate::read_inverse3_inventory(message, "127.0.0.1:10001");
        require(std::isfinite(info.force_gate) && std::isfinite(info.damping), "the settings are finite");
        id = info.id;
    } catch (const nlohmann::json::exception&) {
    } catch (const std::runtime_error&) {
    }
    std::string command;
    palpate::write_inverse3_command(command, "{", palpate::inverse3_command_head(id), axis,
                                    std::isfinite(force) ? force : 0.0);
    const auto written = nlohmann::json::parse(command, nullptr, false);
    require(!written.is_discarded() && written["inverse3"][0]["device_id"] == id,
            "a command is JSON that names the device");
    try {
        const palpate::Inverse3State state = palpate::read_inverse3_state(message, id, axis);
        require(std::isfinite(state.position) && std::isfinite(state.velocity) && std::isfinite(state.force),
                "a state is finite");
    } catch (const nlohmann::json::exception&) {
    } catch (const std::runtime_error&) {
    }
    return 0;
}
