// SPDX-License-Identifier: Apache-2.0
#include "palpate/rendering/scale.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include <gtest/gtest.h>

#include "support.hpp"

namespace palpate {
namespace {

const Domain domain{{1.0}, {3.0}, Continuation::Linear, Continuation::Linear, std::nullopt};

NetworkParameters line(double stiffness, double bias) {
    return {1, {}, {}, {}, {stiffness}, bias};
}

ForceModel spring(double stiffness) {
    return {line(stiffness, 0.0), domain};
}

TEST(LargestForce, IsThatOfADenseSearchOverTheDomain) {
    test::Random random{8};
    for (int k = 0; k < 6; ++k) {
        const ForceModel model{test::random_network(random, 5), domain};
        double largest = 0.0;
        for (int j = 0; j <= 20'000; ++j) {
            largest = std::max(largest, std::abs(model.network()->at(1.0 + 1e-4 * j, {}).force));
        }
        // Between two of 1001 positions the force changes by at most the slope times the half distance
        const double missed = 1e-3 * model.slope_bounds().largest();
        EXPECT_LE(detail::largest_force(model), largest * (1.0 + 1e-12));
        EXPECT_GE(detail::largest_force(model), largest - missed);
    }
    EXPECT_DOUBLE_EQ(detail::largest_force(spring(4.0)), 12.0) << "at the upper end";
    EXPECT_DOUBLE_EQ(detail::largest_force({line(2.0, -6.0), domain}), 4.0) << "at the lower end, negative";
}

TEST(LargestForce, OfAnObjectWithoutForceIsOne) {
    EXPECT_EQ(detail::largest_force(spring(0.0)), 1.0);
    EXPECT_EQ(detail::largest_force(spring(0.125)), 0.375) << "a small force counts as it is";
}

TEST(LargestForce, IncludesPressAndRelease) {
    for (const double stiffness : {4.0, -4.0}) {
        const ForceModel lossy{line(stiffness, 0.0), {{}, 0.0, 0.5}, domain, 0.01};
        EXPECT_DOUBLE_EQ(detail::largest_force(lossy), 12.5) << stiffness;
    }
}

TEST(LargestForce, IncludesTheLargestVelocityInEachDirection) {
    const auto drag = [](double damping) {
        return ForceModel::of_velocity({2, {}, {}, {}, {4.0, damping}, 0.0},
                                       {{1.0, -5.0}, {3.0, 2.0}, {}, {}, std::nullopt});
    };
    EXPECT_DOUBLE_EQ(detail::largest_force(drag(0.5)), 12.0 + 0.5 * 2.0);
    EXPECT_DOUBLE_EQ(detail::largest_force(drag(-0.5)), 12.0 + 0.5 * 5.0);
}

TEST(LargestForce, AddsTheMemoryStretchedOverTheDomain) {
    MemoryParameters memory;
    memory.ratio.bias = 0.25;
    memory.stiffness = {2.0, 3.0};
    memory.time_constant_s = {0.1, 1.0};
    // The coordinate changes by a quarter of the travel of 2, and its force acts with the ratio 1/4
    EXPECT_NEAR(detail::largest_force(spring(4.0).with_memory(memory)), 12.0 + 5.0 * 0.25 * 0.5, 1e-6);
}

TEST(ModelScale, IsTravelAndForceRelativeToTheKnob) {
    const ModelScale scale = scale_of(spring(4.0), false);
    EXPECT_DOUBLE_EQ(scale.length, 4.0) << "travel 2, knob 0.5";
    EXPECT_DOUBLE_EQ(scale.force, 1.05 * 12.0 / 5.0) << "5 percent above the largest force; knob 5 N*m";
    EXPECT_DOUBLE_EQ(scale.stiffness(), 1.05 * 12.0 / 5.0 / 4.0);
    const ModelScale angle = scale_of(spring(4.0), true);
    EXPECT_EQ(angle.length, 1.0);
    EXPECT_EQ(angle.force, 1.0);
    test::Random random{2};
    const ForceModel plate{test::random_network(random, 4, 2), {{0.0, 0.0}, {1.0, 1.0}, {}, {}, {}}};
    EXPECT_THROW((void)scale_of(plate, true), std::invalid_argument);
    EXPECT_THROW((void)scale_of(plate, false), std::invalid_argument);
}

TEST(ScaledKnob, MultipliesEveryNumberByTheScaleOfItsUnit) {
    const DeviceProfile usual;
    const ModelScale scale{4.0, 8.0};
    DeviceProfile device = scaled_knob(scale, false, 0.25);
    EXPECT_EQ(device.id, usual.id + ", scaled");
    EXPECT_EQ(device.position_unit, "m");
    EXPECT_EQ(device.period_s, 0.25);
    EXPECT_DOUBLE_EQ(device.inertia, 2.0 * usual.inertia);
    EXPECT_DOUBLE_EQ(device.viscous_damping, 2.0 * usual.viscous_damping);
    EXPECT_DOUBLE_EQ(device.encoder_step, 4.0 * usual.encoder_step);
    EXPECT_DOUBLE_EQ(device.force_limit, 8.0 * usual.force_limit);
    EXPECT_EQ(device.coulomb_friction, 0.0);
    EXPECT_EQ(device.force_step, 0.0);
    device = scaled_knob(scale, true, 0.25);
    DeviceProfile same;
    same.period_s = 0.25;
    EXPECT_TRUE(device == same);
}

TEST(SchemeFor, ScalesItsDefaults) {
    const Scheme usual;
    const Scheme scheme = scheme_for(spring(4.0), {4.0, 32.0}, {});
    EXPECT_EQ(scheme.structure, usual.structure);
    EXPECT_DOUBLE_EQ(scheme.coupling.stiffness, 8.0 * usual.coupling.stiffness);
    EXPECT_DOUBLE_EQ(scheme.coupling.damping, 8.0 * usual.coupling.damping);
    EXPECT_DOUBLE_EQ(scheme.inertia.mass, 8.0 * usual.inertia.mass);
    EXPECT_DOUBLE_EQ(scheme.inertia.damping, 8.0 * usual.inertia.damping);
    EXPECT_FALSE(scheme.compensated);
    EXPECT_EQ(scheme.play_radius, 0.0);
    EXPECT_EQ(scheme.predict, 0);
}

TEST(SchemeFor, UsesEveryChoice) {
    SchemeChoices chosen;
    EXPECT_FALSE(chosen.any());
    chosen.compensated = false;
    EXPECT_FALSE(chosen.any());
    const auto expect_chosen = [](auto member, auto value) {
        SchemeChoices one;
        one.*member = value;
        EXPECT_TRUE(one.any());
    };
    expect_chosen(&SchemeChoices::structure, StructureKind::Direct);
    expect_chosen(&SchemeChoices::compensated, true);
    expect_chosen(&SchemeChoices::coupling_stiffness, 0.0);
    expect_chosen(&SchemeChoices::coupling_damping, 0.0);
    expect_chosen(&SchemeChoices::mass, 0.0);
    expect_chosen(&SchemeChoices::object_damping, 0.0);
    expect_chosen(&SchemeChoices::play_radius, 0.0);
    expect_chosen(&SchemeChoices::predict, 0);
    chosen = {StructureKind::Implicit, true, 1.0, 2.0, 3.0, 4.0, 5.0, 6};
    const Scheme scheme = scheme_for(spring(4.0), {4.0, 32.0}, {}, chosen);
    EXPECT_EQ(scheme.structure, StructureKind::Implicit);
    EXPECT_TRUE(scheme.compensated);
    EXPECT_EQ(scheme.coupling.stiffness, 1.0);
    EXPECT_EQ(scheme.coupling.damping, 2.0);
    EXPECT_EQ(scheme.inertia.mass, 3.0);
    EXPECT_EQ(scheme.inertia.damping, 4.0);
    EXPECT_EQ(scheme.play_radius, 5.0);
    EXPECT_EQ(scheme.predict, 6);
}

TEST(SchemeFor, ChoosesTheDirectStructureIfNoOtherCanRenderTheModel) {
    const auto structure = [](const ForceModel& model, std::optional<int> predict = std::nullopt) {
        SchemeChoices chosen;
        chosen.predict = predict;
        return scheme_for(model, {}, {}, chosen).structure;
    };
    MemoryParameters memory;
    memory.stiffness = {2.0};
    memory.time_constant_s = {0.1};
    EXPECT_EQ(structure(spring(4.0)), StructureKind::Massless);
    EXPECT_EQ(structure(spring(4.0), 0), StructureKind::Massless);
    EXPECT_EQ(structure(spring(4.0), 1), StructureKind::Direct);
    EXPECT_EQ(structure(spring(4.0).with_memory(memory)), StructureKind::Direct);
    EXPECT_EQ(structure(ForceModel::of_velocity({2, {}, {}, {}, {4.0, 0.5}, 0.0},
                                                {{1.0, -5.0}, {3.0, 2.0}, {}, {}, std::nullopt})),
              StructureKind::Direct);
}

TEST(SchemeFor, SetsAPlayRadiusOnlyIfTheModelNeedsOne) {
    const ForceModel loose{line(4.0, 0.0), {{}, 0.0, 0.5}, domain, {}};
    const ForceModel defined{line(4.0, 0.0), {{}, 0.0, 0.5}, domain, 0.01};
    for (const double encoder_step : {0.0, 0.25}) {
        DeviceProfile device;
        device.encoder_step = encoder_step;
        EXPECT_EQ(scheme_for(loose, {}, device).play_radius, usual_play_radius(2.0, encoder_step));
        EXPECT_EQ(scheme_for(defined, {}, device).play_radius, 0.0);
        EXPECT_EQ(scheme_for(spring(4.0), {}, device).play_radius, 0.0);
    }
    EXPECT_GT(usual_play_radius(2.0, 0.25), usual_play_radius(2.0, 0.0));
}

}  // namespace
}  // namespace palpate
