// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <span>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/realtime/flight_recorder.hpp"
#include "palpate/realtime/periodic.hpp"
#include "palpate/realtime/ring_buffer.hpp"
#include "palpate/realtime/timing.hpp"
#include "support.hpp"

namespace palpate {
namespace {

TEST(RingBuffer, GivesBackWhatWasPutInInOrder) {
    RingBuffer<int> ring{4};
    std::vector<int> out(10);
    for (int round = 0; round < 5; ++round) {
        EXPECT_TRUE(ring.push(2 * round));
        EXPECT_TRUE(ring.push(2 * round + 1));
        ASSERT_EQ(ring.pop(out), 2U);
        EXPECT_EQ(out[0], 2 * round);
        EXPECT_EQ(out[1], 2 * round + 1);
    }
    EXPECT_EQ(ring.pop(out), 0U);
}

TEST(RingBuffer, RefusesWhenFullAndLosesNothingThatItTook) {
    RingBuffer<int> ring{4};
    for (int k = 0; k < 4; ++k) {
        EXPECT_TRUE(ring.push(k));
    }
    EXPECT_FALSE(ring.push(4));
    std::vector<int> out(3);
    EXPECT_EQ(ring.pop(out), 3U);
    EXPECT_EQ(out, (std::vector<int>{0, 1, 2}));
    EXPECT_EQ(ring.pop(out), 1U);
    EXPECT_EQ(out[0], 3);
}

/// Two related numbers: a partly written pair is detected.
struct Pair {
    std::uint64_t value = 0;
    std::uint64_t inverse = ~std::uint64_t{0};
};

TEST(RingBuffer, PassesEveryElementWholeBetweenTwoThreads) {
    const auto total = static_cast<std::uint64_t>(test::cases(100'000));
    RingBuffer<Pair> ring{64};
    std::thread writer{[&] {
        for (std::uint64_t k = 0; k < total;) {
            if (ring.push({k, ~k})) {
                ++k;
            } else {
                std::this_thread::yield();
            }
        }
    }};
    std::vector<Pair> out(50);
    std::uint64_t next = 0;
    bool whole = true;
    while (next < total) {
        const std::size_t count = ring.pop(out);
        for (std::size_t k = 0; k < count; ++k, ++next) {
            whole = whole && out[k].value == next && out[k].inverse == ~next;
        }
        if (count == 0) {
            std::this_thread::yield();
        }
    }
    writer.join();
    EXPECT_TRUE(whole);
}

struct Collector {
    std::vector<std::uint64_t> taken;
    std::chrono::milliseconds slow{0};
    void take(std::span<const std::uint64_t> records) noexcept {
        taken.insert(taken.end(), records.begin(), records.end());
        std::this_thread::sleep_for(slow);
    }
};

TEST(FlightRecorder, HasHandedOverEverythingWhenItIsStopped) {
    Collector collector;
    FlightRecorder<std::uint64_t, Collector> recorder{collector, 1 << 16, std::chrono::milliseconds{1}};
    for (std::uint64_t k = 0; k < 50'000; ++k) {
        recorder.push(k);
    }
    recorder.stop();
    ASSERT_EQ(collector.taken.size(), 50'000U);
    EXPECT_TRUE(std::is_sorted(collector.taken.begin(), collector.taken.end()));
    EXPECT_EQ(recorder.lost(), 0U);
}

TEST(FlightRecorder, CountsWhatFindsNoRoom) {
    Collector collector;
    collector.slow = std::chrono::milliseconds{20};
    FlightRecorder<std::uint64_t, Collector> recorder{collector, 16, std::chrono::milliseconds{1}};
    for (std::uint64_t k = 0; k < 10'000; ++k) {
        recorder.push(k);
    }
    recorder.stop();
    EXPECT_GT(recorder.lost(), 0U);
    EXPECT_EQ(collector.taken.size() + recorder.lost(), 10'000U);
}

TEST(LastRecords, KeepsTheLastOnesOldestFirst) {
    LastRecords<int> last{3};
    EXPECT_TRUE(last.in_order().empty());
    for (int k = 0; k < 5; ++k) {
        last.push(k);
    }
    EXPECT_EQ(last.in_order(), (std::vector<int>{2, 3, 4}));
}

TEST(DurationHistogram, QuantilesAreThoseOfTheSortedDurationsToOnePartIn256) {
    test::Random random{3};
    DurationHistogram histogram;
    std::vector<Nanoseconds> durations;
    for (int k = 0; k < test::cases(20'000); ++k) {
        durations.push_back(static_cast<Nanoseconds>(std::exp(test::uniform(random, 0.0, 25.0))));
        histogram.add(durations.back());
    }
    std::sort(durations.begin(), durations.end());
    for (const double share : {0.001, 0.25, 0.5, 0.99, 0.999, 1.0}) {
        const auto rank =
            static_cast<std::size_t>(std::ceil(share * static_cast<double>(durations.size()))) - 1;
        const auto exact = static_cast<double>(durations[rank]);
        EXPECT_NEAR(histogram.quantile(share), exact, exact / 256.0) << share;
    }
    EXPECT_EQ(histogram.largest(), durations.back());
}

TEST(DurationHistogram, TakesAnythingAndIsEmptyAtFirst) {
    DurationHistogram histogram;
    EXPECT_EQ(histogram.quantile(0.5), 0.0);
    histogram.add(-5);
    EXPECT_EQ(histogram.largest(), 0);
    histogram.add(Nanoseconds{1} << 62);
    EXPECT_EQ(histogram.quantile(1.0), static_cast<double>(histogram.largest()));
    EXPECT_EQ(histogram.count(), 2U);
}

TEST(Periodic, NeverWakesBeforeItsDeadlineAndKeepsToItsGrid) {
    constexpr Nanoseconds period = 500'000;
    Periodic clock{period};
    clock.start();
    Wake last = clock.wait();
    for (int k = 0; k < 50; ++k) {
        const Wake wake = clock.wait();
        EXPECT_GE(wake.now, wake.deadline);
        EXPECT_EQ(wake.deadline - last.deadline, static_cast<Nanoseconds>(last.skipped + 1) * period);
        last = wake;
    }
}

TEST(Periodic, SkipsAndCountsDeadlinesThatPassed) {
    constexpr Nanoseconds period = 1'000'000;
    Periodic clock{period};
    clock.start();
    const Wake first = clock.wait();
    std::this_thread::sleep_for(std::chrono::milliseconds{10});
    const Wake late = clock.wait();
    const Wake next = clock.wait();
    EXPECT_GE(late.skipped, 8U - first.skipped);
    EXPECT_GT(next.deadline, late.now);
}

TEST(LoopTiming, TellsPeriodLatenessAndRate) {
    LoopTiming timing;
    for (Nanoseconds k = 0; k < 1000; ++k) {
        timing.add({k * 1'000'000, k * 1'000'000 + 5'000, 0});
    }
    timing.add({1'000'000'000, 1'003'000'000, 3});
    EXPECT_EQ(timing.ticks(), 1001U);
    EXPECT_EQ(timing.missed, 3U);
    EXPECT_NEAR(timing.lateness.quantile(0.5), 5'000, 20);
    EXPECT_EQ(timing.period.largest(), 3'995'000);
    EXPECT_NEAR(timing.rate_hz(), 1000.0 / 1.002995, 1e-6);
}

TEST(RateCheck, KnowsOfAShortfallWithinOneSecond) {
    RateCheck check;
    bool said = false;
    for (Nanoseconds now = 1; now < 1'000'000'000 && !said; now += 2'000'000) {
        said = check.add(now);
    }
    EXPECT_TRUE(said);
    EXPECT_NEAR(check.rate_hz(), 500.0, 1e-6);
}

}  // namespace
}  // namespace palpate
