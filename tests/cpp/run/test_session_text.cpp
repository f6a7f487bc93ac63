// SPDX-License-Identifier: Apache-2.0
#include "palpate/run/session_text.hpp"

#include <stdlib.h>
#include <sys/resource.h>

#include <csignal>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace palpate {
namespace {

/// Returns a report of 1001 ticks: 600 periods of 100 ns, 390 of 200 ns, 9 of 250 ns and one of 5 us. One tick is late
/// by 2 us and skips three deadlines.
std::unique_ptr<SessionReport> thousand_periods() {
    auto report = std::make_unique<SessionReport>();
    Nanoseconds now = 1'000'000;
    const auto tick = [&](Nanoseconds late, std::uint64_t skipped) {
        report->loop.timing.add({.deadline = now - late, .now = now, .skipped = skipped});
    };
    tick(0, 0);
    for (int k = 0; k < 1000; ++k) {
        now += k < 600 ? 100 : k < 990 ? 200 : k < 999 ? 250 : 5000;
        tick(k == 500 ? 2000 : 0, k == 500 ? 3 : 0);
    }
    report->loop.ticks_by_status[static_cast<std::size_t>(Status::Ok)] = 1000;
    report->loop.ticks_by_status[static_cast<std::size_t>(Status::Ramp)] = 1;
    return report;
}

constexpr auto period_percentiles = "p50 0.1 us, p99 0.2 us, p99.9 0.25 us, max 5 us";

TEST(Percentiles, AreThoseOfTheDurationsInMicroseconds) {
    EXPECT_EQ(percentiles(thousand_periods()->loop.timing.period), period_percentiles);
    EXPECT_EQ(percentiles({}), "p50 0 us, p99 0 us, p99.9 0 us, max 0 us");
}

// 1000 periods in 60 + 78 + 2.25 + 5 us
TEST(TimingText, StatesRatePeriodsAndDelays) {
    EXPECT_EQ(timing_text(thousand_periods()->loop, 2000.0),
              "6884682 Hz of 2000 Hz over 1001 ticks; period " + std::string(period_percentiles) +
                  "; late by p50 0 us, p99 0 us, p99.9 0 us, max 2 us; missed deadlines 3; longest gap 5 us");
}

TEST(ClosingText, StatesWhatIsKnownAboutTheForce) {
    EXPECT_EQ(closing_text(ZeroForce::Commanded), "zero force commanded, device closed");
    EXPECT_EQ(closing_text(ZeroForce::NotSent),
              "zero force could not be sent: switch the motor off if it still pushes");
    EXPECT_EQ(closing_text(ZeroForce::Sent),
              "zero force sent, but not confirmed by the device: switch the motor off if it still pushes");
    EXPECT_EQ(closing_text(ZeroForce::Confirmed), "zero force sent and confirmed, device closed");
}

TEST(DelayText, StatesTheLargestAndTheAllowedDelay) {
    LoopReport report;
    EXPECT_EQ(delay_text(report), "not measured by this device");
    report.longest_delay = 2e-3;
    EXPECT_EQ(delay_text(report), "not measured by this device; the certificate holds for 2 ms");
    report.largest_delay = 1.5e-3;
    EXPECT_EQ(
        delay_text(report),
        "at most 1.5 ms from a sample until the device applied its force; the certificate holds for 2 ms");
    report.longest_delay = std::numeric_limits<double>::infinity();
    EXPECT_EQ(delay_text(report), "at most 1.5 ms from a sample until the device applied its force");
}

TEST(ExitText, StatesEveryReason) {
    const auto report = thousand_periods();
    LoopSettings settings;
    settings.rate_hz = 2000.0;
    settings.lowest_rate_share = 0.75;
    settings.longest_period_s = 0.0025;
    const auto exit = [&](ExitReason reason, Status status = Status::Ok) {
        report->loop.exit_reason = reason;
        report->loop.status = status;
        return exit_text(report->loop, settings);
    };
    EXPECT_EQ(exit(ExitReason::TimeUp), "the duration ended");
    EXPECT_EQ(exit(ExitReason::StopRequested), "stopped on request");
    EXPECT_EQ(
        exit(ExitReason::Guard, Status::Jump),
        "stopped by a guard: Jump, the position moved farther in one sample than the device can; the force "
        "sent is zero");
    EXPECT_EQ(exit(ExitReason::DeviceFault, Status::Timeout),
              "stopped by a fault of the device: Timeout, the device did not answer in time");
    EXPECT_EQ(exit(ExitReason::RateTooLow),
              "stopped because the rate was too low: less than 1500 Hz of 2000 Hz for half a second");
    report->loop.largest_delay = 3e-3;
    report->loop.longest_delay = 2e-3;
    EXPECT_EQ(
        exit(ExitReason::NotCertified, Status::Stale),
        "stopped because the device applied a force 3 ms after its sample, or not at all: the certificate "
        "holds for at most 2 ms; plan with a larger delay_s of the device");
    EXPECT_EQ(exit(ExitReason::NotCertified),
              "stopped because a tick started 0.005 ms after the previous tick: the certificate holds for at "
              "most 2.5 ms");
}

TEST(Describe, NamesThePartsThatTheStructureUses) {
    Scheme scheme{StructureKind::Massless, {100.0, 0.02}, {0.003, 0.04}, false, 0.0, 0};
    EXPECT_EQ(describe(scheme), "massless, K_c = 100, B_c = 0.02");
    scheme.compensated = true;
    EXPECT_EQ(describe(scheme), "massless, compensated, K_c = 100, B_c = 0.02");
    scheme = {StructureKind::Implicit, {50.0, 0.01}, {0.003, 0.04}, false, 0.5, 0};
    EXPECT_EQ(describe(scheme), "implicit, K_c = 50, B_c = 0.01, m = 0.003, B_o = 0.04, r = 0.5");
    scheme = {StructureKind::Direct, {50.0, 0.01}, {0.003, 0.04}, false, 0.0, 1};
    EXPECT_EQ(describe(scheme), "direct, predict 1");
    scheme.predict = 0;
    EXPECT_EQ(describe(scheme), "direct");
}

TEST(FlightMetadata, StatesModelStructureGuardsAndRate) {
    GuardSettings guards;
    guards.force_limit = 3.0;
    guards.slew_s = 0.25;
    guards.ramp_s = 0.5;
    Scheme scheme;
    scheme.structure = StructureKind::Direct;
    const auto metadata = [&] {
        return flight_metadata("a test", {{"device", "knob"}, {"x", "y"}}, "m.json", scheme, guards, 500.0);
    };
    EXPECT_EQ(metadata(),
              (Metadata{{"created_by", "a test"},
                        {"device", "knob"},
                        {"x", "y"},
                        {"model", "m.json"},
                        {"structure", "direct"},
                        {"guards", "force limit 3, slew from zero to the limit in 0.25 s, ramp 0.5 s"},
                        {"rate_hz", "500"}}));
    guards.slew_s = 0.0;
    EXPECT_EQ(metadata()[5].second, "force limit 3, no slew limit, ramp 0.5 s");
}

class RecordTest : public testing::Test {
  protected:
    void SetUp() override {
        std::string pattern = testing::TempDir() + "text-XXXXXX";
        ASSERT_NE(mkdtemp(pattern.data()), nullptr);
        folder_ = pattern;
        report->lost_records = 4;
        report->last_ticks.assign(2, {});
        report->last_ticks[1].sequence = 77;
    }
    void TearDown() override { std::filesystem::remove_all(folder_); }

