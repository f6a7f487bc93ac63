// SPDX-License-Identifier: Apache-2.0
// Tests of each guard alone, at the exact values at which it begins to act.
#include "palpate/guard/limits.hpp"
#include "special_values.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/guard/limit_cycle_detector.hpp"
#include "palpate/guard/line_work.hpp"
#include "palpate/guard/passivity_observer.hpp"
#include "palpate/guard/read_motion.hpp"
#include "palpate/guard/reading_guard.hpp"
#include "palpate/guard/stored_energy.hpp"

namespace palpate {
namespace {

using test::infinity;
using test::nan;

/// Returns the next larger number.
double just_above(double value) {
    return std::nextafter(value, infinity);
}

TEST(ForceLimit, ClipsOnlyBeyondTheLimit) {
    const ForceLimit limit{2.0};
    for (const double sign : {-1.0, 1.0}) {
        double force = sign * 2.0;
        EXPECT_EQ(limit.apply(force), Status::Ok);
        EXPECT_EQ(force, sign * 2.0);
        force = sign * just_above(2.0);
        EXPECT_EQ(limit.apply(force), Status::Limited);
        EXPECT_EQ(force, sign * 2.0);
    }
    for (double force : {nan, infinity, -infinity}) {
        EXPECT_EQ(limit.apply(force), Status::NonFinite);
        EXPECT_EQ(force, 0.0);
    }
}

TEST(SlewLimit, LimitsTheChangeSinceTheForceThatWasSent) {
    SlewLimit slew{0.25, 0.0};
    slew.sent(1.0);
    for (const double change : {-0.25, 0.0, 0.25}) {
        double force = 1.0 + change;
        EXPECT_EQ(slew.apply(force), Status::Ok);
        EXPECT_EQ(force, 1.0 + change);
    }
    double force = just_above(1.25);
    EXPECT_EQ(slew.apply(force), Status::Limited);
    EXPECT_EQ(force, 1.25);
    force = -3.0;
    EXPECT_EQ(slew.apply(force), Status::Limited) << "an applied force that was not sent does not count";
    EXPECT_EQ(force, 0.75);
}

TEST(ForceRamp, RisesByEqualPartsAndIsOverAfterItsTicks) {
    ForceRamp ramp{5, 0};
    for (int k = 0; k < 5; ++k) {
        EXPECT_FALSE(ramp.is_over()) << k;
        double force = -3.0;
        EXPECT_EQ(ramp.apply(force), Status::Ramp);
        EXPECT_DOUBLE_EQ(force, -3.0 * k / 5.0);
    }
    EXPECT_TRUE(ramp.is_over());
    double force = -3.0;
    EXPECT_EQ(ramp.apply(force), Status::Ok);
    EXPECT_EQ(force, -3.0);
    EXPECT_TRUE(ForceRamp{}.is_over());
}

TEST(PassivityObserver, SumsTheWorkAndKeepsItsLeastValue) {
    PassivityObserver observer;
    observer.book(2.0, 0.5);
    EXPECT_EQ(observer.energy(), 1.0);
    EXPECT_EQ(observer.least(), 0.0) << "the account begins at zero";
    observer.book(-4.0, 0.75);
    EXPECT_EQ(observer.energy(), -2.0);
    observer.book(1.0, 8.0);
    EXPECT_EQ(observer.energy(), 6.0);
    EXPECT_EQ(observer.least(), -2.0);
}

TEST(ReadMotion, WithoutAnEncoderStepIsTheChangeOfTheReading) {
    for (ReadMotion motion : {ReadMotion{}, ReadMotion{0.0}}) {
        EXPECT_TRUE(std::isnan(motion.to(3.0)));
        EXPECT_EQ(motion.to(3.5), 0.5);
        EXPECT_EQ(motion.to(1.0), -2.5);
        motion.interrupt();
        EXPECT_TRUE(std::isnan(motion.to(4.0)));
        EXPECT_EQ(motion.to(4.25), 0.25);
    }
}

/// A guard of the readings with the sequence number of the last sample.
struct Samples {
    ReadingGuard guard;
    std::uint64_t sequence = 100;

