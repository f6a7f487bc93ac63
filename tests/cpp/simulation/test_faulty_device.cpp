// SPDX-License-Identifier: Apache-2.0
// Simulates device faults in random order, in virtual time, and tests the forces, the exit status and the files of
// each run.
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/rendering/make_structure.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/run/session.hpp"
#include "palpate/run/session_text.hpp"
#include "palpate/simulation/faulty_device.hpp"
#include "palpate/simulation/simulated_device.hpp"
#include "palpate/simulation/test_rig.hpp"
#include "support.hpp"

namespace palpate {
namespace {

constexpr double period_s = 1e-3;

/// Makes the tick with the number `tick` late by the time `by` [ns]; all other ticks are on time.
struct LateTick {
    std::uint64_t tick = 0;
    Nanoseconds by = 0;
};

/// A clock that meets all deadlines except one, without real waiting.
class VirtualClock {
  public:
    explicit VirtualClock(LateTick late) : late_{late} {}
    void start() noexcept { now_ = 0; }
    [[nodiscard]] Wake wait() noexcept {
        now_ += 1'000'000;
        return {now_, now_ + (tick_++ == late_.tick ? late_.by : 0), 0};
    }

  private:
    LateTick late_;
    std::uint64_t tick_ = 0;
    Nanoseconds now_ = 0;
};

/// Stores the forces sent to the device, and the moment at which the device is closed.
struct Observed {
    std::vector<double> forces;
    bool closed = false;
};

template <Device D>
class Observing {
  public:
    Observing(D device, Observed& observed) : device_{std::move(device)}, observed_{observed} {}
    Opened open() { return device_.open(); }
    [[nodiscard]] Reading exchange(const Command& command) noexcept {
        observed_.forces.push_back(command.force);
        return device_.exchange(command);
    }
    void close() noexcept {
        observed_.closed = true;
        device_.close();
    }

