// SPDX-License-Identifier: Apache-2.0
// Tests the simulated test rig: its values follow from the model, unless the user gives other values.
#include "palpate/simulation/test_rig.hpp"

#include <cmath>
#include <optional>

#include <gtest/gtest.h>

namespace palpate {
namespace {

/// Returns a switch with a travel of `travel` metres, whose release force is 0.1 N smaller than its press force.
ForceModel keyswitch(double travel, std::optional<double> play_radius = {}) {
    const Domain domain{{0.0}, {travel}, Continuation::Linear, Continuation::Linear, std::nullopt};
    return {NetworkParameters{1, {}, {}, {}, {0.8 / travel}, 0.1}, {{}, 0.0, 0.05}, domain, play_radius};
}

TEST(TestRig, IsTheKnobScaledToTheModel) {
    const TestRig small = rig_for(keyswitch(0.004), false, 1e-3);
    const TestRig large = rig_for(keyswitch(0.4), false, 1e-3);
    EXPECT_NEAR(large.scale.length / small.scale.length, 100.0, 1e-9);
    EXPECT_NEAR(large.device.encoder_step / small.device.encoder_step, 100.0, 1e-9);
    EXPECT_NEAR(large.hand.upper / small.hand.upper, 100.0, 1e-6);
    EXPECT_NEAR(large.scale.stiffness() / small.scale.stiffness(), 0.01, 1e-9);
    EXPECT_EQ(large.device.force_limit, small.device.force_limit);
    EXPECT_NEAR(small.device.force_limit, 1.05 * 0.95, 1e-9);
}

TEST(TestRig, UsesTheUnscaledKnobForAnAngle) {
    const TestRig rig = rig_for(keyswitch(0.4), true, 2e-3);
    EXPECT_EQ(rig.device.id, DeviceProfile{}.id);
    EXPECT_EQ(rig.device.encoder_step, DeviceProfile{}.encoder_step);
    EXPECT_EQ(rig.device.period_s, 2e-3);
    EXPECT_EQ(rig.scale.length, 1.0);
}

TEST(TestRig, DefaultPlayRadiusCoversTravelShareAndEncoderSteps) {
    TestRig rig = rig_for(keyswitch(0.004), false, 1e-3);
    EXPECT_NEAR(rig.scheme(keyswitch(0.004)).play_radius, 4e-5, 1e-15);
    rig.device.encoder_step = 1e-4;
    EXPECT_NEAR(rig.scheme(keyswitch(0.004)).play_radius, 4e-4, 1e-15);
    EXPECT_EQ(rig.scheme(keyswitch(0.004, 1e-5)).play_radius, 0.0);  // the model defines its own play radius
}

TEST(TestRig, KeepsChosenFieldsAndScalesTheOthers) {
    const ForceModel model = keyswitch(0.004);
    const TestRig rig = rig_for(model, false, 1e-3);
    SchemeChoices chosen;
    chosen.structure = StructureKind::Implicit;
    chosen.mass = 3.0;
    chosen.play_radius = 1e-3;
    const Scheme scheme = rig.scheme(model, chosen);
    EXPECT_EQ(scheme.structure, StructureKind::Implicit);
    EXPECT_EQ(scheme.inertia.mass, 3.0);
    EXPECT_EQ(scheme.play_radius, 1e-3);
    EXPECT_EQ(scheme.coupling.stiffness, Scheme{}.coupling.stiffness * rig.scale.stiffness());
    EXPECT_EQ(scheme.inertia.damping, Scheme{}.inertia.damping * rig.scale.stiffness());
}

TEST(TestRig, CommandsNoForceAboveTheDeviceLimit) {
    const Domain domain{{0.0}, {0.5}, Continuation::Linear, Continuation::Linear, std::nullopt};
    const ForceModel wall{NetworkParameters{1, {}, {}, {}, {40.0}, 0.0}, domain};
    const TestRig rig = rig_for(wall, true, 1e-3);
    const Trace trace = simulate(wall, rig.scheme(wall), rig.device, rig.hand, 2000);
    double largest = 0.0;
    for (std::size_t k = 0; k < trace.force.size(); ++k) {
        EXPECT_EQ(trace.status[k], Status::Ok);
        largest = std::max(largest, std::abs(trace.force[k]));
    }
    EXPECT_GT(largest, 0.5 * rig.device.force_limit);
    EXPECT_LT(largest, rig.device.force_limit);
}

}  // namespace
}  // namespace palpate
