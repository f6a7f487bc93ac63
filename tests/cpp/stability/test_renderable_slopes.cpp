// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/stability/renderable_slopes.hpp"
#include "slopes.hpp"
#include "special_values.hpp"
#include "support.hpp"

namespace palpate {
namespace {

using test::infinity;
using test::slopes;

/// Returns a device with the damping 0.06 and the friction 0.01; the delay is given in periods.
DeviceProfile fast_device(double delay, double encoder_step = 0.0) {
    DeviceProfile profile;
    profile.viscous_damping = 0.06;
    profile.coulomb_friction = 0.01;
    profile.encoder_step = encoder_step;
    profile.period_s = 0.5e-3;
    profile.delay_s = delay * profile.period_s;
    return profile;
}

TEST(RenderableSlopes, LargestValueThatHoldsIsFoundAtEverySize) {
    for (const double most : {1.0, 3e9}) {
        for (int k = 0; k <= 56; ++k) {
            const double limit = most * std::ldexp(0.9, -k);
            int calls = 0;
            const double found = detail::largest_that_holds(most, [&](double v) {
                ++calls;
                return v <= limit;
            });
            EXPECT_LE(found, limit) << k;
            EXPECT_GE(found, limit * (1.0 - 1e-14)) << k;
            EXPECT_LE(calls, 71);
        }
        EXPECT_EQ(detail::largest_that_holds(most, [](double) { return true; }), most);
        EXPECT_EQ(detail::largest_that_holds(most, [](double) { return false; }), 0.0);
        EXPECT_EQ(detail::largest_that_holds(most, [](double v) { return v == 0.0; }), 0.0);
    }
}

TEST(RenderableSlopes, SearchEndsFarAboveTheSlopesOfTheDevice) {
    EXPECT_DOUBLE_EQ(detail::slope_search_limit(fast_device(0.0)), 1e9 * 121.0);
}

TEST(RenderableSlopes, DirectRenderingHoldsForTheSlopesOfSlidingAndSticking) {
    const DeviceProfile exact = fast_device(0.0, 1e-4);  // b / T = 120, 2 f_c / Delta = 200
    EXPECT_TRUE(detail::holds_directly(exact, {200.0, 199.0}, 0.0));
    EXPECT_FALSE(detail::holds_directly(exact, {200.1, 1.0}, 0.0));
    EXPECT_FALSE(detail::holds_directly(exact, {1.0, 200.1}, 0.0));
    const DeviceProfile smooth = fast_device(0.0);
    EXPECT_TRUE(detail::holds_directly(smooth, {239.9, 1e6}, 0.0));
    EXPECT_FALSE(detail::holds_directly(smooth, {240.1, 0.0}, 0.0));
    EXPECT_TRUE(detail::holds_directly(smooth, {139.9, 1e6}, 100.0));
    EXPECT_FALSE(detail::holds_directly(smooth, {140.1, 0.0}, 100.0));
    // Without hysteresis (h = 0) the play radius is 0, so with encoder steps h / r counts twice.
    EXPECT_TRUE(detail::holds_directly(exact, {99.9, 50.0}, 50.0));
    EXPECT_FALSE(detail::holds_directly(exact, {100.1, 50.0}, 50.0));
    EXPECT_FALSE(detail::holds_directly(exact, {50.0, 100.1}, 50.0));
}

TEST(RenderableSlopes, WithoutDelayAreThoseOfDampingAndFriction) {
    const Interval smooth = renderable_slopes(fast_device(0.0));
    EXPECT_EQ(smooth.lower, -infinity);
    EXPECT_NEAR(smooth.upper, 240.0, 1e-9);
    const Interval stepped = renderable_slopes(fast_device(0.0, 1e-4));
    EXPECT_NEAR(stepped.lower, -200.0, 200.0 * 1.1e-5);
    EXPECT_NEAR(stepped.upper, 200.0, 1e-9);
    const Interval fine = renderable_slopes(fast_device(0.0, 5e-5));  // friction 400
    EXPECT_NEAR(fine.lower, -400.0, 400.0 * 1.1e-5);
    EXPECT_NEAR(fine.upper, 240.0, 1e-9);
    const Interval sticking = renderable_slopes(fast_device(0.0), 100.0);
    EXPECT_NEAR(sticking.upper, 140.0, 1e-9);
    EXPECT_EQ(sticking.lower, -infinity);
    EXPECT_NEAR(renderable_slopes(fast_device(0.0, 1e-4), 50.0).upper, 100.0, 1e-9);
    const Interval wanted = renderable_slopes(fast_device(0.0, 5e-5), 0.0, {10.0, 20.0});
    EXPECT_NEAR(wanted.lower, -400.0, 400.0 * 1.1e-5);
    EXPECT_NEAR(wanted.upper, 240.0, 1e-9);
    DeviceProfile none = fast_device(0.0);
    none.viscous_damping = 0.0;
    EXPECT_EQ(renderable_slopes(none).upper, 0.0);
    none.encoder_step = none.force_step = 0.0;
    none.delay_s = none.period_s;
    EXPECT_EQ(renderable_slopes(none).lower, 0.0);
}

// With delay the falling slope is found first, at the rising slope that is certified together with an equal falling
// slope; then the rising slope is found at that falling slope.
TEST(RenderableSlopes, WithDelayTheFallingSlopeIsFoundFirst) {
    for (const double delay : {0.5, 1.0}) {
        const DeviceProfile profile = fast_device(delay);
        const auto need = [&](double rising, double falling) {
            return device_need(profile, {rising, falling}) * profile.period_s;
        };
        for (const SlopeRange wanted : {SlopeRange{infinity, infinity}, {infinity, 10.0}, {5.0, infinity}}) {
            // Equal slopes first: the need is proportional to the slopes.
            double low = 0.0;
            double high = 1e4;
            for (int k = 0; k < 60; ++k) {
                const double middle = 0.5 * (low + high);
                (need(std::min(middle, wanted.rising), std::min(middle, wanted.falling)) <= 0.06 ? low
                                                                                                 : high) =
                    middle;
            }
            const double rising = std::min(low, wanted.rising) * (1.0 - 1e-5);
            const double both_falling = std::min(low, wanted.falling) * (1.0 - 1e-5);
            const Interval any = renderable_slopes(profile, 0.0, wanted);
            EXPECT_LE(need(rising, -any.lower), 0.06 * (1.0 + 1e-9)) << delay;
            EXPECT_GT(need(rising, -any.lower * (1.0 + 3e-5)), 0.06) << delay;
            EXPECT_GE(-any.lower, both_falling * (1.0 - 1e-9));
            EXPECT_LE(need(any.upper, -any.lower), 0.06) << delay;
            EXPECT_GT(need(any.upper * (1.0 + 1e-4), -any.lower), 0.06) << delay;
        }
    }
}

TEST(RenderableSlopes, SteepestStickIsAddedToASlopeOfItsSize) {
    // Rising slope k + h / r = 2 k: T 2 k / 2 = b
    EXPECT_NEAR(steepest_stick(fast_device(0.0)), 120.0, 1e-9);
    // Friction: (k + 2 k) Delta / 2 = f_c
    EXPECT_NEAR(steepest_stick(fast_device(0.0, 1e-4)), 200.0 / 3.0, 1e-9);
    const DeviceProfile late = fast_device(1.0);
    const double stick = steepest_stick(late);
    EXPECT_NEAR(device_need(late, {2.0 * stick, stick}) * late.period_s, 0.06, 1e-9);
}

/// Returns bounds of a force with hysteresis whose play operator does not stick.
ForceBounds sliding_bounds(double rising, double loss) {
    ForceBounds bounds;
    bounds.hysteresis = true;
    bounds.slope = {-5.0, rising};
    bounds.sliding = bounds.steepest = std::max(rising, 5.0);
    bounds.hysteresis_force = {0.0, loss};
    return bounds;
}

TEST(RenderableSlopes, NarrowestPlayAddsTheSlopeThatRemains) {
    // 10 + h / r = 2 b / T = 240
    EXPECT_NEAR(narrowest_play(sliding_bounds(10.0, 0.1), fast_device(0.0), 0.0, 1.0), 0.1 / 230.0, 1e-15);
    EXPECT_NEAR(narrowest_play(sliding_bounds(10.0, 0.1), fast_device(0.0), 1e-9, 1.0), 0.1 / 230.0, 1e-12);
    EXPECT_EQ(narrowest_play(sliding_bounds(10.0, 0.1), fast_device(0.0), 0.01, 1.0), 0.01);
    EXPECT_EQ(narrowest_play(sliding_bounds(10.0, 0.1), fast_device(0.0), 1e-5, 4e-4), infinity);
    EXPECT_NEAR(narrowest_play(sliding_bounds(10.0, 0.1), fast_device(0.0), 1e-5, 5e-4), 0.1 / 230.0, 1e-15);
    // Friction: h / r counts once with the addition e to the slope, as soon as r >= Delta / 2, or twice.
    const DeviceProfile stepped = fast_device(0.0, 1e-4);
    const double radius = narrowest_play(sliding_bounds(10.0, 0.1), stepped, 1e-5, 1.0);
    const double once = 10.0 * (1.0 + 1e-4 / (2.0 * radius)) + 0.1 / radius;
    EXPECT_NEAR(once, 200.0, 1e-6);
    // Negative hysteresis is never certified; hysteresis of 0 adds nothing.
    ForceBounds negative = sliding_bounds(10.0, -0.1);
    negative.hysteresis_force = {-0.2, -0.1};
    EXPECT_EQ(narrowest_play(negative, fast_device(0.0), 1e-3, 1.0), infinity);
    EXPECT_EQ(narrowest_play(sliding_bounds(10.0, 0.0), fast_device(0.0), 1e-6, 1.0), 1e-6);
    EXPECT_EQ(narrowest_play(sliding_bounds(10.0, -0.1), fast_device(0.0), 1e-6, 1.0), 1e-6);
}

/// A virtual object and its coupling that the explicit structure may use.
struct Candidate {
    double stiffness;
    double damping;
    double mass;
};

/// Returns all combinations in the order of the search: shares of the largest stiffness, then increasing object
/// damping. The mass gives the object a slope limit of `reserve` times the steepest slope, coupling included.
std::vector<Candidate> candidates(double rising, const DeviceProfile& profile, double B_c) {
    const double T = profile.period_s;
    const double stiffest = stiffest_coupling(0.0, 0.0, profile);
    std::vector<Candidate> all;
    for (const double share : {0.9, 0.75, 0.6, 0.45, 0.3, 0.15}) {
        std::vector<Candidate> objects;
        const double K = share * stiffest;
        for (const double ratio : {0.1, 0.25, 0.5, 1.0}) {
            for (const double reserve : {1.1, 1.5, 2.5, 5.0}) {
                // (4 m - 2 (B_o + B_c) T) / T^2 = reserve (rising + K_c) with B_o = ratio m / T
                const double slope = reserve * (std::max(0.0, rising) + K);
                const double mass = (slope * T * T + 2.0 * B_c * T) / (4.0 - 2.0 * ratio);
                objects.push_back({K, ratio * mass / T, mass});
            }
        }
        std::sort(objects.begin(), objects.end(),
                  [](const Candidate& one, const Candidate& other) { return one.damping < other.damping; });
        all.insert(all.end(), objects.begin(), objects.end());
    }
    return all;
}

bool stable(const ForceBounds& bounds, const Candidate& one, double B_c, const DeviceProfile& profile) {
    Scheme scheme;
    scheme.structure = StructureKind::Explicit;
    scheme.coupling = {one.stiffness, B_c};
    scheme.inertia = {one.mass, one.damping};
    return all_hold(inequalities_of(bounds, scheme, profile));
}

TEST(ExplicitScheme, IsTheFirstStableCombinationOfTheSearch) {
    test::Random random{31};
    int found = 0;
    int none = 0;
    int later = 0;
    for (int draw = 0; draw < 6; ++draw) {
        const DeviceProfile profile = fast_device(draw % 3 == 2 ? 1.0 : 0.0);
        const double rising = draw == 5 ? -1.0 : std::exp(test::uniform(random, 0.0, 6.0));
        const ForceBounds bounds =
            slopes(draw == 5 ? -2.0 : -std::exp(test::uniform(random, -2.0, 4.5)), rising);
        const double B_c = 0.1 * profile.viscous_damping;
        const std::vector<Candidate> all = candidates(rising, profile, B_c);
        const auto first = std::find_if(
            all.begin(), all.end(), [&](const Candidate& one) { return stable(bounds, one, B_c, profile); });
        const Candidate& expected = first == all.end() ? all.back() : *first;
        const Scheme scheme = explicit_scheme(bounds, profile, {});
        EXPECT_EQ(scheme.structure, StructureKind::Explicit);
        EXPECT_NEAR(scheme.coupling.stiffness, expected.stiffness, 1e-6 * expected.stiffness) << draw;
        EXPECT_DOUBLE_EQ(scheme.coupling.damping, B_c);
        EXPECT_NEAR(scheme.inertia.damping, expected.damping, 1e-6 * expected.damping) << draw;
        EXPECT_NEAR(scheme.inertia.mass, expected.mass, 1e-6 * expected.mass) << draw;
        EXPECT_EQ(scheme.play_radius, 0.0);
        found += first != all.end() ? 1 : 0;
        none += first == all.end() ? 1 : 0;
        later += first - all.begin() >= 16 && first != all.end() ? 1 : 0;
    }
    EXPECT_GE(found, 3);
    EXPECT_GE(none + later, 1);
}

TEST(ExplicitScheme, KeepsTheNumbersThatTheUserSets) {
    const DeviceProfile profile = fast_device(0.0);
    const ForceBounds bounds = slopes(-1.0, 20.0);
    SchemeChoices chosen;
    chosen.coupling_stiffness = 33.0;
    chosen.coupling_damping = 0.004;
    chosen.mass = 0.002;
    chosen.object_damping = 0.3;
    chosen.play_radius = 0.05;
    const Scheme scheme = explicit_scheme(bounds, profile, chosen);
    EXPECT_EQ(scheme.coupling.stiffness, 33.0);
    EXPECT_EQ(scheme.coupling.damping, 0.004);
    EXPECT_EQ(scheme.inertia.mass, 0.002);
    EXPECT_EQ(scheme.inertia.damping, 0.3);
    EXPECT_EQ(scheme.play_radius, 0.05);
    SchemeChoices massless;
    massless.coupling_stiffness = 33.0;
    massless.mass = 0.0;
    EXPECT_GT(explicit_scheme(bounds, profile, massless).inertia.mass, 0.0);
    SchemeChoices heavy;
    heavy.mass = 0.002;
    EXPECT_DOUBLE_EQ(explicit_scheme(bounds, profile, heavy).inertia.damping, 0.1 * 0.002 / profile.period_s);
    // A force without finite bounds, or a device without damping, has no stable scheme; the last one is returned.
    const Scheme wall = explicit_scheme(slopes(0.0, infinity), profile, heavy);
    EXPECT_NEAR(wall.coupling.stiffness, 0.15 * 228.0, 1e-6);
    EXPECT_DOUBLE_EQ(wall.inertia.damping, 1.0 * 0.002 / profile.period_s);
    DeviceProfile loose = profile;
    loose.viscous_damping = 0.0;
    EXPECT_EQ(explicit_scheme(bounds, loose, {}).coupling.stiffness, 1e-9);
}

}  // namespace
}  // namespace palpate
