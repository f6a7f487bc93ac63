// SPDX-License-Identifier: Apache-2.0
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

}  // namespace
}  // namespace palpate
