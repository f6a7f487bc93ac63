// SPDX-License-Identifier: Apache-2.0
#include "palpate/stability/tangent_inequalities.hpp"

#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "../support.hpp"
#include "palpate/stability/certificate.hpp"

namespace palpate {
namespace {

/// Returns a controller of 20 kHz without own delay, and a host of 1 kHz.
DeviceProfile motor(double delay_s = 0.0) {
    DeviceProfile device;
    device.viscous_damping = 5e-3;
    device.coulomb_friction = 0.01;
    device.encoder_step = 1e-4;
    device.delay_s = delay_s;
    device.held_line = HeldLine{.period_s = 5e-5, .delay_s = 0.0, .encoder_step = 1e-4};
    return device;
}

Scheme tangent(const HeldSlope& line) {
    Scheme scheme;
    scheme.structure = StructureKind::Tangent;
    scheme.line = line;
    return scheme;
}

const Inequality& line_of(const Certificate& certificate, const std::string& id) {
    for (const Inequality& line : certificate.inequalities) {
        if (line.id == id) {
            return line;
        }
    }
    throw std::invalid_argument("no line " + id + ": " + certificate.reason);
}

double damping_of(const ForceBounds& bounds, const HeldSlope& line, const DeviceProfile& device) {
    return line_of(certify(bounds, tangent(line), device), "damping-line").right;
}

TEST(RaisedNeed, HasTheKnownValues) {
    EXPECT_NEAR(raised_need(0.0, 0.0, 0.0), 1.0 / 6.0, 1e-5);
    EXPECT_NEAR(raised_need(0.0, 0.0, 0.5), 0.0, 1e-5);
    EXPECT_NEAR(raised_need(1.0, 1.0, 0.5), 5.0 / 12.0, 2e-4);
    EXPECT_NEAR(raised_need(2.0, 4.0, 0.0), 3.0 + 1.0 / 6.0, 1e-3) << "a line without lift: Taylor's bound";
    EXPECT_NEAR(raised_need(1.0, 1.0, 0.0), 7.0 / 6.0, 1e-3);
}

TEST(RaisedNeed, IsABoundOfTheEnergyOfEveryPairOfMotions) {
    test::Random random{1};
    for (int k = 0; k < test::cases(30); ++k) {
        const double t = test::uniform(random, 0.1, 3.0);
        const double lift = test::uniform(random, 0.0, 1.0);
        const double gamma = test::uniform(random, 0.01, 3.0);
        const detail::RaisedEnergy energy{lift};
        const double a = energy.most(t, gamma, 1e-6);
        double largest = 0.0;
        for (int j = 0; j < 4000; ++j) {
            const double U = test::uniform(random, -t, t);
            const double u = test::uniform(random, 0.0, 1.0);
            double sum = 0.0;  // the integral of E, by the midpoint rule
            constexpr int parts = 50;
            for (int i = 0; i < parts; ++i) {
                const double y = U + u * (i + 0.5) / parts;
                sum += u / parts * (y > 0.0 ? std::max(0.0, y * y / 2.0 - lift * y) : y * y / 2.0 - lift * y);
            }
            largest = std::max(largest, (sum - gamma * U * U) / (u * u));
        }
        EXPECT_GE(a, largest - 2e-3 * (1.0 + largest));
        EXPECT_LE(a, largest + 0.05 * (1.0 + std::abs(largest))) << "t " << t << ", gamma " << gamma;
    }
}

TEST(LineNeed, WithoutDelayIsThatOfTheControllerOnly) {
    const ForceBounds wall = wall_bounds(20.0, 0.01);
    const DeviceProfile device = motor();
    EXPECT_NEAR(damping_of(wall, {SlopeRule::Steepest, 20.0, 0.0, 3e-3}, device), 0.5 * 5e-5 * 20.0, 1e-12);
    // A line that is too flat by 5 needs half of it against the period of the host
    EXPECT_NEAR(damping_of(wall, {SlopeRule::Steepest, 15.0, 0.0, 3e-3}, device),
                0.5 * 5e-5 * 15.0 + 0.5 * 1e-3 * 5.0, 1e-12);
}

TEST(LineNeed, WithoutLiftOrLargestMotionIsThatOfHold) {
    // R(Lambda) of M and M + s is the need of hold if n (M + s) <= (n + 1) M
    const DeviceProfile late = motor(1e-3);
    ForceBounds bounds = wall_bounds(20.0, 0.01);
    bounds.slope.lower = -15.0;
    const double inner = 0.5 * 5e-5 * 20.0;
    EXPECT_NEAR(damping_of(bounds, {SlopeRule::Raised, 0.0, 0.0, std::nullopt}, late), inner + 1.5e-3 * 20.0,
                1e-6);
}

TEST(LineNeed, OfAConstantLineIsThatOfTheRest) {
    const DeviceProfile late = motor(1e-3);
    const ForceBounds wall = wall_bounds(20.0, 0.01);
    // 1/2 sqrt(n^2 - 1/4) M for n = 1, at kappa = M (1/2 + 1/4 / sqrt(3/4))
    const double slope = 20.0 * (0.5 + 0.25 / std::sqrt(0.75));
    EXPECT_NEAR(damping_of(wall, {SlopeRule::Constant, slope, 0.0, std::nullopt}, late),
                0.5 * 5e-5 * slope + 1e-3 * 0.5 * std::sqrt(0.75) * 20.0, 2e-5);
    EXPECT_NEAR(detail::best_constant(wall, late).slope, slope, 0.05 * slope);
}

TEST(LineNeed, OfARaisedLineGrowsWithTheLargestMotion) {
    const DeviceProfile late = motor(1e-3);
    const ForceBounds wall = wall_bounds(20.0, 0.01);  // C = 500
    const auto need = [&](double motion) {
        return damping_of(wall, {SlopeRule::Raised, 0.0, 0.5 * 500.0 * motion, motion}, late) -
               0.5 * 5e-5 * (20.0 + 0.5 * 500.0 * motion);
    };
    // The encoder step adds C Delta / 2 as slope: (1/2 + 1) 0.025
    EXPECT_NEAR(need(3e-3), 1e-3 * (500.0 * 3e-3 * 5.0 / 12.0 + 1.5 * 0.025), 3e-7);
    EXPECT_NEAR(need(6e-3) - need(3e-3), 1e-3 * 500.0 * 3e-3 * 5.0 / 12.0, 3e-7);
}

TEST(LineNeed, IncludesTheStepsOfTheCommand) {
    const ForceBounds wall = wall_bounds(20.0, 0.01);
    DeviceProfile device = motor(1e-3);
    const HeldSlope line{SlopeRule::Constant, 15.0, 0.0, std::nullopt};
    const Certificate exact = certify(wall, tangent(line), device);
    device.held_line->stiffness_step = 0.12;
    device.held_line->encoder_step = 3e-4;
    const Certificate stepped = certify(wall, tangent(line), device);
    EXPECT_NEAR(line_of(stepped, "damping-line").right - line_of(exact, "damping-line").right,
                1e-3 * 1.5 * 0.06 + 0.5 * 5e-5 * 0.06, 1e-9);
    EXPECT_NEAR(line_of(stepped, "friction-line").right - line_of(exact, "friction-line").right,
                0.5 * 1e-4 * 0.06 + 0.5 * (3e-4 * 15.06 - 1e-4 * 15.0), 1e-9);
}

std::string reason_of(const ForceBounds& bounds, const HeldSlope& line, const DeviceProfile& device) {
    return certify(bounds, tangent(line), device).reason;
}

TEST(TangentCertificate, RefusesWhatNoProofCovers) {
    const HeldSlope steepest{SlopeRule::Steepest, 20.0, 0.0, 3e-3};
    const ForceBounds wall = wall_bounds(20.0, 0.01);
    EXPECT_NE(reason_of(wall, steepest, motor(1e-3)).find("proved only for t_d = 0"), std::string::npos)
        << "the line of the rule steepest gives energy with a delay";
    DeviceProfile device = motor();
    device.held_line->limits_force = false;
    EXPECT_NE(reason_of(wall, steepest, device).find("let the controller limit"), std::string::npos);
    device.held_line.reset();
    EXPECT_NE(reason_of(wall, steepest, device).find("held_line"), std::string::npos);
    ForceBounds loss = wall;
    loss.hysteresis = true;
    loss.hysteresis_per_play = 2.0;
    EXPECT_NE(reason_of(loss, {SlopeRule::Constant, 15.0, 0.0, std::nullopt}, motor(1e-3)).find("h / r"),
              std::string::npos);
    EXPECT_NE(reason_of(wall, steepest, motor()).find("every inequality is proved"), std::string::npos);
}

TEST(TangentCertificate, OfAControllerThatTakesSpringsHasAConstantSlopeAndPaysForTheStepOfTheCenter) {
    const ForceBounds wall = wall_bounds(20.0, 0.01);
    DeviceProfile device = motor(1e-3);
    device.viscous_damping = 0.02;
    device.coulomb_friction = 0.02;
    device.held_line->position_step = 4e-4;
    const HeldSlope constant{SlopeRule::Constant, 15.0, 0.0, std::nullopt};
    const double lines = line_of(certify(wall, tangent(constant), device), "friction-line").right;
    device.held_line->largest_center = 1.5;
    EXPECT_NEAR(line_of(certify(wall, tangent(constant), device), "friction-line").right - lines,
                0.5 * 4e-4 * 15.0, 1e-12);
    EXPECT_TRUE(certify(wall, tangent(constant), device).certified());
    for (const SlopeRule rule : {SlopeRule::Raised, SlopeRule::Steepest}) {
        EXPECT_NE(reason_of(wall, {rule, 20.0, 0.0, 3e-3}, device).find("use the rule constant"),
                  std::string::npos);
    }
    EXPECT_EQ(line_for(wall, device, 3e-3).rule, SlopeRule::Constant);
    device.delay_s = 0.0;
    EXPECT_EQ(line_for(wall, device, 3e-3).rule, SlopeRule::Constant);
}

TEST(TangentCertificate, RefusesAControllerWithTooSmallNumbers) {
    const ForceBounds wall = wall_bounds(20.0, 0.01);
    const HeldSlope line{SlopeRule::Steepest, 20.0, 0.0, 3e-3};
    DeviceProfile device = motor();
    EXPECT_TRUE(certify(wall, tangent(line), device).certified());
    device.held_line->largest_stiffness = 19.0;
    EXPECT_FALSE(certify(wall, tangent(line), device).certified());
    EXPECT_LE(line_for(wall, device, 3e-3).slope, 19.0) << "the plan chooses a flatter line";
    device = motor();
    device.held_line->watchdog_s = 1e-3;
    EXPECT_FALSE(certify(wall, tangent(line), device).certified()) << "ends before the next command";
    device.held_line->watchdog_s = 2e-3;
    EXPECT_TRUE(certify(wall, tangent(line), device).certified());
    EXPECT_LT(certify(wall, tangent(line), device).longest_period_s, 2e-3);
    device = motor();
    device.encoder_step = 1e-3;
    EXPECT_FALSE(certify(wall, tangent(line), device).certified()) << "w must be 8 encoder steps";
}

TEST(TangentCertificate, OfAModelIncludesItsCurvature) {
    test::Random random{7};
    for (int k = 0; k < 20; ++k) {
        const ForceModel model{test::random_network(random, 5), test::unit_domain()};
        const BendBounds bend = bend_bounds(model).value();
        const NetworkCurve& curve = model.network()->curve();
        double largest = 0.0;
        for (int j = 0; j <= 2000; ++j) {
            largest = std::max(largest, std::abs(derivatives(curve.parameters(), j / 2000.0)[2]));
        }
        EXPECT_GE(bend.curvature, largest);
        EXPECT_LE(bend.curvature, 1.02 * largest + 1e-3 * derivative_bounds(curve.parameters(), 0.0, 1.0)[2]);
        for (int j = 0; j < 200; ++j) {
            const double x = test::uniform(random, -0.5, 1.5);
            const double y = test::uniform(random, -0.5, 1.5);
            EXPECT_LE(std::abs(curve.at(x).slope - curve.at(y).slope),
                      bend.curvature * std::abs(x - y) + bend.jump + 1e-9);
        }
    }
}

/// The moteus r4 of the example profiles.
DeviceProfile moteus() {
    DeviceProfile device;
    device.jitter_s = 2e-4;
    device.viscous_damping = 2e-3;
    device.coulomb_friction = 0.01;
    device.encoder_step = 3.83495196971410303e-4;
    device.delay_s = 1.16e-3;
    device.force_limit = 1.5;
    device.held_line =
        HeldLine{.period_s = 1.0 / 30e3, .delay_s = 1.0 / 30e3 + 1.6e-4, .encoder_step = device.encoder_step};
    return device;
}

TEST(StiffestLineWall, IsSeveralTimesThatOfHold) {
    const double hold = 2e-3 / (1.2e-3 * device_need(moteus(), {1.0, 0.0}));
    EXPECT_NEAR(hold, 0.99, 0.01);
    EXPECT_GE(stiffest_line_wall(moteus(), 0.01, std::nullopt), 2.0 * hold);
    if (test::cases(1) > 1) {
        EXPECT_GE(stiffest_line_wall(moteus(), 0.01, 3e-3), 3.0 * hold);
        EXPECT_GE(stiffest_line_wall(moteus(), 0.05, 3e-3), 6.0 * hold);
    }
}

TEST(FastMotionEnergy, IsThatOfTheLargestForceUntilZeroForceActs) {
    DeviceProfile device = moteus();
    device.force_limit = 0.3;
    EXPECT_NEAR(fast_motion_energy(device), 2.36e-3 * 0.29 * 0.29 / 8e-3, 1e-9);
}

}  // namespace
}  // namespace palpate
