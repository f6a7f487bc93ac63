// SPDX-License-Identifier: Apache-2.0
// Tests UsbDevice on machines with two devices, no device, a foreign device, and a device that cannot be opened.
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "emulated_machine.hpp"
#include "palpate/device/usb.hpp"

namespace palpate {
namespace {

using test::send_order;
using test::settled;
using test::state;

TEST(UsbTwoDevices, AreDistinguishedBySerialNumber) {
    const std::string both = UsbDevice{}.open().reason;
    EXPECT_NE(both.find("2 suitable USB devices are connected (LEFT, RIGHT): choose one with usb:SERIAL"),
              std::string::npos)
        << both;
    UsbDevice left{{.serial = "LEFT"}};
    UsbDevice right{{.serial = "RIGHT"}};
    ASSERT_EQ(left.open().reason, "");
    ASSERT_EQ(right.open().reason, "");
    EXPECT_EQ(left.name().serial, "LEFT");
    EXPECT_EQ(right.name().serial, "RIGHT");
    for (int k = 0; k < 20; ++k) {
        EXPECT_EQ(left.exchange({0.1}).status, Status::Ok) << k;
        EXPECT_EQ(right.exchange({-0.1}).status, Status::Ok) << k;
    }
    const std::string neither = UsbDevice{{.serial = "MIDDLE"}}.open().reason;
    EXPECT_NE(neither.find("serial number MIDDLE; connected: LEFT, RIGHT"), std::string::npos) << neither;
}

TEST(UsbNoDevice, MessageNamesTheCommandThatListsTheDevice) {
    EXPECT_NE(UsbDevice{}.open().reason.find("lsusb -d 1209:0001"), std::string::npos);
}

TEST(UsbForeignDevice, IsRefusedWithoutAnOutPacket) {
    const std::string reason = UsbDevice{}.open().reason;
    EXPECT_NE(reason.find("is 1209:0001 with another protocol"), std::string::npos) << reason;
    EXPECT_EQ(state("outs"), 0.0);
}

TEST(UsbDeniedDevice, MessageNamesDeviceReasonAndCure) {
    const std::string reason = UsbDevice{}.open().reason;
    EXPECT_NE(reason.find("USB device (bus 1, address 2) cannot be opened: permission denied"),
              std::string::npos)
        << reason;
    EXPECT_NE(reason.find("sudo palpate devices --install-udev-rule"), std::string::npos) << reason;
}

TEST(UsbPlainDevice, MeasuredForceIsNanAndVelocityIsThePositionDifference) {
    UsbDevice device;
    ASSERT_TRUE(device.open());
    Reading last = settled(device);
    for (int k = 0; k < 50; ++k) {
        const Reading reading = device.exchange({0.0});
        EXPECT_TRUE(std::isnan(reading.measured));
        EXPECT_NEAR(reading.velocity, (reading.position - last.position) / 1e-3, 1e-6);
        last = reading;
    }
}

// This device has a model: a spring of 10 uN*m for each count.

TEST(UsbModelDevice, ReportsItsModelAndRendersForTheHost) {
    UsbDevice device;
    ASSERT_EQ(device.open().reason, "");
    const std::optional<wire::DeviceModel> model = device.model();
    ASSERT_TRUE(model);
    EXPECT_EQ(wire::fingerprint_text(model->fingerprint), "0123456789abcdef");
    EXPECT_EQ(model->rate_hz, 10'000U);
    EXPECT_EQ(model->renderer, wire::Renderer::Host);
    settled(device, 0.2);
    EXPECT_NEAR(settled(device, 0.2).applied, 0.2, 1e-9);
}

TEST(UsbModelDevice, RendersItsModelWhileTheHostSendsCommands) {
    UsbOptions options;
    options.device_renders = true;
    UsbDevice device{options};
    ASSERT_EQ(device.open().reason, "");
    EXPECT_EQ(device.model()->renderer, wire::Renderer::Device);
    settled(device);
    for (int k = 0; k < 100; ++k) {
        const Reading reading = device.exchange({1.0});  // this force has no effect
        const double count =
            std::round(reading.position / wire::position_of(1, device.info().counts_per_rev));
        ASSERT_EQ(reading.status, Status::Ok) << k;
        if (k > 20) {  // after the ramp of the device
            ASSERT_NEAR(reading.applied, 10e-6 * count, 1e-9) << k;
            ASSERT_GT(reading.applied, 0.0);
        }
    }
    send_order("fault freeze 15");  // longer than a command is valid
    for (int k = 0; k < 3; ++k) {
        EXPECT_EQ(device.exchange({0.0}).status, Status::Timeout) << k;
    }
    EXPECT_EQ(device.exchange({0.0}).applied, 0.0);
    EXPECT_NEAR(settled(device).applied, 0.0, 1e-2) << "the force grows from zero again";
    device.close();
    EXPECT_EQ(state("torque_uNm"), 0.0);
    EXPECT_EQ(state("enabled"), 0.0);
    UsbDevice next;
    ASSERT_EQ(next.open().reason, "");
    settled(next, 0.2);
    EXPECT_NEAR(settled(next, 0.2).applied, 0.2, 1e-9) << "the next host renders again";
}

// Each run of the tests below emulates a different device, whose firmware behaves randomly where the protocol allows
// it.

TEST(UsbOtherFirmware, BehavesLikeTheUsualDevice) {
    UsbDevice device;
    ASSERT_EQ(device.open().reason, "");
    Reading last = settled(device);
    const double began = last.position - state("position_rad");
    const UsbHealth before = device.health();
    for (int k = 0; k < 200; ++k) {
        const Reading reading = device.exchange({0.0});
        ASSERT_EQ(reading.status, Status::Ok);
        ASSERT_EQ(reading.sequence, last.sequence + 1);
        ASSERT_NEAR(reading.device_time - last.device_time, 1e-3, 0.1e-3);
        last = reading;
    }
    const double step = wire::position_of(1, device.info().counts_per_rev);
    // The handle position that the host has read is one or two samples older than the position in the emulator.
    EXPECT_NEAR(last.position - state("position_rad"), began, 4.0 * step + 2e-3);
    EXPECT_EQ(device.health().stream.lost, before.stream.lost);
    EXPECT_EQ(device.health().stream.late_echoes, 0U);
    EXPECT_EQ(device.health().stream.watchdog_trips, 0U);
    // The last of 200 commands may still wait in the device. The median delay from a sample to the effect of its
    // command is at most two samples.
    EXPECT_GE(device.health().stream.delay.count(), 195U);
    EXPECT_LE(device.health().stream.delay.quantile(0.5), 2.1e6);
    EXPECT_NEAR(settled(device, 0.25).applied, 0.25, 1e-3);
    EXPECT_NEAR(state("torque_uNm"), -0.25e6, 1e3);
    device.close();
    EXPECT_EQ(state("torque_uNm"), 0.0);
    EXPECT_EQ(state("enabled"), 0.0);
}

TEST(UsbOtherFirmware, IsFoundAgainByItsSerialNumber) {
    UsbDevice first;
    ASSERT_EQ(first.open().reason, "");
    const std::string serial = first.name().serial;
    ASSERT_FALSE(serial.empty());
    first.close();
    EXPECT_EQ(UsbDevice{{.serial = serial}}.open().reason, "");
    EXPECT_NE(UsbDevice{{.serial = "another"}}.open().reason.find("connected: " + serial), std::string::npos);
}

TEST(UsbOtherFirmware, StateOfAnEarlierProgramIsNotAFault) {
    UsbDevice rendering;
    ASSERT_EQ(rendering.open().reason, "");
    settled(rendering, 0.2);
    send_order("fault emergency-stop 1");
    Status status = Status::Ok;
    // The device may still hold one or two packets that it made before the emergency stop.
    for (int k = 0; k < 3 && status == Status::Ok; ++k) {
        status = rendering.exchange({0.2}).status;
    }
    ASSERT_EQ(status, Status::Fault);
    EXPECT_EQ(state("torque_uNm"), 0.0);
    rendering.close();
    const std::string reason = rendering.open().reason;
    EXPECT_NE(reason.find("reports an emergency stop"), std::string::npos) << reason;
    detail::UsbConnection connection;
    rendering.close();
    ASSERT_EQ(connection.open("").reason, "");
    ASSERT_EQ(connection.request(wire::Request::Clear, 0), 0);
    ASSERT_EQ(connection.request(wire::Request::Enable, 1),
              0);  // the device stays enabled, as after a program that was killed
    connection.close();
    UsbOptions options;
    options.makes_force = false;
    UsbDevice listening{options};
    ASSERT_EQ(listening.open().reason, "");
    for (int k = 0; k < 20; ++k) {
        ASSERT_NE(listening.exchange({0.0}).status, Status::Fault) << k;
    }
}

TEST(UsbText, AcceptsAllOfUnicodeAndRefusesInvalidText) {
    const auto text = [](const std::u16string& units) {
        std::vector<std::uint8_t> bytes;
        for (const char16_t unit : units) {
            bytes.push_back(static_cast<std::uint8_t>(unit & 0xFFU));
            bytes.push_back(static_cast<std::uint8_t>(unit >> 8U));
        }
        return detail::text_of_utf16(bytes);
    };
    EXPECT_EQ(text(u"EMU-1"), "EMU-1");
    EXPECT_EQ(text(u"\u00b5 \u2116 \U0001D11E"), "\xC2\xB5 \xE2\x84\x96 \xF0\x9D\x84\x9E");
    EXPECT_EQ(text(u" two\nlines\t"), "two lines");
    EXPECT_EQ(text(std::u16string{u"PADDED"} + std::u16string(3, u'\0')), "PADDED");
    EXPECT_EQ(text(u"   "), "");
    EXPECT_EQ(text(u"A\u009b31m\u202e"), "A\\x9b31m\\u202e");
    EXPECT_EQ(text({u'a', char16_t{0xD834}}), "");  // half a pair
    EXPECT_EQ(text({char16_t{0xDD1E}, u'a'}), "");
}

}  // namespace
}  // namespace palpate
