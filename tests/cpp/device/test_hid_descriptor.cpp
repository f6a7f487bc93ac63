// SPDX-License-Identifier: Apache-2.0
#include "palpate/device/hid_descriptor.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "../support.hpp"
#include "emulated_wheel.hpp"

namespace palpate {
namespace {

std::string refusal(const std::vector<std::uint8_t>& bytes) {
    try {
        (void)hid::read_descriptor(bytes);
    } catch (const std::runtime_error& error) {
        return error.what();
    }
    return "";
}

TEST(HidDescriptor, APlaceIsThatOfAllValuesBeforeIt) {
    // Push and pop, a range of usages, padding, and a maximum of 255 in one byte
    const std::vector<std::uint8_t> bytes{
        0x05, 0x01, 0x09, 0x04, 0xA1, 0x01, 0x85, 0x03, 0x15, 0x00, 0x25, 0x01, 0x75, 0x01, 0x95,
        0x03, 0xA4, 0x05, 0x09, 0x19, 0x01, 0x29, 0x03, 0x81, 0x02, 0x95, 0x05, 0x81, 0x03, 0xB4,
        0x09, 0x31, 0x09, 0x30, 0x15, 0x00, 0x25, 0xFF, 0x75, 0x08, 0x95, 0x02, 0x81, 0x02, 0xC0};
    const hid::Reports reports = hid::read_descriptor(bytes);
    ASSERT_EQ(reports.fields.size(), 3U);
    EXPECT_TRUE(reports.numbered);
    EXPECT_EQ(reports.size_of(hid::ReportType::Input, 3), 4U);
    EXPECT_EQ(reports.size_of(hid::ReportType::Output, 3), 0U);
    EXPECT_EQ(reports.fields[0].usages, (std::vector<std::uint32_t>{0x90001, 0x90002, 0x90003}));
    EXPECT_TRUE(reports.fields[1].is_constant);
    const hid::ReportField& axes = reports.fields[2];
    EXPECT_EQ(axes.maximum, 255);
    EXPECT_EQ(axes.usages, (std::vector<std::uint32_t>{0x10031, 0x10030}));
    EXPECT_EQ(axes.inside, (std::vector<std::uint32_t>{0x10004}));
    const auto x = hid::value_of(axes, *axes.place_of(0x10030));
    ASSERT_TRUE(x);
    const std::array<std::uint8_t, 3> content{0xFF, 0x12, 0x34};
    EXPECT_EQ(x->read(content), 0x34);
}

TEST(HidDescriptor, AValueOfAnyPlaceAndSizeIsReadAsItWasWritten) {
    test::Random random{11};
    for (int k = 0; k < test::cases(2000); ++k) {
        hid::Value value;
        value.bits = static_cast<std::size_t>(test::uniform(random, 1.0, 33.0));
        value.first_bit = static_cast<std::size_t>(test::uniform(random, 0.0, 60.0));
        const bool is_signed = value.bits > 1 && k % 2 == 0;
        const auto size = std::int64_t{1} << value.bits;
        value.minimum = is_signed ? -size / 2 : 0;
        value.maximum = is_signed ? size / 2 - 1 : size - 1;
        const auto code = value.minimum + static_cast<std::int64_t>(test::uniform(random, 0.0, 1.0) *
                                                                    static_cast<double>(size - 1));
        std::vector<std::uint8_t> content(12, k % 3 == 0 ? 0xFF : 0x00);
        const std::vector<std::uint8_t> before = content;
        value.write(content, code);
        EXPECT_EQ(value.read(content), code);
        for (std::size_t bit = 0; bit < 96; ++bit) {
            if (bit < value.first_bit || bit >= value.first_bit + value.bits) {
                EXPECT_EQ(content[bit / 8] >> bit % 8 & 1, before[bit / 8] >> bit % 8 & 1);
            }
        }
        EXPECT_EQ(value.read({content.data(), 0}), 0) << "bits behind the end are 0";
    }
}

TEST(HidDescriptor, SharesAreRoundedToTheNearestCodeWithinTheRange) {
    const hid::Value both{1, 0, 16, -32768, 32767};
    EXPECT_EQ(both.code_of(0.0), 0);
    EXPECT_EQ(both.code_of(-1.0), -32767);
    EXPECT_EQ(both.code_of(7.0), 32767);
    EXPECT_EQ(both.code_of(std::nan("")), 0);
    const hid::Value one{1, 0, 8, 0, 255};
    EXPECT_EQ(one.code_of(0.5), 128);
    EXPECT_EQ(one.code_of(-0.5), 0);
    EXPECT_EQ(one.code_of_position(-1.0), 0);
    EXPECT_EQ(one.code_of_position(0.0), 128);
    EXPECT_DOUBLE_EQ(one.share_of(255), 1.0);
    EXPECT_DOUBLE_EQ(one.share_of(0), -1.0);
    EXPECT_DOUBLE_EQ(both.share_of(-32767), -1.0);
}

TEST(HidDescriptor, ADefectIsRefusedWithItsPlace) {
    EXPECT_NE(refusal({0x05}).find("byte 0 begins an item that the end cuts"), std::string::npos);
    EXPECT_NE(refusal({0xC0}).find("byte 0 ends a collection that did not begin"), std::string::npos);
    EXPECT_NE(refusal({0xA1, 0x01}).find("byte 2 is the end, but a collection is open"), std::string::npos);
    EXPECT_NE(refusal({0xB4}).find("takes back items that were not stored"), std::string::npos);
    EXPECT_NE(refusal({0x85, 0x00}).find("the report number 0, must be 1 to 255"), std::string::npos);
    EXPECT_NE(refusal({0xFE, 0x05, 0x00}).find("the end cuts"), std::string::npos);
    EXPECT_EQ(refusal({0xFE, 0x01, 0x00, 0x77}), "");
    EXPECT_NE(refusal({0x77, 0xFF, 0xFF, 0xFF, 0x7F, 0x95, 0x01, 0x81, 0x02}).find("longer than 4096"),
              std::string::npos);
    EXPECT_NE(refusal(std::vector<std::uint8_t>(70, 0xA4)).find("nests deeper"), std::string::npos);
}

TEST(HidDescriptor, AnyBytesAreReadOrRefused) {
    test::Random random{5};
    const std::vector<std::uint8_t> whole = test::EmulatedWheel::whole_descriptor();
    for (int k = 0; k < test::cases(3000); ++k) {
        std::vector<std::uint8_t> bytes = whole;
        for (int change = 0; change < 1 + k % 8; ++change) {
            bytes[static_cast<std::size_t>(test::uniform(random, 0.0, static_cast<double>(bytes.size())))] =
                static_cast<std::uint8_t>(test::uniform(random, 0.0, 256.0));
        }
        test::EmulatedWheel emulated;
        emulated.descriptor_bytes = bytes;
        auto wheel = emulated.device({.makes_force = false});
        const std::string reason = wheel.open().reason;
        EXPECT_TRUE(reason.empty() || reason.starts_with("device on /dev/hidraw0 ")) << reason;
    }
}

}  // namespace
}  // namespace palpate
