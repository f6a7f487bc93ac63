// SPDX-License-Identifier: Apache-2.0
#include "palpate/realtime/periodic.hpp"

#include <chrono>
#include <thread>

#include <gtest/gtest.h>

namespace palpate {
namespace {

TEST(Periodic, NeverWakesBeforeItsDeadlineAndKeepsItsGrid) {
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
    (void)clock.wait();  // the next deadline is at most one period later
    std::this_thread::sleep_for(std::chrono::milliseconds{10});
    const Wake late = clock.wait();
    const Wake next = clock.wait();
    EXPECT_GE(late.skipped, 9U);
    EXPECT_GT(next.deadline, late.now);
}

}  // namespace
}  // namespace palpate
