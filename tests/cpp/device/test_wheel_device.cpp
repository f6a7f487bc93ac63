// SPDX-License-Identifier: Apache-2.0
#include "palpate/device/wheel_device.hpp"

#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "../support.hpp"
#include "emulated_wheel.hpp"
#include "palpate/rendering/direct.hpp"
#include "palpate/run/controller.hpp"

namespace palpate {
namespace {

using test::EmulatedWheel;
constexpr double no_value = std::numeric_limits<double>::infinity();

/// Sends a command to a wheel that then is at a position, and returns its torque.
double torque_at(WheelDevice<EmulatedWheel>& wheel, const Command& command, double position) {
    (void)wheel.exchange(command);
    wheel.node().position = position;
    return wheel.node().torque();
}

TEST(WheelDevice, OpensWithZeroForceAndClosesWithConfirmedZeroForce) {
    auto wheel = EmulatedWheel{}.device();
    ASSERT_EQ(wheel.open().reason, "");
    EXPECT_TRUE(wheel.node().enabled);
    EXPECT_EQ(wheel.node().effects.size(), 2U);
    EXPECT_EQ(wheel.node().torque(), 0.0);
    // Zero force first: stop and reset come before everything else
    EXPECT_EQ(wheel.node().sent[0], (std::vector<std::uint8_t>{25, 4}));
    EXPECT_EQ(wheel.node().sent[1], (std::vector<std::uint8_t>{25, 1}));
    (void)wheel.exchange({2.0, 0.1, 10.0});
    EXPECT_EQ(wheel.close(), ZeroForce::Confirmed);
    EXPECT_FALSE(wheel.node().enabled);
    EXPECT_TRUE(wheel.node().effects.empty());
    EXPECT_EQ(wheel.exchange({1.0}).status, Status::Fault);
}

TEST(WheelDevice, APositiveForcePushesToSmallerPositionsAndALineIsOneSpring) {
    auto wheel = EmulatedWheel{}.device();
    ASSERT_TRUE(wheel.open());
    EXPECT_NEAR(torque_at(wheel, {1.0}, 0.3), -1.0, 1e-3);
    const std::size_t before = wheel.node().sent.size();
    EXPECT_NEAR(torque_at(wheel, {1.0, 0.1, 5.0}, 0.1), -1.0, 2e-3);
    wheel.node().position = 0.2;
    EXPECT_NEAR(wheel.node().torque(), -1.5, 2e-3);
    EXPECT_EQ(wheel.node().sent.size() - before, 2U) << "the constant force ends, the spring begins";
    for (const double force : {1.1, 0.3, -0.4}) {
        const std::size_t sent = wheel.node().sent.size();
        EXPECT_NEAR(torque_at(wheel, {force, 0.1, 5.0}, 0.1), -force, 2e-3);
        EXPECT_EQ(wheel.node().sent.size() - sent, 1U);
    }
    EXPECT_EQ(wheel.health().two_reports, 0U);
    EXPECT_NEAR(torque_at(wheel, {-2.0}, 0.1), 2.0, 1e-3);
}

TEST(WheelDevice, ALineHasItsForceAtThePositionOfTheCommandForAllCommands) {
    auto wheel = EmulatedWheel{}.device();
    ASSERT_TRUE(wheel.open());
    const double step = EmulatedWheel::half_range / 10000.0;
    test::Random random{7};
    for (int k = 0; k < test::cases(2000); ++k) {
        const Command command{test::uniform(random, -3.0, 3.0), test::uniform(random, -1.0, 1.0),
                              test::uniform(random, 0.0, 19.0)};
        const double x = command.position + test::uniform(random, -0.02, 0.02);
        const double slope_error = 0.5 * EmulatedWheel::full_stiffness / 10000.0 * 0.02;
        const double wanted = command.force + command.stiffness * (x - command.position);
        if (std::abs(wanted) > 3.9) {
            continue;
        }
        EXPECT_NEAR(torque_at(wheel, command, x), -wanted,
                    0.5 * step * command.stiffness + slope_error + 1e-3);
    }
    EXPECT_GT(wheel.health().two_reports, 0U) << "a flat line with a force needs both effects";
}

TEST(WheelDevice, OnlySpringsEndTheRunAtALineThatNeedsTwoReports) {
    auto wheel = EmulatedWheel{}.device({.only_springs = true});
    ASSERT_TRUE(wheel.open());
    EXPECT_EQ(wheel.exchange({1.0, 0.1, 5.0}).status, Status::Ok);
    EXPECT_EQ(wheel.exchange({3.0, 0.1, 0.5}).status, Status::Fault);
    EXPECT_EQ(wheel.node().torque(), 0.0);
    EXPECT_EQ(wheel.exchange({1.0, 0.1, 5.0}).applied, 0.0);
    EXPECT_EQ(wheel.node().torque(), 0.0);
}

TEST(WheelDevice, CommandsOutsideOfItsValuesAreReportedAndNumbersThatAreNotFiniteMakeNoForce) {
    auto wheel = EmulatedWheel{}.device();
    ASSERT_TRUE(wheel.open());
    for (const Command& command :
         {Command{5.0}, Command{-5.0}, Command{1.0, 0.0, -1.0}, Command{1.0, 0.0, 21.0}}) {
        EXPECT_EQ(wheel.exchange(command).status, Status::Limited);
        EXPECT_LE(std::abs(wheel.node().torque()), EmulatedWheel::full_torque);
    }
    for (const double value : {std::nan(""), no_value, -no_value}) {
        for (const Command& command : {Command{value}, Command{1.0, value}, Command{1.0, 0.3, value}}) {
            EXPECT_EQ(wheel.exchange(command).status, Status::Limited);
            EXPECT_EQ(wheel.node().torque(), 0.0);
        }
    }
}

TEST(WheelDevice, AWheelThatRestsSendsNoReportAndKeepsItsPosition) {
    auto wheel = EmulatedWheel{}.device();
    ASSERT_TRUE(wheel.open());
    wheel.node().step();
    const Reading moved = wheel.exchange({});
    EXPECT_EQ(moved.status, Status::Ok);
    EXPECT_NEAR(moved.position, wheel.node().position, EmulatedWheel::half_range / 30000.0);
    const Reading rests = wheel.exchange({0.5});
    EXPECT_EQ(rests.status, Status::Ok);
    EXPECT_EQ(rests.position, moved.position);
    EXPECT_EQ(rests.sequence, moved.sequence + 1);
    EXPECT_NEAR(rests.applied, 0.5, 1e-3);
    EXPECT_GE(rests.delay, 0.0);
}

TEST(WheelDevice, ThePauseBeforeTheFirstTickIsNotADelayOfAForce) {
    auto wheel = EmulatedWheel{}.device();
    ASSERT_TRUE(wheel.open());
    std::this_thread::sleep_for(std::chrono::milliseconds{200});
    EXPECT_LT(wheel.exchange({}).delay, 0.2);
    std::this_thread::sleep_for(std::chrono::milliseconds{20});
    EXPECT_GT(wheel.exchange({}).delay, 0.02);
}

TEST(WheelDevice, BothEffectsAreStartedAgainBeforeTheyEnd) {
    EmulatedWheel emulated;
    emulated.watchdog_s = 0.02;
    auto wheel = emulated.device();
    ASSERT_TRUE(wheel.open());
    std::vector<int> started;
    for (int k = 0; k < 6; ++k) {
        std::this_thread::sleep_for(std::chrono::milliseconds{6});
        wheel.node().sent.clear();
        (void)wheel.exchange({1.0});
        for (const std::vector<std::uint8_t>& report : wheel.node().sent) {
            if (report[0] == 24 && report[1] == 2) {
                started.push_back(report[2]);
            }
        }
    }
    ASSERT_EQ(started.size(), 6U) << "each tick is later than a quarter of the duration";
    for (std::size_t k = 1; k < started.size(); ++k) {
        EXPECT_NE(started[k], started[k - 1]);
    }
}

TEST(WheelDevice, TheEffectsEndWithoutTheProgram) {
    EmulatedWheel emulated;
    emulated.watchdog_s = 0.005;
    auto wheel = emulated.device();
    ASSERT_TRUE(wheel.open());
    (void)wheel.exchange({1.0, 0.1, 5.0});
    std::this_thread::sleep_for(std::chrono::milliseconds{6});
    EXPECT_EQ(wheel.node().torque(), 0.0);
}

TEST(WheelDevice, AWheelThatMakesNoForceIsNeverEnabled) {
    auto wheel = EmulatedWheel{}.device({.makes_force = false});
    ASSERT_TRUE(wheel.open());
    for (int k = 0; k < 5; ++k) {
        wheel.node().step();
        EXPECT_EQ(wheel.exchange({2.0, 0.1, 5.0}).status, Status::Ok);
        EXPECT_FALSE(wheel.node().enabled);
        EXPECT_TRUE(wheel.node().effects.empty());
    }
}

TEST(WheelDevice, ItsProfileHasTheStepsOfTheReports) {
    auto wheel = EmulatedWheel{}.device();
    ASSERT_TRUE(wheel.open());
    const DeviceProfile profile = wheel.profile(500.0);
    EXPECT_EQ(profile.period_s, 2e-3);
    EXPECT_DOUBLE_EQ(profile.encoder_step, EmulatedWheel::half_range / 30000.0);
    EXPECT_DOUBLE_EQ(profile.force_step, 1e-3);
    EXPECT_EQ(profile.force_limit, 4.0);
    EXPECT_DOUBLE_EQ((*wheel.spring_steps())[0], 2e-3);
    EXPECT_DOUBLE_EQ((*wheel.spring_steps())[1], EmulatedWheel::half_range / 10000.0);
}

/// Fault of a wheel or of its node, and what must follow.
struct WheelFault {
    std::string name;
    std::function<void(EmulatedWheel&)> begin;
    std::string refusal;  ///< part of the sentence if the fault is there on opening; empty: the wheel opens
    bool ends = true;     ///< true if the run must end
    int lasts = 1000;     ///< ticks after which the fault is over
};

std::vector<WheelFault> wheel_faults() {
    using E = EmulatedWheel;
    return {
        {"gone", [](E& e) { e.gone = true; }, "does not take a report: plug it in"},
        {"refuses reports", [](E& e) { e.refuses = true; }, "does not take a report"},
        {"refuses one report", [](E& e) { e.refuses = true; }, "does not take a report", true, 1},
        {"busy", [](E& e) { e.busy = true; }, "does not take a report"},
        {"busy for one tick", [](E& e) { e.busy = true; }, "does not take a report", false, 1},
        {"busy for five ticks", [](E& e) { e.busy = true; }, "does not take a report", false, 5},
        {"short reports", [](E& e) { e.size = 3; }, "differ from its descriptor"},
        {"one short report", [](E& e) { e.size = 3; }, "differ from", false, 1},
        {"long reports", [](E& e) { e.size = 5; }, "differ from its descriptor"},
        {"empty reports", [](E& e) { e.size = 0; }, "differ from its descriptor"},
        {"reports with another number", [](E& e) { e.number = 8; }, "differ from its descriptor"},
        {"one report with another number", [](E& e) { e.number = 8; }, "differ from", false, 1},
        {"reports with the number of the state", [](E& e) { e.number = 9; }, "differ from its descriptor"},
        {"position outside of its range", [](E& e) { e.end_code = 65000; }, "differ from its descriptor"},
        {"one position outside of its range", [](E& e) { e.end_code = 65000; }, "differ", false, 1},
        {"lower end", [](E& e) { e.end_code = 0; }, "at the end of its axis: turn the wheel"},
        {"upper end", [](E& e) { e.end_code = E::axis_top; }, "at the end of its axis: turn the wheel"},
        {"upper end for one tick", [](E& e) { e.end_code = E::axis_top; }, "at the end of", true, 1},
        {"no reports", [](E& e) { e.silent = true; }, "sends no position: turn the wheel"},
        {"no reports for five ticks", [](E& e) { e.silent = true; }, "sends no position", false, 5},
        {"late reports", [](E& e) { e.late = true; }, "", false},
        {"one late report", [](E& e) { e.late = true; }, "", false, 1},
        {"repeated reports", [](E& e) { e.copies = 2; }, "", false},
        {"many reports", [](E& e) { e.copies = 60; }, "", false},
        {"jump", [](E& e) { e.jump = 0.5; }, ""},
        {"jump back", [](E& e) { e.jump = -0.5; }, ""},
        {"shaking",
         [](E& e) {
             e.jump = 0.2;
             e.shakes = true;
         },
         ""},
        {"paused", [](E& e) { e.reports_state = e.paused = true; }, ""},
        {"motor disabled", [](E& e) { e.reports_state = e.reports_disabled = true; }, ""},
        {"state without a fault", [](E& e) { e.reports_state = true; }, "", false},
        {"reset by another program",
         [](E& e) {
             e.enabled = false;
             e.effects.clear();
             e.reports_state = e.reports_disabled = true;
         },
         ""},
    };
}

/// What happened in a run with a fault.
struct WheelOutcome {
    std::string refusal;
    bool ended = false;
    double torque_after = 0.0;  ///< torque of the wheel one watchdog after the end [N*m]
};

/// Renders a wall for 120 ticks, as `run_loop` does, with a fault from tick `begin` on; 0: before opening.
WheelOutcome run_wheel_with(const WheelFault& fault, int begin) {
    EmulatedWheel emulated;
    emulated.watchdog_s = 0.005;
    if (begin == 0) {
        fault.begin(emulated);
        emulated.waiting.clear();
        emulated.step();
    }
    auto wheel = emulated.device();
    WheelOutcome run;
    run.refusal = wheel.open().reason;
    EmulatedWheel& node = wheel.node();
    Controller<WheelDevice<EmulatedWheel>> controller{
        wheel, Direct{test::Spring{10.0}},
        Guards{.reading = ReadingGuard{{.largest_step = 0.03,
                                        .frozen_step = 1e-5,
                                        .frozen_samples = 10,
                                        .longest_delay = no_value}},
               .limit = {3.5}}};
    (void)controller.start();
    int bad = 0;
    for (int tick = 1; tick <= 120 && !run.ended; ++tick) {
        if (tick == begin) {
            fault.begin(node);
        }
        if (begin > 0 && tick == begin + fault.lasts) {
            EmulatedWheel healthy;
            healthy.watchdog_s = node.watchdog_s;
            healthy.enabled = node.enabled;
            healthy.effects = node.effects;
            healthy.ticks = node.ticks;
            healthy.waiting = node.waiting;
            node = healthy;
        }
        node.step();
        const Tick now = controller.tick();
        bad = sends_force(now.status) ? 0 : bad + 1;
        run.ended = is_final(now.status) || bad > 5;
    }
    (void)controller.stop();
    std::this_thread::sleep_for(std::chrono::milliseconds{6});
    run.torque_after = node.torque();
    return run;
}

TEST(WheelDevice, EveryFaultEndsInZeroForceWithinOneWatchdogOrIsTolerated) {
    int count = 0;
    for (const WheelFault& fault : wheel_faults()) {
        for (const int begin : {0, 7, 60}) {
            if (begin == 0 && (fault.lasts < 1000 || fault.refusal.empty())) {
                continue;
            }
            SCOPED_TRACE(fault.name + " at " + std::to_string(begin));
            const WheelOutcome run = run_wheel_with(fault, begin);
            ++count;
            EXPECT_EQ(run.torque_after, 0.0);
            if (begin == 0) {
                EXPECT_NE(run.refusal.find(fault.refusal), std::string::npos) << run.refusal;
                EXPECT_TRUE(run.refusal.starts_with("device on /dev/hidraw0 ")) << run.refusal;
            } else {
                EXPECT_EQ(run.refusal, "");
                EXPECT_EQ(run.ended, fault.ends);
            }
        }
    }
    EXPECT_GE(count, 60);
}

TEST(WheelDevice, AWheelThatCannotStoreItsEffectsIsRefusedAndReset) {
    struct Defect {
        std::function<void(EmulatedWheel&)> change;
        const char* sentence;
    };
    for (const Defect& defect :
         {Defect{[](auto& e) { e.refuses_effects = true; }, "refuses to create a constant force"},
          Defect{[](auto& e) { e.full = true; }, "has no memory for a constant force: end the programs"},
          Defect{[](auto& e) { e.load_error = true; }, "reports an error when it creates a constant force"},
          Defect{[](auto& e) { e.never_loads = true; }, "does not finish creating a constant force"},
          Defect{[](auto& e) { e.no_load = true; }, "does not say where it stored a constant force"},
          Defect{[](auto& e) { e.wrong_load = true; }, "does not say where it stored a constant force"},
          Defect{[](auto& e) { e.wrong_block = true; }, "in block 99, must be 1 to 14"},
          Defect{[](auto& e) { e.one_block = true; }, "stores two effects in the same block"},
          Defect{[](auto& e) { e.open_failure = "no node"; }, "no node"},
          Defect{[](auto& e) { e.descriptor_bytes = EmulatedWheel::whole_descriptor(false); },
                 "has no spring effect: leave out the stiffness"},
          Defect{[](auto& e) { e.descriptor_bytes = EmulatedWheel::whole_descriptor(true, false); },
                 "no constant forces in both directions"},
          Defect{[](auto& e) { e.watchdog_s = 5e-4; }, "duration in steps of 0.001 s"}}) {
        EmulatedWheel emulated;
        defect.change(emulated);
        auto wheel = emulated.device();
        const std::string reason = wheel.open().reason;
        EXPECT_NE(reason.find(defect.sentence), std::string::npos) << reason;
        EXPECT_FALSE(wheel.node().enabled);
        EXPECT_EQ(wheel.exchange({2.0}).status, Status::Fault);
        EXPECT_EQ(wheel.node().torque(), 0.0);
    }
}

TEST(WheelDevice, ACutDescriptorIsRefusedAtEveryLength) {
    const std::vector<std::uint8_t> whole = EmulatedWheel::whole_descriptor();
    for (std::size_t length = 0; length < whole.size(); ++length) {
        EmulatedWheel emulated;
        emulated.descriptor_bytes.assign(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(length));
        auto wheel = emulated.device();
        const std::string reason = wheel.open().reason;
        EXPECT_NE(reason.find("report descriptor"), std::string::npos) << length << ": " << reason;
        EXPECT_TRUE(wheel.node().sent.empty());
    }
}

TEST(HidNode, AFileThatIsNotAHidNodeIsRefusedWithTheCure) {
    hid::Node node;
    EXPECT_NE(node.open("/nowhere/hidraw0").reason.find("'ls /dev/hidraw*' lists"), std::string::npos);
    EXPECT_NE(node.open("/dev/null").reason.find("choose the hidraw node of a wheel"), std::string::npos);
    const std::array<std::uint8_t, 2> report{1, 2};
    EXPECT_EQ(node.write(report), hid::Written::Gone);
    std::array<std::uint8_t, 8> buffer{};
    std::size_t size = 0;
    EXPECT_EQ(node.receive(buffer, size, monotonic_now() + 1000), hid::Received::Gone);
}

}  // namespace
}  // namespace palpate
