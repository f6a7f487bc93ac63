// SPDX-License-Identifier: Apache-2.0
#include "palpate/run/controller.hpp"

#include <cstdint>
#include <limits>

#include <gtest/gtest.h>

#include "palpate/rendering/direct.hpp"
#include "palpate/rendering/implicit.hpp"
#include "support.hpp"

namespace palpate {
namespace {

/// A device that returns prescribed readings, some of them invalid, to test the controller.
class ScriptedDevice {
  public:
    Opened open() { return {}; }
    Reading exchange(const Command& command) noexcept {
        sent = command.force;
        Reading reading = next;
        reading.sequence = ++sequence;
        return reading;
    }
    void close() noexcept {}

    Reading next;
    double sent = 0.0;
    std::uint64_t sequence = 0;
};

TEST(Controller, SendsZeroForceOnAnyInvalidReading) {
    ScriptedDevice device;
    device.next.position = 0.2;
    Controller<ScriptedDevice, Direct<test::Spring>> controller{device, Direct{test::Spring{10.0}},
                                                                ForceLimit{5.0}};
    ASSERT_EQ(controller.start(), Status::Ok);
    for (const Status bad : {Status::Timeout, Status::Lost, Status::Fault}) {
        device.next.status = Status::Ok;
        (void)controller.tick();
        EXPECT_EQ(controller.tick().command.force, 2.0);
        EXPECT_EQ(device.sent, 2.0);
        device.next.status = bad;
        (void)controller.tick();
        EXPECT_EQ(controller.tick().status, bad);
        EXPECT_EQ(device.sent, 0.0);
    }
    device.next = {};
    device.next.position = std::numeric_limits<double>::quiet_NaN();
    (void)controller.tick();
    EXPECT_EQ(controller.tick().status, Status::NonFinite);
    EXPECT_EQ(device.sent, 0.0);
}

TEST(Controller, PutsTheObjectAtRestUnderTheHandleBeforeTheFirstForce) {
    const VirtualCoupling coupling;
    Implicit expected{test::Spring{10.0}, Inertia{}, coupling, 1e-3};
    expected.reset(0.2);
    ScriptedDevice device;
    device.next.position = 0.2;
    Controller<ScriptedDevice, Implicit<test::Spring>> controller{
        device, Implicit{test::Spring{10.0}, Inertia{}, coupling, 1e-3}, ForceLimit{5.0}};
    (void)controller.start();
    EXPECT_EQ(controller.tick().command.force, expected.step(0.2).force);
}

TEST(Controller, RampsTheForceUpFromZeroAndReportsIt) {
    ScriptedDevice device;
    device.next.position = 0.2;
    Controller<ScriptedDevice, Direct<test::Spring>> controller{device, Direct{test::Spring{10.0}},
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
    Controller<ScriptedDevice, Direct<test::Spring>> controller{device, Direct{test::Spring{10.0}},
                                                                ForceLimit{5.0}};
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
        Controller<ScriptedDevice, Direct<BrokenSpring>> controller{
            device, Direct{BrokenSpring{10.0, 0.5}},
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

}  // namespace
}  // namespace palpate
