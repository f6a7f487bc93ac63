// SPDX-License-Identifier: Apache-2.0
#include "palpate/run/detail/measure.hpp"

#include <stdlib.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "moved_device.hpp"
#include "palpate/rendering/measuring.hpp"
#include "palpate/simulation/simulated_device.hpp"
#include "support.hpp"

namespace palpate {
namespace {

constexpr double period = 1e-3;

/// Returns the force of a detent, f = 2 x + 0.6 exp(-((x - 0.15)/0.03)^2), whose slope falls to -15.
double detent(double x) {
    const double u = (x - 0.15) / 0.03;
    return 2.0 * x + 0.6 * std::exp(-u * u);
}

struct Sweep {
    std::vector<Reading> readings;
    std::vector<double> commands;
};

Sweep sweep_of(SimulatedRig& device, const ProbeSettings& settings, int ticks) {
    (void)device.open();
    Controller controller{device, Probe{settings, period}, ForceLimit{settings.force_limit}};
    (void)controller.start();
    Sweep sweep;
    for (int k = 0; k < ticks; ++k) {
        const Tick tick = controller.tick();
        sweep.readings.push_back(tick.reading);
        sweep.commands.push_back(tick.command.force);
    }
    return sweep;
}

SimulatedRig rig_without_hand(const std::function<double(double)>& object, bool transducer = true) {
    SimulatedRig device{DeviceProfile{}, Hand{0.0, 0.0, 0.0, 0.0, 0.5}};
    device.mount({object, transducer});
    return device;
}

TEST(Probe, CoversItsRangeSlowlyThroughAFallingForce) {
    SimulatedRig device = rig_without_hand(detent);
    ProbeSettings settings;
    settings.upper = 0.4;
    const Sweep sweep = sweep_of(device, settings, 5000);
    double lowest = 1.0;
    double highest = -1.0;
    double fastest = 0.0;
    for (const Reading& reading : sweep.readings) {
        lowest = std::min(lowest, reading.position);
        highest = std::max(highest, reading.position);
        fastest = std::max(fastest, std::abs(reading.velocity));
    }
    EXPECT_LT(lowest, 0.01);
    EXPECT_GT(highest, 0.38);
    EXPECT_LT(fastest, 5.0 * settings.speed);
}

TEST(Probe, ReversesIfTheObjectHoldsItsLimit) {
    SimulatedRig device = rig_without_hand([](double x) { return 20.0 * x; });
    ProbeSettings settings;
    settings.upper = 3.0;
    settings.force_limit = 0.8;
    const Sweep sweep = sweep_of(device, settings, 6000);
    double highest = 0.0;
    for (const Reading& reading : sweep.readings) {
        highest = std::max(highest, reading.position);
    }
    EXPECT_NEAR(highest, 0.04, 0.004);  // 0.8 / 20
    EXPECT_LT(sweep.readings.back().position, 0.04);
    for (const double command : sweep.commands) {
        EXPECT_LE(std::abs(command), settings.force_limit);
    }
}

TEST(Probe, ReturnsIfItStartsOutsideItsRange) {
    SimulatedRig device{DeviceProfile{}, Hand{0.0, 0.0, 0.0, 0.0, 0.5}, 20, 0.9};
    ProbeSettings settings;
    settings.upper = 0.3;
    EXPECT_LT(sweep_of(device, settings, 4000).readings.back().position, 0.32);
}

TEST(Probe, PositionThatIsNotFiniteGivesZeroForce) {
    Probe probe{{}, period};
    probe.reset(0.1);
    const Rendered rendered = probe.step(std::nan(""));
    EXPECT_EQ(rendered.status, Status::NonFinite);
    EXPECT_EQ(rendered.force, 0.0);
}

TEST(Probe, RefusesARangeWithoutWidth) {
    EXPECT_THROW((Probe{{.lower = 0.2, .upper = 0.2}, period}), std::invalid_argument);
    EXPECT_THROW((Probe{{.speed = 0.0}, period}), std::invalid_argument);
}

TEST(ObjectForce, ComesFromTheTransducerOtherwiseFromTheMotor) {
    for (const bool transducer : {true, false}) {
        SimulatedRig device = rig_without_hand([](double x) { return 3.0 * x; }, transducer);
        ProbeSettings settings;
        settings.upper = 0.3;
        settings.force_limit = 5.0;
        const Sweep sweep = sweep_of(device, settings, 4000);
        double worst = 0.0;
        for (std::size_t k = 500; k < sweep.readings.size(); ++k) {
            const Reading& reading = sweep.readings[k];
            TickRecord tick;
            tick.measured = reading.measured;
            tick.applied = reading.applied;
            worst = std::max(worst, std::abs(object_force(tick) - 3.0 * reading.position));
        }
        // With a force sensor the tolerance covers the encoder step; without one it covers the friction of the device,
        // which depends on the direction of the motion.
        EXPECT_LT(worst, transducer ? 2e-4 : 0.05);
    }
}

TEST(Pulses, AlternateAndEndAtTheFarthestPosition) {
    Pulses pulses{{.force = 0.5, .push_s = 0.03, .rest_s = 0.17, .farthest = 0.2}, period};
    pulses.reset(1.0);
    double sum = 0.0;
    int pushed = 0;
    for (int k = 0; k < 400; ++k) {
        const double force = pulses.step(1.0).force;
        sum += force;
        pushed += force != 0.0 ? 1 : 0;
    }
    EXPECT_EQ(pushed, 60);
    EXPECT_NEAR(sum, 0.0, 1e-12);
    for (int k = 0; k < 400; ++k) {
        EXPECT_EQ(pulses.step(1.3).force, 0.0);
    }
    EXPECT_EQ(pulses.step(std::nan("")).status, Status::NonFinite);
    EXPECT_THROW((Pulses{{.force = 0.0}, period}), std::invalid_argument);
}

TEST(Pulses, AreSmallerInEverySecondGroupOfThree) {
    Pulses pulses{{.force = 0.5, .smaller = 0.6, .push_s = 0.03, .rest_s = 0.17}, period};
    pulses.reset(0.0);
    std::vector<double> sizes;
    for (int k = 0; k < 8 * 200; ++k) {
        const double force = pulses.step(0.0).force;
        if (k % 200 == 199) {
            sizes.push_back(force);
        }
    }
    EXPECT_EQ(sizes, (std::vector<double>{0.5, -0.5, 0.5, -0.3, 0.3, -0.3, 0.5, -0.5}));
}

TEST(FreeMotion, SendsZeroForce) {
    FreeMotion free;
    free.reset(1.0);
    EXPECT_EQ(free.step(0.3).force, 0.0);
    EXPECT_EQ(free.step(std::nan("")).status, Status::NonFinite);
}

TEST(Watching, SendsZeroForceAndMarksPositionsOutsideTheDomain) {
    Domain domain;
    domain.lower = {0.0};
    domain.upper = {0.5};
    Watching watching{domain};
    watching.reset(1.0);
    EXPECT_EQ(watching.step(0.3).force, 0.0);
    EXPECT_FALSE(watching.step(0.5).extrapolated);
    EXPECT_TRUE(watching.step(0.501).extrapolated);
    EXPECT_TRUE(watching.step(-0.001).extrapolated);
    EXPECT_EQ(watching.step(std::nan("")).status, Status::NonFinite);
    domain.period = 0.5;
    EXPECT_FALSE(Watching{domain}.step(7.0).extrapolated);
}

TEST(SimulatedRig, MovesAgainstItsMountedObject) {
    SimulatedRig device{DeviceProfile{}, Hand{15.0, 0.05, 0.3, 0.3, 0.5}};
    device.mount({[](double x) { return 5.0 * x; }, true});
    (void)device.open();
    Reading reading;
    for (int k = 0; k < 4000; ++k) {
        reading = device.exchange({});
    }
    EXPECT_NEAR(reading.position, 15.0 * 0.3 / 20.0, 1e-3);
    EXPECT_NEAR(reading.measured, 5.0 * reading.position, 1e-3);
}

// -------------------------------------------------------------------------------------------- measurement

using test::refusal;

TEST(MeasureOptions, MoveTheHandleWithAProbeOrPushes) {
    MeasureOptions options;
    EXPECT_FALSE(options.moves());
    options.push = 0.1;
    EXPECT_TRUE(options.moves());
    options.probe = true;
    EXPECT_TRUE(options.moves());
    options.push.reset();
    EXPECT_TRUE(options.moves());
}

TEST(ChosenProbe, IsScaledToTheDeviceWhereNothingIsGiven) {
    DeviceProfile profile;
    profile.force_limit = 4.0;
    const auto device = test::moved_device({}, profile);
    device->scale = {2.0, 6.0};
    const ProbeSettings usual;
    const ProbeSettings probe = detail::chosen_probe({}, *device);
    EXPECT_EQ(probe.lower, usual.lower);
    EXPECT_EQ(probe.upper, usual.upper);
    EXPECT_EQ(probe.speed, 2.0 * usual.speed);
    EXPECT_EQ(probe.stiffness, 3.0 * usual.stiffness);
    EXPECT_EQ(probe.damping, 3.0 * usual.damping);
    EXPECT_EQ(probe.force_limit, 4.0);

    MeasureOptions options;
    options.lower = 1.0;
    options.upper = 3.0;
    options.speed = 0.5;
    options.stiffness = 7.0;
    options.force_limit = 2.0;
    const ProbeSettings own = detail::chosen_probe(options, *device);
    EXPECT_EQ(own.lower, 1.0);
    EXPECT_EQ(own.upper, 3.0);
    EXPECT_EQ(own.speed, 0.5);
    EXPECT_EQ(own.stiffness, 7.0);
    EXPECT_EQ(own.force_limit, 2.0);
}

TEST(ChosenProbe, IsRefusedBeyondTheForceLimitOfTheDevice) {
    DeviceProfile profile;
    profile.force_limit = 4.0;
    profile.force_step = 0.5;
    const auto device = test::moved_device({}, profile);
    MeasureOptions options;
    options.force_limit = 4.25;
    EXPECT_EQ(detail::chosen_probe(options, *device).force_limit, 4.0) << "within one force step";
    options.force_limit = 4.75;
    EXPECT_EQ(refusal([&] { (void)detail::chosen_probe(options, *device); }),
              "force_limit is 4.75: must be at most 4, the force limit of the device");
    options.force_limit = 1.0;
    options.speed = 0.0;
    EXPECT_EQ(refusal([&] { (void)detail::chosen_probe(options, *device); }),
              "probe: speed is 0, must be > 0");
}

/// A measurement on a moving device, with all ticks in memory.
struct Measurement {
    MeasureOptions options{};
    std::unique_ptr<LiveDeviceOf<test::MovedDevice>> device =
        test::moved_device({[](std::uint64_t sample) { return 1e-4 * static_cast<double>(sample); }});

