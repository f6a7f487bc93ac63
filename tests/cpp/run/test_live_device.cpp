// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <string>

#include <gtest/gtest.h>

#include "palpate/run/live_device.hpp"

namespace palpate {
namespace {

/// Calls that a device received.
struct Calls {
    int opened = 0;
    int closed = 0;
    double sent = 0.0;
};

struct CountingDevice {
    Calls* calls;
    std::string reason{};

    Opened open() {
        ++calls->opened;
        return {reason};
    }
    [[nodiscard]] Reading exchange(const Command& command) noexcept {
        calls->sent = command.force;
        Reading reading;
        reading.position = 0.5;
        reading.sequence = 9;
        return reading;
    }
    void close() noexcept { ++calls->closed; }
};

struct PacingDevice : CountingDevice {
    static constexpr bool paces_host = true;
};

TEST(LiveDevice, PassesAllCallsToItsDevice) {
    Calls calls;
    {
        LiveDeviceOf<CountingDevice> device{CountingDevice{&calls}};
        LiveDevice& live = device;
        EXPECT_TRUE(live.open());
        EXPECT_EQ(calls.opened, 1);
        const Reading reading = live.exchange({2.5});
        EXPECT_EQ(calls.sent, 2.5);
        EXPECT_EQ(reading.position, 0.5);
        EXPECT_EQ(reading.sequence, 9U);
        live.close();
        EXPECT_EQ(calls.closed, 1);
        EXPECT_EQ(device.device().calls, &calls);
        const DeviceReport report = live.report();
        EXPECT_TRUE(report.name.empty() && report.fields.empty() && report.lines.empty());
    }
    EXPECT_EQ(calls.closed, 2) << "a device is closed at the end of its life";
    LiveDeviceOf<CountingDevice> refused{CountingDevice{&calls, "no cable"}};
    EXPECT_EQ(refused.open().reason, "no cable");
}

TEST(LiveDevice, SetsThePaceIfItsDeviceDoes) {
    Calls calls;
    LiveDeviceOf<CountingDevice> plain{CountingDevice{&calls}};
    LiveDeviceOf<PacingDevice> pacing{PacingDevice{{&calls}}};
    EXPECT_FALSE(plain.sets_pace());
    EXPECT_TRUE(pacing.sets_pace());
}

TEST(LiveDevice, ReportsTheStateOfItsDevice) {
    Calls calls;
    LiveDeviceOf<CountingDevice> device{
        CountingDevice{&calls}, [](const CountingDevice& reported) -> DeviceReport {
            return {"counting", {}, {{"sent", std::to_string(reported.calls->sent)}}};
        }};
    (void)device.exchange({0.25});
    const DeviceReport report = device.report();
    EXPECT_EQ(report.name, "counting");
    ASSERT_EQ(report.lines.size(), 1U);
    EXPECT_EQ(report.lines.front().second, "0.250000");
}

TEST(LiveDevice, IsARealDeviceWithATransducerUnlessStatedOtherwise) {
    Calls calls;
    const LiveDeviceOf<CountingDevice> device{CountingDevice{&calls}};
    EXPECT_FALSE(device.simulated);
    EXPECT_TRUE(device.transducer);
    EXPECT_EQ(device.rate_hz, 0.0);
}

}  // namespace
}  // namespace palpate
