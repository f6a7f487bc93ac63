// SPDX-License-Identifier: Apache-2.0
#include "palpate/guard/energy_account.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include <gtest/gtest.h>

#include "limits/account_scenes.hpp"
#include "special_values.hpp"
#include "support.hpp"

namespace palpate {
namespace {

using test::infinity;
using test::nan;

/// Returns an account of 1 J with B = b / T = 2 N/m that has its first reading.
EnergyAccount started(AccountSettings settings = {}) {
    settings.stored.within = 1.0;
    settings.device_damping = 2.0;
    settings.period_s = 1.0;
    EnergyAccount account{settings};
    account.visit(0.0, 0.0);
    account.book(0.0, nan);
    return account;
}

/// Returns the largest force that an account allows.
double largest(const EnergyAccount& account) {
    double force = 1e9;
    EXPECT_EQ(account.apply(force), Status::EnergyLimited);
    double same = -force;
    EXPECT_EQ(account.apply(same), Status::Ok) << "the largest force itself";
    EXPECT_EQ(same, -force);
    return force;
}

TEST(EnergyAccount, NoHandTakesMoreThanTheEnergyAtTheStart) {
    test::Random random{5};
    double deepest = 0.0;
    std::size_t acting = 0;
    const int scenes = test::cases(3000);
    for (int k = 0; k < scenes; ++k) {
        const bench::AccountScene scene = bench::random_account_scene(random);
        const bench::AccountMotion motion = bench::move_account(scene, random, 600);
        EXPECT_GE(motion.deepest, -1.0 - 1e-9) << scene;
        deepest = std::min(deepest, motion.deepest);
        acting += motion.limited > 0 ? 1 : 0;
    }
    EXPECT_LT(deepest, -0.9999) << "the search reaches the bound";
    EXPECT_GT(acting, static_cast<std::size_t>(scenes / 4)) << "of " << scenes << " scenes";
}

// With more losses than the account counts, a hand could take more than E0 by the account's own numbers.
TEST(EnergyAccount, CountsExactlyTheStatedLosses) {
    EnergyAccount account = started({.device_friction = 0.5});
    account.book(-3.0, 0.25);
    EXPECT_DOUBLE_EQ(account.left(), 1.0 - 0.75 + 2.0 * 0.0625 + 0.5 * 0.25);
    account.book(3.0, 0.25);
    EXPECT_DOUBLE_EQ(account.left(), 0.5 + 0.75 + 0.25);
}

TEST(EnergyAccount, AForceTakesAtMostTheEnergyThatIsLeft) {
    EXPECT_DOUBLE_EQ(largest(started()), 2.0 * std::sqrt(2.0));
    EXPECT_DOUBLE_EQ(largest(started({.device_friction = 0.5})), 0.5 + 2.0 * std::sqrt(2.0));
    EXPECT_DOUBLE_EQ(largest(started({.device_friction = 0.5, .force_step = 0.25})),
                     0.375 + 2.0 * std::sqrt(2.0))
        << "the device rounds the force up";
    // Up to a motion of 0.25 the force p takes p D - B D^2 = 1
    EXPECT_DOUBLE_EQ(largest(started({.longest_step = 0.25})), 1.0 / 0.25 + 2.0 * 0.25);
}

TEST(EnergyAccount, WithoutLossesNeedsALargestSpeed) {
    AccountSettings settings{.stored = {.within = 1.0}};
    EnergyAccount account{settings};
    account.book(0.0, nan);
    double force = 0.1;
    EXPECT_EQ(account.apply(force), Status::EnergyLimited);
    EXPECT_EQ(force, 0.0);
    account.sent(0.0);
    settings.longest_step = 0.25;
    account = EnergyAccount{settings};
    account.book(0.0, nan);
    EXPECT_DOUBLE_EQ(largest(account), 4.0);
}

// With n whole and tau of a period of delay, n commands and tau of the command before them still act.
TEST(EnergyAccount, CommandsThatStillActReserveTheirEnergy) {
    EnergyAccount account = started({.whole_delay = 2, .delay_fraction = 0.25});
    const auto r = [](double force) { return force * force / 8.0; };
    account.sent(1.0);
    account.book(0.0, 0.0);
    EXPECT_DOUBLE_EQ(account.left(), 1.0 - r(1.0));
    account.sent(0.5);
    account.book(0.0, 0.0);
    EXPECT_DOUBLE_EQ(account.left(), 1.0 - r(1.0) - r(0.5));
    account.sent(0.0);
    // The force changed to 1 after a quarter of the period, in which the handle did not move: in two parts the hand may
    // have moved it back and forth
    account.book(1.0, 0.0);
    EXPECT_DOUBLE_EQ(account.left(), 1.0 - r(0.5) - 0.25 * r(1.0) - 0.25 * 0.75 * r(1.0));
}

TEST(EnergyAccount, NeverFallsBelowTheEnergyThatCommandsStillTake) {
    EnergyAccount account = started({.device_friction = 0.5, .encoder_step = 0.125});
    account.book(-400.0, 0.125);
    EXPECT_DOUBLE_EQ(account.left(), -0.125 * (400.0 + 0.5)) << "Delta |F| + f_c Delta below zero";
    double force = 9.0;
    EXPECT_EQ(account.apply(force), Status::EnergyLimited);
    EXPECT_EQ(force, 0.5) << "friction holds this force";
}

TEST(EnergyAccount, ForgetsLossesAboveTwiceTheStoredEnergy) {
    EnergyAccount account = started();
    for (int k = 0; k < 10; ++k) {
        account.book(0.0, 1.0);
    }
    EXPECT_DOUBLE_EQ(account.left(), 2.0);
}

TEST(EnergyAccount, PeriodsWithoutTwoReadingsDoNotCount) {
    const auto r = [](double force) { return force * force / 8.0; };
    EnergyAccount account = started({.encoder_step = 0.125, .whole_delay = 1});
    account.sent(1.0);
    account.book(0.0, 0.0);
    account.sent(0.5);
    account.book(1.0, 0.0);
    const double before = account.left() + r(0.5);
    account.sent(0.0);
    account.interrupt();
    account.sent(0.0);
    account.interrupt();
    EXPECT_DOUBLE_EQ(account.left(), before) << "the error of the last reading counts once";
    account.sent(0.0);
    account.book(-9.0, nan);
    EXPECT_DOUBLE_EQ(account.left(), before);
    account.book(0.0, 0.125);
    EXPECT_DOUBLE_EQ(account.left(), before) << "a reading that changes by one step proves no motion";
}

TEST(EnergyAccount, WithoutAReadingOfTheForceSendsOnlyForcesThatTakeNothing) {
    EnergyAccount account = started({.device_friction = 0.5});
    for (const double bad : {nan, infinity}) {
        account.book(bad, 0.25);
        EXPECT_DOUBLE_EQ(largest(account), 0.5);
        account.sent(0.5);
        account.book(0.5, 0.25);
        EXPECT_DOUBLE_EQ(largest(account), 0.5 + 2.0 * std::sqrt(2.0));
    }
}

TEST(EnergyAccount, WithoutABoundOfTheEnergyNeverActs) {
    EnergyAccount account;
    account.visit(0.0, 0.0);
    account.book(-1e9, nan);
    account.book(-1e9, 1.0);
    account.sent(1e9);
    account.interrupt();
    account.book(-1e9, nan);
    double force = -1e9;
    EXPECT_EQ(account.apply(force), Status::Ok);
    EXPECT_EQ(force, -1e9);
    EXPECT_EQ(account.left(), infinity);
}

}  // namespace
}  // namespace palpate
