// SPDX-License-Identifier: Apache-2.0
#include "palpate/device/can_motor.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "emulated_can_motor.hpp"
#include "palpate/device/wheel_device.hpp"
#include "palpate/rendering/direct.hpp"
#include "palpate/run/controller.hpp"
#include "palpate/run/transports.hpp"
#include "support.hpp"

namespace palpate {
namespace {

using test::EmulatedMitDrive;
using test::EmulatedMoteus;

constexpr double infinite = std::numeric_limits<double>::infinity();

TEST(MitWire, ALineIsExactAtItsPositionToHalfAStepOfTheTorque) {
    test::Random random{1};
    for (const mit::Preset& preset : mit::presets) {
        const mit::Ranges& ranges = preset.ranges;
        auto motor = EmulatedMitDrive{preset}.motor();
        ASSERT_TRUE(motor.open()) << preset.name;
        for (int k = 0; k < test::cases(1000); ++k) {
            const double at = test::uniform(random, -ranges.position, ranges.position);
            const double stiffness = test::uniform(random, 0.0, 0.2 * ranges.stiffness);
            const double force = 0.8 * test::uniform(random, -ranges.torque, ranges.torque);
            ASSERT_EQ(motor.exchange({force, at, stiffness}).status, Status::Ok);
            motor.bus().position = at;
            const double half = 0.5 * mit::step_of(-ranges.torque, ranges.torque, mit::field_bits);
            EXPECT_NEAR(motor.bus().torque(), -force, 1.001 * half);
            EXPECT_NEAR(motor.bus().stiffness, stiffness,
                        0.501 * mit::step_of(0.0, ranges.stiffness, mit::field_bits));
            motor.bus().position = 0.3;
        }
    }
}

TEST(MoteusWire, ALineIsExactAtItsPositionToSinglePrecision) {
    test::Random random{2};
    auto motor = EmulatedMoteus{}.motor();
    ASSERT_TRUE(motor.open());
    for (int k = 0; k < test::cases(1000); ++k) {
        const double at = test::uniform(random, -50.0, 50.0);
        const double stiffness = test::uniform(random, 0.0, 30.0);
        const double force = test::uniform(random, -4.9, 4.9);
        ASSERT_EQ(motor.exchange({force, at, stiffness}).status, Status::Ok);
        motor.bus().position = at;
        EXPECT_NEAR(motor.bus().torque(), -force, 1e-6);
        EXPECT_NEAR(motor.bus().stiffness, stiffness, 1e-5);
        EXPECT_NEAR(motor.bus().timeout_s, 0.02, 1e-8);
        EXPECT_EQ(motor.bus().values[0x2B], 0.0);
        EXPECT_EQ(motor.bus().values[0x24], 0.0);
        EXPECT_EQ(motor.bus().values[0x25], 5.0);
        motor.bus().position = 0.3;
    }
}

TEST(MitWire, APositionCommandHasTheDampingOfTheDriveAndZeroForceHasNone) {
    EmulatedMitDrive::Motor motor{{.damping = 0.8}, EmulatedMitDrive{}};
    ASSERT_TRUE(motor.open());
    const double half = 0.501 * mit::step_of(0.0, mit::presets.front().ranges.damping, mit::field_bits);
    EXPECT_EQ(motor.exchange({0.0, 0.31, 300.0}).status, Status::Ok);
    EXPECT_NEAR(motor.bus().damping, 0.8, half);
    EXPECT_NEAR(motor.bus().target, 0.31, 2e-4);
    EXPECT_NEAR(motor.bus().stiffness, 300.0, 0.07);
    (void)motor.exchange({});
    EXPECT_EQ(motor.bus().damping, 0.0);
    auto line = EmulatedMitDrive{}.motor();
    ASSERT_TRUE(line.open());
    (void)line.exchange({0.0, 0.31, 300.0});
    EXPECT_EQ(line.bus().damping, 0.0);
}

TEST(MoteusWire, APositionCommandUsesTheDampingOfTheControllerAndZeroForceDoesNot) {
    EmulatedMoteus::Motor motor{{.kp = EmulatedMoteus::kp, .torque_limit = 5.0, .damping = 1.0},
                                EmulatedMoteus{}};
    ASSERT_TRUE(motor.open());
    (void)motor.exchange({0.0, 0.31, 3.0});
    EXPECT_EQ(motor.bus().values[0x24], 1.0);
    (void)motor.exchange({});
    EXPECT_EQ(motor.bus().values[0x24], 0.0);
}

TEST(MoteusWire, AnAnswerOfAnyBytesIsReadWithoutAnError) {
    test::Random random{3};
    std::vector<std::uint8_t> bytes(64);
    for (int k = 0; k < test::cases(20'000); ++k) {
        for (std::uint8_t& byte : bytes) {
            byte = static_cast<std::uint8_t>(test::uniform(random, 0.0, 256.0));
        }
        bytes[0] = std::array<std::uint8_t, 4>{0x21, 0x2F, 0x2C, 0x23}[static_cast<std::size_t>(k % 4)];
        const auto size = static_cast<std::size_t>(test::uniform(random, 0.0, 64.0));
        const moteus::Values values = moteus::values_of({bytes.data(), size});
        EXPECT_TRUE(!values.complete() || (std::isfinite(values.position) && std::isfinite(values.torque)));
    }
}

template <class Emulated>
class CanMotorOf : public testing::Test {};
using Motors = testing::Types<EmulatedMitDrive, EmulatedMoteus>;
TYPED_TEST_SUITE(CanMotorOf, Motors);

TYPED_TEST(CanMotorOf, APositiveForcePushesToSmallerPositionsAndAPositiveStiffnessIsASpring) {
    auto motor = TypeParam{}.motor();
    ASSERT_TRUE(motor.open());
    (void)motor.exchange({1.0, 0.3, 50.0});
    motor.bus().position = 0.3;
    EXPECT_NEAR(motor.bus().torque(), -1.0, 3e-3);
    motor.bus().position = 0.31;  // further into the object: a larger force against the motion
    EXPECT_NEAR(motor.bus().torque(), -1.5, 0.01);
    EXPECT_NEAR(motor.exchange({1.0, 0.3, 50.0}).applied, 1.5, 0.02);
}

TYPED_TEST(CanMotorOf, ALineOutsideOfTheFieldsIsReportedAndNumbersThatAreNotFiniteMakeNoTorque) {
    auto motor = TypeParam{}.motor();
    ASSERT_TRUE(motor.open());
    for (const Command& command : {Command{11.0}, Command{1.0, 0.0, -1.0}, Command{-11.0, 0.3, 0.0}}) {
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

TEST(MitDevice, APositionAtAnEndOfItsFieldIsAFaultAndOnlyZeroTorqueFollows) {
    for (const int code : {0, 0xFFFF}) {
        auto motor = EmulatedMitDrive{}.motor();
        ASSERT_TRUE(motor.open());
        motor.bus().end_code = code;
        EXPECT_EQ(motor.exchange({2.0}).status, Status::Fault);
        motor.bus().end_code = -1;
        (void)motor.exchange({2.0});
        EXPECT_NEAR(motor.bus().torque(), 0.0, 2.5e-3);
    }
}

TEST(MitDevice, ALineOutsideOfItsFieldsIsReported) {
    auto motor = EmulatedMitDrive{}.motor();
    ASSERT_TRUE(motor.open());
    for (const Command& command : {Command{1.0, 0.0, 501.0}, Command{1.0, 13.0, 1.0}}) {
        EXPECT_EQ(motor.exchange(command).status, Status::Limited);
    }
    EXPECT_EQ(motor.bus().registers[9], 400U);  // 20 ms in units of 50 us
}

TYPED_TEST(CanMotorOf, ReadsPositionVelocityTorqueDelayAndStatus) {
    auto motor = TypeParam{}.motor();
    ASSERT_TRUE(motor.open());
    const Reading reading = motor.exchange({0.5});
    EXPECT_NEAR(reading.position, 0.3, 2e-4);
    EXPECT_NEAR(reading.velocity, 0.0, 8e-3);
    EXPECT_NEAR(reading.applied, 0.5, 6e-3);
    EXPECT_GT(reading.delay, 0.0);
    EXPECT_TRUE(std::isnan(reading.measured));
    EXPECT_EQ(motor.exchange({}).sequence, reading.sequence + 1);
    motor.bus().silent = true;
    EXPECT_EQ(motor.exchange({}).status, Status::Timeout);
    motor.bus().silent = false;
    motor.bus().full = true;
    EXPECT_EQ(motor.exchange({}).status, Status::Lost);
    motor.bus().full = false;
    EXPECT_EQ(motor.exchange({}).status, Status::Ok);
    EXPECT_EQ(motor.close(), ZeroForce::Confirmed);
    EXPECT_FALSE(motor.bus().enabled);
    EXPECT_EQ(motor.exchange({1.0}).status, Status::Fault);
}

TYPED_TEST(CanMotorOf, ThePauseBeforeTheFirstTickIsNotADelayOfAForce) {
    auto motor = TypeParam{}.motor();
    ASSERT_TRUE(motor.open());
    std::this_thread::sleep_for(std::chrono::milliseconds{20});
    EXPECT_LT(motor.exchange({}).delay, 0.01);
    std::this_thread::sleep_for(std::chrono::milliseconds{20});
    EXPECT_GT(motor.exchange({}).delay, 0.02);
}

TYPED_TEST(CanMotorOf, LateAnswersAreCountedAndAreNotASecondMotor) {
    auto motor = TypeParam{}.motor();
    ASSERT_TRUE(motor.open());
    for (int k = 0; k < 8; ++k) {
        motor.bus().late = true;
        EXPECT_EQ(motor.exchange({}).status, Status::Timeout);
    }
    motor.bus().late = false;
    EXPECT_EQ(motor.exchange({}).status, Status::Ok);
    EXPECT_EQ(motor.exchange({}).status, Status::Ok);
    EXPECT_EQ(motor.health().late, 8U);
    EXPECT_EQ(motor.health().repeated, 0U);
    motor.bus().twice = true;
    for (int k = 0; k < 3; ++k) {
        EXPECT_EQ(motor.exchange({}).status, Status::Ok);
    }
    EXPECT_EQ(motor.exchange({}).status, Status::Fault);
}

TYPED_TEST(CanMotorOf, ADeviceThatMakesNoForceIsNeverEnabled) {
    auto settings = TypeParam{}.motor().settings();
    settings.makes_force = false;
    typename TypeParam::Motor motor{settings, TypeParam{}};
    ASSERT_TRUE(motor.open());
    for (int k = 0; k < 10; ++k) {
        EXPECT_EQ(motor.exchange({2.0, 0.1, 5.0}).status, Status::Ok);
        EXPECT_FALSE(motor.bus().enabled);
    }
}

/// Fault of a motor or of its bus, and what must follow.
template <class Emulated>
struct MotorFault {
    std::string name;
    std::function<void(Emulated&)> begin;
    std::string refusal;  ///< part of the sentence if the fault is there on opening; empty: the motor opens
    bool ends = true;     ///< true if the run must end
    int lasts = 1000;     ///< ticks after which the fault is over
};

template <class E>
std::vector<MotorFault<E>> faults_of_the_bus() {
    return {
        {"silent", [](E& e) { e.silent = true; }, "does not answer: check its number"},
        {"silent for one tick", [](E& e) { e.silent = true; }, "does not answer", false, 1},
        {"silent for five ticks", [](E& e) { e.silent = true; }, "does not answer", false, 5},
        {"commands lost", [](E& e) { e.lose_commands = true; }, "does not answer"},
        {"one command lost", [](E& e) { e.lose_commands = true; }, "does not answer", false, 1},
        {"second motor", [](E& e) { e.twice = true; }, "two drives that answer to the same number"},
        {"one frame twice", [](E& e) { e.twice = true; }, "two drives", false, 1},
        {"bus off", [](E& e) { e.off = true; }, "the bus is off"},
        {"interface down", [](E& e) { e.down = true; }, "does not answer"},
        {"queue full", [](E& e) { e.full = true; }, "does not answer"},
        {"queue full for one tick", [](E& e) { e.full = true; }, "does not answer", false, 1},
        {"late answers", [](E& e) { e.late = true; }, ""},
        {"one late answer", [](E& e) { e.late = true; }, "", false, 1},
        {"wrong byte order", [](E& e) { e.wrong_order = true; }, ""},
        {"short frames", [](E& e) { e.length = 6; }, "does not answer"},
        {"frames of one byte", [](E& e) { e.length = 1; }, "does not answer"},
        {"empty frames", [](E& e) { e.length = 0; }, "does not answer"},
        {"one short frame", [](E& e) { e.length = 3; }, "does not answer", false, 1},
        {"other number", [](E& e) { e.answer_number = 2; }, "does not answer"},
        {"remote frames", [](E& e) { e.remote = true; }, "does not answer"},
        {"jump", [](E& e) { e.jump = 4.0; }, ""},
        {"jump back", [](E& e) { e.jump = -4.0; }, ""},
        {"shaking",
         [](E& e) {
             e.jump = 0.5;
             e.shakes = true;
         },
         ""},
        {"disabled",
         [](E& e) {
             e.ignores_enable = true;
             e.enabled = false;
         },
         "reports the fault 0"},
    };
}

std::vector<MotorFault<EmulatedMitDrive>> faults_of(const EmulatedMitDrive& drive) {
    using E = EmulatedMitDrive;
    auto all = faults_of_the_bus<E>();
    all.push_back({"extended frames", [](E& e) { e.extended = true; }, "does not answer"});
    all.push_back({"lower end", [](E& e) { e.end_code = 0; }, "at the end of its range"});
    all.push_back({"upper end", [](E& e) { e.end_code = 0xFFFF; }, "at the end of its range"});
    for (int state = 8; state <= 14; ++state) {
        all.push_back({"fault " + std::to_string(state), [state](E& e) { e.fault = state; },
                       "reports the fault " + std::to_string(state)});
    }
    if (drive.preset.maker != mit::Maker::Damiao) {  // does not report that it is disabled
        std::erase_if(all, [](const auto& fault) { return fault.name == "disabled"; });
    }
    return all;
}

std::vector<MotorFault<EmulatedMoteus>> faults_of(const EmulatedMoteus& /*controller*/) {
    using E = EmulatedMoteus;
    auto all = faults_of_the_bus<E>();
    for (const int fault : {32, 33, 34, 35, 36, 37, 38, 39}) {
        all.push_back({"fault " + std::to_string(fault), [fault](E& e) { e.fault = fault; },
                       "reports the fault -" + std::to_string(fault)});
    }
    return all;
}

/// What happened in a run with a fault.
struct Outcome {
    std::string refusal;
    bool ended = false;
    double torque_after = 0.0;   ///< torque of the motor one watchdog after the end [N*m]
    double most_in_fault = 0.0;  ///< largest torque from one watchdog after the begin of the fault on [N*m]
};

/// Renders a wall for 120 ticks, as `run_loop` does, with a fault from tick `begin` on; 0: before opening.
template <class E>
Outcome run_with(const MotorFault<E>& fault, int begin, const E& healthy) {
    E emulated = healthy;
    if (begin == 0) {
        fault.begin(emulated);
    }
    typename E::Motor motor = emulated.motor();
    Outcome run;
    run.refusal = motor.open().reason;
    E& bus = motor.bus();
    Controller<typename E::Motor> controller{
        motor, Direct{test::Spring{10.0}},
        Guards{.reading = ReadingGuard{{.largest_step = 0.03, .longest_delay = infinite}}, .limit = {4.5}}};
    (void)controller.start();
    int bad = 0;
    for (int tick = 1; tick <= 120 && !run.ended; ++tick) {
        if (tick == begin) {
            fault.begin(bus);
        }
        if (begin > 0 && tick == begin + fault.lasts) {
            const E now = bus;
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
        if (begin > 0 && fault.ends && tick > begin + E::watchdog_ticks) {
            run.most_in_fault = std::max(run.most_in_fault, std::abs(bus.torque()));
        }
    }
    (void)controller.stop();
    for (int k = 0; k <= E::watchdog_ticks; ++k) {
        bus.step();
    }
    run.torque_after = bus.torque();
    return run;
}

template <class E>
int check_faults(const E& healthy) {
    int count = 0;
    for (const MotorFault<E>& fault : faults_of(healthy)) {
        for (const int begin : {0, 7, 60}) {
            if (begin == 0 && (fault.lasts < 1000 || fault.refusal.empty())) {
                continue;
            }
            SCOPED_TRACE(fault.name + " at " + std::to_string(begin));
            const Outcome run = run_with(fault, begin, healthy);
            ++count;
            EXPECT_EQ(run.torque_after, 0.0);
            EXPECT_LT(run.most_in_fault, 3e-3);
            if (begin == 0) {
                EXPECT_NE(run.refusal.find(fault.refusal), std::string::npos) << run.refusal;
                EXPECT_TRUE(run.refusal.starts_with("drive 1 on can0 ")) << run.refusal;
            } else {
                EXPECT_EQ(run.refusal, "");
                EXPECT_EQ(run.ended, fault.ends);
            }
        }
    }
    return count;
}

TEST(CanMotor, EveryFaultEndsInZeroTorqueWithinOneWatchdogOrIsTolerated) {
    EXPECT_GE(check_faults(EmulatedMitDrive{}), 60);
    EXPECT_GE(check_faults(EmulatedMitDrive{mit::presets[9]}), 60);  // CubeMars
    EXPECT_GE(check_faults(EmulatedMoteus{}), 60);
}

TEST(MitDevice, ADriveThatDiffersFromItsPresetIsRefused) {
    struct Difference {
        std::function<void(EmulatedMitDrive&)> change;
        const char* sentence;
    };
    const auto bits = [](float value) { return std::bit_cast<std::uint32_t>(value); };
    for (const Difference& difference :
         {Difference{[](auto& e) { e.registers[10] = 2; }, "set its register 10 (CTRL_MODE) to 1"},
          Difference{[&](auto& e) { e.registers[21] = bits(3.14F); }, "has PMAX = 3.14"},
          Difference{[&](auto& e) { e.registers[22] = bits(45.0F); }, "has VMAX = 45"},
          Difference{[&](auto& e) { e.registers[23] = bits(28.0F); }, "has TMAX = 28"},
          Difference{[](auto& e) { e.registers[21] = __builtin_bswap32(e.registers[21]); }, "has PMAX"},
          Difference{[](auto& e) { e.silent_registers = true; }, "is not in the MIT mode"},
          Difference{[](auto& e) { e.watchdog_refused = true; }, "does not accept its watchdog"},
          Difference{[](auto& e) { e.open_failure = "no bus"; }, "no bus"}}) {
        EmulatedMitDrive drive;
        difference.change(drive);
        auto motor = drive.motor();
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
    EXPECT_NE(bus.open("/nowhere/bus").reason.find("start the emulated device first"), std::string::npos);
    EXPECT_NE(bus.open("/" + std::string(200, 'x')).reason.find("use a shorter one"), std::string::npos);
    canfd_frame frame{};
    EXPECT_EQ(bus.send(frame), Sent::Down);
    EXPECT_FALSE(bus.receive(frame, monotonic_now() + 1000));
}

TEST(Transports, StateTheWaitsOfTheDevices) {
    for (const Transport& transport : transports) {
        if (transport.name == "mit") {
            EXPECT_EQ(transport.wait_s, 1e-9 * static_cast<double>(MitSettings{}.wait));
        } else if (transport.name == "moteus") {
            EXPECT_EQ(transport.wait_s, 1e-9 * static_cast<double>(MoteusSettings{}.wait));
        } else if (transport.name == "wheel") {
            EXPECT_EQ(transport.wait_s, 1e-9 * static_cast<double>(WheelSettings{}.wait));
        }
    }
    EXPECT_EQ(transport_forms(true),
              "simulated, usb[:SERIAL], mit:BUS:NUMBER:KIND, moteus:BUS:NUMBER:KP or "
              "wheel:NODE:DEGREES:TORQUE[:STIFFNESS]");
}

}  // namespace
}  // namespace palpate
