// SPDX-License-Identifier: Apache-2.0
#include "palpate/model/limited_environment.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "palpate/model/hysteresis.hpp"
#include "support.hpp"

namespace palpate {
namespace {

TEST(LimitedEnvironment, LimitsTheForceAndThenHasNoSlope) {
    const LimitedEnvironment<test::Spring> spring{test::Spring{4.0}, 2.0};
    EXPECT_EQ(spring.force_limit(), 2.0);
    EXPECT_EQ(spring.unlimited().stiffness, 4.0);
    for (const double x : {-0.5, -0.2, 0.0, 0.2, 0.5}) {
        EXPECT_EQ(spring.at(x, {}).force, 4.0 * x) << x;
        EXPECT_EQ(spring.at(x, {}).slope, 4.0) << x << ": a force at the limit is not limited";
    }
    for (const double x : {0.5 + 1e-15, 0.8, 1e9}) {
        EXPECT_EQ(spring.at(x, {}).force, 2.0) << x;
        EXPECT_EQ(spring.at(x, {}).slope, 0.0) << x;
        EXPECT_EQ(spring.at(-x, {}).force, -2.0) << x;
        EXPECT_EQ(spring.at(-x, {}).slope, 0.0) << x;
    }
    EXPECT_TRUE(std::isnan(spring.at(0.1, {}).energy));
    EXPECT_TRUE(std::isnan(spring.at(0.8, {}).energy));
}

TEST(LimitedEnvironment, HasTheStateOfItsObject) {
    const HysteresisNetwork object{{1, {}, {}, {}, {2.0}, 0.0}, {{}, 0.0, 0.1}, test::unit_domain(), 0.05};
    const LimitedEnvironment<HysteresisNetwork> limited{object, 1.0};
    auto state = limited.start(0.3);
    EXPECT_EQ(state.play, 0.3);
    EXPECT_DOUBLE_EQ(limited.at(0.4, state).force, object.at(0.4, {0.3}).force);
    limited.advance(0.4, state);
    EXPECT_DOUBLE_EQ(state.play, 0.35);
    EXPECT_FALSE(limited.at(0.9, state).extrapolated);
    EXPECT_TRUE(limited.at(1.1, state).extrapolated);
}

}  // namespace
}  // namespace palpate
