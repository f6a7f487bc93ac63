// SPDX-License-Identifier: Apache-2.0
#include "palpate/rendering/any_structure.hpp"
#include "palpate/rendering/make_structure.hpp"
#include "palpate/run/controller.hpp"
#include "special_values.hpp"

#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "invariants.hpp"
#include "palpate/rendering/direct.hpp"
#include "palpate/rendering/implicit.hpp"
#include "support.hpp"
#include "variants.hpp"

namespace palpate {
namespace {

using test::ClockFault;

using test::infinity;
using test::nan;

/// A device that returns prescribed readings, some of them invalid, to test the controller.
class ScriptedDevice {
  public:
    Opened open() { return {}; }
    Reading exchange(const Command& command) noexcept {
        sent = command.force;
        line = command;
        Reading reading = next;
        reading.sequence = ++sequence;
        return reading;
    }
    void close() noexcept {}

    Reading next;
    double sent = 0.0;
    Command line;
    std::uint64_t sequence = 0;
};

/// A structure that sends a line of slope 20 through the force 10 x.
struct LineStructure {
    void reset(double /*position*/) noexcept {}
    [[nodiscard]] Rendered step(double position) noexcept {
        return {fails ? 0.0 : 10.0 * position,          position, 1,
                fails ? Status::NonFinite : Status::Ok, false,    20.0};
    }
    bool fails = false;
};

TEST(Controller, SendsALineThroughTheMeasuredPosition) {
    ScriptedDevice device;
    device.next.position = 0.2;
    Controller<ScriptedDevice> controller{device, LineStructure{}, ForceLimit{5.0}};
    (void)controller.start();
    (void)controller.tick();
    EXPECT_EQ(device.line.force, 2.0);
    EXPECT_EQ(device.line.position, 0.2);
    EXPECT_EQ(device.line.stiffness, 20.0);
}

TEST(Controller, MovesALineAlongItselfToTheForceLimit) {
    ScriptedDevice device;
    device.next.position = 0.8;
    Controller<ScriptedDevice> controller{device, LineStructure{}, ForceLimit{5.0}};
    (void)controller.start();
    EXPECT_EQ(controller.tick().status, Status::Limited);
    EXPECT_EQ(device.line.force, 5.0);
    EXPECT_EQ(device.line.stiffness, 20.0);
    EXPECT_NEAR(device.line.position, 0.8 - 3.0 / 20.0, 1e-12) << "the same line: 8 + 20 (x - 0.8)";
}

TEST(Controller, RampMultipliesForceAndStiffness) {
    ScriptedDevice device;
    device.next.position = 0.2;
    Controller<ScriptedDevice> controller{device, LineStructure{}, Guards{.limit = {5.0}, .ramp = {4, 0}}};
    (void)controller.start();
    for (const double share : {0.0, 0.25, 0.5, 0.75, 1.0}) {
        (void)controller.tick();
        EXPECT_EQ(device.line.force, share * 2.0);
        EXPECT_EQ(device.line.stiffness, share * 20.0);
    }
}

TEST(Controller, AForceThatAGuardOfHeldForcesChangesIsHeld) {
    ScriptedDevice device;
    device.next.position = 0.2;
    Controller<ScriptedDevice> controller{device, LineStructure{},
                                          Guards{.limit = {5.0}, .slew = {0.5, 0.0}}};
    (void)controller.start();
    (void)controller.tick();
    EXPECT_EQ(device.line.force, 0.5);
    EXPECT_EQ(device.line.stiffness, 0.0);
}

TEST(Controller, ZeroForceHasNoStiffness) {
    ScriptedDevice device;
    device.next.position = 0.2;
    Controller<ScriptedDevice> failing{device, LineStructure{true}, ForceLimit{5.0}};
    (void)failing.start();
    (void)failing.tick();
    EXPECT_EQ(device.line.force, 0.0);
    EXPECT_EQ(device.line.stiffness, 0.0);
    Controller<ScriptedDevice> controller{device, LineStructure{}, ForceLimit{5.0}};
    (void)controller.start();
    (void)controller.tick();
    EXPECT_EQ(device.line.stiffness, 20.0);
    device.next.status = Status::Timeout;
    (void)controller.tick();
    (void)controller.tick();
    EXPECT_EQ(device.line.force, 0.0);
    EXPECT_EQ(device.line.stiffness, 0.0);
    (void)controller.stop();
    EXPECT_EQ(device.line.stiffness, 0.0);
}

TEST(Controller, PutsTheObjectAtRestUnderTheHandleBeforeTheFirstForce) {
    const VirtualCoupling coupling;
    Implicit expected{test::Spring{10.0}, Inertia{}, coupling, 1e-3};
    expected.reset(0.2);
    ScriptedDevice device;
    device.next.position = 0.2;
    Controller<ScriptedDevice> controller{device, Implicit{test::Spring{10.0}, Inertia{}, coupling, 1e-3},
                                          ForceLimit{5.0}};
    (void)controller.start();
    EXPECT_EQ(controller.tick().command.force, expected.step(0.2).force);
}

TEST(Controller, RampsTheForceUpFromZeroAndReportsIt) {
    ScriptedDevice device;
    device.next.position = 0.2;
    Controller<ScriptedDevice> controller{device, Direct{test::Spring{10.0}},
                                          Guards{.limit = {5.0}, .ramp = {4, 0}}};
    (void)controller.start();
    for (const double expected : {0.0, 0.5, 1.0, 1.5}) {
        EXPECT_EQ(controller.tick().status, Status::Ramp);
        EXPECT_EQ(device.sent, expected);
    }
    EXPECT_EQ(controller.tick().status, Status::Ok);
    EXPECT_EQ(device.sent, 2.0);
}

TEST(Controller, ClipsToTheForceLimitAndReportsIt) {
    ScriptedDevice device;
    device.next.position = -3.0;
    Controller<ScriptedDevice> controller{device, Direct{test::Spring{10.0}}, ForceLimit{5.0}};
    (void)controller.start();
    const Tick tick = controller.tick();
    EXPECT_EQ(device.sent, -5.0);
    EXPECT_EQ(tick.rendered.force, -30.0);
    EXPECT_EQ(tick.status, Status::Limited);
}

/// A spring whose force is not a number beyond `broken_from`.
struct BrokenSpring {
    using State = Stateless;
    double stiffness;
    double broken_from;

