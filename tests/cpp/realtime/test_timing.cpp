// SPDX-License-Identifier: Apache-2.0
#include "palpate/realtime/timing.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <gtest/gtest.h>

#include "support.hpp"

namespace palpate {
namespace {

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

TEST(DurationHistogram, AcceptsAnyDurationAndStartsEmpty) {
    DurationHistogram histogram;
    EXPECT_EQ(histogram.quantile(0.5), 0.0);
    histogram.add(-5);
    EXPECT_EQ(histogram.largest(), 0);
    histogram.add(Nanoseconds{1} << 62);
    EXPECT_EQ(histogram.quantile(1.0), static_cast<double>(histogram.largest()));
    EXPECT_EQ(histogram.count(), 2U);
}

TEST(LoopTiming, MeasuresPeriodLatenessAndRate) {
    LoopTiming timing;
    for (Nanoseconds k = 0; k < 1000; ++k) {
        timing.add({k * 1'000'000, k * 1'000'000 + 5'000, 0});
    }
    timing.add({1'000'000'000, 1'003'000'000, 3});
    EXPECT_EQ(timing.wakes(), 1001U);
    EXPECT_EQ(timing.missed, 3U);
    EXPECT_NEAR(timing.lateness.quantile(0.5), 5'000, 20);
    EXPECT_EQ(timing.period.largest(), 3'995'000);
    EXPECT_NEAR(timing.rate_hz(), 1000.0 / 1.002995, 1e-6);
}

TEST(RateCheck, DetectsALowRateWithinOneSecond) {
    RateCheck check;
    bool window_ended = false;
    for (Nanoseconds now = 1; now < 1'000'000'000 && !window_ended; now += 2'000'000) {
        window_ended = check.add(now);
    }
    EXPECT_TRUE(window_ended);
    EXPECT_NEAR(check.rate_hz(), 500.0, 1e-6);
}

}  // namespace
}  // namespace palpate