  private:
    D device_;
    Observed& observed_;
};

struct Collected {
    std::vector<TickRecord> ticks;
    RecordingFile* file = nullptr;
    void push(const TickRecord& tick) noexcept {
        ticks.push_back(tick);
        if (file != nullptr) {
            file->take({&tick, 1});
        }
    }
};

struct Rendering {
    Observed observed;
    std::vector<TickRecord> ticks;
    std::unique_ptr<LoopReport> report = std::make_unique<LoopReport>();
    GuardSettings guards;
};

/// Returns a spring of 8 N*m/rad over half a revolution of the knob, with forces up to 4 N*m.
ForceModel spring() {
    NetworkParameters network;
    network.linear = {8.0};
    return {network, Domain{{0.0}, {0.5}, Continuation::Linear, Continuation::Linear, std::nullopt}};
}

Rendering render(const std::vector<Fault>& faults, const LoopSettings& settings,
                 RecordingFile* file = nullptr, LateTick late = {}) {
    Rendering run;
    const ForceModel model = spring();
    const TestRig rig = rig_for(model, true, period_s);
    run.guards = guards_for(rig.scale, rig.device);
    run.guards.ramp_s = 0.02;
    Observing device{
        Faulty{SimulatedDevice{rig.device, rig.hand, 4}, faults, 3.0 * run.guards.largest_speed * period_s},
        run.observed};
    EXPECT_TRUE(device.open());
    Controller controller{device, make_structure(model, rig.scheme(model), period_s, rig.device.force_limit),
                          guards_of(run.guards, model, rig.scheme(model), period_s)};
    VirtualClock clock{late};
    Collected sink;
    sink.file = file;
    LoopProgress progress;
    const std::atomic<bool> stop_requested{false};
    run_loop(controller, settings, clock, stop_requested, sink, progress, *run.report);
    run.ticks = std::move(sink.ticks);
    return run;
}

Rendering render(const std::vector<Fault>& faults, double duration_s, RecordingFile* file = nullptr) {
    LoopSettings settings;
    settings.duration_s = duration_s;
    return render(faults, settings, file);
}

/// Checks the force limit, the slew limit, and zero force in ticks with a fault status.
void expect_safe(const Rendering& run) {
    const double step = slew_limit(run.guards, period_s).largest_step;
    double last = 0.0;
    for (const TickRecord& tick : run.ticks) {
        ASSERT_TRUE(std::isfinite(tick.force));
        ASSERT_LE(std::abs(tick.force), run.guards.force_limit);
        if (sends_force(tick.status)) {
            ASSERT_LE(std::abs(tick.force - last), step * (1.0 + 1e-12));
        } else {
            ASSERT_EQ(tick.force, 0.0) << text(tick.status).word;
        }
        last = tick.force;
    }
    // The device receives one force for each tick, one force when the run starts, and a force of zero when the run
    // ends.
    ASSERT_EQ(run.observed.forces.size(), run.ticks.size() + 2);
    for (std::size_t k = 0; k < run.ticks.size(); ++k) {
        ASSERT_EQ(run.observed.forces[k + 1], run.ticks[k].force);
    }
    ASSERT_EQ(run.observed.forces.front(), 0.0);
    ASSERT_EQ(run.observed.forces.back(), 0.0);
    ASSERT_TRUE(run.observed.closed);
}

// A suspended process wakes up late: the run ends before the next tick, which would send a force.
TEST(Faults, RunThatEndsBeforeATickCountsTheTicksThatAreRecorded) {
    LoopSettings settings;
    settings.duration_s = 2.0;
    const Rendering slow = render({}, settings, nullptr, {1000, 400'000'000});
    EXPECT_EQ(slow.report->exit_reason, ExitReason::RateTooLow);
    settings.longest_period_s = 1.5 * period_s;
    const Rendering late = render({}, settings, nullptr, {1000, 400'000'000});
    EXPECT_EQ(late.report->exit_reason, ExitReason::NotCertified);
    for (const Rendering* run : {&slow, &late}) {
        EXPECT_EQ(run->report->ticks(), run->ticks.size());
        EXPECT_EQ(run->report->timing.wakes(), run->ticks.size() + 1);
        EXPECT_EQ(run->observed.forces.back(), 0.0);
        const std::string counted = " over " + std::to_string(run->ticks.size()) + " ticks;";
        EXPECT_NE(timing_text(*run->report, 1000.0).find(counted), std::string::npos);
    }
}

TEST(Faults, RunWithoutFaultsIsOrderly) {
    const Rendering run = render({}, 2.0);
    expect_safe(run);
    EXPECT_EQ(run.report->exit_reason, ExitReason::TimeUp);
    EXPECT_EQ(run.ticks.size(), 2000U);
    EXPECT_EQ(run.report->ticks_by_status[static_cast<std::size_t>(Status::Ramp)], 20U);
    EXPECT_EQ(run.report->ticks_by_status[static_cast<std::size_t>(Status::Ok)], 1980U);
    const auto largest = std::max_element(run.ticks.begin(), run.ticks.end(),
                                          [](const auto& a, const auto& b) { return a.force < b.force; });
    EXPECT_GT(largest->force, 2.0);
}

// If a device held a force longer than certified, the certificate is not valid for any later motion of this run.
TEST(Faults, TickLaterThanCertifiedEndsTheRunWithZeroForceAndAReason) {
    LoopSettings settings;
    settings.duration_s = 1.0;
    settings.longest_period_s = 1.5e-3;
    const Rendering punctual = render({}, settings, nullptr, {400, 499'000});
    EXPECT_EQ(punctual.report->exit_reason, ExitReason::TimeUp);
    const Rendering late = render({}, settings, nullptr, {400, 501'000});
    expect_safe(late);
    EXPECT_EQ(late.report->exit_reason, ExitReason::NotCertified);
    EXPECT_FALSE(is_orderly(late.report->exit_reason));
    ASSERT_EQ(late.ticks.size(), 400U) << "the late tick makes no force";
    EXPECT_GT(late.ticks.back().force, 0.1);
    EXPECT_EQ(exit_text(*late.report, settings),
              "stopped because a tick started 1.501 ms after the previous tick: the certificate holds for at "
              "most 1.5 ms");
}

struct Expected {
    FaultKind kind;
    Status status;
    ExitReason exit_reason;
};

TEST(Faults, EachHasItsStatusAndZeroForceInItsTick) {
    // Each fault occurs 0.4 s after the start, when the hand is moving and the force is far from zero.
    for (const Expected& expected :
         std::vector<Expected>{{FaultKind::Late, Status::Timeout, ExitReason::TimeUp},
                               {FaultKind::Lost, Status::Lost, ExitReason::TimeUp},
                               {FaultKind::Repeated, Status::Lost, ExitReason::TimeUp},
                               {FaultKind::NotANumber, Status::NonFinite, ExitReason::TimeUp},
                               {FaultKind::Jump, Status::Jump, ExitReason::Guard},
                               {FaultKind::Gone, Status::Fault, ExitReason::DeviceFault}}) {
        const Rendering run = render({{expected.kind, 400, 1}}, 1.0);
        const std::string name{fault_names[static_cast<std::size_t>(expected.kind)]};
        expect_safe(run);
        ASSERT_GT(run.ticks.size(), 400U);
        EXPECT_GT(run.ticks[399].force, 0.1) << name;
        EXPECT_EQ(run.ticks[400].status, expected.status) << name;
        EXPECT_EQ(run.ticks[400].force, 0.0) << name;
        EXPECT_EQ(run.report->exit_reason, expected.exit_reason) << name;
        if (is_final(expected.status)) {
            EXPECT_EQ(run.ticks.size(), 401U) << name;
        } else {
            EXPECT_EQ(run.ticks[401].status == Status::Ok || run.ticks[401].status == Status::Limited, true)
                << name;
        }
    }
}

TEST(Faults, FrozenEncoderIsDetectedWhileTheHandleMoves) {
    const Rendering run = render({{FaultKind::Frozen, 300, 100'000}}, 1.0);
    expect_safe(run);
    EXPECT_EQ(run.report->exit_reason, ExitReason::Guard);
    EXPECT_EQ(run.report->status, Status::Frozen);
    EXPECT_LE(run.ticks.size(), 300U + 52U);
}

TEST(Faults, SaturatedMotorIsReportedAndTolerated) {
    const Rendering run = render({{FaultKind::Saturated, 300, 50}}, 1.0);
    expect_safe(run);
    EXPECT_EQ(run.report->exit_reason, ExitReason::TimeUp);
    EXPECT_EQ(run.report->ticks_by_status[static_cast<std::size_t>(Status::Limited)], 50U);
    EXPECT_NEAR(run.ticks[320].applied, 0.5 * run.ticks[319].force, 1e-12);
}

TEST(Faults, OneBadSampleMoreThanToleratedEndsTheRun) {
    for (const std::uint64_t samples : {5U, 6U}) {
        const Rendering late = render({{FaultKind::Late, 300, samples}}, 0.5);
        const Rendering nan = render({{FaultKind::NotANumber, 300, samples}}, 0.5);
        EXPECT_EQ(late.report->exit_reason, samples == 5 ? ExitReason::TimeUp : ExitReason::DeviceFault);
        EXPECT_EQ(nan.report->exit_reason, samples == 5 ? ExitReason::TimeUp : ExitReason::Guard);
    }
}

TEST(Faults, LostAndRepeatedSamplesAreCounted) {
    const Rendering run =
        render({{FaultKind::Lost, 100, 3}, {FaultKind::Repeated, 200, 2}, {FaultKind::Late, 300, 2}}, 0.5);
    EXPECT_EQ(run.report->lost_samples, 3U);
    EXPECT_EQ(run.report->repeated_samples, 2U);
    EXPECT_EQ(run.report->ticks_by_status[static_cast<std::size_t>(Status::Timeout)], 2U);
}

/// A temporary folder that the destructor removes.
class Scratch {
  public:
    Scratch()
        : path_{std::filesystem::temp_directory_path() / ("palpate-faults-" + std::to_string(::getpid()))} {
        std::filesystem::create_directories(path_);
    }
    ~Scratch() { std::filesystem::remove_all(path_); }
    Scratch(const Scratch&) = delete;
    Scratch& operator=(const Scratch&) = delete;
    [[nodiscard]] std::string file(const std::string& name) const { return (path_ / name).string(); }

  private:
    std::filesystem::path path_;
};

std::size_t rows_of(const std::string& name) {
    std::ifstream stream{name};
    std::size_t rows = 0;
    for (std::string line; std::getline(stream, line);) {
        rows += line.empty() || line[0] == '#' || line.rfind("time_s", 0) == 0 ? 0 : 1;
    }
    return rows;
}

TEST(Faults, InAnyOrderTheForceStaysSafeAndTheRecordIsComplete) {
    test::Random random{20};
    const Scratch scratch;
    const int wanted = test::cases(100);
    int done = 0;
    for (int number = 0; done < wanted; ++number) {
        std::vector<Fault> faults;
        std::uint64_t at = 20;
        while (at < 480) {
            at += static_cast<std::uint64_t>(test::uniform(random, 1.0, 120.0));
            const auto kind = static_cast<FaultKind>(static_cast<int>(test::uniform(random, 0.0, 8.0)));
            const auto samples = static_cast<std::uint64_t>(test::uniform(random, 1.0, 9.0));
            faults.push_back({kind, at, kind == FaultKind::Frozen ? 80 : samples});
            at += faults.back().samples;
        }
        const std::string name = scratch.file("felt" + std::to_string(number % 50) + ".csv");
        RecordingFile file;
        ASSERT_EQ(file.open(name, {}, {{"model", "spring"}}, true), "");
        const Rendering run = render(faults, 0.5, &file);
        expect_safe(run);
        if (HasFatalFailure()) {
            for (const Fault& fault : faults) {
                std::cerr << fault_names[static_cast<std::size_t>(fault.kind)] << "@" << fault.exchange << "x"
                          << fault.samples << "\n";
            }
            return;
        }
        const std::size_t ticks = run.ticks.size();
        for (const Fault& fault : faults) {
            if (fault.exchange >= ticks) {
                break;
            }
            ++done;
            if (fault.kind != FaultKind::Frozen && fault.kind != FaultKind::Saturated) {
                EXPECT_EQ(run.ticks[fault.exchange].force, 0.0)
                    << fault_names[static_cast<std::size_t>(fault.kind)] << " at " << fault.exchange;
            }
            if (fault.kind == FaultKind::Gone || fault.kind == FaultKind::Jump) {
                EXPECT_EQ(ticks, fault.exchange + 1);
            }
        }
        const bool bad_end = !sends_force(run.report->status);
        EXPECT_EQ(is_orderly(run.report->exit_reason), ticks == 500 && !is_final(run.report->status));
        EXPECT_TRUE(is_orderly(run.report->exit_reason) || bad_end);
        EXPECT_EQ(file.finish(exit_text(*run.report, {}), "virtual"), "");
        EXPECT_EQ(rows_of(name), ticks);
    }
}

TEST(FaultScript, IsReadFromTheCommandLine) {
    const Fault fault = parse_fault("frozen@1.5x200", 1e-3);
    EXPECT_EQ(fault.kind, FaultKind::Frozen);
    EXPECT_EQ(fault.exchange, 1500U);
    EXPECT_EQ(fault.samples, 200U);
    EXPECT_EQ(parse_fault("late@0", 1e-3).samples, 1U);
    for (const char* wrong :
         {"", "late", "late@", "late@x3", "late@-1", "late@1x", "late@1xa", "soft@1", "late@nan"}) {
        EXPECT_THROW((void)parse_fault(wrong, 1e-3), std::invalid_argument) << wrong;
    }
}

}  // namespace
}  // namespace palpate
