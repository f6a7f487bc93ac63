// SPDX-License-Identifier: Apache-2.0
#include "palpate/device/mit_device.hpp"

#include <sys/socket.h>

#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "emulated_mit_drive.hpp"
#include "palpate/rendering/direct.hpp"
#include "palpate/run/controller.hpp"
#include "support.hpp"

namespace palpate {
namespace {

using test::EmulatedMitDrive;
using Drive = MitDevice<EmulatedMitDrive>;

constexpr double infinite = std::numeric_limits<double>::infinity();

TEST(MitWire, ALineIsExactAtItsPositionToHalfAStepOfTheTorque) {
    test::Random random{1};
    for (const mit::Preset& preset : mit::presets) {
        const mit::Ranges& ranges = preset.ranges;
        EmulatedMitDrive drive{preset};
        Drive motor{{.preset = preset}, drive};
        ASSERT_TRUE(motor.open()) << preset.name;
        for (int k = 0; k < test::cases(1000); ++k) {
            const double at = test::uniform(random, -ranges.position, ranges.position);
            const double stiffness = test::uniform(random, 0.0, 0.2 * ranges.stiffness);
            const double force = 0.8 * test::uniform(random, -ranges.torque, ranges.torque);
            ASSERT_EQ(motor.exchange({force, at, stiffness}).status, Status::Ok);
            motor.bus().position = at;
            const double half = 0.5 * mit::step_of(-ranges.torque, ranges.torque, mit::field_bits);
            EXPECT_NEAR(motor.bus().torque(), -force, 1.001 * half);
            EXPECT_NEAR(motor.bus().kp, stiffness,
                        0.501 * mit::step_of(0.0, ranges.stiffness, mit::field_bits));
            motor.bus().position = 0.3;
        }
    }
}

TEST(MitWire, APositiveForcePushesToSmallerPositionsAndAPositiveStiffnessIsASpring) {
    Drive motor{{}, EmulatedMitDrive{}};
    ASSERT_TRUE(motor.open());
    (void)motor.exchange({1.0, 0.3, 50.0});
    motor.bus().position = 0.3;
    EXPECT_NEAR(motor.bus().torque(), -1.0, 3e-3);
    motor.bus().position = 0.31;  // further into the object: a larger force against the motion
    EXPECT_NEAR(motor.bus().torque(), -1.5, 0.01);
    EXPECT_NEAR(motor.exchange({1.0, 0.3, 50.0}).applied, 1.5, 0.02);
}

TEST(MitWire, ALineOutsideOfTheFieldsIsReportedAndNumbersThatAreNotFiniteMakeNoTorque) {
    Drive motor{{}, EmulatedMitDrive{}};
    ASSERT_TRUE(motor.open());
    for (const Command& command : {Command{11.0}, Command{1.0, 0.0, -1.0}, Command{1.0, 0.0, 501.0},
                                   Command{1.0, 13.0, 1.0}, Command{-11.0, 0.3, 0.0}}) {
        EXPECT_EQ(motor.exchange(command).status, Status::Limited);
        EXPECT_LE(std::abs(motor.bus().feed_forward), 10.0);
    }
    EXPECT_EQ(motor.exchange({1.0, 13.0, 0.0}).status, Status::Ok);  // the position has no effect
    for (const double value : {std::nan(""), infinite, -infinite}) {
        for (const Command& command : {Command{value}, Command{1.0, value}, Command{1.0, 0.3, value}}) {
            EXPECT_EQ(motor.exchange(command).status, Status::Limited);
            EXPECT_NEAR(motor.bus().torque(), 0.0, 2.5e-3);
        }
    }
}

TEST(MitDevice, ReadsPositionVelocityTorqueAndDelay) {
    Drive motor{{}, EmulatedMitDrive{}};
    ASSERT_TRUE(motor.open());
    EXPECT_EQ(motor.bus().registers[9], 400U);  // 20 ms in units of 50 us
    const Reading reading = motor.exchange({0.5});
    EXPECT_NEAR(reading.position, 0.3, 2e-4);
    EXPECT_NEAR(reading.velocity, 0.0, 8e-3);
    EXPECT_NEAR(reading.applied, 0.5, 6e-3);
    EXPECT_GT(reading.delay, 0.0);
    EXPECT_TRUE(std::isnan(reading.measured));
    EXPECT_EQ(motor.exchange({}).sequence, reading.sequence + 1);
    EXPECT_EQ(motor.close(), ZeroForce::Confirmed);
    EXPECT_FALSE(motor.bus().enabled);
    EXPECT_EQ(motor.exchange({1.0}).status, Status::Fault);
}

/// Fault of a drive or of its bus, and what must follow.
struct DriveFault {
    std::string name;
    std::function<void(EmulatedMitDrive&)> begin;
    std::string refusal;  ///< part of the sentence if the fault is there on opening; empty: the drive opens
    bool ends = true;     ///< true if the run must end
    int lasts = 1000;     ///< ticks after which the fault is over
};

const std::vector<DriveFault>& drive_faults() {
    using E = EmulatedMitDrive;
    static const std::vector<DriveFault> faults = [] {
        std::vector<DriveFault> all{
            {"silent", [](E& e) { e.silent = true; }, "does not answer: check its number"},
            {"silent for one tick", [](E& e) { e.silent = true; }, "does not answer", false, 1},
            {"silent for five ticks", [](E& e) { e.silent = true; }, "does not answer", false, 5},
            {"commands lost", [](E& e) { e.lose_commands = true; }, "does not answer"},
            {"one command lost", [](E& e) { e.lose_commands = true; }, "does not answer", false, 1},
            {"second drive", [](E& e) { e.twice = true; }, "two drives that answer to the same number"},
            {"one frame twice", [](E& e) { e.twice = true; }, "two drives", false, 1},
            {"bus off", [](E& e) { e.off = true; }, "the bus is off"},
            {"interface down", [](E& e) { e.down = true; }, "does not answer"},
            {"queue full", [](E& e) { e.full = true; }, "does not answer"},
            {"queue full for one tick", [](E& e) { e.full = true; }, "does not answer", false, 1},
            {"late answers", [](E& e) { e.late = true; }, ""},
            {"one late answer", [](E& e) { e.late = true; }, "", false, 1},
            {"wrong byte order", [](E& e) { e.little_endian = true; }, ""},
            {"short frames", [](E& e) { e.length = 6; }, "does not answer"},
            {"empty frames", [](E& e) { e.length = 0; }, "does not answer"},
            {"one short frame", [](E& e) { e.length = 3; }, "does not answer", false, 1},
            {"other number", [](E& e) { e.answer_number = 2; }, "does not answer"},
            {"extended frames", [](E& e) { e.extended = true; }, "does not answer"},
            {"remote frames", [](E& e) { e.remote = true; }, "does not answer"},
            {"lower end", [](E& e) { e.change_position = [](auto& p) { p = 0; }; }, "at the end of its range"},
            {"upper end", [](E& e) { e.change_position = [](auto& p) { p = 0xFFFF; }; }, "at the end of its"},
            {"jump", [](E& e) { e.change_position = [](auto& p) { p ^= 0x4000U; }; }, ""},
            {"jitter", [](E& e) { e.change_position = [&e](auto& p) { p ^= e.ticks % 2 != 0 ? 0x1000U : 0U; }; },
             ""},
            {"disabled",
             [](E& e) {
                 e.ignores_enable = true;
                 e.enabled = false;
             },
             "reports the fault 0"},
        };
        for (int state = 8; state <= 14; ++state) {
            all.push_back({"fault " + std::to_string(state), [state](E& e) { e.fault = state; },
                           "reports the fault " + std::to_string(state)});
        }
        return all;
    }();
    return faults;
}

/// Renders a wall on a drive for 120 ticks, as `run_loop` does, with a fault from tick `begin` on.
struct Outcome {
    std::string refusal;
    bool ended = false;
    double torque_after = 0.0;  ///< torque of the drive one watchdog after the end [N*m]
    double most_in_fault = 0.0;  ///< largest torque from one watchdog after the begin of the fault on [N*m]
};

Outcome run_with(const DriveFault& fault, int begin, const mit::Preset& preset) {
    EmulatedMitDrive drive{preset};
    const EmulatedMitDrive healthy = drive;
    if (begin == 0) {
        fault.begin(drive);
    }
    Drive motor{{.preset = preset}, drive};
    Outcome run;
    run.refusal = motor.open().reason;
    EmulatedMitDrive& bus = motor.bus();
    if (begin == 0 && fault.name == "jitter") {
        fault.begin(bus);
    }
    constexpr double period_s = 1e-3;
    Controller<Drive> controller{
        motor, Direct{test::Spring{20.0}},
        Guards{.reading = ReadingGuard{{.largest_step = 30.0 * period_s, .longest_delay = infinite}},
               .limit = {5.0}}};
    (void)controller.start();
    int bad = 0;
    for (int tick = 1; tick <= 120 && !run.ended; ++tick) {
        if (tick == begin) {
            fault.begin(bus);
        }
        if (begin > 0 && tick == begin + fault.lasts) {
            const EmulatedMitDrive now = bus;
            bus = healthy;
            bus.enabled = now.enabled;
            bus.ticks = now.ticks;
            bus.waiting = now.waiting;
            bus.delayed = now.delayed;
        }
        bus.step();
        const Tick now = controller.tick();
        bad = sends_force(now.status) ? 0 : bad + 1;
        run.ended = is_final(now.status) || bad > 5;
        if (begin > 0 && fault.ends && tick > begin + EmulatedMitDrive::watchdog_ticks) {
            run.most_in_fault = std::max(run.most_in_fault, std::abs(bus.torque()));
        }
    }
    (void)controller.stop();
    for (int k = 0; k <= EmulatedMitDrive::watchdog_ticks; ++k) {
        bus.step();
    }
    run.torque_after = bus.torque();
    return run;
}

TEST(MitDevice, EveryFaultEndsInZeroTorqueWithinOneWatchdogOrIsTolerated) {
    int count = 0;
    for (const mit::Preset& preset : {mit::presets.front(), mit::presets[9]}) {
        for (const DriveFault& fault : drive_faults()) {
            const bool only_damiao = fault.name == "disabled";
            if (only_damiao && preset.maker != mit::Maker::Damiao) {
                continue;  // other makers do not report it
            }
            for (const int begin : {0, 7, 60}) {
                if (begin == 0 && (fault.lasts < 1000 || fault.refusal.empty())) {
                    continue;
                }
                SCOPED_TRACE(std::string(preset.name) + ", " + fault.name + " at " + std::to_string(begin));
                const Outcome run = run_with(fault, begin, preset);
                ++count;
                EXPECT_EQ(run.torque_after, 0.0);
                EXPECT_LT(run.most_in_fault, 3e-3);
                if (begin == 0) {
                    EXPECT_NE(run.refusal.find(fault.refusal), std::string::npos) << run.refusal;
                    EXPECT_TRUE(run.refusal.starts_with("drive 1 on can0 "));
                } else {
                    EXPECT_EQ(run.refusal, "");
                    EXPECT_EQ(run.ended, fault.ends);
                }
            }
        }
    }
    EXPECT_GE(count, 120);  // at least 60 for each maker
}

TEST(MitDevice, ADriveThatDiffersFromItsPresetIsRefused) {
    struct Difference {
        std::function<void(EmulatedMitDrive&)> change;
        const char* sentence;
    };
    for (const Difference& difference :
         {Difference{[](auto& e) { e.registers[10] = 2; }, "set its register 10 (CTRL_MODE) to 1"},
          Difference{[](auto& e) { e.registers[21] = std::bit_cast<std::uint32_t>(3.14F); }, "has PMAX = 3.14"},
          Difference{[](auto& e) { e.registers[22] = std::bit_cast<std::uint32_t>(45.0F); }, "has VMAX = 45"},
          Difference{[](auto& e) { e.registers[23] = std::bit_cast<std::uint32_t>(28.0F); }, "has TMAX = 28"},
          Difference{[](auto& e) { e.registers[21] = __builtin_bswap32(e.registers[21]); }, "has PMAX"},
          Difference{[](auto& e) { e.silent_registers = true; }, "is not in the MIT mode"},
          Difference{[](auto& e) { e.watchdog_refused = true; }, "does not accept its watchdog"},
          Difference{[](auto& e) { e.open_failure = "no bus"; }, "no bus"}}) {
        EmulatedMitDrive drive;
        difference.change(drive);
        Drive motor{{}, drive};
        const std::string reason = motor.open().reason;
        EXPECT_NE(reason.find(difference.sentence), std::string::npos) << reason;
        EXPECT_FALSE(motor.bus().enabled);
        EXPECT_EQ(motor.exchange({5.0}).status, Status::Fault);
        EXPECT_EQ(motor.bus().torque(), 0.0);
    }
}

TEST(CanBus, AnInterfaceOrASocketThatDoesNotExistIsRefusedWithTheCure) {
    CanBus bus;
    EXPECT_NE(bus.open("can99").reason.find("there is no CAN interface can99: 'ip link'"), std::string::npos);
    EXPECT_NE(bus.open("/nowhere/bus").reason.find("start the emulated drive first"), std::string::npos);
    EXPECT_NE(bus.open("/" + std::string(200, 'x')).reason.find("use a shorter one"), std::string::npos);
    can_frame frame{};
    EXPECT_EQ(bus.send(frame), Sent::Down);
    EXPECT_FALSE(bus.receive(frame, monotonic_now() + 1000));
}

}  // namespace
}  // namespace palpate
