// SPDX-License-Identifier: Apache-2.0
#include "palpate/run/record_sinks.hpp"
#include "special_values.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace palpate {
namespace {

using test::nan;

TEST(Range, ContainsAllValuesThatAreNumbers) {
    Range range;
    EXPECT_TRUE(std::isnan(range.lower) && std::isnan(range.upper));
    range.add(nan);
    EXPECT_TRUE(std::isnan(range.lower) && std::isnan(range.upper));
    range.add(3.0);
    EXPECT_EQ(range.lower, 3.0);
    EXPECT_EQ(range.upper, 3.0);
    range.add(5.0);
    range.add(nan);
    range.add(-2.0);
    EXPECT_EQ(range.lower, -2.0);
    EXPECT_EQ(range.upper, 5.0);
}

std::vector<TickRecord> ticks() {
    std::vector<TickRecord> ticks(3);
    for (std::size_t k = 0; k < ticks.size(); ++k) {
        const auto number = static_cast<double>(k);
        ticks[k].time = 0.1 * number;
        ticks[k].position = number;
        ticks[k].force = 10.0 + number;
        ticks[k].applied = 20.0 + number;
        ticks[k].measured = k == 1 ? nan : 30.0 + number;
        ticks[k].extrapolated = k != 1;
    }
    return ticks;
}

TEST(RecordSinks, RecordTheChosenForce) {
    struct Case {
        RecordedForce chosen;
        std::vector<double> forces;
        Range range;
    };
    // The force of the object is that of the transducer; without one it is the opposite of the motor's force
    for (const Case& expected : {Case{RecordedForce::Sent, {10.0, 11.0, 12.0}, {10.0, 12.0}},
                                 {RecordedForce::Applied, {20.0, 21.0, 22.0}, {20.0, 22.0}},
                                 {RecordedForce::Object, {30.0, -21.0, 32.0}, {-21.0, 32.0}}}) {
        RecordSinks sinks;
        sinks.force = expected.chosen;
        sinks.keeps = true;
        sinks.take(ticks());
        ASSERT_EQ(sinks.kept.size(), 3U);
        for (std::size_t k = 0; k < 3; ++k) {
            EXPECT_EQ(sinks.kept[k].force, expected.forces[k]);
            EXPECT_EQ(sinks.kept[k].applied, 20.0 + static_cast<double>(k));
        }
        EXPECT_EQ(sinks.forces.lower, expected.range.lower);
        EXPECT_EQ(sinks.forces.upper, expected.range.upper);
        EXPECT_EQ(sinks.positions.lower, 0.0);
        EXPECT_EQ(sinks.positions.upper, 2.0);
        EXPECT_EQ(sinks.extrapolated, 2U);
        sinks.take(ticks());
        EXPECT_EQ(sinks.kept.size(), 6U);
        EXPECT_EQ(sinks.kept[3].force, expected.forces[0]);
        EXPECT_EQ(sinks.extrapolated, 4U);
    }
}

TEST(RecordSinks, KeepNoTicksUnlessRequested) {
    RecordSinks sinks;
    sinks.take(ticks());
    EXPECT_TRUE(sinks.kept.empty());
    EXPECT_EQ(sinks.file.written(), 0U);
    EXPECT_EQ(sinks.file.refused(), 0U);
    EXPECT_EQ(sinks.telemetry.sent(), 0U);
}

TEST(RecordSinks, WriteTheTicksToAnOpenFile) {
    std::string folder = testing::TempDir() + "sinks-XXXXXX";
    ASSERT_NE(mkdtemp(folder.data()), nullptr);
    RecordSinks sinks;
    ASSERT_EQ(sinks.file.open(folder + "/a.csv", {}, {}), "");
    sinks.take(ticks());
    EXPECT_EQ(sinks.file.written(), 3U);
    std::filesystem::remove_all(folder);
}

/// Returns a UDP socket of this machine and its port.
int listening(std::uint16_t& port) {
    const int listener = ::socket(AF_INET, SOCK_DGRAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    EXPECT_EQ(::bind(listener, reinterpret_cast<sockaddr*>(&address), size), 0);
    EXPECT_EQ(::getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size), 0);
    port = ntohs(address.sin_port);
    return listener;
}

TEST(RecordSinks, SendTheRecordedForceAsTelemetry) {
    std::uint16_t port = 0;
    const int listener = listening(port);
    RecordSinks sinks;
    sinks.force = RecordedForce::Applied;
    ASSERT_EQ(sinks.telemetry.open(port, 50.0, {}), "");
    sinks.take(ticks());
    EXPECT_EQ(sinks.telemetry.sent(), 3U);
    std::array<char, 1000> text{};
    const ssize_t received = ::recv(listener, text.data(), text.size(), MSG_DONTWAIT);
    ASSERT_GT(received, 0);
    EXPECT_NE(std::string(text.data(), static_cast<std::size_t>(received)).find("\"force_Nm\":20,"),
              std::string::npos);
    ::close(listener);
}

}  // namespace
}  // namespace palpate
