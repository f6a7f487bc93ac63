// SPDX-License-Identifier: Apache-2.0
// UsbDevice over real libusb, on a device that is emulated below it, in lock-step: no assertion on wall-clock time.
//
// Started as it is, this program runs itself under the emulator, once for each kind of device.
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "../cpp/support.hpp"
#include "palpate/device/usb.hpp"

namespace palpate {
namespace {

using std::chrono::milliseconds;

/// A word to the emulator; its answer.
std::string tell(const std::string& order) {
    const int talk = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    sockaddr_un own{};
    own.sun_family = AF_UNIX;
    ::bind(talk, reinterpret_cast<const sockaddr*>(&own),
           sizeof own.sun_family);  // a name of the kernel's choice
    sockaddr_un emulator{};
    emulator.sun_family = AF_UNIX;
    std::string{std::getenv("PALPATE_EMULATOR")}.copy(emulator.sun_path, sizeof emulator.sun_path - 1);
    ::sendto(talk, order.data(), order.size(), 0, reinterpret_cast<const sockaddr*>(&emulator),
             sizeof emulator);
    std::array<char, 512> answer{};
    const ssize_t length = ::recv(talk, answer.data(), answer.size(), 0);
    ::close(talk);
    return {answer.data(), static_cast<std::size_t>(length)};
}

/// One number of what the emulator says of its device.
double state(const std::string& field) {
    const std::string all = tell("state");
    const std::string key = "\"" + field + "\": ";
    const std::string value = all.substr(all.find(key) + key.size());
    return value.rfind("true", 0) == 0 ? 1.0 : value.rfind("false", 0) == 0 ? 0.0 : std::stod(value);
}

/// Patient: a busy machine is no fault of the device.
UsbDevice patient(const std::string& serial = "") {
    UsbOptions options;
    options.serial = serial;
    options.wait = std::chrono::seconds{20};
    return UsbDevice{options};
}

/// Exchanges until every command goes out, the last one is on the motor, the reading is the device's newest and only
/// two reads are on their way: from there on, one exchange is one frame.
Reading settled(UsbDevice& device, double force = 0.0) {
    Reading reading;
    for (int k = 0; k < 4; ++k) {
        reading = device.exchange({force});
    }
    const auto is_newest = [&] {
        return static_cast<std::uint16_t>(reading.sequence) == static_cast<std::uint16_t>(state("sequence"));
    };
    while (reading.status != Status::Fault &&
           (reading.status == Status::Lost || device.in_flight() > 2 || !is_newest())) {
        std::this_thread::sleep_for(milliseconds{2});  // one is still on its way, and will be waiting
        reading = device.exchange({force});
    }
    return reading;
}

std::size_t open_files() {
    std::size_t count = 0;
    for ([[maybe_unused]] const auto& file : std::filesystem::directory_iterator("/proc/self/fd")) {
        ++count;
    }
    return count;
}

// ------------------------------------------------------------------------------------------------ one device

TEST(UsbDevice, SaysWhoItIsAndWhatItCan) {
    UsbDevice device = patient();
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
    EXPECT_NO_THROW(validate(profile));
}

TEST(UsbDevice, EveryControlRequestDoesWhatThePageSays) {
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

TEST(UsbDevice, StreamsEverySampleOnceAndInOrder) {
    UsbDevice device = patient();
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
    EXPECT_EQ(health.skipped_commands, before.skipped_commands);
    EXPECT_EQ(health.timeouts, 0U);
    EXPECT_EQ(health.stalls, 0U);
    EXPECT_EQ(health.bus_errors, 0U);
    EXPECT_GE(health.stream.round_trip.count(), static_cast<std::uint64_t>(samples));
    EXPECT_NEAR(health.stream.delay.quantile(1.0), 1e6, 1.0);  // the emulated one: one sample
}

TEST(UsbDevice, AForceThatPushesOutMovesTheHandleBack) {
    UsbDevice device = patient();
    ASSERT_TRUE(device.open());
    const Reading before = settled(device);
    const Reading after = settled(device, 0.25);
    EXPECT_EQ(state("torque_uNm"), -250'000.0);
    EXPECT_NEAR(after.applied, 0.25, 1e-9);
    EXPECT_NEAR(after.measured, 0.25, 1e-9);
    EXPECT_LT(after.velocity, before.velocity - 0.1);
}

TEST(UsbDevice, ForcesBeyondTheDeviceAreClippedAndNoNumbersAreZero) {
    UsbDevice device = patient();
    ASSERT_TRUE(device.open());
    settled(device, 1e9);
    EXPECT_EQ(state("torque_uNm"), -5e6);
    settled(device, std::nan(""));
    EXPECT_EQ(state("torque_uNm"), 0.0);
}

TEST(UsbDevice, PacketsThatAreNotOfThisProtocolAreCountedAndNeverBelieved) {
    UsbDevice device = patient();
    ASSERT_TRUE(device.open());
    std::uint64_t malformed = 0;
    for (const char* fault : {"short", "magic", "version", "long"}) {
        const Reading before = settled(device);
        const std::uint64_t lost = device.health().stream.lost;
        tell(std::string("fault ") + fault + " 1");
        const Reading after = device.exchange({0.0});  // the one behind it
        EXPECT_EQ(after.status, Status::Ok) << fault;
        EXPECT_EQ(after.sequence, before.sequence + 2) << fault;
        EXPECT_EQ(device.health().stream.malformed, ++malformed) << fault;
        EXPECT_EQ(device.health().stream.lost, lost + 1) << fault;
    }
}

TEST(UsbDevice, HaltedEndpointsAreClearedAndTheStreamGoesOn) {
    UsbDevice device = patient();
    ASSERT_TRUE(device.open());
    std::uint64_t stalls = 0;
    for (const char* fault : {"stall-in", "stall-out", "stall-in", "stall-out"}) {
        settled(device, 0.1);
        tell(std::string("fault ") + fault + " 1");
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

TEST(UsbDevice, ADeviceThatDoesNotAnswerIsATimeoutAndNoMore) {
    UsbOptions options;
    options.wait = milliseconds{5};
    UsbDevice device{options};
    ASSERT_TRUE(device.open());
    settled(device);
    tell("fault mute 30");
    int timeouts = 0;
    for (int k = 0; k < 3; ++k) {
        timeouts += device.exchange({0.0}).status == Status::Timeout ? 1 : 0;
    }
    EXPECT_GE(timeouts, 1);
    EXPECT_GE(device.health().timeouts, 1U);
    Status status = Status::Timeout;
    for (int k = 0; k < 10'000 && status != Status::Ok; ++k) {
        status = device.exchange({0.0}).status;
    }
    EXPECT_EQ(status, Status::Ok);
}

TEST(UsbDevice, SamplesLeftOutShowInTheSequence) {
    UsbDevice device = patient();
    ASSERT_TRUE(device.open());
    const Reading before = settled(device);
    const std::uint64_t lost = device.health().stream.lost;
    tell("fault skip 5");
    EXPECT_EQ(device.exchange({0.0}).sequence, before.sequence + 6);
    EXPECT_EQ(device.health().stream.lost, lost + 5);
    tell("fault repeat 1");
    const Reading again = device.exchange({0.0});
    EXPECT_EQ(again.sequence, before.sequence + 6);
    EXPECT_EQ(device.health().stream.repeated, 1U);
}

TEST(UsbDevice, AnEchoFromBeforeIsCounted) {
    UsbDevice device = patient();
    ASSERT_TRUE(device.open());
    settled(device);
    tell("fault old-echo 1");
    EXPECT_EQ(device.exchange({0.0}).status, Status::Ok);
    EXPECT_EQ(settled(device).status, Status::Ok);
    EXPECT_EQ(device.health().stream.late_echoes, 1U);
}

TEST(UsbDevice, TheWatchdogEndsATorqueAndTheNextCommandBringsItBack) {
    UsbDevice device = patient();
    ASSERT_TRUE(device.open());
    settled(device, 0.2);
    EXPECT_EQ(state("torque_uNm"), -200'000.0);
    tell("fault freeze 15");  // longer than a command lives
    const Reading tripped = device.exchange({0.2});
    EXPECT_EQ(tripped.status, Status::Timeout);
    EXPECT_EQ(tripped.applied, 0.0);
    EXPECT_EQ(device.health().stream.watchdog_trips, 1U);
    EXPECT_EQ(settled(device, 0.2).status, Status::Ok);
    EXPECT_EQ(state("torque_uNm"), -200'000.0);
}

TEST(UsbDevice, EveryFaultOfTheDeviceIsAFault) {
    for (const char* fault : {"encoder", "over-temperature", "emergency-stop", "reset"}) {
        UsbDevice device = patient();
        ASSERT_EQ(device.open().reason, "") << fault;
        settled(device, 0.2);
        tell(std::string("fault ") + fault + " 1");
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

TEST(UsbDevice, ASaturatedTorqueIsLimited) {
    UsbDevice device = patient();
    ASSERT_TRUE(device.open());
    settled(device, 0.2);
    tell("fault saturate 1");
    EXPECT_EQ(device.exchange({0.2}).status, Status::Limited);
}

TEST(UsbDevice, ClosingLeavesZeroTorqueADisabledDeviceAndNothingInFlight) {
    UsbDevice device = patient();
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

TEST(UsbDevice, StartsAndStopsFiftyTimesAndLeavesNothingBehind) {
    UsbDevice device = patient();
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

TEST(UsbDevice, UnpluggedItIsGoneForGoodAndPluggedInItGoesOn) {
    UsbDevice device = patient();
    ASSERT_TRUE(device.open());
    device.close();
    const std::size_t files = open_files();
    for (int round = 0; round < 3; ++round) {
        ASSERT_EQ(device.open().reason, "") << round;
        settled(device, 0.1);
        tell("fault unplug 3");
        Status status = Status::Ok;
        for (int k = 0; k < 10 && status == Status::Ok; ++k) {
            status = device.exchange({0.1}).status;
        }
        EXPECT_EQ(status, Status::Fault);
        EXPECT_EQ(device.exchange({0.1}).status, Status::Fault);
        device.close();
        EXPECT_EQ(device.in_flight(), 0);
        EXPECT_EQ(open_files(), files);
        const std::string reason = device.open().reason;  // depends on whether the system knows already
        EXPECT_TRUE(reason.find("is plugged in") != std::string::npos ||
                    reason.find("unplugged meanwhile") != std::string::npos)
            << reason;
        ASSERT_EQ(tell("plug"), "ok");
    }
    ASSERT_EQ(device.open().reason, "");
    EXPECT_EQ(settled(device).status, Status::Ok);
}

TEST(UsbDevice, IsUsedByOneProgramAtATime) {
    UsbDevice first = patient();
    ASSERT_TRUE(first.open());
    UsbDevice second = patient();
    const std::string reason = second.open().reason;
    EXPECT_NE(reason.find("emulated knob EMU-1"), std::string::npos) << reason;
    EXPECT_NE(reason.find("another program uses it"), std::string::npos) << reason;
    EXPECT_EQ(settled(first).status, Status::Ok);
}

TEST(UsbDevice, CanBeHandedOn) {
    UsbDevice device = patient();
    ASSERT_TRUE(device.open());
    settled(device, 0.1);
    UsbDevice other = std::move(device);
    EXPECT_EQ(other.exchange({0.1}).status, Status::Ok);
    EXPECT_EQ(device.exchange({0.1}).status,
              Status::Fault);  // NOLINT(bugprone-use-after-move): that is the claim
}

// --------------------------------------------------------------------------------------------- other machines

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

namespace {

struct Machine {
    const char* suite;
    std::vector<std::string> options;
};

/// This program again, under the emulator; the exit code.
int run_under_emulator(const std::string& self, const Machine& machine, std::vector<std::string> words) {
    std::vector<std::string> command{PALPATE_USB_EMULATOR, "--lock-step"};
    command.insert(command.end(), machine.options.begin(), machine.options.end());
    if (const std::string first = PALPATE_PRELOAD_FIRST; !first.empty()) {
        command.insert(command.end(), {"--preload-first", first});
    }
    command.insert(command.end(), {"--", self});
    command.insert(command.end(), words.begin(), words.end());
    const pid_t child = ::fork();
    if (child == 0) {
        std::vector<char*> pointers;
        for (std::string& word : command) {
            pointers.push_back(word.data());
        }
        pointers.push_back(nullptr);
        ::execv(pointers[0], pointers.data());
        ::_exit(127);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}

}  // namespace

int main(int count, char** words) {
    const std::string self = std::filesystem::read_symlink("/proc/self/exe");
    std::vector<std::string> asked(words + 1, words + count);
    std::string filter;
    bool lists = false;
    for (const std::string& word : asked) {
        filter = word.rfind("--gtest_filter=", 0) == 0 ? word.substr(15) : filter;
        lists = lists || word == "--gtest_list_tests";
    }
    if (lists || std::getenv("PALPATE_EMULATOR") != nullptr) {
        testing::InitGoogleTest(&count, words);
        return RUN_ALL_TESTS();
    }
    int worst = 0;
    for (const Machine& machine : {Machine{"UsbDevice", {}},
                                   {"UsbTwoDevices", {"--serial", "LEFT", "--serial", "RIGHT"}},
                                   {"UsbNoDevice", {"--no-device"}},
                                   {"UsbForeignDevice", {"--somebody-elses"}},
                                   {"UsbDeniedDevice", {"--denied"}},
                                   {"UsbPlainDevice", {"--no-transducer", "--no-velocity"}},
                                   {"UsbOtherFirmware", {"--takes-out-first", "--from-zero"}}}) {
        const std::string suite = machine.suite;
        if (filter.empty() || filter.rfind(suite + ".", 0) == 0) {
            std::vector<std::string> given = asked;
            if (filter.empty()) {
                given.push_back("--gtest_filter=" + suite + ".*");
            }
            worst = std::max(worst, run_under_emulator(self, machine, given));
        }
    }
    return worst;
}
