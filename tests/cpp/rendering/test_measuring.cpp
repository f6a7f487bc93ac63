// SPDX-License-Identifier: Apache-2.0
// Tests of the structures that measure objects and devices, tick by tick. All numbers are sums of powers of two, so
// that results are exact.
#include "palpate/rendering/measuring.hpp"
#include "special_values.hpp"

#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "support.hpp"

namespace palpate {
namespace {

using test::infinity;
using test::nan;
constexpr double probe_period = 0.125;

constexpr ProbeSettings settings{
    .lower = 0.0, .upper = 1.0, .speed = 1.0, .stiffness = 64.0, .damping = 0.5, .force_limit = 16.0};

template <class S>
void expect_refusal(S& structure, double environment_position) {
    for (const double bad : {nan, infinity, -infinity}) {
        const Rendered refused = structure.step(bad);
        EXPECT_EQ(refused.status, Status::NonFinite);
        EXPECT_EQ(refused.force, 0.0);
        EXPECT_TRUE(refused.environment_position == environment_position || std::isnan(environment_position));
    }
}

void expect_plain(const Rendered& rendered, double force, double environment_position) {
    EXPECT_EQ(rendered.force, force);
    EXPECT_EQ(rendered.environment_position, environment_position);
    EXPECT_EQ(rendered.evaluations, 0);
    EXPECT_EQ(rendered.status, Status::Ok);
}

TEST(Probe, FollowsATriangleWithSpringAndDamper) {
    Probe probe{settings, probe_period};
    probe.reset(0.0);
    double last = 0.0;
    for (int k = 1; k <= 40; ++k) {
        const double target = 1.0 - std::abs(std::fmod(k * probe_period, 2.0) - 1.0);
        const double speed = (k - 1) / 8 % 2 == 0 ? 1.0 : -1.0;
        const double position = target + (k % 3 - 1) / 64.0;
        const double force = 64.0 * (position - target) + 0.5 * ((position - last) / probe_period - speed);
        const Rendered rendered = probe.step(position);
        expect_plain(rendered, force, target);
        EXPECT_FALSE(rendered.extrapolated);
        last = position;
        expect_refusal(probe, target);
    }
    probe.reset(0.5);
    (void)probe.step(0.5);
    EXPECT_EQ(probe.step(0.5).environment_position, 0.75) << "upwards after each reset";
}

TEST(Probe, MovesAtItsSpeedAndUpwardsAfterEachReset) {
    ProbeSettings fast = settings;
    fast.speed = 2.0;
    Probe probe{fast, probe_period};
    for (int run = 0; run < 2; ++run) {
        probe.reset(0.5);
        expect_plain(probe.step(0.75), 0.5 * (2.0 - 2.0), 0.75);
        expect_plain(probe.step(1.0), 0.5 * (2.0 - 2.0), 1.0);
        expect_plain(probe.step(0.875), 64.0 * 0.125 + 0.5 * (-1.0 + 2.0), 0.75);
        expect_plain(probe.step(0.5), 0.5 * (-3.0 + 2.0), 0.5);
    }
}

TEST(Probe, MovesIntoItsRange) {
    for (const double start : {-2.0, 3.0}) {
        Probe probe{settings, probe_period};
        probe.reset(start);
        const double way = start < 0.0 ? 0.125 : -0.125;
        for (int k = 1; k < 8; ++k) {
            EXPECT_EQ(probe.step(start + k * way).environment_position, start + k * way);
        }
    }
}

// The object holds the handle at 0. At the third tick the spring's force of 24 is beyond the limit 16.
TEST(Probe, ReversesBeyondItsForceLimit) {
    ProbeSettings wide = settings;
    wide.lower = -8.0;
    wide.upper = 8.0;
    Probe probe{wide, probe_period};
    probe.reset(0.0);
    expect_plain(probe.step(0.0), -8.0 - 0.5, 0.125);
    expect_plain(probe.step(0.0), -16.0, 0.25);
    expect_plain(probe.step(0.0), -16.0, 0.25);
    expect_plain(probe.step(0.0), -8.0 + 0.5, 0.125);
    expect_plain(probe.step(0.0), 0.5, 0.0);
    expect_plain(probe.step(0.0), 8.0 + 0.5, -0.125);
    expect_plain(probe.step(0.0), 16.0, -0.25);
    expect_plain(probe.step(0.0), 16.0, -0.25);
    expect_plain(probe.step(0.0), 8.0 - 0.5, -0.125);
}

TEST(Probe, RefusalNamesTheFieldItsValueAndTheRule) {
    const auto refusal = [](const ProbeSettings& given) {
        return test::refusal([&] { const Probe probe{given, probe_period}; });
    };
    EXPECT_EQ(refusal(settings), "");
    EXPECT_EQ(refusal({.lower = infinity}), "probe: lower is inf, must be a finite number");
    EXPECT_EQ(refusal({.upper = nan}), "probe: upper is nan, must be a finite number");
    EXPECT_EQ(refusal({.speed = 0.0}), "probe: speed is 0, must be > 0");
    EXPECT_EQ(refusal({.stiffness = 0.0}), "probe: stiffness is 0, must be > 0");
    EXPECT_EQ(refusal({.damping = -1.0}), "probe: damping is -1, must be >= 0");
    EXPECT_EQ(refusal({.damping = 0.0}), "");
    EXPECT_EQ(refusal({.force_limit = 0.0}), "probe: force_limit is 0, must be > 0");
    EXPECT_EQ(refusal({.lower = 0.25, .upper = 0.25}), "probe: upper is 0.25, must be above lower");
    EXPECT_EQ(refusal({.lower = 0.25, .upper = std::nextafter(0.25, 1.0)}), "");
}

// Three ticks without force, then two with force; three pushes of full size, three of half size.
TEST(Pulses, FollowTheirSchedule) {
    Pulses pulses{{.force = 0.5, .smaller = 0.25, .push_s = 0.25, .rest_s = 0.375, .farthest = 2.0},
                  probe_period};
    pulses.reset(10.0);
    for (const int start : {0, 37}) {
        for (int k = 0; k < 100; ++k) {
            if (start > 0 && k == 0) {
                pulses.reset(10.0);  // from the middle of a sequence
            }
            const int push = k / 5;
            const double size = push % 6 < 3 ? 0.5 : 0.125;
            const double force = k % 5 < 3 ? 0.0 : push % 2 == 0 ? size : -size;
            const double away = k % 4 == 0 ? 2.0 : k % 4 == 1 ? -2.0 : k % 4 == 2 ? 1.875 : -1.875;
            const Rendered rendered = pulses.step(10.0 + away);
            expect_plain(rendered, std::abs(away) < 2.0 ? force : 0.0, 10.0 + away);
            EXPECT_FALSE(rendered.extrapolated);
            expect_refusal(pulses, 10.0);
        }
    }
}

TEST(Pulses, RefuseAForceThatIsNotPositiveAndFinite) {
    for (const double bad : {0.0, -0.5, nan, infinity}) {
        EXPECT_THROW((Pulses{{.force = bad}, probe_period}), std::invalid_argument) << bad;
    }
    try {
        const Pulses pulses{{.force = -0.5}, probe_period};
        FAIL();
    } catch (const std::invalid_argument& error) {
        EXPECT_STREQ(error.what(), "push is -0.500000, must be > 0");
    }
}

TEST(FreeMotion, AndWatchingRenderZeroForceAtThePosition) {
    FreeMotion free;
    free.reset(1.0);
    expect_plain(free.step(0.25), 0.0, 0.25);
    EXPECT_FALSE(free.step(0.25).extrapolated);
    expect_refusal(free, nan);
    Domain domain;
    domain.lower = {-1.0};
    domain.upper = {0.5};
    Watching watching{domain};
    watching.reset(0.0);
    for (const double x : {-1.0, 0.0, 0.5}) {
        expect_plain(watching.step(x), 0.0, x);
        EXPECT_FALSE(watching.step(x).extrapolated) << x;
    }
    for (const double x : {std::nextafter(-1.0, -2.0), std::nextafter(0.5, 1.0)}) {
        expect_plain(watching.step(x), 0.0, x);
        EXPECT_TRUE(watching.step(x).extrapolated) << x;
    }
    expect_refusal(watching, nan);
    domain.period = 1.5;
    Watching wheel{domain};
    EXPECT_FALSE(wheel.step(-7.0).extrapolated);
    EXPECT_FALSE(wheel.step(7.0).extrapolated);
}

}  // namespace
}  // namespace palpate
