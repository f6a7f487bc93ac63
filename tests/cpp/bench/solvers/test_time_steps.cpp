// SPDX-License-Identifier: Apache-2.0
// Tests the order of accuracy and the special cases of the time integration methods that the benchmarks compare.
#include "solvers/time_steps.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "palpate/rendering/implicit.hpp"
#include "palpate/rendering/massless.hpp"
#include "rendering/time_step_checks.hpp"
#include "support.hpp"

namespace palpate::bench {
namespace {

using test::coupling;
using test::Hardening;
using test::inertia;
using test::order;

TEST(TimeSteps, SubsteppedIsOfFirstOrder) {
    EXPECT_NEAR(order([](double T) { return Substepped{Hardening{}, inertia, coupling, T, 4}; }), 1.0, 0.1);
}

TEST(TimeSteps, LinearlyImplicitIsOfFirstOrder) {
    EXPECT_NEAR(order([](double T) { return Implicit{Hardening{}, inertia, coupling, T, OneNewtonStep{}}; }),
                1.0, 0.1);
}

TEST(TimeSteps, TrapezoidalIsOfSecondOrder) {
    EXPECT_NEAR(order([](double T) { return Trapezoidal{Hardening{}, inertia, coupling, T}; }), 2.0, 0.1);
}

TEST(TimeSteps, OneNewtonStepIsExactForALine) {
    const test::Spring spring{50.0};
    Implicit exact{spring, inertia, coupling, 1e-3};
    Implicit linear{spring, inertia, coupling, 1e-3, OneNewtonStep{}};
    for (int k = 0; k < 500; ++k) {
        const double x = 0.1 * std::sin(0.03 * k);
        const Rendered rendered = linear.step(x);
        EXPECT_NEAR(rendered.force, exact.step(x).force, 1e-9);
        EXPECT_EQ(rendered.evaluations, 1);
    }
    Massless massless{spring, coupling, 1e-3, OneNewtonStep{}};
    Massless massless_exact{spring, coupling, 1e-3};
    for (int k = 0; k < 500; ++k) {
        const double x = 0.1 * std::sin(0.03 * k);
        EXPECT_NEAR(massless.step(x).force, massless_exact.step(x).force, 1e-9);
    }
}

TEST(TimeSteps, SubstepsInterpolateTheDeviceMotion) {
    Substepped together{Hardening{}, inertia, coupling, 1e-3, 4};
    Explicit apart{Hardening{}, inertia, coupling, 0.25e-3};
    for (int k = 1; k <= 500; ++k) {
        const double from = 0.001 * (k - 1);
        Rendered expected;
        for (int j = 1; j <= 4; ++j) {
            expected = apart.step(from + 0.00025 * j);
        }
        const Rendered rendered = together.step(0.001 * k);
        ASSERT_NEAR(rendered.force, expected.force, 1e-9) << k;
        ASSERT_EQ(rendered.evaluations, 4);
    }
}

TEST(TimeSteps, ReachTheSameForceBehindTheCoupling) {
    test::expect_the_force_of_the_coupling_at_rest(
        Implicit{Hardening{}, inertia, coupling, 1e-3, OneNewtonStep{}});
    test::expect_the_force_of_the_coupling_at_rest(Trapezoidal{Hardening{}, inertia, coupling, 1e-3});
    test::expect_the_force_of_the_coupling_at_rest(Substepped{Hardening{}, inertia, coupling, 1e-3, 4});
}

TEST(TimeSteps, NanGivesZeroForceAndTheNextStepContinues) {
    test::expect_nan_is_refused(Implicit{Hardening{}, inertia, coupling, 1e-3, OneNewtonStep{}});
    test::expect_nan_is_refused(Trapezoidal{Hardening{}, inertia, coupling, 1e-3});
    test::expect_nan_is_refused(Substepped{Hardening{}, inertia, coupling, 1e-3, 4});
}

}  // namespace
}  // namespace palpate::bench
