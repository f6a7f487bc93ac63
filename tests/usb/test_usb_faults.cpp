// SPDX-License-Identifier: Apache-2.0
// Tests UsbDevice with faults of the USB transfers and faults of the device.
#include <dlfcn.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include "emulated_machine.hpp"
#include "palpate/device/usb.hpp"

namespace {

/// Pause of the calling thread after each transfer that it submits.
thread_local std::chrono::milliseconds pause_after_submit{0};

}  // namespace

/// Replaces the function of libusb, to delay the transfers of a thread.
extern "C" int LIBUSB_CALL libusb_submit_transfer(libusb_transfer* transfer) {
    const int code = reinterpret_cast<decltype(&::libusb_submit_transfer)>(
        ::dlsym(RTLD_NEXT, "libusb_submit_transfer"))(transfer);
    std::this_thread::sleep_for(pause_after_submit);
    return code;
}

namespace palpate {
namespace {

using std::chrono::milliseconds;
using test::open_files;
using test::send_order;
using test::settled;
using test::state;

TEST(UsbDevice, CountsAndIgnoresPacketsOfAnotherProtocol) {
    UsbDevice device;
    ASSERT_TRUE(device.open());
    std::uint64_t malformed = 0;
    for (const char* fault : {"short", "magic", "version", "long"}) {
        const Reading before = settled(device);
        const std::uint64_t lost = device.health().stream.lost;
        send_order(std::string("fault ") + fault + " 1");
        const Reading after = device.exchange({0.0});  // the next packet
        EXPECT_EQ(after.status, Status::Ok) << fault;
        EXPECT_EQ(after.sequence, before.sequence + 2) << fault;
        EXPECT_EQ(device.health().stream.malformed, ++malformed) << fault;
        EXPECT_EQ(device.health().stream.lost, lost + 1) << fault;
    }
}

TEST(UsbDevice, ClearsHaltedEndpointsAndContinuesTheStream) {
    UsbDevice device;
    ASSERT_TRUE(device.open());
    std::uint64_t stalls = 0;
    for (const char* fault : {"stall-in", "stall-out", "stall-in", "stall-out"}) {
        settled(device, 0.1);
        send_order(std::string("fault ") + fault + " 1");
        int lost = 0;
        for (int k = 0; k < 5; ++k) {
            const Status status = device.exchange({0.1}).status;
            EXPECT_NE(status, Status::Fault) << fault;
            lost += status == Status::Lost ? 1 : 0;
        }
        EXPECT_EQ(lost > 0, std::string(fault) == "stall-out") << fault;  // the command
        EXPECT_EQ(device.health().stalls, ++stalls) << fault;
        EXPECT_EQ(settled(device, 0.1).status, Status::Ok) << fault;
        EXPECT_EQ(state("torque_uNm"), -100'000.0) << fault;
    }
}

TEST(UsbDevice, OpensADeviceThatTheLastProgramLeftHalted) {
    for (const unsigned char endpoint : {wire::in_endpoint, wire::out_endpoint}) {
        {
            detail::UsbConnection last;
            ASSERT_TRUE(last.open(""));
            send_order(endpoint == wire::in_endpoint ? "fault stall-in 1" : "fault stall-out 1");
            std::array<unsigned char, 64> packet{};
            int moved = 0;
            const int code =
                libusb_bulk_transfer(last.handle(), endpoint, packet.data(), packet.size(), &moved, 1000);
            ASSERT_EQ(code, LIBUSB_ERROR_PIPE);
        }
        UsbDevice device;
        ASSERT_EQ(device.open().reason, "");
        EXPECT_EQ(settled(device, 0.1).status, Status::Ok);
        EXPECT_EQ(device.health().stalls, 1U);
    }
}

TEST(UsbDevice, OpensAHaltedDeviceIfTheSecondReadIsSubmittedAfterTheHalt) {
    send_order("fault stall-in 1");
    UsbDevice device;
    pause_after_submit = milliseconds{3};
    const std::string reason = device.open().reason;
    pause_after_submit = {};
    EXPECT_EQ(reason, "");
    EXPECT_EQ(settled(device, 0.1).status, Status::Ok);
    EXPECT_EQ(device.health().stalls, 1U);
}

TEST(UsbDevice, ALateProgramDiscardsOldPacketsAndContinues) {
    UsbDevice device;
    ASSERT_TRUE(device.open());
    const Reading before = settled(device, 0.1);
    std::this_thread::sleep_for(milliseconds{6});
    const Reading after = device.exchange({0.1});
    EXPECT_EQ(after.status, Status::Ok);
    EXPECT_EQ(after.sequence, before.sequence + 7);
    EXPECT_EQ(device.health().discarded, 6U);
    EXPECT_EQ(device.health().stream.lost, 0U);
    EXPECT_EQ(settled(device, 0.1).sequence, after.sequence + 4);
}

TEST(UsbDevice, ReportsATimeoutWhileTheDeviceDoesNotAnswer) {
    UsbDevice device;
    ASSERT_TRUE(device.open());
    settled(device);
    send_order("fault mute 30");
    for (int k = 0; k < 6; ++k) {  // each waits 5 ms
        EXPECT_EQ(device.exchange({0.0}).status, Status::Timeout) << k;
    }
    EXPECT_EQ(device.health().timeouts, 6U);
    EXPECT_EQ(device.exchange({0.0}).status, Status::Ok);
}

// After a late command the next commands must arrive in time, because each late command ends a certified run.
TEST(UsbDevice, ALateCommandDoesNotDelayTheNextOnes) {
    UsbDevice device;
    ASSERT_EQ(device.open().reason, "");
    for (int round = 0; round < 20; ++round) {
        // The first exchange after opening only waits for a packet. A late command shows while it is expected, when
        // it is confirmed, and once more because the host skips the command after it.
        const int late = round == 0 ? 2 : 1;
        send_order("fault busy 1");
        for (int k = 0; k < 10; ++k) {
            const Reading reading = device.exchange({0.1});
            EXPECT_EQ(reading.status, Status::Ok) << round << " " << k;
            EXPECT_EQ(reading.delay > 1.25e-3, late <= k && k < late + 3)
                << round << " " << k << " " << reading.delay;
        }
    }
}

TEST(UsbDevice, CountsSkippedSamplesInTheSequence) {
    UsbDevice device;
    ASSERT_TRUE(device.open());
    const Reading before = settled(device);
    const std::uint64_t lost = device.health().stream.lost;
    send_order("fault skip 5");
    EXPECT_EQ(device.exchange({0.0}).sequence, before.sequence + 6);
    EXPECT_EQ(device.health().stream.lost, lost + 5);
    send_order("fault repeat 1");
    const Reading again = device.exchange({0.0});
    EXPECT_EQ(again.sequence, before.sequence + 6);
    EXPECT_EQ(device.health().stream.repeated, 1U);
}

TEST(UsbDevice, CountsLateEchoes) {
    UsbDevice device;
    ASSERT_TRUE(device.open());
    settled(device);
    send_order("fault old-echo 1");
    EXPECT_EQ(device.exchange({0.0}).status, Status::Ok);
    EXPECT_EQ(settled(device).status, Status::Ok);
    EXPECT_EQ(device.health().stream.late_echoes, 1U);
}

TEST(UsbDevice, WatchdogEndsTheTorqueUntilTheNextCommand) {
    UsbDevice device;
    ASSERT_TRUE(device.open());
    settled(device, 0.2);
    EXPECT_EQ(state("torque_uNm"), -200'000.0);
    // The device answers no transfer for 15 frames, which is longer than it applies a command
    send_order("fault freeze 15");
    for (int k = 0; k < 3; ++k) {  // each waits 5 ms
        EXPECT_EQ(device.exchange({0.2}).status, Status::Timeout) << k;
    }
    EXPECT_EQ(device.health().timeouts, 3U);
    const Reading tripped = device.exchange({0.2});
    EXPECT_EQ(tripped.status, Status::Timeout);
    EXPECT_EQ(tripped.applied, 0.0);
    EXPECT_EQ(device.health().stream.watchdog_trips, 1U);
    EXPECT_EQ(settled(device, 0.2).status, Status::Ok);
    EXPECT_EQ(state("torque_uNm"), -200'000.0);
}

TEST(UsbDevice, ReportsEveryFaultOfTheDevice) {
    for (const char* fault : {"encoder", "over-temperature", "emergency-stop", "reset"}) {
        UsbDevice device;
        ASSERT_EQ(device.open().reason, "") << fault;
        settled(device, 0.2);
        send_order(std::string("fault ") + fault + " 1");
        EXPECT_EQ(device.exchange({0.2}).status, Status::Fault) << fault;
        EXPECT_EQ(state("torque_uNm"), 0.0) << fault;
        device.close();
        const std::string reason = device.open().reason;
        EXPECT_EQ(reason.empty(), std::string(fault) == "reset") << reason;
        if (!reason.empty()) {
            EXPECT_NE(reason.find("EMU-1 (bus 1, address 2) reports "), std::string::npos) << reason;
            EXPECT_NE(reason.find("palpate devices --clear"), std::string::npos) << reason;
        }
        detail::UsbConnection connection;
        device.close();
        ASSERT_EQ(connection.open("").reason, "");
        EXPECT_EQ(connection.request(wire::Request::Clear, 0), 0);
    }
}

TEST(UsbDevice, ReportsASaturatedTorqueAsLimited) {
    UsbDevice device;
    ASSERT_TRUE(device.open());
    settled(device, 0.2);
    send_order("fault saturate 1");
    EXPECT_EQ(device.exchange({0.2}).status, Status::Limited);
}

TEST(UsbDevice, ReportsAFaultAfterUnpluggingAndOpensAgainAfterPluggingIn) {
    UsbDevice device;
    ASSERT_TRUE(device.open());
    device.close();
    const std::size_t files = open_files();
    for (int round = 0; round < 3; ++round) {
        ASSERT_EQ(device.open().reason, "") << round;
        settled(device, 0.1);
        send_order("fault unplug 3");
        Status status = Status::Ok;
        for (int k = 0; k < 10 && status == Status::Ok; ++k) {
            status = device.exchange({0.1}).status;
        }
        EXPECT_EQ(status, Status::Fault);
        EXPECT_EQ(device.exchange({0.1}).status, Status::Fault);
        device.close();
        EXPECT_EQ(device.in_flight(), 0);
        EXPECT_EQ(open_files(), files);
        const std::string reason = device.open().reason;
        EXPECT_NE(reason.find("is connected"), std::string::npos) << reason;
        ASSERT_EQ(send_order("plug"), "ok");
    }
    ASSERT_EQ(device.open().reason, "");
    EXPECT_EQ(settled(device).status, Status::Ok);
}

}  // namespace
}  // namespace palpate
