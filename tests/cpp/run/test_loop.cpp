// SPDX-License-Identifier: Apache-2.0
#include "palpate/run/loop.hpp"

#include <stdexcept>

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace palpate
