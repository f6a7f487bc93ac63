// SPDX-License-Identifier: Apache-2.0
// Tests that the report of a session states every defect of the session, and how the user can remove the defect.
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
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
