// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/stability/inequality.hpp"
#include "special_values.hpp"

namespace palpate {
namespace {

using test::infinity;
using test::nan;

Inequality line(double left, double right, bool strict = false) {
    Inequality made{"id", "friction", "f_c >= x", left, right, Basis::Proved, "a proof"};
    made.strict = strict;
    return made;
}

TEST(Inequality, HoldsAtEqualityUnlessItIsStrict) {
    EXPECT_TRUE(line(0.3, 0.3).holds());
    EXPECT_FALSE(line(0.3, 0.3, true).holds());
    EXPECT_TRUE(line(std::nextafter(0.3, 1.0), 0.3, true).holds());
    EXPECT_FALSE(line(std::nextafter(0.3, 0.0), 0.3).holds());
    EXPECT_FALSE(line(std::nextafter(0.3, 0.0), 0.3, true).holds());
    EXPECT_FALSE(Inequality{}.strict);
    EXPECT_TRUE(Inequality{}.holds());
}

TEST(Inequality, WithASideThatIsNotFiniteDoesNotHold) {
    for (const bool strict : {false, true}) {
        EXPECT_FALSE(line(infinity, 1.0, strict).holds());
        EXPECT_FALSE(line(1.0, -infinity, strict).holds());
        EXPECT_FALSE(line(nan, 1.0, strict).holds());
        EXPECT_FALSE(line(1.0, nan, strict).holds());
    }
}

TEST(Inequality, ReserveIsTheShareOfTheLeftSide) {
    EXPECT_DOUBLE_EQ(line(4.0, 3.0).margin(), 1.0);
    EXPECT_DOUBLE_EQ(line(4.0, 3.0).reserve(), 0.25);
    EXPECT_DOUBLE_EQ(line(-4.0, -6.0).reserve(), 0.5);
    EXPECT_DOUBLE_EQ(line(-4.0, -2.0).reserve(), -0.5);
}

TEST(Inequality, AllHoldOnlyIfEachOneHolds) {
    EXPECT_TRUE(all_hold({}));
    EXPECT_TRUE(all_hold({line(1.0, 0.0), line(2.0, 2.0)}));
    EXPECT_FALSE(all_hold({line(1.0, 0.0), line(2.0, 2.5)}));
    EXPECT_FALSE(all_hold({line(1.0, nan), line(2.0, 2.0)}));
}

TEST(Inequality, ShortfallNamesBothSidesAndTheMissingAmount) {
    EXPECT_EQ(shortfall(line(0.06, 0.075)), "friction: f_c >= x needs 0.075, there is 0.06, short by 0.015");
    Inequality none = line(0.0, 0.5);
    none.basis = Basis::None;
    none.source = "use direct rendering";
    EXPECT_EQ(shortfall(none), "friction: f_c >= x, but the value is 0.5; use direct rendering");
    none.left = 0.25;
    EXPECT_EQ(shortfall(none), "friction: f_c >= x = 0.25, but the value is 0.5; use direct rendering");
    none.basis = Basis::Linear;
    EXPECT_EQ(shortfall(none), "friction: f_c >= x needs 0.5, there is 0.25, short by 0.25");
}

}  // namespace
}  // namespace palpate
