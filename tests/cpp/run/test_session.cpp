// SPDX-License-Identifier: Apache-2.0
// Records and messages of a session. ctest runs these tests in virtual time.
#include "palpate/run/session.hpp"

#include <sched.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/rendering/direct.hpp"
#include "support.hpp"

namespace palpate {
namespace {

/// A device whose clock sets the rate: each exchange returns at once, or waits for the test.
struct PacedHandle {
    static constexpr bool paces_host = true;
    std::chrono::milliseconds first_takes{0};
    std::chrono::microseconds others_take{0};
    std::uint64_t sequence = 0;
    bool is_closed = false;

    Opened open() { return {}; }
    [[nodiscard]] Reading exchange(const Command& command) noexcept {
        if (sequence == 0) {
            std::this_thread::sleep_for(first_takes);
        } else if (others_take.count() > 0) {
            std::this_thread::sleep_for(others_take);
        }
        Reading reading;
        reading.position = 1e-3 * static_cast<double>(sequence);
        reading.applied = command.force;
        reading.sequence = ++sequence;
        return reading;
    }
    void close() noexcept { is_closed = true; }
};

/// Settings of a session without requests to the operating system.
SessionSettings session_of(double duration_s) {
    SessionSettings settings;
    settings.loop.duration_s = duration_s;
    settings.loop.lowest_rate_share = 0.0;
    settings.real_time = {.priority = 0, .cpu = -2};
    return settings;
}

SessionReport run(
    PacedHandle& device, const SessionSettings& settings, RecordSinks& sinks,
    const Watch& watch = [](const SessionView&) {}) {
    Controller controller{device, Direct{test::Spring{2.0}}, ForceLimit{}};
    const std::atomic<bool> stop_requested{false};
    return run_session(controller, settings, sinks, stop_requested, watch);
}

TEST(RunSession, PassesAllRecordsToTheSinksAndReturnsTheLastOnes) {
    PacedHandle device;
    RecordSinks sinks;
    sinks.keeps = true;
    SessionSettings settings = session_of(0.3);
    settings.last_ticks = 7;
    const SessionReport report = run(device, settings, sinks);
    EXPECT_TRUE(device.is_closed);
    EXPECT_EQ(report.loop.ticks(), 300U);
    EXPECT_EQ(report.loop.exit_reason, ExitReason::TimeUp);
    EXPECT_EQ(report.lost_records, 0U);
    ASSERT_EQ(sinks.kept.size(), 300U);
    for (std::size_t k = 0; k < 300; ++k) {
        ASSERT_EQ(sinks.kept[k].sequence, k + 1);
    }
    ASSERT_EQ(report.last_ticks.size(), 7U);
    for (std::size_t k = 0; k < 7; ++k) {
        EXPECT_EQ(report.last_ticks[k].sequence, 294 + k);
        EXPECT_EQ(report.last_ticks[k].force, sinks.kept[293 + k].force);
    }
}

// The first exchange ends after the recorder has emptied its buffer, and all others end before it does so again.
TEST(RunSession, LosesNoRecordWithinTheTimeOfItsBuffer) {
    for (const auto& [ring_s, ticks, loses] : {std::tuple{1.024, 1500, false}, {0.01, 1500, true}}) {
        PacedHandle device;
        device.first_takes = std::chrono::milliseconds{30};
        RecordSinks sinks;
        sinks.keeps = true;
        SessionSettings settings = session_of(1e-3 * ticks);
        settings.ring_s = ring_s;
        settings.hand_over_every = std::chrono::milliseconds{150};
        const SessionReport report = run(device, settings, sinks);
        EXPECT_EQ(report.loop.ticks(), static_cast<std::uint64_t>(ticks));
        EXPECT_EQ(report.lost_records > 0, loses);
        EXPECT_EQ(sinks.kept.size() + report.lost_records, static_cast<std::uint64_t>(ticks));
    }
}

TEST(RunSession, ShowsTheRefusedRequestsAndTheProgressToItsWatch) {
    PacedHandle device;
    device.others_take = std::chrono::microseconds{1000};
    RecordSinks sinks;
    SessionSettings settings = session_of(5.0);
    settings.real_time.cpu = CPU_SETSIZE - 1;  // no computer of a test has so many cores
    Controller controller{device, Direct{test::Spring{2.0}}, ForceLimit{}};
    std::atomic<bool> stop_requested{false};
    std::vector<std::string> seen;
    const SessionReport report =
        run_session(controller, settings, sinks, stop_requested, [&](const SessionView& view) {
            EXPECT_EQ(view.disk_error, 0);
            if (view.refused != nullptr && view.progress.ticks > 0) {
                seen = *view.refused;
                stop_requested = true;
            }
        });
    EXPECT_EQ(report.loop.exit_reason, ExitReason::StopRequested);
    EXPECT_FALSE(seen.empty());
    EXPECT_EQ(seen, report.refused);
    EXPECT_EQ(seen.back().rfind("the loop is not kept on core 1023 (", 0), 0U) << seen.back();
}

/// A device that the clock of the host paces.
struct HostPacedHandle : PacedHandle {
    static constexpr bool paces_host = false;
};

TEST(RunSession, PacesADeviceWithoutAClockByTheRate) {
    HostPacedHandle device;
    RecordSinks sinks;
    const SessionSettings settings = session_of(0.05);
    Controller controller{device, Direct{test::Spring{2.0}}, ForceLimit{}};
    const std::atomic<bool> stop_requested{false};
    const SessionReport report =
        run_session(controller, settings, sinks, stop_requested, [](const SessionView&) {});
    const LoopTiming& timing = report.loop.timing;
    EXPECT_GE(report.loop.ticks() + timing.missed, 50U);
    // Each wake-up comes at or after its deadline
    EXPECT_GE(static_cast<double>(timing.last - timing.first) + timing.lateness.quantile(1.0), 49e6);
}

}  // namespace
}  // namespace palpate