    [[nodiscard]] EnvironmentSample at(double x, const State& state) const noexcept {
        return x < broken_from ? test::Spring{stiffness}.at(x, state)
                               : EnvironmentSample{std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0, false};
    }
    void advance(double /*x*/, State& /*stateless*/) const noexcept {}
    [[nodiscard]] State start(double /*x*/) const noexcept { return {}; }
};

TEST(Controller, SendsZeroForceAtOnceAfterAFailedStep) {
    for (const ForceRamp ramp : {ForceRamp{}, ForceRamp{1000, 900}}) {
        ScriptedDevice device;
        device.next.position = 0.3;
        Controller<ScriptedDevice> controller{device, Direct{BrokenSpring{10.0, 0.5}},
                                              Guards{.limit = {5.0}, .ramp = ramp, .slew = {1.0, 0.0}}};
        ASSERT_EQ(controller.start(), Status::Ok);
        for (int k = 0; k < 4; ++k) {
            (void)controller.tick();
        }
        ASSERT_GT(device.sent, 2.0);
        device.next.position = 0.6;
        (void)controller.tick();
        EXPECT_EQ(controller.tick().status, Status::NonFinite);
        EXPECT_EQ(device.sent, 0.0) << "the slew limit must not delay the zero force";
        device.next.position = 0.3;
        (void)controller.tick();
        (void)controller.tick();
        EXPECT_NEAR(device.sent, 1.0, 1e-12) << "after the failed step the force rises from zero";
    }
}

/// A structure that counts its resets, and whose force and status a test chooses.
struct ChosenStructure {
    Rendered* next;
    std::vector<double>* resets;