    Measurement() {
        options.loop.duration_s = 0.4;
        options.loop.lowest_rate_share = 0.0;
        options.real_time = {.priority = 0, .cpu = -2};
        options.keep = true;
    }
    [[nodiscard]] Summary run() const {
        const std::atomic<bool> stop_requested{false};
        return measure(options, *device, stop_requested, [](const SessionView&) {});
    }
    [[nodiscard]] std::string refused() const {
        return refusal([&] { (void)run(); });
    }
};

TEST(Measure, RecordsTheForceOfTheObjectWhileAHandMoves) {
    Measurement by_hand;
    by_hand.device->device().measured = -0.5;
    const Summary summary = by_hand.run();
    ASSERT_EQ(summary.kept.size(), 400U);
    EXPECT_EQ(summary.forces.lower, -0.5);
    EXPECT_EQ(summary.forces.upper, -0.5);
    EXPECT_DOUBLE_EQ(summary.positions.upper, 0.0399);
    EXPECT_EQ(summary.kept.back().applied, 0.0);
    EXPECT_EQ(summary.report.loop.ticks_by_status[static_cast<std::size_t>(Status::Ok)], 400U)
        << "there is no start ramp without a force of the motor";
    EXPECT_EQ(summary.loop.rate_hz, 1000.0);
    EXPECT_EQ(summary.device, "a moved device");
    EXPECT_TRUE(summary.notes.empty());
    EXPECT_EQ(level_of(summary.findings), "good") << verdict_text(summary.findings);

    by_hand.options.keep = false;
    EXPECT_TRUE(by_hand.run().kept.empty());
}

TEST(Measure, JudgesTheTravelInEncoderSteps) {
    Measurement slow;
    slow.device->device().position = [](std::uint64_t sample) { return 1e-6 * static_cast<double>(sample); };
    slow.device->device().measured = 1.0;
    slow.options.units.position = "deg";
    const std::string verdict = verdict_text(slow.run().findings);
    EXPECT_EQ(verdict.rfind("usable: the handle covered 0.000399 deg, 4.162 encoder steps", 0), 0U)
        << verdict;
}

// The spring of the probe pulls with 50 (x - s), and damps the difference of the speeds of handle and target.
TEST(Measure, SendsTheForceOfTheProbeAfterItsRamp) {
    Measurement probing;
    probing.options.probe = true;
    probing.options.speed = 0.1;
    probing.options.stiffness = 5.0;
    const Summary summary = probing.run();
    ASSERT_EQ(summary.kept.size(), 400U);
    EXPECT_EQ(summary.report.loop.ticks_by_status[static_cast<std::size_t>(Status::Ramp)], 200U);
    // Handle and target have the same speed; the target is one step ahead
    EXPECT_NEAR(summary.kept.back().applied, -5.0 * 1e-4, 1e-9);
    EXPECT_NEAR(summary.kept.back().force, 5.0 * 1e-4, 1e-9) << "the object pushes back";
    EXPECT_NEAR(summary.kept[101].applied, -5.0 * 1e-4 * 0.5, 1e-9);

    probing.device = test::moved_device({[](std::uint64_t) { return 0.0; }});
    probing.options.force_limit = 0.01;
    const Summary held = probing.run();
    EXPECT_DOUBLE_EQ(held.forces.upper, 0.01);
}

// A jump of the handle by 0.05 rad requires the force limit of 1 N*m at once; the slew limit takes 5 ms for it.
TEST(Measure, LimitsTheSlewByTheForceLimitOfTheProbe) {
    Measurement probing;
    probing.options.probe = true;
    probing.options.force_limit = 1.0;
    probing.device = test::moved_device({[](std::uint64_t sample) { return sample < 300 ? 0.0 : 0.05; }});
    const Summary summary = probing.run();
    double fastest = 0.0;
    for (std::size_t k = 250; k < summary.kept.size(); ++k) {
        fastest = std::max(fastest, std::abs(summary.kept[k].applied - summary.kept[k - 1].applied));
    }
    EXPECT_NEAR(fastest, 0.2, 1e-9);
}

TEST(Measure, RecordsTheForceSentWithPushes) {
    Measurement pushing;
    pushing.options.push = 2.0;
    pushing.options.loop.duration_s = 0.6;
    pushing.device = test::moved_device({[](std::uint64_t) { return 0.0; }, 0.0, 7.0});
    const Summary summary = pushing.run();
    EXPECT_DOUBLE_EQ(summary.forces.lower, -2.0);  // the second push, after the ramp
    EXPECT_DOUBLE_EQ(summary.forces.upper, 2.0);
    EXPECT_EQ(summary.report.loop.ticks_by_status[static_cast<std::size_t>(Status::Ramp)], 200U);
    EXPECT_GT(summary.report.loop.ticks_by_status[static_cast<std::size_t>(Status::Limited)], 0U)
        << "the slew limit rounds the pushes";
}

TEST(Measure, RecordsTheMotorOfADeviceThatRenders) {
    Measurement rendered;
    rendered.options.device_renders = true;
    rendered.device->device().own_force = 0.375;
    rendered.device->device().measured = 7.0;
    rendered.device->transducer = false;
    const Summary summary = rendered.run();
    EXPECT_EQ(summary.forces.lower, 0.375);
    EXPECT_EQ(summary.forces.upper, 0.375);
    for (const bool probe : {false, true}) {
        rendered.options.probe = probe;
        rendered.options.push = probe ? std::optional<double>{} : 0.1;
        EXPECT_EQ(rendered.refused(),
                  "device_renders is set: leave out probe and push, because the host makes no force");
    }
}

TEST(Measure, IsRefusedWithoutTheReasonForItsForce) {
    Measurement refused;
    refused.device->rate_hz = 50.0;
    EXPECT_EQ(refused.refused(), "rate_hz is 50, must be 100 to 10000");
    refused.device->rate_hz = 1000.0;
    refused.device->device().refusal = "no cable";
    EXPECT_EQ(refused.refused(), "no cable");
    refused.device->device().refusal = "";
    refused.device->profile.coulomb_friction = -1.0;
    EXPECT_EQ(refused.refused(), "device_friction is -1, must be >= 0");
}

class RecordedMeasurement : public testing::Test {
  protected:
    void SetUp() override {
        std::string pattern = testing::TempDir() + "measure-XXXXXX";
        ASSERT_NE(mkdtemp(pattern.data()), nullptr);
        folder = pattern;
        measured.options.record = folder / "a.csv";
        measured.options.created_by = "a test";
        measured.options.loop.duration_s = 0.1;
        measured.device->metadata.emplace_back("serial", "5");
    }
    void TearDown() override { std::filesystem::remove_all(folder); }

