// SPDX-License-Identifier: Apache-2.0
// Tests of the messages without libusb. tests/usb and the Python tests use an emulated device.
#include <optional>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "palpate/run/detail/open_inverse3.hpp"
#include "palpate/run/open_usb.hpp"
#include "support.hpp"

namespace palpate {
namespace {

PlannedModel line() {
    NetworkParameters network;
    network.linear = {1.0};
    return {"a.json",     {network, {{0.0}, {1.0}, Continuation::Linear, Continuation::Linear, std::nullopt}},
            "mm",         "N",
            std::nullopt, std::nullopt,
            std::nullopt};
}

using test::refusal;

TEST(Refuse, ThrowsTheSentence) {
    EXPECT_EQ(refusal([] { refuse("a sentence"); }), "a sentence");
}

#ifndef PALPATE_HAS_USB

TEST(OpenUsb, NamesThePackageThatIsMissing) {
    const std::string missing =
        "device usb:5: palpate was built without libusb; install libusb-1.0-0-dev and build palpate again";
    RenderOptions options;
    options.device = "usb:5";
    EXPECT_EQ(refusal([&] { (void)open_usb(options, line()); }), missing);
    MeasureOptions measuring;
    measuring.device = "usb:5";
    EXPECT_EQ(refusal([&] { (void)usb_to_measure(measuring); }), missing);
}

#endif

TEST(OpenInverse3, RefusesAModelInOtherUnits) {
    RenderOptions options;
    options.device = "inverse3";
    EXPECT_EQ(refusal([&] { (void)open_inverse3(options, line()); }),
              "a.json is in mm and N; an Inverse3 moves along a line and needs a model in m and N");
}

}  // namespace
}  // namespace palpate
