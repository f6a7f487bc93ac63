// SPDX-License-Identifier: Apache-2.0
#include "palpate/run/admittance_controller.hpp"

#include <atomic>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "admittance/displays.hpp"
#include "palpate/rendering/implicit.hpp"
#include "palpate/run/loop.hpp"
#include "palpate/simulation/faulty_device.hpp"
#include "palpate/simulation/simulated_display.hpp"

namespace palpate::admittance_tests {
namespace {

constexpr double period = 1e-3;
constexpr double servo_stiffness = 50.0;
constexpr double stiffness = 1000.0;
constexpr double start = 0.05;

/// Pedal whose force of the hand is set by the test.
class Pedal {
  public:
    Opened open() { return {}; }
    [[nodiscard]] Reading exchange(const Command& command) noexcept {
        commands.push_back(command);
        if (command.stiffness != 0.0) {
            next.position = command.position;
        }
        ++next.sequence;
        Reading reading = next;
        std::exchange(fault, [](Reading&) {})(reading);
        return reading;
    }
    ZeroForce close() noexcept { return ZeroForce::Held; }

    Reading next{.position = start, .measured = 0.0};
    std::vector<Command> commands;
    std::function<void(Reading&)> fault = [](Reading&) {};  ///< changes the next reading
};

DeviceProfile profile() {
    DeviceProfile device;
    device.position_unit = "m";
    device.period_s = period;
    device.force_limit = 100.0;
    device.admittance = AdmittanceDisplay{.hand_stiffness = 2e3};
    return device;
}

Admittance object() {
    return {Implicit{bench::LinearSpring{stiffness}, {1.0, 50.0}, {0.0, 0.0}, period}, profile()};
}

AdmittanceController<Pedal> controller_of(Pedal& pedal) {
    return {pedal, object(), Guards{}, 100.0, servo_stiffness};
}

TEST(AdmittanceController, StartDoesNotMoveTheHandleAndTheObjectStartsThere) {
    Pedal pedal;
    auto controller = controller_of(pedal);
    EXPECT_EQ(controller.start(), Status::Ok);
    EXPECT_EQ(pedal.commands.front().stiffness, 0.0);
    pedal.next.measured = stiffness * start;
    (void)controller.tick();
    pedal.next.measured = stiffness * start;
    const Tick tick = controller.tick();
    EXPECT_EQ(tick.status, Status::Ok);
    EXPECT_EQ(tick.command.stiffness, servo_stiffness);
    EXPECT_EQ(tick.command.force, 0.0);
    EXPECT_NEAR(tick.command.position, start, 1e-3);
}

TEST(AdmittanceController, ForceOfTheMotorIsUsedWithoutATransducer) {
    Pedal with;
    Pedal without;
    auto measured = controller_of(with);
    auto of_motor = controller_of(without);
    with.next.measured = 40.0;
    without.next.measured = std::numeric_limits<double>::quiet_NaN();
    without.next.applied = 40.0;
    (void)measured.start();
    (void)of_motor.start();
    EXPECT_EQ(measured.tick().command.position, of_motor.tick().command.position);
    EXPECT_NE(with.commands.back().position, start);
}

TEST(AdmittanceController, EveryWrongReadingHoldsTheLastCommand) {
    const auto wrong = [](auto change, Status expected) {
        Pedal pedal;
        auto controller = controller_of(pedal);
        (void)controller.start();
        for (int k = 0; k < 20; ++k) {
            (void)controller.tick();
        }
        pedal.fault = change;
        (void)controller.tick();  // takes the wrong reading
        const Command last = pedal.commands.back();
        const Tick tick = controller.tick();
        EXPECT_EQ(tick.status, expected);
        EXPECT_EQ(pedal.commands.back().position, last.position);
        EXPECT_EQ(pedal.commands.back().stiffness, servo_stiffness);
        EXPECT_EQ(tick.rendered.evaluations, 0);
        EXPECT_EQ(tick.rendered.environment_position, last.position);
    };
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    constexpr double infinite = std::numeric_limits<double>::infinity();
    wrong([](Reading& reading) { reading.measured = reading.applied = nan; }, Status::NonFinite);
    wrong([](Reading& reading) { reading.measured = infinite; }, Status::NonFinite);
    wrong([](Reading& reading) { reading.position = nan; }, Status::NonFinite);
    wrong([](Reading& reading) { reading.status = Status::Timeout; }, Status::Timeout);
    wrong([](Reading& reading) { --reading.sequence; }, Status::Lost);
    wrong([](Reading& reading) { reading.measured = 100.0; }, Status::Saturated);
    wrong([](Reading& reading) { reading.measured = -100.0; }, Status::Saturated);
}

TEST(AdmittanceController, StopHoldsThePositionBeforeTheDeviceIsClosed) {
    Pedal pedal;
    auto controller = controller_of(pedal);
    (void)controller.start();
    const Command last = controller.tick().command;
    EXPECT_EQ(controller.stop(), ZeroForce::Held);
    EXPECT_EQ(pedal.commands.back().position, last.position);
    EXPECT_EQ(pedal.commands.back().stiffness, servo_stiffness);
}

/// Clock in simulated time.
struct SimulatedClock {
    Nanoseconds now = 0;
    void start() noexcept {}
    Wake wait() noexcept {
        now += 1'000'000;
        return {now, now, 0};
    }
};

struct Rows {
    std::vector<TickRecord> records;
    void push(const TickRecord& record) { records.push_back(record); }
};

LoopReport run(const std::vector<Fault>& faults, Rows& rows, double force_limit = 100.0) {
    DeviceProfile device = profile();
    device.force_limit = force_limit;
    const Hand hand{.stiffness = 2e3, .damping = 10.0, .lower = 0.0, .upper = 0.06, .frequency_hz = 1.0};
    Faulty pedal{SimulatedPedal{device, hand}, faults, 1.0};
    EXPECT_TRUE(pedal.open());
    Guards guards;
    guards.reading = ReadingGuard{{.largest_step = 0.01}};
    AdmittanceController controller{pedal, object(), guards, force_limit, 1.0};
    LoopProgress progress;
    LoopReport report;
    const std::atomic<bool> stop{false};
    SimulatedClock clock;
    run_loop(controller, {.rate_hz = 1000.0, .duration_s = 2.0, .lowest_rate_share = 0.0, .tolerated = 0},
             clock, stop, rows, progress, report);
    return report;
}

TEST(AdmittanceController, LoopMovesASimulatedPedalAndTheHandDoesWork) {
    Rows rows;
    const LoopReport report = run({}, rows);
    EXPECT_TRUE(report.orderly());
    EXPECT_EQ(report.zero_force, ZeroForce::Held);
    EXPECT_EQ(report.given, 0.0);
    double largest = 0.0;
    for (const TickRecord& row : rows.records) {
        EXPECT_EQ(row.measured, row.applied);
        largest = std::max(largest, row.position);
    }
    // Two springs: the foot of 2 N/mm and the object of 1 N/mm share 60 mm
    EXPECT_NEAR(largest, 0.04, 2e-3);
}

TEST(AdmittanceController, EveryFaultEndsACertifiedRunWithoutAMotion) {
    for (const FaultKind kind : {FaultKind::Late, FaultKind::Lost, FaultKind::Repeated, FaultKind::NotANumber,
                                 FaultKind::Jump, FaultKind::Gone}) {
        Rows rows;
        const LoopReport report = run({{kind, 500, 1}}, rows);
        EXPECT_FALSE(report.orderly()) << static_cast<int>(kind);
        EXPECT_EQ(rows.records.back().environment_position,
                  rows.records[rows.records.size() - 2].environment_position);
    }
}

TEST(AdmittanceController, SaturatedSensorEndsTheRun) {
    Rows rows;
    const LoopReport report = run({}, rows, 20.0);
    EXPECT_EQ(report.exit_reason, ExitReason::Guard);
    EXPECT_EQ(report.status, Status::Saturated);
}

}  // namespace
}  // namespace palpate::admittance_tests