    /// Returns the recording without its rows.
    [[nodiscard]] std::string head() {
        measured.options.force = true;
        const Summary summary = measured.run();
        EXPECT_EQ(summary.recorded, 100U);
        std::ifstream stream{measured.options.record};
        const std::string text{std::istreambuf_iterator<char>{stream}, {}};
        return text.substr(0, text.find("time_s,"));
    }
    void expect(const std::string& part) {
        const std::string text = head();
        EXPECT_NE(text.find(part), std::string::npos) << text;
    }

    Measurement measured;
    std::filesystem::path folder;
};

TEST_F(RecordedMeasurement, StatesTheSourceOfItsForceAndOfTheMotion) {
    const std::string device = "# created_by: a test\n# device: simulated-knob\n# serial: 5\n";
    const std::string rate = "# rate_hz: 1000\n";
    expect(device +
           "# force: of the object against the handle, from the device's force transducer\n# moved_by: a "
           "hand\n" +
           rate);
    measured.options.probe = true;
    measured.options.upper = 0.25;
    measured.options.speed = 0.125;
    measured.options.force_limit = 2.0;
    const std::string sweep =
        "# moved_by: the device: a sweep from 0 to 0.25 at 0.125 a second, with a force of at most 2\n";
    expect(sweep + rate);
    measured.device->transducer = false;
    expect(device + "# force: of the motor against the object, including the device's friction\n" + sweep +
           rate);
    measured.options.probe = false;
    measured.options.device_renders = true;
    expect("# force: of the motor, from the model that the device renders\n# moved_by: a hand\n");
}

TEST_F(RecordedMeasurement, NeedsATransducerOrAProbe) {
    measured.device->transducer = false;
    const std::string reason =
        "simulated-knob has no force transducer, so it cannot measure a force while a hand moves the handle: "
        "set probe";
    EXPECT_EQ(measured.refused(), reason);
    measured.options.push = 0.1;
    EXPECT_EQ(measured.refused(), reason);
    measured.options.push.reset();
    measured.options.record.clear();
    EXPECT_EQ(measured.refused(), "") << "without a recording the force is not needed";
    measured.options.record = folder / "b.csv";
    measured.options.probe = true;
    EXPECT_EQ(measured.refused(), "");
}

TEST_F(RecordedMeasurement, NotesAnInterruptedRecording) {
    std::ofstream{measured.options.record + ".part"} << "interrupted\n";
    EXPECT_EQ(measured.run().notes,
              std::vector<std::string>{"an earlier recording that was interrupted is kept as " +
                                       measured.options.record + ".1.part"});
    EXPECT_EQ(measured.refused().rfind(measured.options.record + " exists already", 0), 0U);
}

}  // namespace
}  // namespace palpate
