// SPDX-License-Identifier: Apache-2.0
// The structures' time steps: what order each has, and what each keeps.
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/rendering/energy_consistent.hpp"
#include "palpate/rendering/explicit.hpp"
#include "palpate/rendering/implicit.hpp"
#include "palpate/rendering/massless.hpp"
#include "palpate/rendering/substepped.hpp"
#include "palpate/rendering/trapezoidal.hpp"
#include "palpate/solver/one_newton_step.hpp"
#include "support.hpp"

namespace palpate {
namespace {

/// A hardening spring with its energy: smooth, so that orders can be seen.
struct Hardening {
    using State = Stateless;

    [[nodiscard]] EnvironmentSample at(double x, const State& /*stateless*/) const noexcept {
        return {20.0 * x + 300.0 * x * x * x, 20.0 + 900.0 * x * x, 10.0 * x * x + 75.0 * x * x * x * x,
                false};
    }
    void advance(double /*x*/, State& /*stateless*/) const noexcept {}
    [[nodiscard]] State start(double /*x*/) const noexcept { return {}; }
};

constexpr VirtualCoupling coupling{100.0, 0.02};
constexpr Inertia inertia{0.05, 0.3};

/// Position after `duration` from rest at 0.3 under a constant force.
template <class S>
double driven(S structure, double duration, double period) {
    structure.reset(0.3);
    Rendered rendered;
    for (int k = 0; k < std::lround(duration / period); ++k) {
        rendered = structure.drive(2.0);
        EXPECT_EQ(rendered.status, Status::Ok);
    }
    return rendered.environment_position;
}

/// The error at T over the error at T/2, against the same scheme's limit: 2 to the power of the order. The
/// truth is the fourth-order Runge-Kutta solution.
template <class Make>
double order(Make make) {
    constexpr double duration = 0.256;
    double y = 0.3;
    double v = 0.0;
    const Hardening object;
    const auto acceleration = [&](double at, double speed) {
        return (2.0 - object.at(at, {}).force - inertia.damping * speed) / inertia.mass;
    };
    constexpr int steps = 25'600;
    constexpr double h = duration / steps;
    for (int k = 0; k < steps; ++k) {
        const double a1 = acceleration(y, v);
        const double a2 = acceleration(y + 0.5 * h * v, v + 0.5 * h * a1);
        const double a3 = acceleration(y + 0.5 * h * (v + 0.5 * h * a1), v + 0.5 * h * a2);
        const double a4 = acceleration(y + h * (v + 0.5 * h * a2), v + h * a3);
        y += h * v + h * h / 6.0 * (a1 + a2 + a3);
        v += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
    }
    const double coarse = std::abs(driven(make(5e-4), duration, 5e-4) - y);
    const double fine = std::abs(driven(make(2.5e-4), duration, 2.5e-4) - y);
    EXPECT_GT(fine, 1e-9);
    return std::log2(coarse / fine);
}

TEST(Steppers, ExplicitIsOfFirstOrder) {
    EXPECT_NEAR(order([](double T) { return Explicit{Hardening{}, inertia, coupling, T}; }), 1.0, 0.1);
}

TEST(Steppers, SubsteppedIsOfFirstOrder) {
    EXPECT_NEAR(order([](double T) { return Substepped{Hardening{}, inertia, coupling, T, 4}; }), 1.0, 0.1);
}

TEST(Steppers, ImplicitIsOfFirstOrder) {
    EXPECT_NEAR(order([](double T) { return Implicit{Hardening{}, inertia, coupling, T}; }), 1.0, 0.1);
}

TEST(Steppers, LinearlyImplicitIsOfFirstOrder) {
    EXPECT_NEAR(order([](double T) { return Implicit{Hardening{}, inertia, coupling, T, OneNewtonStep{}}; }),
                1.0, 0.1);
}

TEST(Steppers, TrapezoidalIsOfSecondOrder) {
    EXPECT_NEAR(order([](double T) { return Trapezoidal{Hardening{}, inertia, coupling, T}; }), 2.0, 0.1);
}

TEST(Steppers, EnergyConsistentIsOfSecondOrderAndOfFirstWithItsSwitch) {
    EXPECT_NEAR(
        order([](double T) { return EnergyConsistent{Hardening{}, inertia, coupling, T, 1e-4, false}; }), 2.0,
        0.1);
    EXPECT_NEAR(order([](double T) { return EnergyConsistent{Hardening{}, inertia, coupling, T}; }), 1.0,
                0.15);
}

TEST(Steppers, OneNewtonStepIsExactForALine) {
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

TEST(Steppers, SubstepsSeeTheDeviceMoveEvenly) {
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

// spec section 5: "undamped amplitude constant"
TEST(Steppers, EnergyConsistentKeepsTheEnergyOfAnUndampedObject) {
    const Hardening object;
    EnergyConsistent structure{object, {0.001, 0.0}, coupling, 1e-3, 1e-4, false};
    structure.reset(0.3);
    const double start = object.at(0.3, {}).energy;
    for (int k = 0; k < 20'000; ++k) {
        const Rendered rendered = structure.drive(0.0);
        ASSERT_EQ(rendered.status, Status::Ok);
        const double energy = object.at(rendered.environment_position, {}).energy +
                              0.5 * 0.001 * structure.velocity() * structure.velocity();
        ASSERT_NEAR(energy, start, 1e-8 * start) << k;
    }
}

TEST(Steppers, TheSwitchNeverGivesEnergy) {
    const Hardening object;
    EnergyConsistent structure{object, {0.001, 0.0}, coupling, 1e-3};
    structure.reset(0.3);
    double before = object.at(0.3, {}).energy;
    for (int k = 0; k < 2000; ++k) {
        const Rendered rendered = structure.drive(0.0);
        const double energy = object.at(rendered.environment_position, {}).energy +
                              0.5 * 0.001 * structure.velocity() * structure.velocity();
        ASSERT_LE(energy, before + 1e-9) << k;
        before = energy;
    }
    EXPECT_LT(before, 0.5 * object.at(0.3, {}).energy);
}

TEST(Steppers, SettleOnTheSameForceBehindTheCoupling) {
    // At rest the coupling and the object carry the same force: 100 (0.2 - y) = 20 y + 300 y^3.
    const Hardening object;
    const auto settled = [](auto structure) {
        structure.reset(0.0);
        Rendered rendered;
        for (int k = 0; k < 20'000; ++k) {
            rendered = structure.step(0.2 * std::min(1.0, k / 1000.0));
        }
        EXPECT_EQ(rendered.status, Status::Ok);
        return rendered;
    };
    for (const Rendered& rendered : {settled(Implicit{object, inertia, coupling, 1e-3}),
                                     settled(Implicit{object, inertia, coupling, 1e-3, OneNewtonStep{}}),
                                     settled(Trapezoidal{object, inertia, coupling, 1e-3}),
                                     settled(EnergyConsistent{object, inertia, coupling, 1e-3}),
                                     settled(EnergyConsistent{object, inertia, coupling, 1e-3, 1e-4, false}),
                                     settled(Substepped{object, inertia, coupling, 1e-3, 4}),
                                     settled(Explicit{object, inertia, coupling, 1e-3})}) {
        EXPECT_NEAR(rendered.force, object.at(rendered.environment_position, {}).force, 1e-6);
        EXPECT_NEAR(rendered.force, 100.0 * (0.2 - rendered.environment_position), 1e-6);
    }
}

TEST(Steppers, RefuseWhatIsNotANumberAndGoOn) {
    const auto refuses = [](auto structure) {
        structure.reset(0.1);
        const double expected = structure.step(0.1).force;
        structure.reset(0.1);
        EXPECT_EQ(structure.step(std::nan("")).status, Status::NonFinite);
        EXPECT_EQ(structure.step(std::nan("")).force, 0.0);
        EXPECT_EQ(structure.step(0.1).force, expected);
    };
    refuses(Implicit{Hardening{}, inertia, coupling, 1e-3, OneNewtonStep{}});
    refuses(Trapezoidal{Hardening{}, inertia, coupling, 1e-3});
    refuses(EnergyConsistent{Hardening{}, inertia, coupling, 1e-3});
    refuses(Substepped{Hardening{}, inertia, coupling, 1e-3, 4});
}

}  // namespace
}  // namespace palpate
