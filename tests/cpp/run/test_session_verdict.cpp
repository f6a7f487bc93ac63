// SPDX-License-Identifier: Apache-2.0
// Tests that the report of a session states every defect of the session, and how the user can remove the defect.
#include <stdlib.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/run/session_verdict.hpp"

namespace palpate {
namespace {

/// A session of 1000 ticks without delay, with handle positions over the whole domain of the model.
struct Judged {
    // `SessionReport` is on the heap, because it is too large for the stack.
    std::unique_ptr<SessionReport> report = std::make_unique<SessionReport>();
    LoopSettings settings;
    RecordSinks sinks;
    SessionExpectation expected{false, 1e-3, {0.0, 1.0}, "rad", {}};

    Judged() {
        for (int k = 0; k < 1000; ++k) {
            tick(k * 1'000'000LL);
        }
        count(Status::Ok) = 1000;
        sinks.positions = {0.0, 1.0};
        sinks.forces = {-1.0, 2.0};
    }
    void tick(Nanoseconds now, std::uint64_t skipped = 0) {
        report->loop.timing.add({.deadline = now, .now = now, .skipped = skipped});
    }
    [[nodiscard]] std::uint64_t& count(Status status) {
        return report->loop.ticks_by_status[static_cast<std::size_t>(status)];
    }
    void set_ticks(Status status, std::uint64_t ticks) {
        count(Status::Ok) -= ticks;
        count(status) += ticks;
    }
    [[nodiscard]] std::string text() const {
        return verdict_text(judge_session(*report, settings, sinks, expected));
    }
};

void expect(const Judged& judged, const std::string& begin, const std::string& within) {
    const std::string text = judged.text();
    EXPECT_EQ(text.rfind(begin, 0), 0U) << text;
    EXPECT_NE(text.find(within), std::string::npos) << text;
}

TEST(SessionVerdict, IsGoodWithoutFindings) {
    EXPECT_EQ(Judged{}.text(), "good");
}

TEST(SessionVerdict, RefusesASessionWhoseDeviceDidNotConfirmZeroForce) {
    Judged judged;
    judged.report->loop.zero_force = ZeroForce::Confirmed;
    EXPECT_EQ(judged.text(), "good");
    judged.report->loop.zero_force = ZeroForce::Sent;
    expect(judged, "no: the duration ended; zero force sent, but not confirmed by the device",
           "switch the motor off");
    judged.report->loop.zero_force = ZeroForce::NotSent;
    expect(judged, "no: the duration ended; zero force could not be sent", "switch the motor off");
}

TEST(SessionVerdict, ReportsMissedDeadlinesAboveOneInAThousand) {
    Judged one;
    one.tick(1'001'000'000, 1);
    EXPECT_EQ(one.text(), "good");
    Judged two;
    two.tick(1'002'000'000, 2);
    expect(two, "usable: 2 of 1003 (0.1994 %) deadlines of the loop were missed: close other programs",
           "real-time priority");
}

TEST(SessionVerdict, ReportsALowRateOfADeviceThatPacesTheLoop) {
    Judged slow;
    slow.settings.rate_hz = 1100.0;
    expect(slow, "usable: the rate of the loop was 1000 Hz of 1100 Hz", "choose a lower rate");
}

TEST(SessionVerdict, ReportsLostSamplesAndLostRows) {
    Judged lost;
    lost.report->loop.lost_samples = 2;
    expect(lost, "usable: 2 of 1000 (0.2 %) samples of the device were lost or repeated", "check its cable");
    Judged rows;
    rows.report->lost_records = 1;
    expect(rows, "usable: 1 of 1000 (0.1 %) rows are missing in the recording", "record to a faster disk");
}

TEST(SessionVerdict, ReportsTicksWithChangedForcesAboveOnePercent) {
    for (const auto& [status, sentence] :
         {std::pair{Status::Limited, "clipped the force to the force limit: raise the force limit"},
          {Status::EnergyLimited, "reduced the force, because the rendering gave energy"},
          {Status::LimitCycleScaled, "reduced the force, because the rendering gave energy"},
          {Status::MaxIterations, "did not solve the load line"},
          {Status::NotUnique, "did not solve the load line"}}) {
        Judged few;
        few.set_ticks(status, 10);
        EXPECT_EQ(few.text(), "good");
        Judged many;
        many.set_ticks(status, 11);
        expect(many, "usable: 11 of 1000 (1.1 %) ticks ", sentence);
    }
    Judged outside;
    outside.sinks.extrapolated = 300;
    expect(outside, "usable: 300 of 1000 (30 %) ticks had a position outside the model's domain, 0 to 1 rad",
           "only within the domain");
    Judged ramp;
    ramp.set_ticks(Status::Ramp, 1000);
    expect(ramp, "usable: all 1000 ticks were part of the start ramp", "run for a longer time");
}

TEST(SessionVerdict, RefusesASessionWithoutForce) {
    Judged none;
    none.sinks.forces = {0.0, 0.0};
    expect(none, "no: every force was zero: the handle did not touch the object between 0 and 1 rad",
           "move the handle");
}

TEST(SessionVerdict, RefusesARecordingWithoutMotion) {
    Judged still;
    still.sinks.positions = {0.5, 0.5015};  // handle moved by fewer than two encoder steps
    expect(still, "usable: the handle covered 0.0015 rad", "move the handle over the whole object");
    still.expected.recorded = true;
    expect(still, "no: ", "so the force over position is unknown");
    still.sinks.positions = {0.5, 0.5021};
    still.expected.recorded = false;
    expect(still, "usable: the handle covered 0.0021 rad, 0.21 % of the model's domain", "move the handle");
}

TEST(SessionVerdict, ReportsARealObjectMeasuredAtFewPositions) {
    Judged object;
    object.expected.domain = {};
    EXPECT_EQ(object.text(), "good");
    object.sinks.positions = {0.0, 0.049};
    expect(object, "usable: the handle covered 0.049 rad, 49 encoder steps",
           "move the handle over the whole object");
}

TEST(SessionVerdict, RefusesARecordingWithoutUsableRows) {
    Judged nothing;
    nothing.expected.recorded = true;
    expect(nothing, "no: nothing was recorded", "");
}

TEST(SessionVerdict, RefusesAStoppedRunWithThatFindingFirst) {
    Judged stopped;
    stopped.report->lost_records = 5;
    stopped.report->loop.exit_reason = ExitReason::DeviceFault;
    stopped.report->loop.status = Status::Fault;
    expect(stopped, "no: stopped by a fault of the device: Fault", "; 5 of 1000 (0.5 %) rows are missing");
}

TEST(SessionVerdict, DoesNotJudgeTheMotionOfAStoppedRun) {
    Judged stopped;
    stopped.report->loop.exit_reason = ExitReason::RateTooLow;
    stopped.sinks.positions = {0.5, 0.5};
    stopped.sinks.forces = {0.0, 0.0};
    EXPECT_EQ(stopped.text().find("handle"), std::string::npos) << stopped.text();
}

TEST(SessionVerdict, RepeatsTheWarningsOfTheRecording) {
    Judged kept;
    kept.expected.warnings = {"rendered.csv is incomplete"};
    EXPECT_EQ(kept.text(), "usable: rendered.csv is incomplete");
}

TEST(SessionVerdict, HasTheLevelOfTheMostSeriousFinding) {
    EXPECT_EQ(level_of({}), "good");
    EXPECT_EQ(verdict_text({}), "good");
    EXPECT_EQ(level_of({{"usable", "a"}, {"usable", "b"}}), "usable");
    EXPECT_EQ(verdict_text({{"no", "a"}, {"usable", "b"}, {"usable", "c"}}), "no: a; b; c");
}

TEST(SessionVerdict, StatesSharesInPercentAlsoOfNothing) {
    EXPECT_EQ(detail::share_text(12, 1000), "12 of 1000 (1.2 %)");
    EXPECT_EQ(detail::share_text(1, 1), "1 of 1 (100 %)");
    EXPECT_EQ(detail::share_text(1, 0), "1 of 0 (100 %)");
    EXPECT_FALSE(detail::exceeds(10, 1000, 0.01));
    EXPECT_TRUE(detail::exceeds(11, 1000, 0.01));
    EXPECT_FALSE(detail::exceeds(0, 0, 0.01));
}

// The rate is measured between the first and the last wake-up: 999 periods of 1 ms.
TEST(SessionVerdict, AcceptsARateOfNinetyNinePercent) {
    Judged held;
    held.settings.rate_hz = 1000.0 / 0.99;
    EXPECT_EQ(held.text(), "good");
    held.settings.rate_hz = 1011.0;
    expect(held, "usable: the rate of the loop was 1000 Hz of 1011 Hz", "close other programs");
    EXPECT_EQ(held.text().find(';'), std::string::npos) << held.text();
    held.tick(1'002'000'000, 2);
    EXPECT_EQ(held.text().find("rate of the loop"), std::string::npos) << "missed deadlines are the reason";
}

TEST(SessionVerdict, DoesNotJudgeTheRateOfASingleTick) {
    Judged judged;
    judged.report = std::make_unique<SessionReport>();
    judged.tick(1'000'000);
    judged.count(Status::Ok) = 1;
    EXPECT_EQ(judged.text(), "good");
    judged.tick(1'000'000'000);
    judged.count(Status::Ok) = 2;
    expect(judged, "usable: the rate of the loop was 1.001 Hz of 1000 Hz", "");
}

TEST(SessionVerdict, AddsLostAndRepeatedSamples) {
    Judged judged;
    judged.report->loop.lost_samples = 1;
    EXPECT_EQ(judged.text(), "good");
    judged.report->loop.repeated_samples = 2;
    expect(judged, "usable: 3 of 1000 (0.3 %) samples of the device were lost or repeated", "close other ");
}

TEST(SessionVerdict, AddsTheTicksOfStatusesWithOneCause) {
    for (const auto& [first, second, sentence] :
         {std::tuple{Status::EnergyLimited, Status::LimitCycleScaled, "reduced the force"},
          {Status::MaxIterations, Status::NotUnique, "did not solve the load line"}}) {
        Judged both;
        both.set_ticks(first, 6);
        both.set_ticks(second, 5);
        expect(both, "usable: 11 of 1000 (1.1 %) ticks ", sentence);
    }
    Judged outside;
    outside.sinks.extrapolated = 10;
    EXPECT_EQ(outside.text(), "good");
}

TEST(SessionVerdict, ReportsTheRampOnlyIfItLastsForTheWholeRun) {
    Judged judged;
    judged.set_ticks(Status::Ramp, 999);
    EXPECT_EQ(judged.text(), "good");
}

TEST(SessionVerdict, JudgesARunOfASingleTick) {
    Judged judged;
    judged.report = std::make_unique<SessionReport>();
    judged.tick(1'000'000);
    judged.count(Status::Ramp) = 1;
    expect(judged, "usable: all 1 ticks were part of the start ramp", "");
    judged.sinks.forces = {0.0, 0.0};
    expect(judged, "no: every force was zero", "all 1 ticks");
}

TEST(SessionVerdict, RefusesOnlyASessionInWhichEveryForceWasZero) {
    for (const Range forces : {Range{0.0, 1e-9}, Range{-1e-9, 0.0}}) {
        Judged touched;
        touched.sinks.forces = forces;
        EXPECT_EQ(touched.text(), "good");
    }
    Judged empty;  // without a tick there is no force to judge
    empty.report = std::make_unique<SessionReport>();
    empty.sinks.forces = {0.0, 0.0};
    EXPECT_EQ(empty.text(), "good");
}

// Positions and steps are powers of two, so that the limits are met exactly.
TEST(SessionVerdict, JudgesTheTravelAtItsExactLimits) {
    const double step = 0x1p-10;
    const auto with_travel = [&](double travel, Range domain) {
        Judged judged;
        judged.expected.encoder_step = step;
        judged.expected.domain = domain;
        judged.sinks.positions = {1.0, 1.0 + travel};
        return judged.text();
    };
    const std::string unknown =
        "usable: the handle covered 0.001953 rad, so the force over position is unknown: "
        "move the handle over the whole object";
    EXPECT_EQ(with_travel(2.0 * step, {0.0, 0.001}), unknown);
    EXPECT_EQ(with_travel(2.0 * step, {}), unknown);
    EXPECT_EQ(with_travel(3.0 * step, {0.0, 0.001}), "good");
    // A tenth of the domain
    EXPECT_EQ(with_travel(0.125, {3.0, 4.25}), "good");
    EXPECT_EQ(with_travel(0.125, {3.0, 4.375}),
              "usable: the handle covered 0.125 rad, 9.091 % of the model's domain: move the handle over the "
              "whole object");
    EXPECT_EQ(with_travel(50.0 * step, {}), "good");
    EXPECT_EQ(
        with_travel(49.0 * step, {}),
        "usable: the handle covered 0.04785 rad, 49 encoder steps: move the handle over the whole object");
    // The number of encoder steps is judged only without a domain
    EXPECT_EQ(with_travel(49.0 * step, {0.0, 0.1}), "good");
}

TEST(SessionVerdict, RefusesARecordingInWhichNoRowIsUsable) {
    std::string pattern = testing::TempDir() + "verdict-XXXXXX";
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    Judged judged;
    ASSERT_EQ(judged.sinks.file.open(pattern + "/a.csv", {}, {}), "");
    judged.sinks.file.take(std::vector<TickRecord>(3));
    EXPECT_EQ(judged.text(), "good");
    judged.expected.recorded = true;
    EXPECT_EQ(judged.text(), "good");
    judged.count(Status::Ok) = 0;
    judged.count(Status::Lost) = 1000;
    EXPECT_EQ(judged.text(),
              "no: the recording has no usable row: in all 3 rows the force was scaled, limited or missing; "
              "record for a longer time");
    judged.count(Status::Ok) = 1;
    EXPECT_EQ(judged.text(), "good");
    judged.count(Status::Ok) = 0;
    judged.expected.recorded = false;
    EXPECT_EQ(judged.text(), "good");
    std::filesystem::remove_all(pattern);
}

TEST(SessionVerdict, PutsSeriousFindingsFirstAndKeepsTheOrderOfTheOthers) {
    Judged judged;
    judged.report->lost_records = 1;
    judged.expected.warnings = {"one", "two"};
    judged.sinks.forces = {0.0, 0.0};
    judged.expected.recorded = true;
    expect(judged, "no: nothing was recorded; every force was zero: ", "; one; two; 1 of 1000 (0.1 %) rows");
}

TEST(EnergyText, StatesTheEnergyOfTheRampSeparately) {
    LoopReport report;
    report.given_in_ramp = 0.0125;
    report.given = 0.25;
    report.most_stored = 0.5;
    EXPECT_EQ(energy_text(report),
              "the motor gave 0.0125 J during the start ramp and 0.25 J after the ramp; the object stored at "
              "most 0.5 J");
    report.most_stored = std::numeric_limits<double>::infinity();
    EXPECT_EQ(energy_text(report),
              "the motor gave 0.0125 J during the start ramp and 0.25 J after the ramp; no bound of the "
              "stored energy is known");
}

}  // namespace
}  // namespace palpate
