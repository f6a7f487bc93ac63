// SPDX-License-Identifier: Apache-2.0
#include <cstddef>
#include <cstdint>
#include <limits>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/run/summary.hpp"

namespace palpate {
namespace {

/// Returns the summary of a run of 101 ticks in 0.1 s with a different number in every counter.
Summary summary() {
    Summary summary;
    LoopReport& loop = summary.report.loop;
    for (Nanoseconds k = 0; k <= 100; ++k) {
        const Nanoseconds now = 1'000'000 * (k + 1);
        loop.timing.add({.deadline = now - 10 * k, .now = now, .skipped = k == 50 ? 2U : 0U});
    }
    loop.ticks_by_status[static_cast<std::size_t>(Status::Ok)] = 90;
    loop.ticks_by_status[static_cast<std::size_t>(Status::Ramp)] = 8;
    loop.ticks_by_status[static_cast<std::size_t>(Status::Timeout)] = 3;
    loop.status = Status::Timeout;
    loop.exit_reason = ExitReason::StopRequested;
    loop.lost_samples = 11;
    loop.repeated_samples = 12;
    loop.largest_delay = 0.0015;
    loop.longest_delay = 0.002;
    loop.limit_cycles = 13;
    loop.given_in_ramp = 0.25;
    loop.given = 0.5;
    loop.most_stored = 0.75;
    summary.report.refused = {"no priority"};
    summary.loop.rate_hz = 1000.0;
    summary.record = "a.csv";
    summary.recorded = 14;
    summary.lost_records = 15;
    summary.telemetry_sent = 16;
    summary.telemetry_dropped = 17;
    summary.positions = {1.0, 2.0};
    summary.forces = {3.0, 4.0};
    summary.notes = {"a note", "another"};
    summary.warnings = {"a warning"};
    summary.findings = {{"usable", "first"}, {"usable", "second"}};
    summary.device = "knob";
    return summary;
}

const Value& value(const NamedValues& values, const std::string& name) {
    for (const NamedValue& each : values) {
        if (each.name == name) {
            return each.value;
        }
    }
    throw std::invalid_argument("no value " + name);
}

template <class T>
T get(const NamedValues& values, const std::string& name) {
    return std::get<T>(value(values, name));
}

TEST(Summary, IsOrderlyAfterARequestAndStatesItsEnd) {
    Summary one = summary();
    EXPECT_TRUE(one.orderly());
    EXPECT_EQ(one.ended(), "stopped on request");
    for (const ZeroForce zero_force :
         {ZeroForce::Commanded, ZeroForce::NotSent, ZeroForce::Sent, ZeroForce::Confirmed}) {
        one.report.loop.zero_force = zero_force;
        EXPECT_EQ(one.orderly(), zero_force == ZeroForce::Commanded || zero_force == ZeroForce::Confirmed);
        EXPECT_EQ(one.zero_force(), closing_text(zero_force));
    }
    one.report.loop.exit_reason = ExitReason::DeviceFault;
    EXPECT_FALSE(one.orderly());
}

TEST(Summary, CollectsAllMessages) {
    Summary one = summary();
    EXPECT_EQ(one.all_notes(), (std::vector<std::string>{"no priority", "a note", "another", "a warning"}));
    one.last_ticks = "the last ticks";
    EXPECT_EQ(one.all_notes().size(), 5U);
    EXPECT_EQ(one.all_notes().back(), "the last ticks");
    EXPECT_TRUE(Summary{}.all_notes().empty());
}

TEST(Summary, PercentilesAreInMicroseconds) {
    DurationHistogram histogram;
    for (int k = 0; k < 1000; ++k) {
        histogram.add(k < 600 ? 100 : k < 990 ? 200 : k < 999 ? 250 : 5000);
    }
    const NamedValues values = fields(histogram);
    ASSERT_EQ(values.size(), 4U);
    EXPECT_DOUBLE_EQ(get<double>(values, "p50_us"), 0.1);
    EXPECT_DOUBLE_EQ(get<double>(values, "p99_us"), 0.2);
    EXPECT_DOUBLE_EQ(get<double>(values, "p999_us"), 0.25);
    EXPECT_DOUBLE_EQ(get<double>(values, "max_us"), 5.0);
}

TEST(Summary, CountsOnlyStatusesThatOccurred) {
    const NamedValues counts = ticks_by_status(summary().report.loop);
    ASSERT_EQ(counts.size(), 3U);
    EXPECT_EQ(get<std::uint64_t>(counts, "Ok"), 90U);
    EXPECT_EQ(get<std::uint64_t>(counts, "Ramp"), 8U);
    EXPECT_EQ(get<std::uint64_t>(counts, "Timeout"), 3U);
    LoopReport all;
    all.ticks_by_status.fill(1);
    EXPECT_EQ(ticks_by_status(all).size(), status_texts.size());
    EXPECT_TRUE(ticks_by_status({}).empty());
}

TEST(Summary, NamesEveryValueForPrograms) {
    const Summary one = summary();
    const NamedValues values = fields(one);
    EXPECT_EQ(get<std::string>(values, "verdict"), "usable: first; second");
    const auto& findings = std::get<std::vector<NamedValues>>(value(values, "findings"));
    ASSERT_EQ(findings.size(), 2U);
    EXPECT_EQ(get<std::string>(findings[1], "level"), "usable");
    EXPECT_EQ(get<std::string>(findings[1], "sentence"), "second");
    EXPECT_TRUE(get<bool>(values, "orderly"));
    EXPECT_EQ(get<std::string>(values, "ended"), "stopped on request");
    EXPECT_EQ(get<std::string>(values, "zero_force"), "zero force commanded, device closed");
    EXPECT_EQ(get<double>(values, "largest_delay_s"), 0.0015);
    EXPECT_EQ(get<double>(values, "longest_delay_s"), 0.002);
    EXPECT_EQ(get<std::string>(values, "status"), "Timeout");
    EXPECT_EQ(get<std::string>(values, "device"), "knob");
    EXPECT_EQ(get<double>(values, "rate_hz"), 1000.0);
    EXPECT_EQ(get<double>(values, "wanted_rate_hz"), 1000.0);
    EXPECT_EQ(get<double>(values, "longest_gap_us"), 1000.0);
    EXPECT_EQ(get<double>(get<NamedValues>(values, "period"), "max_us"), 1000.0);
    EXPECT_EQ(get<double>(get<NamedValues>(values, "lateness"), "max_us"), 1.0);
    EXPECT_EQ(get<std::uint64_t>(get<NamedValues>(values, "ticks_by_status"), "Ramp"), 8U);
    for (const auto& [name, count] : {std::pair{"ticks", 101U},
                                      {"missed_deadlines", 2U},
                                      {"lost_samples", 11U},
                                      {"repeated_samples", 12U},
                                      {"limit_cycles", 13U},
                                      {"recorded", 14U},
                                      {"lost_records", 15U},
                                      {"telemetry_sent", 16U},
                                      {"telemetry_dropped", 17U}}) {
        EXPECT_EQ(get<std::uint64_t>(values, name), count) << name;
    }
    EXPECT_EQ(get<std::string>(values, "record"), "a.csv");
    EXPECT_EQ(get<std::vector<double>>(values, "position_range"), (std::vector<double>{1.0, 2.0}));
    EXPECT_EQ(get<std::vector<double>>(values, "force_range"), (std::vector<double>{3.0, 4.0}));
    const auto energy = get<NamedValues>(values, "energy");
    EXPECT_EQ(get<double>(energy, "given_in_ramp_J"), 0.25);
    EXPECT_EQ(get<double>(energy, "given_J"), 0.5);
    EXPECT_EQ(get<double>(energy, "most_stored_J"), 0.75);
    EXPECT_EQ(get<std::string>(energy, "sentence"), energy_text(one.report.loop));
    EXPECT_EQ(get<std::vector<std::string>>(values, "without"), std::vector<std::string>{"no priority"});
    EXPECT_EQ(get<std::vector<std::string>>(values, "notes"), one.all_notes());
    std::set<std::string> names;
    for (const NamedValue& each : values) {
        names.insert(each.name);
    }
    EXPECT_EQ(names.size(), values.size()) << "a name occurs twice";
}

TEST(Summary, HasAnEmptyValueWithoutARecordingAndNoValuesOfADeviceWithoutAReport) {
    Summary one = summary();
    const std::size_t without = fields(one).size();
    one.record.clear();
    EXPECT_TRUE(std::holds_alternative<std::monostate>(value(fields(one), "record")));
    EXPECT_EQ(fields(one).size(), without);
    one.device_report.name = "usb";
    one.device_report.fields = {{"packets", std::uint64_t{5}}};
    EXPECT_EQ(fields(one).size(), without + 1);
    EXPECT_EQ(get<std::uint64_t>(get<NamedValues>(fields(one), "usb"), "packets"), 5U);
}

TEST(Summary, IsATableForTheTerminal) {
    Summary one = summary();
    one.device_report.lines = {{"wire", "5 packets"}};
    EXPECT_EQ(lines(one),
              (Lines{{"ended", "stopped on request; zero force commanded, device closed"},
                     {"rate", "1000 Hz of 1000 Hz, 2 deadlines of the loop missed"},
                     {"period", "p50 1000 us, p99 1000 us, p99.9 1000 us, max 1000 us (the longest gap)"},
                     {"late by", percentiles(one.report.loop.timing.lateness)},
                     {"ticks", "90 Ok, 3 Timeout, 8 Ramp"},
                     {"samples", "11 lost, 12 repeated"},
                     {"delay", delay_text(one.report.loop)},
                     {"energy", energy_text(one.report.loop)},
                     {"wire", "5 packets"},
                     {"recorded", "a.csv: 14 rows, 15 lost"},
                     {"telemetry", "16 lines sent, 17 dropped"}}));
}

TEST(Summary, HasNoLinesAboutUnusedFunctions) {
    const auto titles = [](const Summary& of) {
        std::vector<std::string> all;
        for (const auto& [title, text] : lines(of)) {
            all.push_back(title);
        }
        return all;
    };
    Summary one = summary();
    one.record.clear();
    one.telemetry_sent = one.telemetry_dropped = 0;
    EXPECT_EQ(titles(one), (std::vector<std::string>{"ended", "rate", "period", "late by", "ticks", "samples",
                                                     "delay", "energy"}));
    one.telemetry_dropped = 1;
    EXPECT_EQ(lines(one).back().second, "0 lines sent, 1 dropped");
    one.telemetry_dropped = 0;
    one.telemetry_sent = 1;
    EXPECT_EQ(lines(one).back().second, "1 lines sent, 0 dropped");
    one.telemetry_dropped = 1;
    EXPECT_EQ(lines(one).back().second, "1 lines sent, 1 dropped");
}

// The measured rate is exactly 1000 Hz.
TEST(Summary, MarksARateBelowNinetyNinePercent) {
    Summary one = summary();
    const auto rate = [&](double wanted_hz) {
        one.loop.rate_hz = wanted_hz;
        return lines(one)[1].second;
    };
    ASSERT_EQ(0.99 * (1000.0 / 0.99), 1000.0) << "the limit is met exactly";
    EXPECT_EQ(rate(1000.0 / 0.99).find("lower"), std::string::npos);
    EXPECT_EQ(rate(1011.0), "1000 Hz of 1011 Hz, lower than required, 2 deadlines of the loop missed");
    EXPECT_EQ(rate(900.0).find("lower"), std::string::npos);
}

}  // namespace
}  // namespace palpate
