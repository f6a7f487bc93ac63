// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include "palpate/fields/escaped.hpp"

// Messages between a program and the Inverse Service of a Haply Inverse3; inverse3.hpp names their documentation.
namespace palpate {

/// Properties of the Inverse3 that its service sent when the device was opened.
struct Inverse3Info {
    std::string id;    ///< identifier of the device, such as 049D; unchanged, for commands
    std::string type;  ///< device type: inverse3, inverse3x or minverse; unchanged
    /// Gain of the service's reduction of forces when the handle oscillates [-]; empty if it reports none
    std::optional<double> force_gate;
    std::optional<double>
        damping;  ///< largest damping that the service adds [N·s/m]; empty if it reports none

    /// Returns type and identifier for messages and files, escaped.
    [[nodiscard]] std::string name() const { return escaped(type) + "-" + escaped(id); }
};

/// State of the handle along one axis in a message of the service.
struct Inverse3State {
    double position = 0.0;  ///< [m]
    double velocity = 0.0;  ///< [m/s]
    double force = 0.0;     ///< commanded force, as the service reports it [N]
};

/// Reads identifier and type of the first device in the service's first message. Throws std::runtime_error if the message
/// contains no device, or the device is not calibrated, and an exception of nlohmann-json for other content.
[[nodiscard]] inline Inverse3Info read_inverse3_inventory(const std::string& message,
                                                          const std::string& service) {
    using Message = nlohmann::json;
    const Message inventory = Message::parse(message);
    const Message none = Message::array();
    const Message& devices = inventory.contains("inverse3") ? inventory.at("inverse3") : none;
    if (devices.empty()) {
        throw std::runtime_error(
            "the Haply Inverse Service at " + service +
            " detects no Inverse3: plug the Inverse3 in, and check that Haply Hub shows it");
    }
    const Message& device = devices.at(0);
    Inverse3Info info;
    info.id = device.at("device_id").get<std::string>();
    info.type = device.at("config").value("type", "inverse3");
    if (!device.value(Message::json_pointer{"/status/calibrated"}, true)) {
        throw std::runtime_error("Inverse3 " + escaped(info.id) +
                                 " is not calibrated: follow the instructions of its light or of Haply Hub");
    }
    return info;
}

/// Returns the entry of a device in a message of the service. Throws std::runtime_error if there is none, and an
/// exception of nlohmann-json if the message differs from the service's documentation.
[[nodiscard]] inline const nlohmann::json& inverse3_entry(const nlohmann::json& message,
                                                          const std::string& id) {
    for (const auto& device : message.at("inverse3")) {
        if (device.at("device_id").get_ref<const std::string&>() == id) {
            return device;
        }
    }
    throw std::runtime_error("Inverse3 " + escaped(id) + " is missing in the service's message");
}

/// Reads the state of a device along one axis (0 = x, 1 = y, 2 = z) from a message of the service. Throws as
/// `inverse3_entry`.
[[nodiscard]] inline Inverse3State read_inverse3_state(const std::string& message, const std::string& id,
                                                       int axis) {
    constexpr std::string_view axis_names = "xyz";
    const auto parsed = nlohmann::json::parse(message);
    const auto& state = inverse3_entry(parsed, id).at("state");
    const std::string key(1, axis_names[static_cast<std::size_t>(axis)]);
    return {state.at("cursor_position").at(key).get<double>(),
            state.at("cursor_velocity").at(key).get<double>(),
            state.at("current_cursor_force").at(key).get<double>()};
}

/// Reads the filters of a device's forces from a message of the service that contains the configuration. Throws as
/// `inverse3_entry`.
inline void read_inverse3_filters(const std::string& message, Inverse3Info& info) {
    const auto parsed = nlohmann::json::parse(message);
    const auto none = nlohmann::json::object();
    const auto& entry = inverse3_entry(parsed, info.id);
    const auto filters = entry.value("config", none).value("filters", none);
    info.force_gate.reset();
    info.damping.reset();
    if (filters.contains("force_gate")) {
        info.force_gate = filters.at("force_gate").at("gain").get<double>();
    }
    if (filters.contains("damping")) {
        const auto& damping = filters.at("damping");
        const auto size = [](const auto& values, const char* key) {
            return std::abs(values.value(key, 0.0));
        };
        const auto vector = damping.value("vector", none);
        info.damping =
            std::max({size(damping, "scalar"), size(vector, "x"), size(vector, "y"), size(vector, "z")});
    }
}

/// Setting of a device in a message to the service: no reduction of forces, no added damping.
inline constexpr const char* inverse3_without_filters =
    R"("configure":{"force_gate":{"gain":0.0},)"
    R"("damping":{"scalar":0.0,"vector":{"x":0.0,"y":0.0,"z":0.0}}},)";

/// Returns the start of each command's text to a device, up to the force. `settings`: empty or
/// `inverse3_without_filters`.
[[nodiscard]] inline std::string inverse3_command_head(const std::string& id, const char* settings = "") {
    return R"("inverse3":[{"device_id":)" + nlohmann::json(id).dump() + "," + settings +
           R"("commands":{"set_cursor_force":{"vector":{)";
}

/// Writes a command of a force along an axis [N] to `text`: the start of the message, `command_head`, and the force.
inline void write_inverse3_command(std::string& text, const char* head, const std::string& command_head,
                                   int axis, double force) {
    constexpr std::array<const char*, 3> axis_keys{R"("x":)", R"("y":)", R"("z":)"};
    text.assign(head).append(command_head);
    for (int k = 0; k < 3; ++k) {
        text += k > 0 ? "," : "";
        text += axis_keys[static_cast<std::size_t>(k)];
        std::array<char, 32> digits{};
        text.append(digits.data(),
                    std::to_chars(digits.data(), digits.data() + digits.size(), k == axis ? force : 0.0).ptr);
    }
    text += "}}}}]}";
}

}  // namespace palpate
