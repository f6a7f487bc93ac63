// SPDX-License-Identifier: Apache-2.0
// UsbDevice on machines with other devices than the usual one: two, none, a foreign one, one that may not be opened.
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "emulated_machine.hpp"
#include "palpate/device/usb.hpp"

namespace palpate {
namespace {

using test::patient;
using test::settled;
using test::state;

TEST(UsbTwoDevices, AreToldApartByTheirSerialNumbers) {
    const std::string both = patient().open().reason;
    EXPECT_NE(both.find("2 USB devices could be meant (LEFT, RIGHT): choose with usb:SERIAL"),
              std::string::npos)
        << both;
    UsbDevice left = patient("LEFT");
    UsbDevice right = patient("RIGHT");
    ASSERT_EQ(left.open().reason, "");
    ASSERT_EQ(right.open().reason, "");
    EXPECT_EQ(left.name().serial, "LEFT");
    EXPECT_EQ(right.name().serial, "RIGHT");
    int in_a_row = 0;
    for (int k = 0; k < 100 && in_a_row < 20; ++k) {
        const Status one = left.exchange({0.1}).status;
        const Status other = right.exchange({-0.1}).status;
        in_a_row = one == Status::Ok && other == Status::Ok ? in_a_row + 1 : 0;
    }
    EXPECT_EQ(in_a_row, 20);
    const std::string neither = patient("MIDDLE").open().reason;
    EXPECT_NE(neither.find("serial number MIDDLE; there is LEFT, RIGHT"), std::string::npos) << neither;
}

TEST(UsbNoDevice, SaysWhatToLookFor) {
    EXPECT_NE(patient().open().reason.find("lsusb -d 1209:0001"), std::string::npos);
}

TEST(UsbForeignDevice, IsLeftAlone) {
    const std::string reason = patient().open().reason;
    EXPECT_NE(reason.find("is 1209:0001 but not of this protocol"), std::string::npos) << reason;
    EXPECT_EQ(state("outs"), 0.0);
}

TEST(UsbDeniedDevice, NamesDeviceReasonAndCure) {
    const std::string reason = patient().open().reason;
    EXPECT_NE(reason.find("USB device (bus 1, address 2) cannot be opened: permission denied"),
              std::string::npos)
        << reason;
    EXPECT_NE(reason.find("sudo palpate devices --install-udev-rule"), std::string::npos) << reason;
}

TEST(UsbPlainDevice, WithoutTransducerAndTachometerHasNoMeasuredForceAndDifferencesItsPosition) {
    UsbDevice device = patient();
    ASSERT_TRUE(device.open());
    Reading last = settled(device);
    for (int k = 0; k < 50; ++k) {
        const Reading reading = device.exchange({0.0});
        EXPECT_TRUE(std::isnan(reading.measured));
        EXPECT_NEAR(reading.velocity, (reading.position - last.position) / 1e-3, 1e-6);
        last = reading;
    }
}

// Whatever the page leaves to the firmware.
TEST(UsbOtherFirmware, IsTheSameDevice) {
    UsbDevice device = patient();
    ASSERT_EQ(device.open().reason, "");
    Reading last = settled(device);
    const UsbHealth before = device.health();
    for (int k = 0; k < 200; ++k) {
        const Reading reading = device.exchange({0.0});
        ASSERT_EQ(reading.status, Status::Ok);
        ASSERT_EQ(reading.sequence, last.sequence + 1);
        last = reading;
    }
    EXPECT_EQ(device.health().stream.lost, before.stream.lost);
    EXPECT_EQ(device.health().stream.late_echoes, 0U);
    EXPECT_LE(device.health().stream.delay.quantile(0.5), 1e6 + 1.0);  // a sample at most
    EXPECT_NEAR(settled(device, 0.25).applied, 0.25, 1e-9);
    device.close();
    EXPECT_EQ(state("torque_uNm"), 0.0);
    EXPECT_EQ(state("enabled"), 0.0);
}

}  // namespace
}  // namespace palpate
