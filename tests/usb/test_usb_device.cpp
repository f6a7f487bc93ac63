// SPDX-License-Identifier: Apache-2.0
// Tests UsbDevice with the real libusb on an emulated device. The clock of this program shows the time of the device
// (lock-step), so every result is exact on a computer of any speed.
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "../cpp/support.hpp"
#include "emulated_machine.hpp"
#include "palpate/device/usb.hpp"
#include "palpate/guard/guard_settings.hpp"

namespace palpate {
namespace {

using test::open_files;
using test::settled;
using test::state;

TEST(UsbDevice, ReportsItsNameAndProperties) {
    UsbDevice device;
    ASSERT_EQ(device.open().reason, "");
    EXPECT_EQ(device.name().manufacturer, "palpate");
    EXPECT_EQ(device.name().text().substr(0, 28), "emulated knob EMU-1 (bus 1, ");
    EXPECT_EQ(device.info().counts_per_rev, 65536U);
    EXPECT_EQ(device.info().max_torque_uNm, 5'000'000);
    EXPECT_EQ(device.info().rate_hz, 1000);
    EXPECT_EQ(device.info().capabilities, wire::has_transducer | wire::measures_velocity);
    const DeviceProfile profile = device.profile();
    EXPECT_EQ(profile.id, "EMU-1");
    EXPECT_EQ(profile.period_s, 1e-3);
    EXPECT_EQ(profile.force_limit, 5.0);
    EXPECT_EQ(guards_for({}, profile).device_damping, 0.0) << "it was not measured";
    EXPECT_NO_THROW(validate(profile));
}

TEST(UsbDevice, ControlRequestsFollowTheProtocol) {
    detail::UsbConnection connection;
    ASSERT_EQ(connection.open("").reason, "");
    EXPECT_EQ(connection.request(wire::Request::Enable, 1), 0);
    EXPECT_EQ(state("enabled"), 1.0);
    EXPECT_EQ(connection.request(wire::Request::Enable, 0), 0);
    EXPECT_EQ(state("enabled"), 0.0);
    EXPECT_EQ(connection.request(wire::Request::Zero, 0), 0);
    EXPECT_EQ(connection.request(wire::Request::Clear, 0), 0);
    for (const std::uint16_t good : {2, 20, 1000}) {
        EXPECT_EQ(connection.request(wire::Request::Watchdog, good), 0) << good;
    }
    for (const std::uint16_t bad : {0, 1, 1001, 65'535}) {
        EXPECT_EQ(connection.request(wire::Request::Watchdog, bad), LIBUSB_ERROR_PIPE) << bad;
    }
    EXPECT_EQ(connection.request(static_cast<wire::Request>(99), 0), LIBUSB_ERROR_PIPE);
    std::array<std::uint8_t, 2> count{1, 0};
    for (const std::uint16_t fault : {0, 6, 7}) {
        const int moved = libusb_control_transfer(connection.handle(), wire::request_to_device, 0x7F, fault,
                                                  0, count.data(), count.size(), 500);
        EXPECT_EQ(moved, fault == 6 ? 2 : LIBUSB_ERROR_PIPE) << fault;
    }
}

TEST(UsbDevice, WithoutAModelItDoesNotRenderItself) {
    UsbDevice device;
    ASSERT_EQ(device.open().reason, "");
    EXPECT_FALSE(device.model());
    device.close();
    EXPECT_FALSE(device.model());
    UsbOptions options;
    options.device_renders = true;
    const std::string reason = UsbDevice{options}.open().reason;
    EXPECT_NE(reason.find("emulated knob EMU-1"), std::string::npos) << reason;
    EXPECT_NE(reason.find("does not report a model to render"), std::string::npos) << reason;
}

TEST(UsbDevice, StreamsEverySampleOnceAndInOrder) {
    UsbDevice device;
    ASSERT_TRUE(device.open());
    Reading last = settled(device);
    const UsbHealth before = device.health();
    const int samples = test::cases(500);
    for (int k = 0; k < samples; ++k) {
        const Reading reading = device.exchange({0.0});
        ASSERT_EQ(reading.status, Status::Ok);
        ASSERT_EQ(reading.sequence, last.sequence + 1);
        ASSERT_NEAR(reading.device_time - last.device_time, 1e-3, 1e-9);
        last = reading;
    }
    const UsbHealth health = device.health();
    EXPECT_EQ(health.stream.packets, before.stream.packets + static_cast<std::uint64_t>(samples));
    EXPECT_EQ(health.stream.lost, before.stream.lost);
    EXPECT_EQ(health.stream.repeated + health.stream.malformed, 0U);
    EXPECT_EQ(health.timeouts, 0U);
    EXPECT_EQ(health.stalls, 0U);
    EXPECT_EQ(health.bus_errors, 0U);
    EXPECT_GE(health.stream.round_trip.count(), static_cast<std::uint64_t>(samples));
    EXPECT_EQ(health.skipped_commands, before.skipped_commands);
    // From each sample to the effect of its command, one sample passes. The median has the resolution of the histogram.
    EXPECT_EQ(health.stream.delay.largest(), 1'000'000);
    EXPECT_NEAR(health.stream.delay.quantile(0.5), 1e6, 1e6 / 256);
}

TEST(UsbDevice, APositiveForceMovesTheHandleBack) {
    UsbDevice device;
    ASSERT_TRUE(device.open());
    const Reading before = settled(device);
    const Reading after = settled(device, 0.25);
    EXPECT_EQ(state("torque_uNm"), -250'000.0);
    EXPECT_NEAR(after.applied, 0.25, 1e-9);
    EXPECT_NEAR(after.measured, 0.25, 1e-9);
    EXPECT_LT(after.velocity, before.velocity - 0.1);
}

TEST(UsbDevice, ClipsLargeForcesAndReplacesNanByZero) {
    UsbDevice device;
    ASSERT_TRUE(device.open());
    settled(device, 1e9);
    EXPECT_EQ(state("torque_uNm"), -5e6);
    settled(device, std::nan(""));
    EXPECT_EQ(state("torque_uNm"), 0.0);
}

TEST(UsbDevice, CloseSetsZeroTorqueDisablesTheDeviceAndEndsAllTransfers) {
    UsbDevice device;
    ASSERT_TRUE(device.open());
    settled(device, 0.3);
    EXPECT_EQ(state("torque_uNm"), -300'000.0);
    device.close();
    EXPECT_EQ(state("torque_uNm"), 0.0);
    EXPECT_EQ(state("enabled"), 0.0);
    EXPECT_EQ(state("waiting"), 0.0);
    EXPECT_EQ(device.in_flight(), 0);
    EXPECT_EQ(device.exchange({0.1}).status, Status::Fault);
    device.close();
}

TEST(UsbDevice, OpensAndClosesFiftyTimesWithoutLeaks) {
    UsbDevice device;
    ASSERT_TRUE(device.open());
    device.close();
    const std::size_t files = open_files();
    for (int k = 0; k < 50; ++k) {
        ASSERT_EQ(device.open().reason, "") << k;
        ASSERT_EQ(settled(device, 0.1).status, Status::Ok) << k;
        device.close();
        ASSERT_EQ(state("torque_uNm"), 0.0);
        ASSERT_EQ(state("waiting"), 0.0);
        ASSERT_EQ(open_files(), files);
    }
}

TEST(UsbDevice, IsUsedByOneProgramAtATime) {
    UsbDevice first;
    ASSERT_TRUE(first.open());
    UsbDevice second;
    const std::string reason = second.open().reason;
    EXPECT_NE(reason.find("emulated knob EMU-1"), std::string::npos) << reason;
    EXPECT_NE(reason.find("another program uses the device"), std::string::npos) << reason;
    EXPECT_EQ(settled(first).status, Status::Ok);
}

TEST(UsbDevice, CanBeMoved) {
    UsbDevice device;
    ASSERT_TRUE(device.open());
    settled(device, 0.1);
    UsbDevice other = std::move(device);
    EXPECT_EQ(other.exchange({0.1}).status, Status::Ok);
    EXPECT_EQ(device.exchange({0.1}).status,
              Status::Fault);  // NOLINT(bugprone-use-after-move): tested here
}

}  // namespace
}  // namespace palpate
