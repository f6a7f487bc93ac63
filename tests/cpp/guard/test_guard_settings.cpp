// SPDX-License-Identifier: Apache-2.0
// Tests of the settings of the guards, and of the guards that they make for a model.
#include "palpate/guard/guard_settings.hpp"
#include "special_values.hpp"

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "palpate/guard/guards.hpp"
#include "support.hpp"

namespace palpate {
namespace {

using test::infinity;

/// Returns the message with which `validate` refuses the settings, or nothing.
std::string refusal(const GuardSettings& settings) {
    return test::refusal([&] { validate(settings); });
}

TEST(GuardSettings, RefusalNamesTheFieldItsValueAndTheRule) {
    EXPECT_EQ(refusal({}), "");
    struct Case {
        double GuardSettings::* field;
        std::string name;
        double least;
        bool least_allowed;
        double most;
        std::string rule;
    };
    const std::string hour = "0 to 3600";
    for (const Case& each :
         {Case{&GuardSettings::force_limit, "force_limit", 0.0, false, 1e300, "> 0"},
          {&GuardSettings::slew_s, "slew_s", 0.0, true, 1e300, ">= 0"},
          {&GuardSettings::ramp_s, "ramp_s", 0.0, true, 3600.0, hour},
          {&GuardSettings::largest_speed, "largest_speed", 0.0, false, infinity, "> 0"},
          {&GuardSettings::frozen_speed, "frozen_speed", 0.0, true, 1e300, ">= 0"},
          {&GuardSettings::frozen_s, "frozen_s", 0.0, true, 3600.0, hour},
          {&GuardSettings::limit_cycle_force, "limit_cycle_force", 0.0, true, 1e300, ">= 0"},
          {&GuardSettings::device_damping, "device_damping", 0.0, true, 1e300, ">= 0"},
          {&GuardSettings::device_friction, "device_friction", 0.0, true, 1e300, ">= 0"},
          {&GuardSettings::encoder_step, "encoder_step", 0.0, true, 1e300, ">= 0"}}) {
        const auto with = [&](double value) {
            GuardSettings settings;
            settings.*each.field = value;
            return refusal(settings);
        };
        const auto refused = [&](const std::string& value) {
            return each.name + " is " + value + ", must be " + each.rule;
        };
        EXPECT_EQ(with(-1.0), refused("-1"));
        EXPECT_EQ(with(std::nan("")), refused("nan"));
        EXPECT_EQ(with(each.least), each.least_allowed ? "" : refused("0"));
        EXPECT_EQ(with(std::numeric_limits<double>::min()), "") << each.name;
        EXPECT_EQ(with(each.most), "") << each.name;
        EXPECT_EQ(with(infinity), each.most == infinity ? "" : refused("inf"));
    }
    GuardSettings settings;
    settings.ramp_s = 3601.0;
    EXPECT_EQ(refusal(settings), "ramp_s is 3601, must be 0 to 3600");
}

TEST(GuardSettings, DefaultsAreScaledToModelAndDevice) {
    DeviceProfile device;
    device.force_limit = 7.0;
    device.viscous_damping = 0.125;
    device.coulomb_friction = 0.375;
    device.period_s = 0.25;
    device.encoder_step = 0.0625;
    const ModelScale scale{4.0, 12.0};
    const GuardSettings usual;
    GuardSettings guards = guards_for(scale, device);
    EXPECT_EQ(guards.force_limit, 7.0);
    EXPECT_EQ(guards.device_damping, 0.125);
    EXPECT_EQ(guards.device_friction, 0.375);
    EXPECT_EQ(guards.encoder_step, 0.0625);
    EXPECT_EQ(guards.largest_speed, 4.0 * usual.largest_speed);
    EXPECT_EQ(guards.frozen_speed, 4.0 * usual.frozen_speed) << "above three encoder steps a sample, 0.75";
    EXPECT_DOUBLE_EQ(guards.limit_cycle_force, 12.0 * usual.limit_cycle_force);
    device.encoder_step = 0.25;
    guards = guards_for(scale, device);
    EXPECT_EQ(guards.frozen_speed, 3.0) << "three encoder steps a sample";
    EXPECT_EQ(guards.ramp_s, usual.ramp_s);
    EXPECT_EQ(guards.slew_s, usual.slew_s);
    EXPECT_EQ(guards.frozen_s, usual.frozen_s);
}

TEST(GuardSettings, BecomeLimitsOfOneTick) {
    GuardSettings settings;
    settings.force_limit = 6.0;
    settings.slew_s = 0.75;
    settings.ramp_s = 2.0;
    EXPECT_EQ(force_limit(settings).largest, 6.0);
    EXPECT_EQ(slew_limit(settings, 0.25).largest_step, 2.0) << "three ticks from zero to the force limit";
    EXPECT_EQ(slew_limit(settings, 0.25).last, 0.0);
    EXPECT_EQ(force_ramp(settings, 0.25).ticks, 8U);
    EXPECT_EQ(force_ramp(settings, 0.25).done, 0U);
    EXPECT_EQ(force_ramp(settings, 0.3).ticks, 7U) << "rounded";
    settings.slew_s = 0.0;
    EXPECT_EQ(slew_limit(settings, 0.25).largest_step, infinity);
}

/// Returns the number of ticks at rest, after motion at a speed, from which the encoder counts as frozen; 0 if never.
int frozen_after(const GuardSettings& settings, double period_s, double speed) {
    ReadingGuard guard = reading_guard(settings, period_s);
    std::uint64_t sequence = 0;
    EXPECT_EQ(guard.check({.sequence = sequence}), Status::Ok);
    const double position = speed * period_s;
    EXPECT_EQ(guard.check({.position = position, .sequence = ++sequence}), Status::Ok);
    for (int k = 1; k < 200; ++k) {
        if (guard.check({.position = position, .sequence = ++sequence}) == Status::Frozen) {
            return k;
        }
    }
    return 0;
}

TEST(GuardSettings, ReadingsAreCheckedAtTheirSpeeds) {
    GuardSettings settings;
    settings.largest_speed = 8.0;
    settings.frozen_speed = 2.0;
    settings.frozen_s = 4.0;
    for (const double speed : {8.0, 8.25}) {
        ReadingGuard guard = reading_guard(settings, 0.25);
        (void)guard.check({.sequence = 1});
        EXPECT_EQ(guard.check({.position = 0.25 * speed, .sequence = 2}),
                  speed > 8.0 ? Status::Jump : Status::Ok);
    }
    EXPECT_EQ(frozen_after(settings, 0.25, 2.0), 16);
    EXPECT_EQ(frozen_after(settings, 0.25, 1.875), 0) << "slower than the frozen speed";
    settings.frozen_s = 0.25;
    EXPECT_EQ(frozen_after(settings, 0.25, 2.0), 5) << "never fewer than five";
    settings.frozen_s = 0.0;
    EXPECT_EQ(frozen_after(settings, 0.25, 2.0), 0) << "switched off";
}

/// Returns a model with the force `stiffness` x over [-1, 2].
ForceModel spring(double stiffness, std::optional<double> period = std::nullopt) {
    return {NetworkParameters{1, {}, {}, {}, {stiffness}, 0.0},
            {{-1.0}, {2.0}, Continuation::Linear, Continuation::Linear, period}};
}

/// Returns a model with the force `stiffness` x + s `loss` over [0, 2], with the direction state s.
ForceModel spring_with_hysteresis(double stiffness, double loss, std::optional<double> play_radius) {
    return {NetworkParameters{1, {}, {}, {}, {stiffness}, 0.0},
            {{}, 0.0, loss},
            {{0.0}, {2.0}, Continuation::Linear, Continuation::Linear, std::nullopt},
            play_radius};
}

Scheme scheme_of(StructureKind kind) {
    Scheme scheme;
    scheme.structure = kind;
    scheme.coupling = {16.0, 0.0};
    scheme.inertia = {0.5, 0.0};
    return scheme;
}

TEST(LargestStoredEnergy, RestingForceIsTheLargestOfTheDomainUpToTheForceLimit) {
    EXPECT_NEAR(largest_resting_force(spring(3.0), 10.0), 6.0, 1e-6);
    EXPECT_NEAR(largest_resting_force(spring(-3.0), 10.0), 6.0, 1e-6) << "its size";
    EXPECT_EQ(largest_resting_force(spring(3.0), 5.0), 5.0);
    EXPECT_NEAR(largest_resting_force(spring_with_hysteresis(3.0, 0.5, 0.1), 10.0), 6.5, 1e-6);
}

// The play operator stores at most r h / 2, the triangle of the hysteresis h over the play radius r.
TEST(LargestStoredEnergy, UsesThePlayRadiusOfTheScheme) {
    Scheme scheme = scheme_of(StructureKind::Direct);
    const ForceModel model = spring_with_hysteresis(3.0, 0.5, 0.125);
    EXPECT_NEAR(largest_stored_energy(model, scheme, 100.0), 6.0 + 0.5 * 0.5 * 0.125, 1e-5);
    scheme.play_radius = 0.25;
    EXPECT_NEAR(largest_stored_energy(model, scheme, 100.0), 6.0 + 0.5 * 0.5 * 0.25, 1e-5);
}

// A spring stores 3 * 2^2 / 2 = 6, and its coupling 6^2 / (2 * 16) = 1.125.
TEST(LargestStoredEnergy, IncludesTheCouplingAndTwiceThatOfACompensatedModel) {
    EXPECT_NEAR(largest_stored_energy(spring(3.0), scheme_of(StructureKind::Direct), 100.0), 6.0, 1e-5);
    for (const StructureKind kind : {StructureKind::Massless, StructureKind::Implicit,
                                     StructureKind::Explicit, StructureKind::EnergyConsistent}) {
        Scheme scheme = scheme_of(kind);
        EXPECT_NEAR(largest_stored_energy(spring(3.0), scheme, 100.0), 7.125, 1e-5);
        scheme.compensated = true;
        EXPECT_NEAR(largest_stored_energy(spring(3.0), scheme, 100.0), 8.25, 1e-5);
    }
}

TEST(StoredEnergy, TakesItsNumbersFromModelSchemeAndDevice) {
    const StoredEnergySettings direct =
        stored_energy(spring(3.0), scheme_of(StructureKind::Direct), 100.0, 0.25);
    EXPECT_NEAR(direct.within, 6.0, 1e-5);
    EXPECT_EQ(direct.lower, -1.0);
    EXPECT_EQ(direct.upper, 2.0);
    EXPECT_EQ(direct.force_limit, 100.0);
    EXPECT_EQ(direct.stiffness, 0.0);
    EXPECT_EQ(direct.mass, 0.0);
    EXPECT_EQ(direct.period_s, 0.25);
    const StoredEnergySettings massless =
        stored_energy(spring(3.0), scheme_of(StructureKind::Massless), 100.0, 0.25);
    EXPECT_NEAR(massless.within, 7.125, 1e-5);
    EXPECT_EQ(massless.stiffness, 16.0);
    EXPECT_EQ(massless.included_stretch, infinity);
    EXPECT_EQ(massless.mass, 0.0);
    const StoredEnergySettings heavy =
        stored_energy(spring(3.0), scheme_of(StructureKind::Implicit), 4.0, 0.25);
    EXPECT_EQ(heavy.stiffness, 16.0);
    EXPECT_EQ(heavy.included_stretch, 0.25) << "force limit 4 over stiffness 16";
    EXPECT_EQ(heavy.mass, 0.5);
    const StoredEnergySettings wheel =
        stored_energy(spring(0.0, 3.0), scheme_of(StructureKind::Direct), 4.0, 0.25);
    EXPECT_EQ(wheel.lower, -infinity) << "a periodic model has no end";
    EXPECT_EQ(wheel.upper, infinity);
}

GuardSettings settings_of(bool certified) {
    GuardSettings settings;
    settings.force_limit = 100.0;
    settings.slew_s = 0.5;
    settings.ramp_s = 1.0;
    settings.largest_speed = 8.0;
    settings.frozen_s = 0.0;
    settings.device_damping = 0.25;
    settings.device_friction = 0.5;
    settings.encoder_step = 0.125;
    settings.certified = certified;
    return settings;
}

TEST(Guards, ArePlacedInTheirRunWithTheSettings) {
    for (const bool certified : {false, true}) {
        const Guards guards =
            guards_of(settings_of(certified), spring(3.0), scheme_of(StructureKind::Direct), 0.25);
        EXPECT_EQ(guards.limit.largest, 100.0);
        EXPECT_EQ(guards.slew.largest_step, 50.0);
        EXPECT_EQ(guards.ramp.ticks, 4U);
        ReadingGuard reading = guards.reading;
        (void)reading.check({.sequence = 1});
        EXPECT_EQ(reading.check({.position = 2.25, .sequence = 2}), Status::Jump);
    }
}

TEST(Guards, OnlyACertifiedRunUsesTheProvedMotion) {
    const auto motion = [](bool certified) {
        ReadMotion read =
            guards_of(settings_of(certified), spring(3.0), scheme_of(StructureKind::Direct), 0.25).motion;
        (void)read.to(0.0);
        return read.to(0.5);
    };
    EXPECT_EQ(motion(false), 0.5);
    EXPECT_EQ(motion(true), 0.4375) << "half an encoder step less";
}

// A motion of 0.625 against the force -16, with d = 0.625 in a certified run. Without a certificate the account counts
// nine tenths of the losses with d = 0.5, the friction over the motion of the play operator, and the errors of the
// readings.
TEST(Guards, ACertifiedRunCountsAllLosses) {
    const auto spent = [](bool certified) {
        EnergyAccount account =
            guards_of(settings_of(certified), spring(3.0), scheme_of(StructureKind::Direct), 0.25).account;
        account.visit(0.0, 0.0);
        account.book(-4.0, nan);
        account.book(-4.0, 0.0);
        const double before = account.left();
        account.book(-4.0, 0.625);
        return before - account.left();
    };
    EXPECT_NEAR(spent(true), 2.5 - (0.25 * 0.625 * 0.625 / 0.25 + 0.5 * 0.625), 1e-12);
    EXPECT_NEAR(spent(false), 2.5 - 0.9 * (0.25 * 0.5 * 0.5 / 0.25 + 0.5 * 0.5625), 1e-12);
}

TEST(Guards, OnlyACertifiedRunMayGiveTheEnergyOfAStartOutsideTheDomain) {
    for (const bool certified : {false, true}) {
        EnergyAccount account =
            guards_of(settings_of(certified), spring(3.0), scheme_of(StructureKind::Direct), 0.25).account;
        EXPECT_NEAR(account.stored().within(), 6.0, 1e-5);
        account.visit(5.0, 5.0);
        EXPECT_NEAR(account.stored().most(), 306.0, 1e-5);
        EXPECT_NEAR(account.left(), certified ? 306.0 : 6.0, 1e-5);
    }
}

// The account of an uncertified run uses steps, delay, jitter and largest speed of the device.
TEST(Guards, AnAccountUsesTheNumbersOfTheDevice) {
    GuardSettings settings = settings_of(false);
    settings.force_step = 0.5;
    settings.delay_s = 0.625;
    settings.jitter_s = 0.25;
    const AccountSettings account = account_settings(settings, 0.25);
    EXPECT_EQ(account.encoder_step, 0.125);
    EXPECT_EQ(account.force_step, 0.5);
    EXPECT_EQ(account.whole_delay, 2);
    EXPECT_DOUBLE_EQ(account.delay_fraction, 0.25) << "of the longest period";
    EXPECT_EQ(account.period_s, 0.5);
    EXPECT_EQ(account.longest_step, 8.0 * 0.5 + 0.125);
    settings.certified = true;
    const AccountSettings certified = account_settings(settings, 0.25);
    EXPECT_EQ(certified.encoder_step, 0.0) << "the certificate includes the steps";
    EXPECT_EQ(certified.force_step, 0.0);
}

// Without known losses the errors of the readings would use up the account, although nothing moves alone.
TEST(Guards, WithoutKnownLossesTheAccountLimitsTheForceOnlyInItsLastQuarter) {
    GuardSettings settings = settings_of(false);
    settings.device_damping = settings.device_friction = 0.0;
    EnergyAccount account = guards_of(settings, spring(3.0), scheme_of(StructureKind::Direct), 0.25).account;
    const double stored = account.stored().within();
    account.visit(0.0, 0.0);
    account.book(0.0, nan);
    for (int k = 0; k < 1000; ++k) {
        account.book(k % 2 == 0 ? 1.0 : -1.0, 0.0);
        account.sent(0.0);
    }
    EXPECT_DOUBLE_EQ(account.left(), stored);
    double force = settings.force_limit;
    EXPECT_EQ(account.apply(force), Status::Ok);
    account.book(-0.8 * stored, 1.0);
    EXPECT_EQ(account.apply(force), Status::EnergyLimited);
    EXPECT_NEAR(force, 0.8 * settings.force_limit, 1e-9);
}

TEST(Guards, CanBeSwitchedOff) {
    GuardSettings settings = settings_of(false);
    settings.energy_account = false;
    settings.limit_cycle_force = 0.0;
    Guards guards = guards_of(settings, spring(3.0), scheme_of(StructureKind::Direct), 1e-3);
    guards.account.book(-1.0, nan);
    guards.account.book(-1e9, 1.0);
    double force = 1.0;
    EXPECT_EQ(guards.account.apply(force), Status::Ok);
    for (int k = 0; k < 100; ++k) {
        guards.limit_cycle.watch(k % 2, k % 2);
    }
    EXPECT_EQ(guards.limit_cycle.limit_cycles(), 0U);
}

/// Returns the limit cycles of an oscillation with a number of ticks in each swing.
std::uint64_t cycles(const GuardSettings& settings, double period_s, int ticks, double reach, double force) {
    LimitCycleDetector detector =
        guards_of(settings, spring(3.0), scheme_of(StructureKind::Direct), period_s).limit_cycle;
    for (int k = 0; k < 30 * ticks; ++k) {
        const bool far = k / ticks % 2 == 0;
        detector.watch(far ? reach : 0.0, far ? force : 0.0);
    }
    return detector.limit_cycles();
}

// A swing is half a period of the oscillation: at 20 Hz 25 ms.
TEST(Guards, LimitCyclesAreFasterThanTwentyHertz) {
    GuardSettings settings = settings_of(false);
    settings.limit_cycle_force = 0.5;
    EXPECT_EQ(cycles(settings, 1e-3, 25, 1.0, 0.5), 2U);
    EXPECT_EQ(cycles(settings, 1e-3, 26, 1.0, 0.5), 0U);
    EXPECT_EQ(cycles(settings, 5e-4, 50, 1.0, 0.5), 2U);
    EXPECT_EQ(cycles(settings, 5e-4, 51, 1.0, 0.5), 0U);
    EXPECT_EQ(cycles(settings, 1e-3, 25, 1.0, 0.49), 0U) << "force";
    EXPECT_EQ(cycles(settings, 1e-3, 25, 0.125, 0.5), 0U) << "one encoder step";
    EXPECT_EQ(cycles(settings, 1e-3, 25, 0.13, 0.5), 2U);
}

}  // namespace
}  // namespace palpate
