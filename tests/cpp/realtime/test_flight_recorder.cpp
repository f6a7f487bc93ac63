// SPDX-License-Identifier: Apache-2.0
#include "palpate/realtime/flight_recorder.hpp"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <span>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace palpate {
namespace {

struct Collector {
    std::vector<std::uint64_t> taken;
    std::chrono::milliseconds slow{0};
    void take(std::span<const std::uint64_t> records) noexcept {
        taken.insert(taken.end(), records.begin(), records.end());
        std::this_thread::sleep_for(slow);
    }
};

TEST(FlightRecorder, StopPassesOnAllRecords) {
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

TEST(FlightRecorder, CountsRecordsThatDoNotFit) {
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

TEST(LastRecords, KeepsTheLastRecordsOldestFirst) {
    LastRecords<int> last{3};
    EXPECT_TRUE(last.in_order().empty());
    for (int k = 0; k < 5; ++k) {
        last.push(k);
    }
    EXPECT_EQ(last.in_order(), (std::vector<int>{2, 3, 4}));
}

}  // namespace
}  // namespace palpate
