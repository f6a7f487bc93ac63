// SPDX-License-Identifier: Apache-2.0
#include "mujoco/joint_force.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <vector>

namespace palpate {
namespace {

constexpr double mass = 0.003;
constexpr double press = 0.9;
constexpr double play_radius = 4e-5;

/// A key switch [m, N] with a force drop of 0.2 N, and a hysteresis of 0.05 N if `hysteresis` is true.
ForceModel key_switch(bool hysteresis) {
    const NetworkParameters network{1, {4000.0}, {0.002}, {-0.2}, {400.0}, 0.3};
    const Domain domain{{0.0}, {0.004}, Continuation::Linear, Continuation::Linear, std::nullopt};
    if (hysteresis) {
        return {network, {{0.0}, 0.0, 0.05}, domain, play_radius};
    }
    return {network, domain};
}

/// A key under a constant force in a simulator of one joint.
struct Key {
    ModelOnJoint model;
    double period;
    double position = 0.0;
    double velocity = 0.0;
    double force = 0.0;
    double velocity_at_end = 0.0;
    std::vector<double> stored = std::vector<double>(ModelOnJoint::states);

    Key(const ForceModel& of, JointMethod method, double step) : model{of, method}, period{step} {
        ModelOnJoint::start(0.0, stored.data());
    }

    void step() {
        force = model.force({position, velocity, press / mass, 1.0 / mass, period}, stored.data());
        velocity += period * (press - force) / mass;
        position += period * velocity;
        velocity_at_end = 2.0 * velocity - velocity_at_end;
        model.advance(position, 0.0, stored.data());
    }
};

constexpr std::array methods{JointMethod::Implicit, JointMethod::EnergyConsistent};

double energy(const ForceModel& model, double position, double velocity) {
    return model.network()->at(position, {}).energy - model.network()->at(0.0, {}).energy - press * position +
           0.5 * mass * velocity * velocity;
}

TEST(JointForce, ImplicitForceIsThatOfTheEndOfTheStep) {
    const ForceModel model = key_switch(false);
    for (const double period : {1e-5, 1e-3, 1e-2}) {
        Key key{model, JointMethod::Implicit, period};
        for (int k = 0; k < 100; ++k) {
            key.step();
            EXPECT_NEAR(key.force, model.network()->at(key.position, {}).force, 1e-9);
        }
    }
}

TEST(JointForce, EnergyConsistentStepsKeepTheEnergy) {
    const ForceModel model = key_switch(false);
    for (const double period : {1e-5, 1e-4, 1e-3, 1e-2, 0.1}) {
        Key key{model, JointMethod::EnergyConsistent, period};
        for (int k = 0; k < 500; ++k) {
            key.step();
            EXPECT_NEAR(energy(model, key.position, key.velocity_at_end), 0.0, 1e-10);
        }
    }
}

TEST(JointForce, ImplicitStepsGenerateNoEnergy) {
    const ForceModel model = key_switch(false);
    for (const double period : {1e-5, 1e-4, 1e-3, 1e-2, 0.1}) {
        Key key{model, JointMethod::Implicit, period};
        for (int k = 0; k < 500; ++k) {
            key.step();
            EXPECT_LE(energy(model, key.position, key.velocity), 1e-12);
        }
    }
}

TEST(JointForce, MeanForceDoesTheWorkOfTheHysteresis) {
    // The mean force over a motion times its length, against the sum over 20 000 small motions with the play operator.
    const ForceModel model = key_switch(true);
    const HysteresisNetwork& pair = *model.hysteresis();
    const CompiledHysteresis compiled{pair};
    const JointForce force{compiled, 1e-4};
    for (const double from : {0.001, 0.0021}) {
        for (const double play_offset : {-4e-5, 0.0, 3e-5}) {
            for (const double moved : {-5e-4, -3e-5, 2e-6, 3e-5, 1e-3}) {
                // A joint that the force almost does not accelerate moves by `moved`.
                const double period = 1e-3;
                const double mobility = 1e-9;
                const CompiledHysteresis::State start{from + play_offset};
                const JointStep step{from, moved / period, 0.0, mobility, period};
                const double mean = force.solve(JointMethod::EnergyConsistent, step, start, 0.0).mean;
                double work = 0.0;
                HysteresisNetwork::State state{start.play};
                const int parts = 20'000;
                for (int k = 0; k < parts; ++k) {
                    const double x = from + moved * (k + 0.5) / parts;
                    work += pair.at(x, state).force * moved / parts;
                    pair.advance(x, state);
                }
                EXPECT_NEAR(mean * moved, work, 1e-5 * std::abs(work)) << from << play_offset << moved;
            }
        }
    }
}

TEST(JointForce, HysteresisEndsASwing) {
    for (const JointMethod method : methods) {
        Key key{key_switch(true), method, 1e-3};
        const auto range = [&](int steps) {
            double low = key.position;
            double high = key.position;
            for (int k = 0; k < steps; ++k) {
                key.step();
                low = std::min(low, key.position);
                high = std::max(high, key.position);
            }
            return high - low;
        };
        EXPECT_GT(range(100), 1e-3);
        (void)range(2000);
        // The play operator does not move any more, so the rest of the swing dissipates nothing.
        EXPECT_LE(range(100), 2.0 * play_radius);
    }
}

TEST(JointForce, ForcesOfVelocityAreRefused) {
    const ForceModel damper = ForceModel::of_velocity(
        {2, {1.0, 1.0}, {0.0, 0.0}, {0.1}, {0.0, 0.0}, 0.0},
        {{0.0, -1.0}, {1.0, 1.0}, Continuation::Linear, Continuation::Linear, std::nullopt});
    EXPECT_THROW((ModelOnJoint{damper, JointMethod::Implicit}), std::invalid_argument);
}

}  // namespace
}  // namespace palpate
