// SPDX-License-Identifier: Apache-2.0
#include "palpate/rendering/tangent.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <gtest/gtest.h>

#include "../support.hpp"
#include "palpate/rendering/make_structure.hpp"

namespace palpate {
namespace {

constexpr double no_limit = 1e9;

Scheme tangent(const HeldSlope& line) {
    Scheme scheme;
    scheme.structure = StructureKind::Tangent;
    scheme.line = line;
    return scheme;
}

AnyStructure structure_of(const ForceModel& model, const HeldSlope& line, double force_limit = no_limit) {
    return make_structure(model, tangent(line), 1e-3, force_limit);
}

ForceModel wavy(test::Random& random) {
    return {test::random_network(random, 4), test::unit_domain()};
}

TEST(Tangent, HasTheForceOfTheModelAtTheMeasuredPosition) {
    test::Random random{1};
    const ForceModel model = wavy(random);
    AnyStructure structure = structure_of(model, {SlopeRule::Raised, 0.0, 0.5, std::nullopt});
    for (const double x : {-0.3, 0.0, 0.2, 0.71, 1.4}) {
        const Rendered rendered = structure.step(x);
        const Curve exact = model.network()->curve().at(x);
        EXPECT_NEAR(rendered.force, exact.value, 1e-9);
        EXPECT_EQ(rendered.environment_position, x);
        EXPECT_NEAR(rendered.stiffness, std::max(0.0, exact.slope) + 0.5, 1e-6);
    }
}

TEST(Tangent, HasAConstantSlopeByTheRuleConstant) {
    test::Random random{2};
    AnyStructure structure = structure_of(wavy(random), {SlopeRule::Constant, 3.0, 0.0, std::nullopt});
    EXPECT_EQ(structure.step(0.1).stiffness, 3.0);
    EXPECT_EQ(structure.step(0.9).stiffness, 3.0);
}

/// Returns 2 [V(x + d) - V(x) - f(x) d] / d^2, the slope of the line that stores the energy of the force.
double storing_slope(const NetworkCurve& curve, double x, double d) {
    const Curve here = curve.at(x);
    return 2.0 * (curve.at(x + d).integral - here.integral - here.value * d) / (d * d);
}

TEST(Tangent, SteepestLineStoresTheEnergyOfTheForceInEveryMotion) {
    test::Random random{3};
    for (int k = 0; k < test::cases(40); ++k) {
        const ForceModel model = wavy(random);
        const NetworkCurve& curve = model.network()->curve();
        const double motion = std::exp(test::uniform(random, -4.0, -1.0));
        AnyStructure structure = structure_of(model, {SlopeRule::Steepest, 1e9, 0.0, motion});
        const double steepest = curve.slopes_everywhere().upper;
        for (int j = 0; j < 200; ++j) {
            const double x = test::uniform(random, -0.3, 1.3);
            // The reading is wrong by up to half of an encoder step of w / 8
            const double read = x + test::uniform(random, -1.0, 1.0) * motion / cells_in_motion;
            // In a short motion the rounding of the energy is too large compared with d^2
            const double d = (random() % 2 == 0 ? 1.0 : -1.0) * test::uniform(random, 0.02, 1.0) * motion;
            const double slope = structure.step(read).stiffness;
            EXPECT_GE(slope, storing_slope(curve, x, d) - 1e-7 * std::abs(steepest))
                << "at " << x << " by " << d;
        }
    }
}

TEST(Tangent, SteepestLineIsAsSteepAsTheForceWhereItIsStraight) {
    NetworkParameters line;
    line.linear = {4.0};
    line.bias = 0.5;
    const ForceModel spring{line, test::unit_domain()};
    AnyStructure structure = structure_of(spring, {SlopeRule::Steepest, 1e9, 0.0, 0.1});
    EXPECT_NEAR(structure.step(0.5).stiffness, 4.0, 1e-9);
    EXPECT_EQ(structure_of(spring, {SlopeRule::Steepest, 1.5, 0.0, 0.1}).step(0.5).stiffness, 1.5);
    line.linear = {-4.0};
    const ForceModel falling{line, test::unit_domain()};
    EXPECT_EQ(structure_of(falling, {SlopeRule::Steepest, 1e9, 0.0, 0.01}).step(0.5).stiffness, 0.0)
        << "a falling force needs no slope";
}

TEST(Tangent, SteepestLineRepeatsWithAPeriodicForce) {
    NetworkParameters wheel;
    wheel.alpha = {12.0};
    wheel.beta = {0.4};
    wheel.weight = {0.3};
    wheel.linear = {0.0};
    const ForceModel model{wheel, {{0.0}, {1.0}, Continuation::Linear, Continuation::Linear, 1.0}};
    AnyStructure structure = structure_of(model, {SlopeRule::Steepest, 1e9, 0.0, 0.05});
    for (const double x : {0.01, 0.37, 0.62, 0.999}) {
        const double slope = structure.step(x).stiffness;
        EXPECT_EQ(structure.step(x + 3.0).stiffness, slope) << x;
        EXPECT_EQ(structure.step(x - 2.0).stiffness, slope) << x;
        for (double d = -0.05; d < 0.05; d += 0.0101) {
            EXPECT_GE(slope, storing_slope(model.network()->curve(), x, d) - 1e-9);
        }
    }
}

TEST(Tangent, SteepestLineOfAHysteresisHasTheSlopeOfTheStickingBranch) {
    NetworkParameters force;
    force.linear = {2.0};
    HysteresisParameters loss;
    loss.bias = 0.3;
    const ForceModel model{force, loss, test::unit_domain(), 0.05};
    AnyStructure structure = structure_of(model, {SlopeRule::Steepest, 1e9, 0.0, 0.02});
    structure.reset(0.2);
    EXPECT_NEAR(structure.step(0.2).stiffness, 2.0 + 0.3 / 0.05, 1e-9);
    EXPECT_NEAR(structure.step(0.6).stiffness, 2.0 + 0.3 / 0.05, 1e-9) << "also while the play slides";
}

TEST(Tangent, LimitsTheForceOfASteepestLineOnly) {
    NetworkParameters line;
    line.linear = {10.0};
    const ForceModel spring{line, test::unit_domain()};
    EXPECT_EQ(structure_of(spring, {SlopeRule::Steepest, 1e9, 0.0, 0.1}, 2.0).step(0.9).force, 2.0);
    EXPECT_NEAR(structure_of(spring, {SlopeRule::Raised, 0.0, 0.0, std::nullopt}, 2.0).step(0.9).force, 9.0,
                1e-9);
}

TEST(Tangent, SendsNothingForAPositionThatIsNotFinite) {
    test::Random random{4};
    AnyStructure structure = structure_of(wavy(random), {SlopeRule::Steepest, 1e9, 0.0, 0.1});
    const Rendered before = structure.step(0.4);
    for (const double x :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
        const Rendered rendered = structure.step(x);
        EXPECT_EQ(rendered.force, 0.0);
        EXPECT_EQ(rendered.stiffness, 0.0);
        EXPECT_EQ(rendered.status, Status::NonFinite);
    }
    EXPECT_EQ(structure.step(0.4).force, before.force);
}

std::string refusal_of(const ForceModel& model, const Scheme& scheme) {
    try {
        validate(scheme, model);
    } catch (const std::invalid_argument& error) {
        return error.what();
    }
    return "";
}

TEST(Tangent, RefusesASchemeWithAWrongLine) {
    test::Random random{5};
    const ForceModel model = wavy(random);
    Scheme scheme;
    scheme.structure = StructureKind::Tangent;
    EXPECT_EQ(refusal_of(model, scheme), "") << "absent: the slope of the force";
    scheme.line = HeldSlope{SlopeRule::Steepest, 1.0, 0.0, 1e-5};
    EXPECT_EQ(
        refusal_of(model, scheme),
        "line.motion is 1e-05, must be at least 0.0002441 for the rule steepest and a domain of this length");
    scheme.line = HeldSlope{SlopeRule::Raised, 0.0, -1.0, std::nullopt};
    EXPECT_EQ(refusal_of(model, scheme), "line.lift is -1, must be >= 0");
    scheme.line = HeldSlope{};
    scheme.structure = StructureKind::Direct;
    EXPECT_EQ(refusal_of(model, scheme), "line is given, must be absent for the structure direct");
}

}  // namespace
}  // namespace palpate
