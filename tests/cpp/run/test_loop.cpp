// SPDX-License-Identifier: Apache-2.0
#include "palpate/run/loop.hpp"
#include "special_values.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/guard/guards.hpp"
#include "support.hpp"

namespace palpate {
namespace {

// The plan may use up the whole reserve of an inequality, and the rate is one over the period, rounded.
TEST(LoopSettings, AcceptACertificateThatHoldsForExactlyOnePeriod) {
    for (int microseconds = 100; microseconds <= 10'000; ++microseconds) {
        LoopSettings settings;
        settings.longest_period_s = 1e-6 * microseconds;
        settings.rate_hz = 1.0 / settings.longest_period_s;
        EXPECT_NO_THROW(validate(settings)) << microseconds << " us";
        settings.longest_period_s *= 0.999;
        EXPECT_THROW(validate(settings), std::invalid_argument) << microseconds << " us";
    }
}

// ---------------------------------------------------------------------------------------------- settings

using test::infinity;
using test::nan;

/// Returns the message with which settings are refused; empty if they are accepted.
std::string loop_refusal(const std::function<void(LoopSettings&)>& change) {
    LoopSettings settings;
    change(settings);
    return test::refusal([&] { validate(settings); });
}

std::string loop_refusal(double LoopSettings::* field, double value) {
    return loop_refusal([&](LoopSettings& settings) { settings.*field = value; });
}

TEST(LoopSettings, AreRefusedJustOutsideOfTheirRange) {
    EXPECT_EQ(loop_refusal([](LoopSettings&) {}), "");
    for (const double rate : {100.0, 10'000.0}) {
        EXPECT_EQ(loop_refusal(&LoopSettings::rate_hz, rate), "");
    }
    EXPECT_EQ(loop_refusal(&LoopSettings::rate_hz, 99.0), "rate_hz is 99, must be 100 to 10000");
    EXPECT_EQ(loop_refusal(&LoopSettings::rate_hz, 10'001.0), "rate_hz is 10001, must be 100 to 10000");
    for (const double rate : {std::nextafter(100.0, 0.0), std::nextafter(10'000.0, infinity), nan}) {
        EXPECT_NE(loop_refusal(&LoopSettings::rate_hz, rate), "");
    }

    for (const double duration : {std::numeric_limits<double>::denorm_min(), 0.5, infinity}) {
        EXPECT_EQ(loop_refusal(&LoopSettings::duration_s, duration), "");
    }
    EXPECT_EQ(loop_refusal(&LoopSettings::duration_s, 0.0), "duration_s is 0, must be > 0");
    EXPECT_EQ(loop_refusal(&LoopSettings::duration_s, -2.0), "duration_s is -2, must be > 0");
    EXPECT_EQ(loop_refusal(&LoopSettings::duration_s, nan), "duration_s is nan, must be > 0");

    for (const double share : {0.0, 0.5, 1.0}) {
        EXPECT_EQ(loop_refusal(&LoopSettings::lowest_rate_share, share), "");
    }
    EXPECT_EQ(loop_refusal(&LoopSettings::lowest_rate_share, -0.5),
              "lowest_rate_share is -0.5, must be 0 to 1");
    EXPECT_EQ(loop_refusal(&LoopSettings::lowest_rate_share, 1.5),
              "lowest_rate_share is 1.5, must be 0 to 1");
    for (const double share : {-std::numeric_limits<double>::denorm_min(), std::nextafter(1.0, 2.0), nan}) {
        EXPECT_NE(loop_refusal(&LoopSettings::lowest_rate_share, share), "");
    }
}

// With a rate of a power of two, the product of rate and period is exact.
TEST(LoopSettings, AcceptALongestPeriodThatIsShorterOnlyByRounding) {
    const auto with_period = [](double periods) {
        return loop_refusal([&](LoopSettings& settings) {
            settings.rate_hz = 1024.0;
            settings.longest_period_s = periods / 1024.0;
        });
    };
    const double shortest = 1.0 - 1e-9;
    EXPECT_EQ(with_period(infinity), "");
    EXPECT_EQ(with_period(shortest), "");
    EXPECT_NE(with_period(std::nextafter(shortest, 0.0)), "");
    EXPECT_EQ(with_period(0.512), "longest_period_s is 0.0005, must be at least one period");
    EXPECT_NE(with_period(nan), "");
}

// ------------------------------------------------------------------------------- records and exit reasons

TEST(ExitReason, IsOrderlyAfterTheDurationOrARequest) {
    EXPECT_TRUE(is_orderly(ExitReason::TimeUp));
    EXPECT_TRUE(is_orderly(ExitReason::StopRequested));
    for (const ExitReason reason :
         {ExitReason::Guard, ExitReason::DeviceFault, ExitReason::RateTooLow, ExitReason::NotCertified}) {
        EXPECT_FALSE(is_orderly(reason));
    }
}

TEST(RecordOf, ContainsEveryValueOfATick) {
    Tick tick;
    tick.reading = {1.0, 2.0, 3.0, 4.0, 5.0, 6, Status::Ok, 11.0};
    tick.rendered = {7.0, 8.0, 9, Status::Ok, true};
    tick.command.force = 10.0;
    tick.status = Status::Limited;
    const TickRecord record = record_of(tick, {.deadline = 5'000'000, .now = 7'500'000}, 1'000'000);
    EXPECT_DOUBLE_EQ(record.time, 6.5e-3);
    EXPECT_DOUBLE_EQ(record.lateness, 2.5e-3);
    EXPECT_EQ(record.position, 1.0);
    EXPECT_EQ(record.velocity, 2.0);
    EXPECT_EQ(record.applied, 3.0);
    EXPECT_EQ(record.measured, 4.0);
    EXPECT_EQ(record.device_time, 5.0);
    EXPECT_EQ(record.delay, 11.0);
    EXPECT_EQ(record.sequence, 6U);
    EXPECT_EQ(record.environment_position, 8.0);
    EXPECT_EQ(record.evaluations, 9);
    EXPECT_EQ(record.force, 10.0);
    EXPECT_EQ(record.status, Status::Limited);
    EXPECT_TRUE(record.extrapolated);
}

// The device ends the run for its own statuses; for all others a guard does.
TEST(MustStop, AfterAFinalStatusOrMoreBadTicksThanTolerated) {
    for (std::size_t k = 0; k < status_texts.size(); ++k) {
        const auto status = static_cast<Status>(k);
        const std::string word = text(status).word;
        const bool at_once =
            word == "Fault" || word == "Jump" || word == "Frozen" || word == "Stale" || word == "Saturated";
        const bool of_device = word == "Fault" || word == "Timeout" || word == "Lost";
        for (const std::uint64_t tolerated : {0U, 3U}) {
            for (std::uint64_t bad = 0; bad < 6; ++bad) {
                ExitReason reason = ExitReason::TimeUp;
                const bool stops = detail::must_stop(status, bad, tolerated, reason);
                EXPECT_EQ(stops, at_once || bad > tolerated) << word << ", " << bad;
                EXPECT_EQ(reason, !stops            ? ExitReason::TimeUp
                                  : word == "Stale" ? ExitReason::NotCertified
                                  : of_device       ? ExitReason::DeviceFault
                                                    : ExitReason::Guard)
                    << word;
            }
        }
    }
}

// ------------------------------------------------------------------------------------------------- the loop

constexpr Nanoseconds period_ns = 1'000'000;
constexpr Nanoseconds start_ns = 7'000'000'000;

/// A device that returns prescribed readings, then the last one with new sample numbers.
struct ListedDevice {
    std::vector<Reading> readings{Reading{}};
    std::vector<double> sent{};
    int closed = 0;

    Opened open() { return {}; }
    [[nodiscard]] Reading exchange(const Command& command) noexcept {
        const std::size_t at = sent.size();
        sent.push_back(command.force);
        Reading reading = readings[std::min(at, readings.size() - 1)];
        if (reading.sequence == 0) {
            reading.sequence = at + 1;
        }
        return reading;
    }
    ZeroForce close() noexcept {
        ++closed;
        return at_close;
    }
    ZeroForce at_close = ZeroForce::Confirmed;
};

/// A clock that wakes up at prescribed times. The loop must end before the times do.
struct ListedClock {
    std::vector<Wake> wakes;
    std::size_t at = 0;
    int starts = 0;

    void start() noexcept { ++starts; }
    [[nodiscard]] Wake wait() noexcept {
        if (at == wakes.size()) {
            std::abort();
        }
        return wakes[at++];
    }
};

/// Returns wake-ups at the times of a period.
ListedClock regular(std::size_t ticks, Nanoseconds period = period_ns) {
    ListedClock clock;
    for (std::size_t k = 0; k < ticks; ++k) {
        const Nanoseconds now = start_ns + static_cast<Nanoseconds>(k) * period;
        clock.wakes.push_back({.deadline = now, .now = now});
    }
    return clock;
}

/// The force 2 x, of an object that lags behind the handle by 0.25.
struct Lagging {
    void reset(double /*position*/) noexcept {}
    [[nodiscard]] Rendered step(double position) noexcept {
        return {2.0 * position, position - 0.25, 3, Status::Ok, position > 1.0};
    }
};

/// One run of the loop, with all records.
struct LoopRun {
    ListedDevice device{};
    Guards guards{};
    LoopSettings settings{};
    ListedClock clock{};
    std::size_t stop_after = 0;  ///< number of ticks after which a stop is requested; 0: never

    std::vector<TickRecord> records{};
    std::unique_ptr<LoopProgress> progress = std::make_unique<LoopProgress>();
    std::unique_ptr<LoopReport> report = std::make_unique<LoopReport>();

    void go(ExitReason before) {
        struct Sink {
            LoopRun& run;
            std::atomic<bool>& stop;
            void push(const TickRecord& record) noexcept {
                run.records.push_back(record);
                stop = run.records.size() == run.stop_after;
            }
        };
        std::atomic<bool> stop{false};
        Sink sink{*this, stop};
        report->exit_reason = before;
        Controller controller{device, Lagging{}, guards};
        run_loop(controller, settings, clock, stop, sink, *progress, *report);
        EXPECT_EQ(clock.starts, 1);
        EXPECT_EQ(device.closed, 1);
        EXPECT_EQ(device.sent.size(), records.size() + 2);
        EXPECT_EQ(device.sent.back(), 0.0);
        EXPECT_EQ(report->ticks(), records.size());
    }
};

TEST(RunLoop, RunsTheRoundedNumberOfTicksAndAtLeastOne) {
    for (const auto& [duration_s, ticks] :
         {std::pair{1e-9, 1U}, {0.0006, 1U}, {0.001, 1U}, {0.0024, 2U}, {0.0026, 3U}, {0.05, 50U}}) {
        LoopRun run;
        run.settings.duration_s = duration_s;
        run.clock = regular(ticks);
        run.go(ExitReason::Guard);
        EXPECT_EQ(run.records.size(), ticks) << duration_s;
        EXPECT_EQ(run.report->exit_reason, ExitReason::TimeUp);
        EXPECT_EQ(run.report->status, Status::Ok);
    }
}

// The command of a sample acts late: the force that is computed from this sample must not be sent.
TEST(RunLoop, EndsAtTheFirstForceThatIsLaterThanAllowed) {
    LoopRun run;
    run.guards.reading = ReadingGuard{{.longest_delay = 2e-3}};
    run.clock = regular(10);
    for (const double delay : {1e-3, 2e-3, 3e-3, 1e-3}) {
        run.device.readings.push_back({.position = 1.0, .delay = delay});
    }
    run.go(ExitReason::Guard);
    EXPECT_EQ(run.report->exit_reason, ExitReason::NotCertified);
    EXPECT_EQ(run.report->status, Status::Stale);
    EXPECT_EQ(run.report->largest_delay, 3e-3);
    EXPECT_EQ(run.report->longest_delay, 2e-3);
    ASSERT_EQ(run.records.size(), 4U);
    EXPECT_EQ(run.records[2].force, 2.0);
    EXPECT_EQ(run.records[3].force, 0.0);
    EXPECT_EQ(run.records[3].delay, 3e-3);
}

TEST(RunLoop, ReportsWhatTheDeviceConfirmedAtTheEnd) {
    for (const ZeroForce zero_force :
         {ZeroForce::Commanded, ZeroForce::NotSent, ZeroForce::Sent, ZeroForce::Confirmed}) {
        LoopRun run;
        run.settings.duration_s = 0.001;
        run.clock = regular(1);
        run.device.at_close = zero_force;
        run.go(ExitReason::Guard);
        EXPECT_EQ(run.report->zero_force, zero_force);
    }
}

TEST(RunLoop, CountsSkippedTicksForTheDuration) {
    for (const std::uint64_t skipped : {3U, 4U}) {
        LoopRun run;
        run.settings.duration_s = 0.01;
        run.clock = regular(10);
        run.clock.wakes[2].skipped = skipped;
        run.clock.wakes[4].skipped = 1;
        run.go(ExitReason::Guard);
        EXPECT_EQ(run.records.size(), 9 - skipped);
        EXPECT_EQ(run.report->timing.missed, skipped + 1);
    }
}

TEST(RunLoop, RunsUntilAStopIfItsDurationIsInfinite) {
    LoopRun run;
    run.settings.duration_s = infinity;
    run.clock = regular(700);
    run.stop_after = 700;
    run.go(ExitReason::Guard);
    EXPECT_EQ(run.records.size(), 700U);
    EXPECT_EQ(run.report->exit_reason, ExitReason::StopRequested);
}

TEST(RunLoop, SumsUpTheRunForTheReportAndForOtherThreads) {
    LoopRun run;
    run.settings.duration_s = 0.007;
    run.clock = regular(6);
    run.clock.wakes[3].skipped = 1;
    run.clock.wakes[4].now += 1'000;
    Reading reading;
    reading.position = 0.5;
    reading.applied = 0.75;
    reading.measured = -0.125;
    run.device.readings.assign(6, reading);
    run.device.readings[2].sequence = 5;  // samples 3 and 4 are lost
    run.device.readings[3].sequence = 5;  // repeated
    run.device.readings[4].sequence = 6;
    run.device.readings[5].sequence = 7;
    run.device.readings[5].position = 1.5;
    run.device.readings.push_back(run.device.readings.back());
    run.go(ExitReason::Guard);
    ASSERT_EQ(run.records.size(), 6U);
    const LoopReport& report = *run.report;
    EXPECT_EQ(report.exit_reason, ExitReason::TimeUp);
    EXPECT_EQ(report.ticks_by_status[static_cast<std::size_t>(Status::Ok)], 4U);
    EXPECT_EQ(report.ticks_by_status[static_cast<std::size_t>(Status::Lost)], 2U);
    EXPECT_EQ(report.lost_samples, 2U);
    EXPECT_EQ(report.repeated_samples, 1U);
    EXPECT_EQ(report.limit_cycles, 0U);
    EXPECT_EQ(report.timing.wakes(), 6U);
    const LoopProgress& progress = *run.progress;
    EXPECT_EQ(progress.ticks, 6U);
    EXPECT_EQ(progress.missed, 1U);
    EXPECT_EQ(progress.lost, 2U);
    EXPECT_EQ(progress.position, 1.5);
    EXPECT_EQ(progress.force, 3.0);
    EXPECT_EQ(progress.applied, 0.75);
    EXPECT_EQ(progress.object_force, -0.125);
    EXPECT_DOUBLE_EQ(run.records[4].time, 0.004001);
    EXPECT_DOUBLE_EQ(run.records[4].lateness, 1e-6);
    EXPECT_EQ(run.records[2].status, Status::Lost);
    EXPECT_EQ(run.records[2].force, 0.0);
    EXPECT_TRUE(run.records[5].extrapolated);
    EXPECT_EQ(run.records[5].environment_position, 1.25);
}

TEST(RunLoop, ContinuesAfterAsManyBadTicksAsAreTolerated) {
    Reading bad;
    bad.status = Status::Timeout;
    const auto run_with = [&](std::size_t first, std::size_t count) {
        LoopRun run;
        run.settings.tolerated = 2;
        run.settings.duration_s = 0.02;
        run.clock = regular(20);
        run.device.readings.assign(20, Reading{});
        for (std::size_t k = 0; k < count; ++k) {
            run.device.readings[first + k] = bad;
        }
        run.go(ExitReason::TimeUp);
        return run;
    };
    for (const std::size_t first : {0U, 5U}) {
        EXPECT_EQ(run_with(first, 2).records.size(), 20U);
        const LoopRun ended = run_with(first, 3);
        EXPECT_EQ(ended.records.size(), first + 3);
        EXPECT_EQ(ended.report->exit_reason, ExitReason::DeviceFault);
        EXPECT_EQ(ended.report->status, Status::Timeout);
    }
}

TEST(RunLoop, AFaultInTheTickOfAStopIsReported) {
    LoopRun run;
    run.clock = regular(3);
    run.stop_after = 3;
    run.device.readings.assign(3, Reading{});
    run.device.readings[2].status = Status::Fault;
    run.go(ExitReason::TimeUp);
    EXPECT_EQ(run.report->exit_reason, ExitReason::DeviceFault);
}

// 400 ticks in half a second are 800 Hz, exactly the lowest rate.
TEST(RunLoop, EndsBeforeATickIfTheRateIsBelowItsShare) {
    LoopRun held;
    held.settings.duration_s = 0.5;
    held.settings.lowest_rate_share = 0.8;
    held.clock = regular(500, 1'250'000);
    held.go(ExitReason::Guard);
    EXPECT_EQ(held.records.size(), 500U);
    EXPECT_EQ(held.report->exit_reason, ExitReason::TimeUp);

    LoopRun slow;
    slow.settings.lowest_rate_share = 0.8;
    slow.clock = regular(500, 1'260'000);
    slow.go(ExitReason::Guard);
    EXPECT_EQ(slow.records.size(), 397U);  // 397 periods last longer than half a second, 396 do not
    EXPECT_EQ(slow.report->exit_reason, ExitReason::RateTooLow);
    EXPECT_EQ(slow.report->timing.wakes(), 398U);

    slow = {};
    slow.settings.lowest_rate_share = 0.0;
    slow.settings.duration_s = 0.5;
    slow.clock = regular(500, 1'260'000);
    slow.go(ExitReason::Guard);
    EXPECT_EQ(slow.report->exit_reason, ExitReason::TimeUp);
}

TEST(RunLoop, EndsBeforeATickThatIsLaterThanCertified) {
    for (const Nanoseconds late : {Nanoseconds{0}, Nanoseconds{1}}) {
        LoopRun run;
        run.settings.longest_period_s = static_cast<double>(1'500'000) * 1e-9;
        run.settings.duration_s = 0.01;
        run.clock = regular(10);
        for (std::size_t k = 6; k < 10; ++k) {
            run.clock.wakes[k].now += 500'000 + late;
        }
        run.go(ExitReason::Guard);
        EXPECT_EQ(run.records.size(), late == 0 ? 10U : 6U);
        EXPECT_EQ(run.report->exit_reason, late == 0 ? ExitReason::TimeUp : ExitReason::NotCertified);
        EXPECT_EQ(run.report->timing.wakes(), late == 0 ? 10U : 7U);
    }
}

// Energy given = - sum of the motor's force times the motion of the handle; its largest value in each part of the run.
TEST(RunLoop, ReportsTheEnergyOfRampAndRunSeparately) {
    const std::vector<std::pair<double, double>> motion{
        {0.0, 0.0},  {-0.1, 1.0}, {0.0, 2.0},               // in the ramp: gives 0.1 J, then absorbs 0.2 J
        {-0.2, 3.0}, {-0.3, 4.0}, {-0.1, 1.0}, {-0.2, 1.0}  // after it: 0.6, 1.0, 0.8 and 0.9 J
    };
    LoopRun run;
    run.guards.ramp = {3, 0};
    run.guards.account = EnergyAccount{{.stored = {.within = 40.0, .force_limit = 5.0}}};
    run.settings.duration_s = 0.007;
    run.clock = regular(7);
    run.device.readings.clear();
    for (const auto& [position, applied] : motion) {
        Reading reading;
        reading.position = position;
        reading.applied = applied;
        run.device.readings.push_back(reading);
    }
    run.go(ExitReason::Guard);
    EXPECT_DOUBLE_EQ(run.report->given_in_ramp, 0.1);
    EXPECT_DOUBLE_EQ(run.report->given, 1.0);
    EXPECT_DOUBLE_EQ(run.report->most_stored, 40.0);
    EXPECT_EQ(run.report->ticks_by_status[static_cast<std::size_t>(Status::Ramp)], 3U);

    LoopRun still;
    still.settings.duration_s = 0.003;
    still.clock = regular(3);
    still.go(ExitReason::Guard);
    for (const double given : {still.report->given, still.report->given_in_ramp}) {
        EXPECT_EQ(given, 0.0);
        EXPECT_FALSE(std::signbit(given)) << "the text of the report must not contain -0";
    }
}

// A handle that reverses in every tick is in a limit cycle after ten swings.
TEST(RunLoop, ReportsTheNumberOfLimitCycles) {
    LoopRun run;
    run.guards.limit_cycle = LimitCycleDetector{{.force_swing = 0.1, .longest_swing = 25}};
    run.settings.duration_s = 0.026;
    run.clock = regular(26);
    run.device.readings.clear();
    for (int k = 0; k < 26; ++k) {
        Reading reading;
        reading.position = k % 2 == 0 ? 0.5 : -0.5;
        run.device.readings.push_back(reading);
    }
    run.go(ExitReason::Guard);
    EXPECT_EQ(run.report->limit_cycles, 2U);
    EXPECT_NEAR(run.records.back().force, -1.0 * 0.7 * 0.7, 1e-12);
    EXPECT_EQ(run.report->status, Status::LimitCycleScaled);
}

}  // namespace
}  // namespace palpate
