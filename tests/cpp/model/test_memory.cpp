// SPDX-License-Identifier: Apache-2.0
#include "palpate/model/memory.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/model/energy.hpp"
#include "palpate/model/fingerprint.hpp"
#include "palpate/model/force_model.hpp"
#include "support.hpp"

namespace palpate {
namespace {

using test::cases;
using test::Random;
using test::random_memory;
using test::uniform;

Continuation random_side(Random& random) {
    return uniform(random, 0.0, 1.0) < 0.5 ? Continuation::Linear : Continuation::Free;
}

ForceModel random_model(Random& random) {
    const Domain domain = test::unit_domain(random_side(random), random_side(random));
    return ForceModel{test::random_network(random, 1 + random() % 3), domain}.with_memory(
        random_memory(random));
}

MemoryForce<NetworkCurve> force_of(const ForceModel& model, double period_s,
                                   double limit = std::numeric_limits<double>::infinity()) {
    return {model.network()->curve(), model.memory()->ratio(), *model.memory(), period_s, limit};
}

MemoryParameters one_branch(double stiffness, double time_constant_s) {
    MemoryParameters memory;
    memory.stiffness = {stiffness};
    memory.time_constant_s = {time_constant_s};
    return memory;
}

/// Returns a spring at rest with one linear branch.
ForceModel standard_linear_solid(double rest, double stiffness, double time_constant_s) {
    return ForceModel{{1, {}, {}, {}, {rest}, 0.0}, test::unit_domain()}.with_memory(
        one_branch(stiffness, time_constant_s));
}

// No closed motion takes energy out of the branches, with any ratio, force limit and contact. The branches act along
// the coordinate u. The energy of the force at rest depends on the position alone.
TEST(Memory, NoMotionGeneratesEnergy) {
    Random random{21};
    double worst = 0.0;
    for (int k = 0; k < cases(100'000);) {
        const ForceModel model = random_model(random);
        const double period_s = std::exp(uniform(random, -7.0, 1.0));
        const double limit = uniform(random, 0.0, 1.0) < 0.5 ? 1e9 : uniform(random, 0.1, 3.0);
        const auto object = force_of(model, period_s, limit);
        const std::vector<double>& stiffness = model.memory()->parameters().stiffness;
        for (int motion = 0; motion < 100; ++motion, ++k) {
            const double start = uniform(random, -0.3, 1.3);
            auto state = object.start(start);
            const double reach = std::exp(uniform(random, -5.0, 0.5));
            double work = 0.0;
            double throughput = 1e-300;
            for (int move = 0; move < 20; ++move) {
                const double from = state.coordinate;
                object.advance(move == 19 ? start : start + reach * uniform(random, -1.0, 1.0), state);
                double force = 0.0;
                for (std::size_t j = 0; j < stiffness.size(); ++j) {
                    force += stiffness[j] * state.stretch[j];
                }
                const double done = force * (state.coordinate - from);
                work += done;
                throughput += std::abs(done);
            }
            worst = std::min(worst, work / throughput);
            EXPECT_GE(work, -1e-12 * throughput) << "motion " << k;
        }
    }
    RecordProperty("smallest_share", std::to_string(worst));
}

TEST(Memory, StoredEnergyDecreasesAtRest) {
    Random random{22};
    for (int k = 0; k < cases(200); ++k) {
        const ForceModel model = random_model(random);
        const auto object = force_of(model, 0.01);
        auto state = object.start(uniform(random, 0.0, 1.0));
        const double x = uniform(random, -0.2, 1.2);
        double before = object.move(x, state).energy;
        for (int tick = 0; tick < 20; ++tick) {
            const double now = object.move(x, state).energy;
            EXPECT_LE(now, before + 1e-12 * (1.0 + std::abs(before)));
            before = now;
        }
    }
}

TEST(Memory, RelaxesWithItsTimeConstant) {
    const ForceModel model = standard_linear_solid(3.0, 5.0, 0.4);
    const auto object = force_of(model, 1e-4);
    auto state = object.start(0.0);
    EXPECT_NEAR(object.move(0.5, state).force, 0.5 * 8.0, 1e-3);
    for (int tick = 0; tick < 4000; ++tick) {
        object.advance(0.5, state);
    }
    EXPECT_NEAR(object.at(0.5, state).force, 0.5 * (3.0 + 5.0 * std::exp(-1.0)), 1e-3);
}

TEST(Memory, RecordedRampAndHoldAreExactAtAnyRate) {
    const double tau = 0.3;
    const ForceModel model = standard_linear_solid(0.0, 2.0, tau);
    const auto object = force_of(model, 1e-3);
    auto state = object.start(0.0);
    const double ramp_s = 0.5;
    const double speed = 1.6;
    const double at_end = 2.0 * speed * tau * (1.0 - std::exp(-ramp_s / tau));
    EXPECT_NEAR(object.move_for(0.2 * speed, 0.2, state).sample.force,
                2.0 * speed * tau * (1.0 - std::exp(-0.2 / tau)), 1e-14);
    EXPECT_NEAR(object.move_for(0.5 * speed, 0.3, state).sample.force, at_end, 1e-14);
    EXPECT_NEAR(object.move_for(0.5 * speed, 2.0, state).sample.force, at_end * std::exp(-2.0 / tau), 1e-14);
}

TEST(Memory, StartsAtRestAtAnyPosition) {
    Random random{23};
    for (int k = 0; k < cases(100); ++k) {
        const ForceModel model = random_model(random);
        const auto object = force_of(model, 1e-3);
        const double x = uniform(random, -0.2, 1.2);
        EXPECT_DOUBLE_EQ(object.at(x, object.start(x)).force, model.network()->curve().at(x).value);
    }
}

TEST(Memory, NeverPullsAToolThatCanLeave) {
    const ForceModel model =
        ForceModel{{1, {}, {}, {}, {1.0}, 0.0}, test::unit_domain(Continuation::Free)}.with_memory(
            one_branch(10.0, 0.1));
    const auto object = force_of(model, 1e-3);
    auto state = object.start(0.0);
    for (int tick = 0; tick < 1000; ++tick) {
        object.advance(0.8, state);
    }
    EXPECT_GT(object.at(0.8, state).force, 0.7);
    for (int tick = 1; tick <= 50; ++tick) {
        EXPECT_GE(object.move(0.8 - 0.01 * tick, state).force, 0.0);
    }
}

TEST(Memory, KeepsTheForceLimitWithItsState) {
    const ForceModel model = standard_linear_solid(1.0, 10.0, 1e3);
    const auto object = force_of(model, 1e-3, 2.0);
    auto state = object.start(0.0);
    EXPECT_DOUBLE_EQ(object.move(0.9, state).force, 2.0);
    // The stretch was reduced to 1.1 / 10, so that the release starts from the limit
    EXPECT_NEAR(object.move(0.85, state).force, 0.85 + 10.0 * (0.11 - 0.05), 1e-3);
}

TEST(Memory, StretchIsBoundedOutsideTheDomain) {
    Random random{24};
    for (int k = 0; k < cases(100); ++k) {
        const ForceModel model = random_model(random);
        const auto object = force_of(model, 1e-3);
        auto state = object.start(0.0);
        for (int tick = 0; tick < 20; ++tick) {
            object.advance(uniform(random, -5.0, 5.0), state);
            for (const double stretch : state.stretch) {
                EXPECT_LE(std::abs(stretch), model.memory()->largest_stretch());
            }
        }
    }
}

TEST(Memory, BoundsHoldForTheRatio) {
    Random random{25};
    for (int k = 0; k < cases(100); ++k) {
        const ForceModel model = random_model(random);
        const MemoryNetwork& memory = *model.memory();
        for (int i = 0; i < 200; ++i) {
            const Curve p = memory.ratio().at(uniform(random, -1.0, 2.0));
            EXPECT_LE(std::abs(p.value), memory.largest_ratio() * (1.0 + 1e-12));
            EXPECT_LE(std::abs(p.slope), memory.steepest_ratio() * (1.0 + 1e-12));
        }
    }
}

TEST(Memory, SlopeIsTheDerivativeOfTheForce) {
    Random random{26};
    for (int k = 0; k < cases(100); ++k) {
        const ForceModel model = random_model(random);
        const auto object = force_of(model, 1e-2);
        auto state = object.start(0.5);
        object.advance(0.7, state);
        const double x = uniform(random, 0.1, 0.9);
        const double h = 1e-6;
        const auto sample = object.at(x, state);
        if (sample.slope == 0.0) {
            continue;  // at a limit of the force
        }
        const double slope = (object.at(x + h, state).force - object.at(x - h, state).force) / (2.0 * h);
        EXPECT_NEAR(sample.slope, slope, 1e-4 * (1.0 + std::abs(slope)));
    }
}

TEST(Memory, CompiledCurvesGiveTheSameForce) {
    Random random{27};
    for (int k = 0; k < cases(50); ++k) {
        const ForceModel model = random_model(random);
        const auto object = force_of(model, 1e-3);
        const MemoryForce<CompiledCurve> compiled{CompiledCurve{model.network()->curve()},
                                                  CompiledCurve{model.memory()->ratio()}, *model.memory(),
                                                  1e-3};
        auto state = object.start(0.2);
        auto same = compiled.start(0.2);
        for (int tick = 0; tick < 50; ++tick) {
            const double x = uniform(random, -0.2, 1.2);
            const double force = object.move(x, state).force;
            EXPECT_NEAR(compiled.move(x, same).force, force, 1e-9 * (1.0 + std::abs(force)));
        }
    }
}

TEST(Memory, ChangesTheFingerprintAndTheEnergyRange) {
    const ForceModel spring{{1, {}, {}, {}, {1.0}, 0.0}, test::unit_domain()};
    const ForceModel soft = spring.with_memory(one_branch(1.0, 0.5));
    EXPECT_NE(fingerprint(spring), fingerprint(soft));
    EXPECT_NE(fingerprint(soft), fingerprint(spring.with_memory(one_branch(1.0, 0.6))));
    EXPECT_NEAR(energy_range(soft).largest, energy_range(spring).largest + 0.5, 1e-12);
}

TEST(Memory, RefusesWrongParameters) {
    const ForceModel spring{{1, {}, {}, {}, {1.0}, 0.0}, test::unit_domain()};
    const auto refuses = [](const ForceModel& model, const MemoryParameters& memory) {
        EXPECT_THROW((void)model.with_memory(memory), std::invalid_argument);
    };
    refuses(spring, MemoryParameters{});
    refuses(spring, one_branch(-1.0, 1.0));
    refuses(spring, one_branch(1.0, 0.0));
    MemoryParameters wide = one_branch(1.0, 1.0);
    wide.stiffness.resize(9, 1.0);
    wide.time_constant_s.resize(9, 1.0);
    refuses(spring, wide);
    const Domain turn{{0.0}, {1.0}, {}, {}, 1.0};
    refuses(ForceModel{{1, {}, {}, {}, {0.0}, 0.0}, turn}, one_branch(1.0, 1.0));
    refuses(ForceModel{{1, {}, {}, {}, {0.0}, 0.0}, {{}, 0.0, 0.1}, test::unit_domain(), std::nullopt},
            one_branch(1.0, 1.0));
}

}  // namespace
}  // namespace palpate