    /// Returns the status of a sample whose sequence number is larger by `more`.
    Status next(double position, std::uint64_t more = 1, Status reported = Status::Ok) {
        sequence += more;
        return guard.check({.position = position, .sequence = sequence, .status = reported});
    }
    /// Exchanges that end without a sample.
    void miss(int exchanges) {
        for (int k = 0; k < exchanges; ++k) {
            EXPECT_EQ(guard.check({.position = nan, .status = Status::Timeout}), Status::Timeout);
        }
    }
};

TEST(ReadingGuard, CountsLostSamples) {
    Samples samples;
    EXPECT_EQ(samples.next(0.0, 1000), Status::Ok) << "a device may begin with any number";
    EXPECT_EQ(samples.next(0.0), Status::Ok);
    EXPECT_EQ(samples.next(0.0, 2), Status::Lost);
    EXPECT_EQ(samples.guard.lost(), 1U);
    EXPECT_EQ(samples.next(0.0), Status::Ok);
    EXPECT_EQ(samples.next(0.0, 4), Status::Lost);
    EXPECT_EQ(samples.guard.lost(), 4U);
    EXPECT_EQ(samples.guard.repeated(), 0U);
    EXPECT_EQ(samples.next(0.0, 1, Status::Limited), Status::Limited) << "the status of the device";
}

TEST(ReadingGuard, AForceThatIsLaterThanAllowedIsStale) {
    for (const double allowed : {0.0, 2e-3}) {
        ReadingGuard guard{{.longest_delay = allowed}};
        std::uint64_t sequence = 0;
        const auto check = [&](double delay, Status reported = Status::Ok) {
            return guard.check({.sequence = ++sequence, .status = reported, .delay = delay});
        };
        EXPECT_EQ(guard.longest_delay(), allowed);
        EXPECT_EQ(check(nan), Status::Ok) << "this device does not measure the delay";
        EXPECT_TRUE(std::isnan(guard.largest_delay()));
        EXPECT_EQ(check(allowed), Status::Ok);
        EXPECT_EQ(check(1e-6 * std::round(1e6 * allowed)), Status::Ok) << "rounding of another unit";
        EXPECT_EQ(check(allowed + 1e-6), Status::Stale);
        EXPECT_EQ(check(0.5 * allowed), Status::Ok) << "the loop ends after a stale force, not the guard";
        EXPECT_EQ(check(1.0, Status::Timeout), Status::Timeout) << "the status of the device";
        EXPECT_EQ(check(infinity), Status::Stale);
        EXPECT_EQ(guard.largest_delay(), infinity);
    }
    ReadingGuard unlimited;
    EXPECT_EQ(unlimited.check({.sequence = 1, .delay = 1e9}), Status::Ok);
}

TEST(ReadingGuard, BeginsWithTheNumberZero) {
    ReadingGuard guard;
    EXPECT_EQ(guard.check({}), Status::Ok);
    EXPECT_EQ(guard.check({}), Status::Lost);
    EXPECT_EQ(guard.repeated(), 1U);
}

TEST(ReadingGuard, CountsRepeatedAndEarlierSamples) {
    Samples samples;
    (void)samples.next(0.0);
    EXPECT_EQ(samples.next(0.0, 0), Status::Lost);
    EXPECT_EQ(samples.guard.repeated(), 1U);
    EXPECT_EQ(samples.guard.check({.sequence = samples.sequence - 1}), Status::Lost);
    EXPECT_EQ(samples.guard.repeated(), 2U);
    EXPECT_EQ(samples.next(0.0, 3), Status::Ok) << "the third exchange since the last new sample";
    EXPECT_EQ(samples.next(0.0, 2), Status::Lost) << "nothing is late any more";
    EXPECT_EQ(samples.guard.lost(), 1U);
}

// A sample of an exchange that ended in a timeout may arrive late, or never. At most two samples are late at a time.
TEST(ReadingGuard, ExpectsTheSamplesOfTimeoutsLate) {
    for (const int missed : {0, 1, 2, 3, 6}) {
        Samples samples;
        (void)samples.next(0.0);
        samples.miss(missed);
        const auto all = static_cast<std::uint64_t>(missed) + 1;
        Samples newest = samples;
        EXPECT_EQ(newest.next(0.0, all), Status::Ok) << missed;
        EXPECT_EQ(newest.next(0.0, 2), Status::Lost) << missed << ": no sample is late";
        EXPECT_EQ(newest.guard.lost(), 1U);

        Samples oldest = samples;
        EXPECT_EQ(oldest.next(0.0, 1), Status::Ok) << missed;
        const auto late = std::min<std::uint64_t>(all - 1, 2);
        Samples more = oldest;
        EXPECT_EQ(oldest.next(0.0, late + 1), Status::Ok) << missed;
        EXPECT_EQ(oldest.guard.lost(), 0U);
        EXPECT_EQ(more.next(0.0, late + 2), Status::Lost) << missed;
        EXPECT_EQ(more.guard.lost(), 1U);
    }
}

TEST(ReadingGuard, StatusesWithoutASampleAreReturned) {
    for (const Status status : {Status::Timeout, Status::Fault}) {
        Samples samples;
        EXPECT_EQ(samples.next(0.0, 1, status), status);
        EXPECT_EQ(samples.next(0.0, 5), Status::Ok) << "the first sample";
        EXPECT_EQ(samples.guard.lost(), 0U);
    }
}

TEST(ReadingGuard, IgnoresAPositionThatIsNotFinite) {
    Samples samples{ReadingGuard{{.largest_step = 0.5}}};
    EXPECT_EQ(samples.next(infinity), Status::NonFinite);
    EXPECT_EQ(samples.next(7.0, 3), Status::Ok) << "the first reading";
    EXPECT_EQ(samples.next(nan), Status::NonFinite);
    EXPECT_EQ(samples.next(7.25), Status::Ok);
    EXPECT_EQ(samples.guard.lost(), 0U);
    EXPECT_EQ(samples.next(nan, 2), Status::NonFinite);
    EXPECT_EQ(samples.guard.lost(), 1U) << "the number of this sample is valid";
    EXPECT_EQ(samples.next(8.0), Status::Jump) << "from the last reading";
}

TEST(ReadingGuard, JumpIsFartherThanTheLargestStepForEachSample) {
    for (const double sign : {-1.0, 1.0}) {
        Samples samples{ReadingGuard{{.largest_step = 0.5}}};
        EXPECT_EQ(samples.next(100.0), Status::Ok) << "without a motion before it";
        samples.next(0.0);
        EXPECT_EQ(samples.next(sign * 0.5), Status::Ok);
        samples.next(0.0);
        EXPECT_EQ(samples.next(sign * just_above(0.5)), Status::Jump);
        EXPECT_EQ(samples.next(sign * 0.5), Status::Ok) << "small motion from the position of the jump";
        samples.next(0.0);
        EXPECT_EQ(samples.next(sign * 1.5, 3), Status::Lost);
        samples.next(sign * 1.0);
        samples.next(sign * 0.5);
        samples.next(0.0);
        EXPECT_EQ(samples.next(sign * just_above(1.5), 3), Status::Jump) << "before the lost samples";
        EXPECT_EQ(samples.guard.lost(), 4U);
    }
}

/// Returns the number of samples at one position after which the encoder counts as frozen; 0 if it never does.
int frozen_after(Samples samples, double position) {
    for (int k = 1; k <= 50; ++k) {
        if (samples.next(position) == Status::Frozen) {
            return k;
        }
    }
    return 0;
}

TEST(ReadingGuard, FrozenIsAStopWithinOneSampleOfFastMotion) {
    const ReadingGuard guard{{.frozen_step = 0.25, .frozen_samples = 4}};
    Samples fast{guard};
    EXPECT_EQ(frozen_after(fast, 1.0), 0) << "no motion before";
    fast.next(1.0);
    fast.next(0.75);
    EXPECT_EQ(frozen_after(fast, 0.75), 4);
    Samples resting = fast;
    for (int k = 0; k < 3; ++k) {
        EXPECT_EQ(resting.next(0.75), Status::Ok);
    }
    EXPECT_EQ(resting.next(0.75), Status::Frozen);
    EXPECT_EQ(resting.next(0.75), Status::Frozen) << "until the position changes";
    EXPECT_EQ(resting.next(1.75), Status::Ok);
    EXPECT_EQ(frozen_after(resting, 1.75), 4) << "counted again after each motion";
    Samples slow = fast;
    slow.next(std::nextafter(0.5, 1.0));
    EXPECT_EQ(frozen_after(slow, std::nextafter(0.5, 1.0)), 0) << "slower before the stop";
    Samples lossy = fast;
    EXPECT_EQ(lossy.next(1.25, 2), Status::Lost);
    EXPECT_EQ(frozen_after(lossy, 1.25), 4);
    lossy.next(std::nextafter(1.75, 0.0), 2);
    EXPECT_EQ(frozen_after(lossy, std::nextafter(1.75, 0.0)), 0) << "slower in each of two samples";
    Samples one{ReadingGuard{{.frozen_step = 0.25, .frozen_samples = 1}}};
    one.next(0.0);
    one.next(1.0);
    EXPECT_EQ(frozen_after(one, 1.0), 1);
    Samples unchecked{ReadingGuard{{.frozen_step = 0.0, .frozen_samples = 0}}};
    unchecked.next(0.0);
    unchecked.next(1.0);
    EXPECT_EQ(frozen_after(unchecked, 1.0), 0);
}

constexpr LimitCycleSettings fast_swings{1.0, 6, 0.0};

/// Moves a handle in alternating directions, one motion of each length in each tick. The force changes by `force` in
/// each motion. One more motion ends the last swing.
LimitCycleDetector after_swings(const std::vector<double>& lengths, LimitCycleDetector detector) {
    double position = 0.0;
    double direction = 1.0;
    detector.watch(position, 0.0);
    for (const double length : lengths) {
        position += 0.01 * direction * length;
        detector.watch(position, direction);
        direction = -direction;
    }
    detector.watch(position + 0.01 * direction, direction);
    return detector;
}

std::vector<double> ones(std::size_t count) {
    return std::vector<double>(count, 1.0);
}

TEST(LimitCycleDetector, NeedsTenSwings) {
    const LimitCycleDetector fresh{fast_swings};
    for (std::size_t count = 0; count < 35; ++count) {
        const LimitCycleDetector detector = after_swings(ones(count), fresh);
        EXPECT_EQ(detector.limit_cycles(), count / 10) << count;
        EXPECT_DOUBLE_EQ(detector.scale(), std::pow(0.7, static_cast<double>(count / 10))) << count;
        double force = -2.0;
        EXPECT_EQ(detector.apply(force), count < 10 ? Status::Ok : Status::LimitCycleScaled);
        EXPECT_DOUBLE_EQ(force, -2.0 * detector.scale());
    }
}

TEST(LimitCycleDetector, ComparesTheLongestSwingsOfBothHalves) {
    for (std::size_t first = 0; first < 5; ++first) {
        for (std::size_t last = 5; last < 10; ++last) {
            for (const double length : {7.99, 8.01, 20.0}) {
                std::vector<double> lengths = ones(10);
                lengths[first] = 10.0;
                lengths[last] = length;
                EXPECT_EQ(after_swings(lengths, LimitCycleDetector{fast_swings}).limit_cycles(),
                          length > 8.0 ? 1U : 0U)
                    << first << " " << last << " " << length;
            }
        }
    }
}

TEST(LimitCycleDetector, DetectsSwingsOfFourFifthsOfTheFirstHalf) {
    for (const double last : {4.0, 3.96875}) {
        LimitCycleDetector detector{fast_swings};
        double position = 0.0;
        for (int k = 0; k <= 11; ++k) {
            detector.watch(position, k % 2);
            position += (k % 2 == 0 ? 1.0 : -1.0) * (k < 5 ? 5.0 : last);
        }
        EXPECT_EQ(detector.limit_cycles(), last == 4.0 ? 1U : 0U) << last;
    }
}

TEST(LimitCycleDetector, ComparesOnlySwingsOfTheSameTen) {
    std::vector<double> lengths = ones(20);
    lengths[0] = 10.0;
    EXPECT_EQ(after_swings(lengths, LimitCycleDetector{fast_swings}).limit_cycles(), 1U) << "the second ten";
    lengths = ones(20);
    lengths[7] = 10.0;
    lengths[12] = 10.0;
    EXPECT_EQ(after_swings(lengths, LimitCycleDetector{fast_swings}).limit_cycles(), 1U) << "the first ten";
}

/// Returns the number of limit cycles if the handle stays at each end for a number of ticks.
std::uint64_t cycles_of(const LimitCycleSettings& settings, int ticks, double reach, double force,
                        int swings = 11) {
    LimitCycleDetector detector{settings};
    for (int swing = 0; swing < swings; ++swing) {
        for (int k = 0; k < ticks; ++k) {
            detector.watch(swing % 2 == 0 ? reach : 0.0, swing % 2 == 0 ? force : 0.0);
        }
    }
    return detector.limit_cycles();
}

TEST(LimitCycleDetector, BeginsAtExactlyItsLimits) {
    EXPECT_EQ(cycles_of({1.0, 6, 0.0}, 5, 0.1, 1.0), 1U);
    EXPECT_EQ(cycles_of({1.0, 5, 0.0}, 5, 0.1, 1.0, 12), 1U) << "the first swing has one tick more";
    EXPECT_EQ(cycles_of({1.0, 4, 0.0}, 5, 0.1, 1.0, 40), 0U) << "too slow";
    EXPECT_EQ(cycles_of({just_above(1.0), 6, 0.0}, 5, 0.1, 1.0, 40), 0U) << "the force changes too little";
    EXPECT_EQ(cycles_of({1.0, 6, 0.5}, 5, 0.5, 1.0, 40), 0U) << "too small for a reversal";
    EXPECT_EQ(cycles_of({1.0, 6, 0.5}, 5, just_above(0.5), 1.0), 1U);
}

// A force that rises steadily changes by 0.75 in each swing, which is less than the needed change.
TEST(LimitCycleDetector, CountsTheChangeOfForceOfOneSwing) {
    LimitCycleDetector detector{fast_swings};
    for (int k = 0; k < 100; ++k) {
        detector.watch(k % 2 == 0 ? 0.1 : 0.0, 0.75 * k);
    }
    EXPECT_EQ(detector.limit_cycles(), 0U);
    for (int k = 100; k < 111; ++k) {
        detector.watch(k % 2 == 0 ? 0.1 : 0.0, 1.0 * k);
    }
    EXPECT_EQ(detector.limit_cycles(), 1U);
}

TEST(LimitCycleDetector, BeginsAgainAfterASlowSwing) {
    LimitCycleDetector detector = after_swings(ones(9), LimitCycleDetector{fast_swings});
    for (int k = 0; k < 20; ++k) {  // a long slow swing in the direction of the last motion
        detector.watch(-1.0 - k, 0.0);
    }
    double position = -20.0;
    for (int k = 0; k <= 10; ++k) {
        EXPECT_EQ(detector.limit_cycles(), 0U) << k;
        position += k % 2 == 0 ? 0.01 : -0.01;
        detector.watch(position, k % 2 == 0 ? 1.0 : -1.0);
    }
    EXPECT_EQ(detector.limit_cycles(), 1U);
}

// Small motions ahead belong to the same swing, also if they are shorter than an encoder step.
TEST(LimitCycleDetector, ASwingEndsAtItsFarthestPosition) {
    LimitCycleDetector detector{{1.0, 20, 0.05}};
    for (int k = 0; k < 200; ++k) {
        const int phase = k % 10;
        detector.watch(0.02 * (phase < 5 ? phase : 10 - phase), phase < 5 ? 1.0 : 0.0);
    }
    EXPECT_GE(detector.limit_cycles(), 2U);
}

TEST(StoredEnergy, AddsTheFarthestPositionOfHandleAndObjectOnEachSide) {
    const StoredEnergySettings settings{.within = 1.0, .lower = 2.0, .upper = 5.0, .force_limit = 4.0};
    StoredEnergy stored{settings};
    stored.visit(2.0, 5.0);
    EXPECT_EQ(stored.most(), 1.0) << "both ends belong to the domain";
    stored.visit(1.5, 3.0);
    EXPECT_EQ(stored.most(), 1.0 + 4.0 * 0.5) << "handle below";
    stored.visit(3.0, 1.0);
    EXPECT_EQ(stored.most(), 1.0 + 4.0 * 1.0) << "object below";
    stored.visit(5.25, 3.0);
    EXPECT_EQ(stored.most(), 1.0 + 4.0 * 1.25) << "handle above";
    stored.visit(3.0, 7.0);
    EXPECT_EQ(stored.most(), 1.0 + 4.0 * 3.0) << "object above";
    stored.visit(3.0, 3.0);
    EXPECT_EQ(stored.most(), 1.0 + 4.0 * 3.0) << "the bound never falls";
    EXPECT_EQ(stored.within(), 1.0);
    for (const double bad : {nan, infinity, -infinity}) {
        stored.visit(bad, -100.0);
        stored.visit(-100.0, bad);
        EXPECT_EQ(stored.most(), 1.0 + 4.0 * 3.0) << "ignored";
    }
}

TEST(StoredEnergy, AddsTheKineticEnergyOfTheFastestMotionOfTheObject) {
    StoredEnergy stored{{.within = 1.0, .mass = 2.0, .period_s = 0.5}};
    stored.visit(0.0, 8.0);
    EXPECT_EQ(stored.most(), 1.0) << "no motion before the first position";
    stored.visit(100.0, 6.5);
    EXPECT_EQ(stored.most(), 1.0 + 9.0) << "speed 3, backwards; without the handle";
    stored.visit(nan, 100.0);
    stored.visit(0.0, 7.0);
    EXPECT_EQ(stored.most(), 1.0 + 9.0) << "slower";
}

// The coupling's limited force stores the integral of min(K e, F_max) over the stretch e.
TEST(StoredEnergy, CouplingStoresTheIntegralOfItsLimitedForce) {
    for (const double stiffness : {0.25, 0.75, 40.0}) {
        constexpr double limit = 3.0;
        const auto energy_to = [&](double stretch) {
            constexpr int cells = 20'000;
            double sum = 0.0;
            for (int k = 0; k < cells; ++k) {
                sum += std::min(stiffness * stretch * (k + 0.5) / cells, limit) * stretch / cells;
            }
            return sum;
        };
        const double knee = limit / stiffness;
        for (const double included : {0.0, 0.5 * knee, 2.0 * knee}) {
            for (const double stretch : {0.25 * knee, 0.75 * knee, 3.0 * knee}) {
                StoredEnergy stored{{.within = 1.0,
                                     .force_limit = limit,
                                     .stiffness = stiffness,
                                     .included_stretch = included}};
                stored.visit(0.5, 0.5 + stretch);
                stored.visit(0.5, 0.5);
                const double more = std::max(0.0, energy_to(stretch) - energy_to(included));
                EXPECT_NEAR(stored.most(), 1.0 + more, 1e-6 * (1.0 + more))
                    << stiffness << " " << included << " " << stretch;
            }
        }
    }
    StoredEnergy balanced{{.within = 1.0, .force_limit = 3.0, .stiffness = 2.0}};
    balanced.visit(0.0, 1.5);
    EXPECT_EQ(balanced.most(), 1.0) << "included up to the force limit";
    balanced.visit(0.0, 2.0);
    EXPECT_EQ(balanced.most(), 1.0 + 3.0 * 0.5);
    StoredEnergy uncoupled{{.within = 1.0, .force_limit = 3.0, .included_stretch = 0.0}};
    uncoupled.visit(0.0, 10.0);
    EXPECT_EQ(uncoupled.most(), 1.0);
}

TEST(ForceLimit, ALineThatIsNotFiniteBecomesZeroForce) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (Command line : {Command{nan, 0.0, 1.0}, Command{1.0, nan, 1.0}, Command{1.0, 0.0, nan}}) {
        EXPECT_EQ(ForceLimit{5.0}.apply(line), Status::NonFinite);
        EXPECT_EQ(line.force, 0.0);
        EXPECT_EQ(line.stiffness, 0.0);
    }
}

TEST(LineWork, IsTheMeanOfTheForcesAtBothEndsOfAMotion) {
    LineWork work{1};
    work.sent(4.0);
    work.sent(0.0);
    // The line of stiffness 4 acts one period late: from 2.0 to 2.4 over a motion of 0.1
    EXPECT_NEAR(work.mean(2.4, 0.1), 2.2, 1e-12);
    work.sent(0.0);
    EXPECT_EQ(work.mean(2.4, 0.1), 2.4);
}

}  // namespace
}  // namespace palpate
