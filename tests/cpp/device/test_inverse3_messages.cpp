// SPDX-License-Identifier: Apache-2.0
#include <optional>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "palpate/device/inverse3_messages.hpp"

namespace palpate {
namespace {

constexpr const char* id = "04\x1b[2J\n9D";

/// Returns the first message of a service whose texts contain control characters.
std::string inventory(bool is_calibrated) {
    return nlohmann::json{{"inverse3",
                           {{{"device_id", id},
                             {"config", {{"type", "inverse3\x1b]0;x"}}},
                             {"status", {{"calibrated", is_calibrated}}}}}}}
        .dump();
}

TEST(Inverse3Messages, NameHasTheTextsOfTheServiceEscaped) {
    const Inverse3Info info = read_inverse3_inventory(inventory(true), "here");
    EXPECT_EQ(info.name(), "inverse3\\x1b]0;x-04\\x1b[2J\\x0a9D");
    EXPECT_EQ(info.id, id) << "commands name the device as the service does";
}

TEST(Inverse3Messages, MessagesHaveTheTextsOfTheServiceEscaped) {
    const auto message_of = [](const auto& read) -> std::string {
        try {
            (void)read();
        } catch (const std::runtime_error& error) {
            return error.what();
        }
        return "";
    };
    const std::string uncalibrated =
        message_of([] { return read_inverse3_inventory(inventory(false), "here"); });
    EXPECT_TRUE(uncalibrated.starts_with("Inverse3 04\\x1b[2J\\x0a9D is not calibrated")) << uncalibrated;
    const std::string missing = message_of([] { return read_inverse3_state(R"({"inverse3":[]})", id, 0); });
    EXPECT_EQ(missing, "Inverse3 04\\x1b[2J\\x0a9D is missing in the service's message");
}

/// Returns the filters that a message with this configuration of the device reports.
Inverse3Info filters_of(const nlohmann::json& config) {
    Inverse3Info info;
    info.id = id;
    info.force_gate = info.damping = 7.0;
    read_inverse3_filters(
        nlohmann::json{{"inverse3", {{{"device_id", "0000"}}, {{"device_id", id}, {"config", config}}}}}
            .dump(),
        info);
    return info;
}

TEST(Inverse3Messages, FiltersAreThoseOfTheDevice) {
    const Inverse3Info scalar =
        filters_of({{"filters", {{"force_gate", {{"gain", 0.3}}}, {"damping", {{"scalar", -0.5}}}}}});
    EXPECT_EQ(scalar.force_gate, 0.3);
    EXPECT_EQ(scalar.damping, 0.5);
}

TEST(Inverse3Messages, DampingIsThatOfTheMostDampedDirection) {
    for (const char* axis : {"x", "y", "z"}) {
        const nlohmann::json damping = {{"scalar", 0.1}, {"vector", {{axis, -2.0}}}};
        EXPECT_EQ(filters_of({{"filters", {{"damping", damping}}}}).damping, 2.0) << axis;
    }
}

TEST(Inverse3Messages, FiltersThatTheServiceDoesNotReportAreEmpty) {
    for (const nlohmann::json& config :
         {nlohmann::json::object(), nlohmann::json{{"filters", nlohmann::json::object()}}}) {
        EXPECT_EQ(filters_of(config).force_gate, std::nullopt);
        EXPECT_EQ(filters_of(config).damping, std::nullopt);
    }
}

TEST(Inverse3Messages, SettingsWithoutFiltersAreValidJson) {
    std::string text;
    write_inverse3_command(text, "{", inverse3_command_head(id, inverse3_without_filters), 1, 0.5);
    const auto device = nlohmann::json::parse(text).at("inverse3").at(0);
    EXPECT_EQ(device.at("device_id"), id);
    EXPECT_EQ(device.at("configure").at("force_gate").at("gain"), 0.0);
    EXPECT_EQ(device.at("configure").at("damping").at("scalar"), 0.0);
    EXPECT_EQ(device.at("commands").at("set_cursor_force").at("vector").at("y"), 0.5);
}

}  // namespace
}  // namespace palpate
