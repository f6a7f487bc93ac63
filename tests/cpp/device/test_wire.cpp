// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#if __has_include(<libusb-1.0/libusb.h>)
#include <libusb-1.0/libusb.h>
#endif

#include "packet.hpp"
#include "palpate/device/wire.hpp"
#include "support.hpp"

namespace palpate {
namespace {

using test::Bytes;
using test::knob;
using test::Packet;

TEST(Wire, InPacketsAreReadFieldByField) {
    const Packet sent{0xFEDC, 0x89AB'CDEF, -2, 0x0102'0304, -70'000, 0x0041, 0x1234, 999, 5};
    wire::InPacket read;
    ASSERT_TRUE(wire::decode(sent.bytes(), read));
    EXPECT_EQ(read.sequence, 0xFEDC);
    EXPECT_EQ(read.clock_us, 0x89AB'CDEFU);
    EXPECT_EQ(read.count, -2);
    EXPECT_EQ(read.velocity_cps, 0x0102'0304);
    EXPECT_EQ(read.torque_uNm, -70'000);
    EXPECT_EQ(read.status, 0x0041);
    EXPECT_EQ(read.out_sequence, 0x1234);
    EXPECT_EQ(read.out_age_us, 999);
    EXPECT_EQ(read.temperature_dC, 253);
    EXPECT_EQ(read.sensor_uNm, 5);
}

TEST(Wire, OutPacketsAreWrittenByteByByte) {
    const auto bytes = wire::encode({0x1234, -1'000'000, 10, 0x89AB'CDEF});
    const std::array<std::uint8_t, 16> expected{'T',  1, 0x34, 0x12, 0xC0, 0xBD, 0xF0, 0xFF,
                                                0x00, 0, 10,   0,    0xEF, 0xCD, 0xAB, 0x89};
    EXPECT_EQ(bytes, expected);
}

TEST(Wire, WrongSizeMagicOrVersionIsAnErrorForBothPackets) {
    const Bytes good = Packet{}.bytes();
    for (std::size_t size = 0; size <= 64; ++size) {
        Bytes other = good;
        other.resize(size);
        wire::InPacket packet;
        EXPECT_EQ(wire::decode(other, packet), size == 32);
        wire::Info info;
        EXPECT_NE(wire::decode(other, info), "");
    }
    for (int byte = 0; byte < 256; ++byte) {
        Bytes other = good;
        wire::InPacket packet;
        other[0] = static_cast<std::uint8_t>(byte);
        EXPECT_EQ(wire::decode(other, packet), byte == 'H');
        other = good;
        other[1] = static_cast<std::uint8_t>(byte);
        EXPECT_EQ(wire::decode(other, packet), byte == 1);
    }
}

TEST(Wire, ReadsInfoAndRefusesInvalidFields) {
    const Bytes good{'I', 1, 0x02, 0x01, 0,  0,  1, 0, 0x40, 0x4B, 0x4C, 0, 0xE8, 3, 20, 0,
                     3,   0, 0,    0,    32, 16, 1, 0, 1,    2,    3,    4, 5,    6, 7,  8};
    wire::Info info;
    ASSERT_EQ(wire::decode(good, info), "");
    EXPECT_EQ(info.firmware, 0x0102);
    EXPECT_EQ(info.counts_per_rev, 65536U);
    EXPECT_EQ(info.max_torque_uNm, 5'000'000);
    EXPECT_EQ(info.rate_hz, 1000);
    EXPECT_EQ(info.watchdog_ms, 20);
    EXPECT_EQ(info.capabilities, 3U);
    EXPECT_EQ(info.uid, 0x0807'0605'0403'0201U);
    for (const auto& [at, value] : std::vector<std::pair<std::size_t, std::uint8_t>>{
             {6, 0}, {11, 0xFF}, {16, 4}, {20, 31}, {21, 15}, {22, 2}, {23, 1}}) {
        Bytes other = good;
        other[at] = value;
        EXPECT_NE(wire::decode(other, info).find(", must be "), std::string::npos) << at;
    }
}

TEST(Wire, ReadsTheModelOfADeviceAndRefusesInvalidFields) {
    const Bytes good{1, 2, 3, 4, 5, 6, 7, 8, 11, 12, 13, 14, 15, 16, 17, 18, 0xE8, 3, 0, 0, 1, 0, 0, 0};
    wire::DeviceModel model;
    ASSERT_EQ(wire::decode(good, model), "");
    EXPECT_EQ(model.fingerprint, 0x0807'0605'0403'0201U);
    EXPECT_EQ(model.certificate, 0x1211'100F'0E0D'0C0BU);
    EXPECT_EQ(model.rate_hz, 1000U);
    EXPECT_EQ(model.renderer, wire::Renderer::Device);
    const auto changed = [&](std::size_t at, std::uint8_t value) {
        Bytes other = good;
        other[at] = value;
        return other;
    };
    for (const std::size_t size : {std::size_t{0}, good.size() - 1, good.size() + 1}) {
        Bytes other = good;
        other.resize(size);
        EXPECT_EQ(wire::decode(other, model),
                  "the answer to GET_MODEL has " + std::to_string(size) + " bytes, must have 24");
    }
    Bytes at_rest = changed(16, 0);
    at_rest[17] = 0;
    EXPECT_EQ(wire::decode(at_rest, model), "the answer to GET_MODEL: rate_hz is 0, must be > 0");
    EXPECT_EQ(wire::decode(changed(20, 2), model), "the answer to GET_MODEL: renderer is 2, must be 0 or 1");
    EXPECT_EQ(wire::decode(changed(23, 1), model),
              "the answer to GET_MODEL: renderer is 16777217, must be 0 or 1");
    ASSERT_EQ(wire::decode(changed(20, 0), model), "");
    EXPECT_EQ(model.renderer, wire::Renderer::Host);
}

TEST(Wire, NamesTheFirstDifferenceBetweenTheModelOfADeviceAndThePlan) {
    const wire::DeviceModel planned{0x12, 0xAB, 1000, wire::Renderer::Host};
    EXPECT_EQ(wire::difference({0x12, 0xAB, 1000, wire::Renderer::Device}, planned), "");
    EXPECT_EQ(wire::difference({0x13, 0xAC, 500}, planned),
              "contains the model 0000000000000013, but the plan is for the model 0000000000000012");
    EXPECT_EQ(wire::difference({0x12, 0xAC, 500}, planned),
              "contains this model with the certificate 00000000000000ac, but that of the plan is "
              "00000000000000ab");
    EXPECT_EQ(wire::difference({0x12, 0xAB, 500}, planned),
              "renders this model at 500 Hz, but the certificate of the plan is for 1000 Hz");
}

#if __has_include(<libusb-1.0/libusb.h>)
TEST(Wire, HasACauseForTheErrorsOfLibusbThatADeviceCanHave) {
    for (const auto& [code, word] :
         std::vector<std::pair<int, std::string>>{{LIBUSB_ERROR_IO, "failed on the bus"},
                                                  {LIBUSB_ERROR_ACCESS, "permission"},
                                                  {LIBUSB_ERROR_NO_DEVICE, "unplugged"},
                                                  {LIBUSB_ERROR_NOT_FOUND, "unplugged"},
                                                  {LIBUSB_ERROR_BUSY, "another program"},
                                                  {LIBUSB_ERROR_TIMEOUT, "not answer"},
                                                  {LIBUSB_ERROR_PIPE, "refused"},
                                                  {LIBUSB_ERROR_NO_MEM, "memory"}}) {
        EXPECT_NE(wire::usb_cause(code).find(word), std::string::npos) << code;
    }
    for (const int code :
         {int{LIBUSB_SUCCESS}, int{LIBUSB_ERROR_INVALID_PARAM}, int{LIBUSB_ERROR_OTHER}, 1}) {
        EXPECT_EQ(wire::usb_cause(code), "") << code;
    }
}
#endif

TEST(Wire, ForceOutOfTheObjectIsATorqueTowardsSmallerCounts) {
    EXPECT_EQ(wire::torque_of(0.5, 5'000'000), -500'000);
    EXPECT_EQ(wire::force_of(-500'000), 0.5);
    EXPECT_FALSE(std::signbit(wire::force_of(0)));
    EXPECT_NEAR(wire::position_of(16384, 65536), 0.5 * std::numbers::pi, 1e-15);
}

TEST(Wire, TorqueStaysInTheDevicesRangeAndNanIsZero) {
    for (const double force : {1e300, std::numeric_limits<double>::infinity(), 5.0001}) {
        EXPECT_EQ(wire::torque_of(force, 5'000'000), -5'000'000);
        EXPECT_EQ(wire::torque_of(-force, 5'000'000), 5'000'000);
    }
    EXPECT_EQ(wire::torque_of(std::numeric_limits<double>::quiet_NaN(), 5'000'000), 0);
    test::Random random{1};
    for (int k = 0; k < test::cases(10'000); ++k) {
        const double force = test::uniform(random, -6.0, 6.0);
        const double back = wire::force_of(wire::torque_of(force, 5'000'000));
        EXPECT_NEAR(back, std::clamp(force, -5.0, 5.0), 0.5e-6);
    }
}

TEST(Unwrapped, FollowsACounterThroughWrapsLossAndRepetition) {
    test::Random random{2};
    wire::Unwrapped<std::uint16_t> counter;
    std::int64_t truth = 65'000;
    counter.follow(static_cast<std::uint16_t>(truth));
    for (int k = 0; k < test::cases(20'000); ++k) {
        const auto step = static_cast<std::int64_t>(test::uniform(random, -20.0, 30'000.0));
        truth += step;
        EXPECT_EQ(counter.follow(static_cast<std::uint16_t>(truth)), step);
        EXPECT_EQ(counter.value(), truth);
    }
}

}  // namespace
}  // namespace palpate