    [[nodiscard]] std::string file(const std::string& name) const { return folder_ / name; }
    [[nodiscard]] std::string text(const std::string& name) const {
        std::ifstream stream{file(name)};
        return {std::istreambuf_iterator<char>{stream}, {}};
    }
    [[nodiscard]] static bool has(const std::string& text, const std::string& part) {
        return text.find(part) != std::string::npos;
    }

    std::unique_ptr<SessionReport> report = thousand_periods();
    LoopSettings settings;

  private:
    std::filesystem::path folder_;
};

TEST_F(RecordTest, EndsWithReasonTimingAndItsName) {
    RecordingFile recording;
    std::string name = file("a.csv");
    ASSERT_EQ(recording.open(name, {}, {}), "");
    recording.take(report->last_ticks);
    EXPECT_TRUE(finish_record(recording, *report, settings, name).empty());
    EXPECT_EQ(name, file("a.csv"));
    const std::string written = text("a.csv");
    EXPECT_TRUE(has(written, "# ended: the duration ended; zero force commanded, device closed  "))
        << written;
    EXPECT_TRUE(has(written, "# timing: " + timing_text(report->loop, 1000.0) + "; lost records 4"));
    EXPECT_FALSE(has(written, "incomplete"));
}

TEST_F(RecordTest, KeepsItsTemporaryNameIfTheNameIsTaken) {
    RecordingFile recording;
    std::string name = file("a.csv");
    ASSERT_EQ(recording.open(name, {}, {}), "");
    std::ofstream{name} << "of another program\n";
    const std::vector<std::string> warnings = finish_record(recording, *report, settings, name);
    EXPECT_EQ(name, file("a.csv.part"));
    ASSERT_EQ(warnings.size(), 1U);
    EXPECT_TRUE(has(warnings.front(), "was created by another program meanwhile")) << warnings.front();
    EXPECT_EQ(text("a.csv"), "of another program\n");
}

TEST_F(RecordTest, StatesHowManyRowsAFullDiskHasCost) {
    // A limit of the size of files acts like a full disk
    rlimit before{};
    ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
    const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
    RecordingFile recording;
    std::string name = file("a.csv");
    ASSERT_EQ(recording.open(name, {}, {}), "");
    rlimit small = before;
    small.rlim_cur = 8192;
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
    recording.take(std::vector<TickRecord>(1000));
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
    std::signal(SIGXFSZ, old_handler);
    const std::uint64_t refused = recording.refused();
    ASSERT_GT(refused, 0U);
    const std::vector<std::string> warnings = finish_record(recording, *report, settings, name);
    EXPECT_EQ(warnings, std::vector<std::string>{file("a.csv") + " is incomplete: File too large; " +
                                                 std::to_string(refused) + " rows are missing at its end"});
    EXPECT_TRUE(has(text("a.csv"), "device closed; incomplete, because of the disk: File too large "));
}

TEST_F(RecordTest, TheLastTicksGetASeparateFile) {
    const auto write = [&](const std::string& record, bool force) {
        return write_last_ticks(file(record), force, {}, {{"device", "knob"}}, *report, settings);
    };
    EXPECT_EQ(write("a.csv", false), "the last 2 ticks are in " + file("a.fault.csv"));
    const std::string written = text("a.fault.csv");
    EXPECT_TRUE(has(written, "# device: knob\n"));
    EXPECT_TRUE(has(written, "# ended: the duration ended"));
    EXPECT_TRUE(has(written, ",77,"));
    EXPECT_EQ(write("a.csv", false), "the last 2 ticks are in " + file("a.fault-2.csv"));
    EXPECT_EQ(write("a.csv", false), "the last 2 ticks are in " + file("a.fault-3.csv"));
    EXPECT_EQ(write("b.CSV", false), "the last 2 ticks are in " + file("b.CSV.fault.csv"));
    report->last_ticks.resize(1);
    EXPECT_EQ(write("a.csv", true), "the last 1 ticks are in " + file("a.fault.csv"));
    EXPECT_FALSE(has(text("a.fault.csv"), ",77,"));
    EXPECT_FALSE(std::filesystem::exists(file("a.fault-4.csv")));
}

TEST_F(RecordTest, StatesWhyTheLastTicksCouldNotBeWritten) {
    const std::string message = write_last_ticks(file("missing/a.csv"), false, {}, {}, *report, settings);
    EXPECT_EQ(message.rfind("the last ticks could not be written: ", 0), 0U) << message;
    EXPECT_TRUE(has(message, "missing/a.fault.csv")) << message;
}

}  // namespace
}  // namespace palpate