    void reset(double position) noexcept { resets->push_back(position); }
    [[nodiscard]] Rendered step(double /*position*/) noexcept { return *next; }
};

TEST(Controller, PutsTheObjectUnderTheHandleOnceAtTheFirstValidReading) {
    ScriptedDevice device;
    Rendered next;
    std::vector<double> resets;
    Controller controller{device, ChosenStructure{&next, &resets}, Guards{}};
    device.next.position = 0.1;
    device.next.status = Status::Timeout;
    EXPECT_EQ(controller.start(), Status::Timeout);
    device.next.position = 0.2;
    device.next.status = Status::Ok;
    EXPECT_EQ(controller.tick().status, Status::Timeout);
    EXPECT_TRUE(resets.empty());
    device.next.position = 0.3;
    for (int k = 0; k < 4; ++k) {
        (void)controller.tick();
    }
    EXPECT_EQ(resets, std::vector<double>{0.2});
}

TEST(Controller, SendsZeroForceIfTheStructureReportsAFailedStepWithAForce) {
    ScriptedDevice device;
    Rendered next{1.5, 0.0, 0, Status::NonFinite, false};
    std::vector<double> resets;
    Controller controller{device, ChosenStructure{&next, &resets}, Guards{.slew = {0.5, 0.0}}};
    (void)controller.start();
    const Tick failed = controller.tick();
    EXPECT_EQ(failed.command.force, 0.0);
    EXPECT_EQ(failed.status, Status::NonFinite);
    EXPECT_EQ(device.sent, 0.0);
    next.status = Status::Ok;
    EXPECT_EQ(controller.tick().command.force, 0.5) << "the force rises from zero with the slew limit";
}

/// Guards that all change a force of 100.
Guards all_guards() {
    Guards guards{.limit = {10.0}, .ramp = {1000, 500}, .slew = {1.0, 0.0}};
    guards.limit_cycle = LimitCycleDetector{{.force_swing = 0.0, .longest_swing = 1000}};
    for (int k = 0; k < 14; ++k) {
        guards.limit_cycle.watch(k % 2 == 0 ? 0.0 : 1.0, 0.0);
    }
    // With B = b / T = 1 the force F takes at most F^2 / 4 J in a tick
    guards.account = EnergyAccount{{.stored = {.within = 3.0625}, .device_damping = 1e-3}};
    return guards;
}

TEST(Controller, ReportsTheFirstOfItsStatusesInTheirOrder) {
    ASSERT_EQ(all_guards().limit_cycle.limit_cycles(), 1U);
    Guards guards = all_guards();
    Rendered next{100.0, 0.0, 0, Status::MaxIterations, false};
    std::vector<double> resets;
    const auto tick = [&](Status reported = Status::Ok) {
        ScriptedDevice device;
        device.next.status = reported;
        Controller controller{device, ChosenStructure{&next, &resets}, guards};
        (void)controller.start();
        return controller.tick();
    };
    // Limited to 10, scaled by 0.7, by half a ramp, limited to a change of 1; the account allows 2 sqrt(3.0625) = 3.5
    EXPECT_EQ(tick().status, Status::MaxIterations);
    EXPECT_NEAR(tick().command.force, 1.0, 1e-12);
    next.status = Status::Ok;
    EXPECT_EQ(tick().status, Status::Ramp);
    guards.slew.largest_step = infinity;
    EXPECT_NEAR(tick().command.force, 10.0 * 0.7 * 0.5, 1e-12);
    guards.ramp = {};
    EXPECT_EQ(tick().status, Status::EnergyLimited);
    EXPECT_NEAR(tick().command.force, 3.5, 1e-12);
    guards.account = {};
    EXPECT_EQ(tick().status, Status::LimitCycleScaled);
    EXPECT_NEAR(tick().command.force, 10.0 * 0.7, 1e-12);
    guards.limit_cycle = {};
    EXPECT_EQ(tick().status, Status::Limited);
    EXPECT_EQ(tick().command.force, 10.0);
    guards.limit.largest = 200.0;
    EXPECT_EQ(tick().status, Status::Ok);
    EXPECT_EQ(tick(Status::Limited).status, Status::Limited) << "the device limits the force";
    guards.slew.largest_step = 99.0;
    EXPECT_EQ(tick().status, Status::Limited);
    EXPECT_EQ(tick().command.force, 99.0);
}

// The work of the motor counts only between two valid readings, and in the ramp in a separate account.
TEST(Controller, AddsUpTheWorkOfTheMotorBetweenValidReadings) {
    ScriptedDevice device;
    Rendered next{0.0, 5.0, 0, Status::Ok, false};
    std::vector<double> resets;
    Guards guards{.ramp = {2, 0}};
    guards.account =
        EnergyAccount{{.stored = {.within = 1.0, .lower = 0.0, .upper = 2.0, .force_limit = 10.0}}};
    Controller controller{device, ChosenStructure{&next, &resets}, guards};
    const auto then = [&](double position, double applied, Status status = Status::Ok) {
        device.next.position = position;
        device.next.applied = applied;
        device.next.status = status;
        (void)controller.tick();
    };
    device.next.position = 1.0;
    (void)controller.start();
    then(1.5, 2.0);
    then(1.25, 4.0);                  // the motor absorbed 0.5 * 2 in the ramp
    then(1.0, 0.0, Status::Timeout);  // then gave 0.25 * 4 after the ramp
    EXPECT_DOUBLE_EQ(controller.guards().ramp_observer.energy(), 1.0);
    then(0.25, 8.0);
    then(0.5, 8.0);
    EXPECT_DOUBLE_EQ(controller.guards().observer.energy(), -1.0) << "the motion before the first reading";
    then(0.75, nan);  // absorbed 0.25 * 8
    then(1.0, 2.0);
    then(-0.5, 2.0);  // absorbed 0.25 * 2; the force that is not a number does not count
    EXPECT_DOUBLE_EQ(controller.guards().observer.energy(), -1.0 + 2.0 + 0.5);
    EXPECT_DOUBLE_EQ(controller.guards().observer.least(), -1.0);
    EXPECT_DOUBLE_EQ(controller.guards().ramp_observer.energy(), 1.0);
    EXPECT_DOUBLE_EQ(controller.guards().account.stored().most(), 1.0 + 10.0 * 3.0) << "the object is at 5";
    (void)controller.tick();
    EXPECT_DOUBLE_EQ(controller.guards().account.stored().most(), 1.0 + 10.0 * 3.5)
        << "the handle is at -0.5";
}

TEST(Controller, LimitsTheForceOfATickToTheGivenLimit) {
    ScriptedDevice device;
    Rendered next{-100.0, 0.0, 0, Status::Ok, false};
    std::vector<double> resets;
    Controller controller{device, ChosenStructure{&next, &resets}, ForceLimit{3.0}};
    (void)controller.start();
    EXPECT_EQ(controller.tick().command.force, -3.0);
}

/// A device whose clock sets the rate, if a test chooses so.
struct PaceByChoice : ScriptedDevice {
    bool paces = false;
    [[nodiscard]] bool sets_pace() const noexcept { return paces; }
};

/// A device whose clock always sets the rate.
struct AlwaysPacingDevice : ScriptedDevice {
    static constexpr bool paces_host = true;
};

TEST(Controller, KnowsWhetherTheClockOfTheDeviceSetsTheRate) {
    Rendered next;
    std::vector<double> resets;
    const auto paced = [&](auto& device) {
        return Controller{device, ChosenStructure{&next, &resets}, Guards{}}.paced_by_device();
    };
    ScriptedDevice plain;
    EXPECT_FALSE(paced(plain));
    AlwaysPacingDevice always;
    EXPECT_TRUE(paced(always));
    PaceByChoice chosen;
    EXPECT_FALSE(paced(chosen));
    chosen.paces = true;
    EXPECT_TRUE(paced(chosen));
}

// ------------------------------------------------------------- every state, every event, every structure

constexpr double tick_s = 1e-3;
constexpr std::uint64_t tolerated = 3;

GuardSettings guard_settings(bool certified) {
    GuardSettings settings;
    settings.force_limit = 2.0;
    settings.slew_s = certified ? 0.0 : 0.01;
    settings.ramp_s = 0.01;
    settings.frozen_s = 0.01;
    settings.encoder_step = 1e-4;
    settings.device_damping = 0.001;
    settings.device_friction = 0.001;
    settings.certified = certified;
    return settings;
}

/// Largest change of position that is not a jump.
const double largest_step = guard_settings(false).largest_speed * tick_s;

/// A reading that follows the last valid one, or a disturbance of the clock, with the answer in a healthy state.
struct Event {
    const char* name;
    Status answer;          ///< status of the tick; Ok: any status that sends a force
    double moved = 0.0;     ///< motion of the handle [rad]
    double position = 0.0;  ///< if not 0: reported position [rad]
    Status status = Status::Ok;
    std::uint64_t samples = 1;  ///< change of the sample number
    double applied = 0.0;       ///< if not 0: reported force of the motor [N*m]
    ClockFault clock{};
};

const std::vector<Event> events{
    {"rest", Status::Ok},
    {"creep", Status::Ok, 1e-4},
    {"back", Status::Ok, -1e-4},
    {"fast", Status::Ok, 0.9 * largest_step},
    {"fast back", Status::Ok, -0.9 * largest_step},
    {"largest step", Status::Ok, largest_step * (1.0 - 1e-9)},
    {"jump", Status::Jump, 1.01 * largest_step},
    {"jump back", Status::Jump, -1.01 * largest_step},
    {"far", Status::Jump, 0.0, 1e3},
    {"largest number", Status::Jump, 0.0, std::numeric_limits<double>::max()},
    {"NaN", Status::NonFinite, 0.0, nan},
    {"infinity", Status::NonFinite, 0.0, infinity},
    {"minus infinity", Status::NonFinite, 0.0, -infinity},
    {"timeout", Status::Timeout, 0.0, 0.0, Status::Timeout, 0},
    {"timeout with NaN", Status::Timeout, 0.0, nan, Status::Timeout, 0},
    {"command lost", Status::Lost, 0.0, 0.0, Status::Lost},
    {"one sample lost", Status::Lost, 0.0, 0.0, Status::Ok, 2},
    {"many samples lost", Status::Lost, 0.0, 0.0, Status::Ok, 1000},
    {"repeated", Status::Lost, 0.0, 0.0, Status::Ok, 0},
    {"older", Status::Lost, 0.0, 0.0, Status::Ok, std::uint64_t(-1)},
    {"much older", Status::Lost, 0.0, 0.0, Status::Ok, std::uint64_t{1} << 63U},
    {"device fault", Status::Fault, 0.0, 0.0, Status::Fault},
    {"device fault with NaN", Status::Fault, 0.0, nan, Status::Fault, 0},
    {"device reports a jump", Status::Jump, 0.0, 0.0, Status::Jump},
    {"device reports NaN", Status::NonFinite, 0.0, 0.0, Status::NonFinite},
    {"device limits", Status::Ok, 0.0, 0.0, Status::Limited},
    {"motor force NaN", Status::Ok, 1e-4, 0.0, Status::Ok, 1, nan},
    {"motor force infinite", Status::Ok, 1e-4, 0.0, Status::Ok, 1, infinity},
    {"motor gives energy", Status::Ok, -0.9 * largest_step, 0.0, Status::Ok, 1, 2.0},
    {"late tick", Status::Ok, 0.0, 0.0, Status::Ok, 1, 0.0, {0, 400'000, 0}},
    {"much too late tick", Status::Ok, 0.0, 0.0, Status::Ok, 1, 0.0, {0, 3'000'000, 0}},
    {"clock jumps back", Status::Ok, 0.0, 0.0, Status::Ok, 1, 0.0, {0, 0, -5'000'000}},
};

std::size_t event(const std::string& name) {
    for (std::size_t k = 0; k < events.size(); ++k) {
        if (name == events[k].name) {
            return k;
        }
    }
    throw std::invalid_argument(name);
}

/// Events that bring the controller into a state.
struct State {
    const char* name;
    std::vector<std::size_t> before;
    bool healthy = false;  ///< the next event has the answer of its row
};

std::vector<State> states() {
    const auto times = [](std::size_t count, std::vector<std::string> names) {
        std::vector<std::size_t> all;
        for (std::size_t k = 0; k < count; ++k) {
            for (const std::string& name : names) {
                all.push_back(event(name));
            }
        }
        return all;
    };
    const auto then = [](std::vector<std::size_t> first, const std::vector<std::size_t>& second) {
        first.insert(first.end(), second.begin(), second.end());
        return first;
    };
    const auto running = times(15, {"creep"});
    return {{"start", {}},
            {"ramp", times(5, {"creep"}), true},
            {"running", running, true},
            {"after one bad tick", then(running, times(1, {"timeout"}))},
            {"after all tolerated bad ticks", then(running, times(tolerated, {"repeated"}))},
            {"limited", then(running, times(6, {"fast"})), true},
            {"slewing back", then(running, times(6, {"fast", "fast back"})), true},
            {"almost frozen", then(running, then(times(1, {"fast"}), times(9, {"rest"})))},
            {"account empty", then(running, times(30, {"fast", "motor gives energy"})), true},
            {"limit cycle", then(running, times(12, {"fast", "creep", "fast back", "back"})), true}};
}

/// A device that plays events, then rests.
class EventDevice {
  public:
    EventDevice(const std::vector<std::size_t>& played, double start) : played_{played} {
        reading_.position = start;
    }
    Opened open() { return {}; }
    [[nodiscard]] Reading exchange(const Command& command) noexcept {
        const Event& next = events[exchanges_ < played_.size() ? played_[exchanges_] : 0];
        ++exchanges_;
        reading_.position += next.moved;
        reading_.applied = command.force;
        Reading reported = reading_;
        reported.sequence += next.samples;
        reported.status = next.status;
        reported.position = next.position != 0.0 ? next.position : reported.position;
        reported.applied = next.applied != 0.0 ? next.applied : reported.applied;
        // Samples follow the newest one
        if (static_cast<std::int64_t>(reported.sequence - reading_.sequence) > 0) {
            reading_.sequence = reported.sequence;
        }
        return reported;
    }
    void close() noexcept {}

  private:
    const std::vector<std::size_t>& played_;
    std::size_t exchanges_ = 0;
    Reading reading_;
};

struct Played {
    std::vector<Status> statuses;
    LoopReport report;
    std::string broken;
};

/// Plays events and then eight samples at rest.
Played play(const AnyStructure& structure, const Guards& guards, const GuardSettings& settings,
            const std::vector<std::size_t>& played) {
    LoopSettings loop;
    loop.rate_hz = 1.0 / tick_s;
    loop.tolerated = tolerated;
    loop.lowest_rate_share = 0.0;
    loop.longest_period_s = settings.certified ? 1.5 * tick_s : infinity;
    // The clock stretches the run when it jumps, so the number of ticks is not that of the events
    loop.duration_s = static_cast<double>(played.size() + 8) * tick_s;
    std::vector<ClockFault> clock;
    for (std::size_t k = 0; k < played.size(); ++k) {
        ClockFault fault = events[played[k]].clock;
        if (fault.late != 0 || fault.jump != 0) {
            fault.tick = k;
            clock.push_back(fault);
        }
    }
    DeviceProfile device;
    device.encoder_step = settings.encoder_step;
    device.force_limit = settings.force_limit;
    test::Invariants invariants{settings, loop, device};
    invariants.motor_does_not_obey();
    Played result;
    result.report =
        test::run_checked(structure, EventDevice{played, 0.05}, guards, loop, tick_s, clock, invariants,
                          [&](const TickRecord& record) { result.statuses.push_back(record.status); });
    result.broken = invariants.broken();
    return result;
}

/// Checks the answer to the event after `state`, in tick `at`.
std::string wrong_answer(const State& state, const Event& next, const Played& run, std::size_t at,
                         bool certified) {
    if (next.clock.late > 500'000 && certified && at > 0) {  // no force is held before the first tick
        return run.report.exit_reason == ExitReason::NotCertified && run.statuses.size() == at
                   ? ""
                   : "a tick later than certified does not end the run";
    }
    if (run.statuses.size() <= at) {
        return "the run ended before the event";
    }
    const Status status = run.statuses[at];
    const bool right = next.answer == Status::Ok ? sends_force(status) : status == next.answer;
    if (state.healthy && !right) {
        return std::string("the status is ") + text(status).word;
    }
    const bool ends = run.statuses.size() == at + 1;
    if (state.healthy && ends != is_final(status)) {
        return ends ? "the run ends" : "the run continues";
    }
    // After one bad first sample the run continues, unless the next ones cannot follow its number or position
    const bool continues = at == 0 && !is_final(next.answer) && next.name != std::string("much older");
    if (!ends && !sends_force(run.statuses.back()) &&
        (continues || run.report.exit_reason == ExitReason::TimeUp)) {
        return "the force does not return";
    }
    return "";
}

TEST(Controller, EveryEventInEveryStateOfEveryStructureKeepsThePromises) {
    const std::vector<State> all_states = states();
    // The normal test run plays every eighth pair of events, others for every structure and state
    const std::size_t stride = test::cases(1) > 1 ? 1 : 8;
    std::size_t runs = 0;
    for (const test::Variant& variant : test::all_variants()) {
        const AnyStructure structure = make_structure(variant.model, variant.scheme, tick_s, 2.0);
        for (const bool certified : {false, true}) {
            const GuardSettings settings = guard_settings(certified);
            const Guards guards = guards_of(settings, variant.model, variant.scheme, tick_s);
            for (const State& state : all_states) {
                for (std::size_t first = 0; first < events.size(); ++first) {
                    for (std::size_t second = 0; second < events.size(); ++second) {
                        if (second > 0 && (first + second + runs) % stride != 0) {
                            continue;
                        }
                        std::vector<std::size_t> played = state.before;
                        played.push_back(first);
                        played.push_back(second);
                        const Played run = play(structure, guards, settings, played);
                        ++runs;
                        const std::string wrong = !run.broken.empty() ? run.broken
                                                  : second == 0 ? wrong_answer(state, events[first], run,
                                                                               state.before.size(), certified)
                                                                : "";
                        ASSERT_EQ(wrong, "")
                            << variant.name << (certified ? ", certified" : "") << "; state " << state.name
                            << ", then " << events[first].name << ", then " << events[second].name;
                    }
                }
            }
        }

        if (HasFatalFailure()) {
            return;
        }
    }
    RecordProperty("runs", std::to_string(runs));
}

// Each sequence of events leads to the state of its name.
TEST(Controller, EventsReachEveryState) {
    const test::Variant variant = test::all_variants().front();
    const AnyStructure structure = make_structure(variant.model, variant.scheme, tick_s, 2.0);
    const GuardSettings settings = guard_settings(false);
    const Guards guards = guards_of(settings, variant.model, variant.scheme, tick_s);
    for (const State& state : states()) {
        const Played run = play(structure, guards, settings, state.before);
        const std::string name = state.name;
        const auto expects = [&](Status status) {
            EXPECT_GT(run.report.ticks_by_status[static_cast<std::size_t>(status)], 0U) << name;
        };
        EXPECT_EQ(run.broken, "");
        expects(Status::Ramp);
        if (name == "limited" || name == "slewing back") {
            expects(Status::Limited);
        } else if (name == "account empty") {
            expects(Status::EnergyLimited);
        } else if (name == "limit cycle") {
            expects(Status::LimitCycleScaled);
        } else if (name == "almost frozen") {
            EXPECT_EQ(run.report.status, Status::Frozen);
        }
    }
}

}  // namespace
}  // namespace palpate
