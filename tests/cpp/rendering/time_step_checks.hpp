// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "palpate/dynamics/coupling.hpp"
#include "palpate/model/environment.hpp"
#include "palpate/rendering/structure.hpp"

// Checks that every time integration method of a mass behind a coupling must pass.
namespace palpate::test {

/// Spring whose stiffness increases with its displacement, with its stored energy. The force is smooth, so the order
/// of a time integration method can be measured.
struct Hardening {
    using State = Stateless;

    [[nodiscard]] EnvironmentSample at(double x, const State& /*stateless*/) const noexcept {
        return {20.0 * x + 300.0 * x * x * x, 20.0 + 900.0 * x * x, 10.0 * x * x + 75.0 * x * x * x * x,
                false};
    }
    void advance(double /*x*/, State& /*stateless*/) const noexcept {}
    [[nodiscard]] State start(double /*x*/) const noexcept { return {}; }
};

inline constexpr VirtualCoupling coupling{100.0, 0.02};
inline constexpr Inertia inertia{0.05, 0.3};

/// Returns the position of the mass after `duration`, starting at rest at 0.3, under a constant force.
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

/// Returns the order of a time integration method from its errors at periods T and T/2. The reference is the
/// fourth-order Runge-Kutta solution.
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

/// Holds the handle at position 0.2 and waits until the virtual object rests at the position y at which coupling force
/// and object force are equal: 100 (0.2 - y) = 20 y + 300 y^3.
template <class S>
void expect_the_force_of_the_coupling_at_rest(S structure) {
    structure.reset(0.0);
    Rendered rendered;
    for (int k = 0; k < 20'000; ++k) {
        rendered = structure.step(0.2 * std::min(1.0, k / 1000.0));
    }
    EXPECT_EQ(rendered.status, Status::Ok);
    EXPECT_NEAR(rendered.force, Hardening{}.at(rendered.environment_position, {}).force, 1e-6);
    EXPECT_NEAR(rendered.force, 100.0 * (0.2 - rendered.environment_position), 1e-6);
}

template <class S>
void expect_nan_is_refused(S structure) {
    structure.reset(0.1);
    const double expected = structure.step(0.1).force;
    structure.reset(0.1);
    EXPECT_EQ(structure.step(std::nan("")).status, Status::NonFinite);
    EXPECT_EQ(structure.step(std::nan("")).force, 0.0);
    EXPECT_EQ(structure.step(0.1).force, expected);
}

}  // namespace palpate::test
