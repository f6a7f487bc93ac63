// SPDX-License-Identifier: Apache-2.0
#include "palpate/model/memory.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
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

// Masing's rule: after a turn the force of sliders that all slip follows the first loading, twice as large.
TEST(Memory, LoopsOfSlidersGrowWithTheirLength) {
    MemoryParameters memory = one_branch(4.0, std::numeric_limits<double>::infinity());
    memory.stiffness.push_back(2.0);
    memory.time_constant_s.push_back(std::numeric_limits<double>::infinity());
    memory.yield_stretch = {0.1, 0.25};
    const ForceModel model = ForceModel{{1, {}, {}, {}, {1.0}, 0.0}, test::unit_domain()}.with_memory(memory);
    const auto object = force_of(model, 1e-3);
    const auto loading = [](double moved) {
        return moved + 4.0 * std::min(moved, 0.1) + 2.0 * std::min(moved, 0.25);
    };
    auto state = object.start(0.0);
    for (const double x : {0.05, 0.2, 0.9}) {
        const auto sample = object.move(x, state);
        EXPECT_NEAR(sample.force, loading(x), 1e-14);
        EXPECT_EQ(sample.slope, x < 0.1 ? 7.0 : x < 0.25 ? 3.0 : 1.0);
    }
    const double turn = loading(0.9);
    EXPECT_NEAR(object.move_for(0.9, 1e9, state).sample.force, turn, 1e-14) << "a slider does not relax";
    for (const double x : {0.85, 0.6, 0.1}) {
        EXPECT_NEAR(object.move_for(x, 0.1, state).sample.force, turn - 2.0 * loading((0.9 - x) / 2.0),
                    1e-14);
    }
    EXPECT_DOUBLE_EQ(model.memory()->largest_tension(), 0.4 + 0.5);
    EXPECT_DOUBLE_EQ(model.memory()->largest_energy(), 0.5 * 4.0 * 0.01 + 0.5 * 2.0 * 0.0625);
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

TEST(Memory, MirroredObjectHasTheMirroredForce) {
    Random random{32};
    const Domain mirror{{-1.0}, {0.0}, Continuation::Linear, Continuation::Free, std::nullopt};
    for (int k = 0; k < cases(20); ++k) {
        MemoryParameters memory = one_branch(uniform(random, 1.0, 10.0), uniform(random, 0.1, 1.0));
        memory.ratio = {.linear = {0.5}, .bias = 1.0};
        const ForceModel model =
            ForceModel{{1, {}, {}, {}, {1.0}, 0.0}, test::unit_domain(Continuation::Free)}.with_memory(
                memory);
        memory.ratio.linear = {-0.5};
        const ForceModel mirrored = ForceModel{{1, {}, {}, {}, {1.0}, 0.0}, mirror}.with_memory(memory);
        const auto object = force_of(model, 1e-3);
        const auto image = force_of(mirrored, 1e-3);
        auto state = object.start(0.0);
        auto other = image.start(0.0);
        for (int move = 0; move < 20; ++move) {
            const double x = uniform(random, -0.2, 1.0);
            const auto sample = object.move_for(x, 0.1, state);
            const auto opposite = image.move_for(-x, 0.1, other);
            EXPECT_NEAR(opposite.sample.force, -sample.sample.force, 1e-12);
            EXPECT_NEAR(opposite.factor, sample.factor, 1e-12);
        }
    }
}

// A tool that leaves faster than the ratio ends between two rows leaves the same object behind as a slow one.
TEST(Memory, ToolThatIsAwayReleasesTheBranchesAtAnyRate) {
    MemoryParameters memory = one_branch(4.0, std::numeric_limits<double>::infinity());
    memory.yield_stretch = {0.5};
    const ForceModel model =
        ForceModel{{1, {}, {}, {}, {1.0}, 0.0}, test::unit_domain(Continuation::Free)}.with_memory(memory);
    const auto object = force_of(model, 1e-3);
    for (const int rows : {1, 10, 1000}) {
        auto state = object.start(0.0);
        for (const auto& [from, to] : {std::array{0.0, 0.9}, {0.9, -0.3}, {-0.3, 0.2}}) {
            for (int row = 1; row <= rows; ++row) {
                object.advance(from + (to - from) * row / rows, state);
            }
        }
        EXPECT_NEAR(object.at(0.2, state).force, 0.2 + 4.0 * (0.2 + 0.01), 1e-3) << rows;
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
            for (std::size_t j = 0; j < model.memory()->parameters().stiffness.size(); ++j) {
                EXPECT_LE(std::abs(state.stretch[j]), model.memory()->largest_stretch(j));
                EXPECT_LE(std::abs(state.stretch[j]), model.memory()->parameters().yield_at(j));
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
    MemoryParameters slipping = one_branch(1.0, 0.5);
    slipping.yield_stretch = {0.2};
    EXPECT_NE(fingerprint(soft), fingerprint(spring.with_memory(slipping)));
    EXPECT_NEAR(energy_range(soft).largest, energy_range(spring).largest + 0.5, 1e-12);
}

/// A domain of length 2 that does not start at zero.
Domain two_long(Continuation below = Continuation::Linear, Continuation above = Continuation::Linear) {
    return {{1.0}, {3.0}, below, above, std::nullopt};
}

/// Returns the force at rest g = 2 (x - 1) over [1, 3] with a ratio p that is a straight line.
ForceModel with_ratio(double slope, double at_one, const Domain& domain) {
    MemoryParameters memory = one_branch(3.0, 1e12);
    memory.ratio.linear = {slope};
    memory.ratio.bias = at_one - slope;
    return ForceModel{{1, {}, {}, {}, {2.0}, -2.0}, domain}.with_memory(memory);
}

// p = 0.5 + 0.25 (x - 1). Below, g ends at once, and p falls over 2 % of the domain, 0.04. Above, g(3) = 4 falls to zero
// over the length 2 of the domain, and p(3) = 1 with it.
TEST(Memory, RatioFallsToZeroWithTheForceAtRest) {
    const ForceModel free = with_ratio(0.25, 0.5, two_long(Continuation::Free, Continuation::Free));
    const NetworkCurve& p = free.memory()->ratio();
    EXPECT_NEAR(p.at(1.0).value, 0.5, 1e-14);
    EXPECT_NEAR(p.at(0.98).value, 0.25, 1e-12);
    EXPECT_EQ(p.at(0.9599).value, 0.0);
    EXPECT_NEAR(p.at(3.0).value, 1.0, 1e-14);
    EXPECT_NEAR(p.at(3.5).value, 0.75, 1e-9);
    EXPECT_NEAR(p.at(4.5).value, 0.25, 1e-9);
    EXPECT_EQ(p.at(5.001).value, 0.0);
    const ForceModel linear = with_ratio(0.25, 0.5, two_long());
    EXPECT_NEAR(linear.memory()->ratio().at(-4.0).value, 0.5, 1e-14);
    EXPECT_NEAR(linear.memory()->ratio().at(9.0).value, 1.0, 1e-14);
}

// The coordinate changes by 1.5 over the domain, by 0.5 * 0.04 / 2 below it and by 1 * 2 / 2 above it.
TEST(Memory, LargestStretchIsTheRangeOfTheCoordinate) {
    const auto stretch = [](Continuation below, Continuation above) {
        return with_ratio(0.25, 0.5, two_long(below, above)).memory()->largest_stretch(0);
    };
    EXPECT_NEAR(stretch(Continuation::Linear, Continuation::Linear), 1.5, 1e-12);
    EXPECT_NEAR(stretch(Continuation::Free, Continuation::Linear), 1.51, 1e-12);
    EXPECT_NEAR(stretch(Continuation::Linear, Continuation::Free), 2.5, 1e-9);
    EXPECT_NEAR(stretch(Continuation::Free, Continuation::Free), 2.51, 1e-9);
    // A ratio of both signs: max|p| = 1 times the length 2
    EXPECT_NEAR(with_ratio(1.0, -1.0, two_long()).memory()->largest_stretch(0), 2.0, 1e-9);
    EXPECT_NEAR(with_ratio(-0.5, 1.2, two_long()).memory()->largest_stretch(0), 1.4, 1e-9);
    const ForceModel free = with_ratio(0.25, 0.5, two_long(Continuation::Free, Continuation::Free));
    EXPECT_NEAR(free.memory()->largest_energy(), 0.5 * 3.0 * 2.51 * 2.51, 1e-8);
    // A sudden motion through all positions reaches the bound before the tool is away, above 5.
    const auto object = force_of(free, 1e-3);
    auto state = object.start(-9.0);
    object.advance(4.9999, state);
    EXPECT_NEAR(state.stretch[0], 2.51, 1e-8);
    object.advance(9.0, state);
    EXPECT_EQ(state.stretch[0], 0.0);
}

TEST(Memory, BoundsOfTheRatioAreTight) {
    Random random{28};
    for (int k = 0; k < cases(20); ++k) {
        const Domain domain = two_long(random_side(random), random_side(random));
        const ForceModel model =
            ForceModel{test::random_network(random, 2), domain}.with_memory(random_memory(random));
        const MemoryNetwork& memory = *model.memory();
        double largest = 0.0;
        double steepest = 0.0;
        for (int j = -4'000; j <= 8'000; ++j) {
            const Curve p = memory.ratio().at(1.0 + j * 5e-4);
            largest = std::max(largest, std::abs(p.value));
            steepest = std::max(steepest, std::abs(p.slope));
        }
        EXPECT_GE(memory.largest_ratio(), largest - 1e-9);
        EXPECT_LE(memory.largest_ratio(), 1.011 * largest);
        EXPECT_GE(memory.steepest_ratio(), steepest - 1e-6);
        EXPECT_LE(memory.steepest_ratio(), 1.011 * steepest + 1e-9);
    }
}

TEST(Memory, ToolCanLeaveAnObjectWithAFreeSide) {
    const auto contact = [](Continuation below, Continuation above) {
        return with_ratio(0.25, 0.5, two_long(below, above)).memory()->contact();
    };
    EXPECT_FALSE(contact(Continuation::Linear, Continuation::Linear));
    EXPECT_TRUE(contact(Continuation::Free, Continuation::Linear));
    EXPECT_TRUE(contact(Continuation::Linear, Continuation::Free));
    EXPECT_TRUE(contact(Continuation::Free, Continuation::Free));
}

/// Returns a memory with the largest number of branches, all different, and a ratio that is not constant.
MemoryParameters eight_branches() {
    MemoryParameters memory;
    memory.ratio = {1, {6.0}, {0.5}, {0.4}, {0.3}, 1.2};
    for (int j = 0; j < 8; ++j) {
        memory.stiffness.push_back(0.5 + j);
        memory.time_constant_s.push_back(0.01 * (1.0 + j * j));
    }
    return memory;
}

/// Checks force and energy of a sample against the sums over eight branches.
void expect_sums(const ForceModel& model, double x, const EnvironmentSample& sample,
                 const std::array<double, most_branches>& stretch) {
    const Curve g = model.network()->curve().at(x);
    double force = 0.0;
    double energy = 0.0;
    for (std::size_t j = 0; j < 8; ++j) {
        const double k = model.memory()->parameters().stiffness[j];
        force += k * stretch[j];
        energy += k * stretch[j] * stretch[j] / 2.0;
    }
    EXPECT_NEAR(sample.force, g.value + model.memory()->ratio().at(x).value * force, 1e-12);
    EXPECT_NEAR(sample.energy, g.integral + energy, 1e-12);
    EXPECT_EQ(sample.extrapolated, x < 0.0 || x > 1.0);
}

// Each step is the solution of the implicit equation (e - e_before - du) / T = -e / tau. The state behind the moved one
// in memory is not changed.
TEST(Memory, StepsOfAPeriodSolveTheImplicitEquation) {
    Random random{29};
    const ForceModel model =
        ForceModel{test::random_network(random, 2), test::unit_domain()}.with_memory(eight_branches());
    constexpr double period_s = 0.02;
    const auto object = force_of(model, period_s);
    const NetworkCurve& ratio = model.memory()->ratio();
    std::array<MemoryForce<NetworkCurve>::State, 2> states{object.start(0.4), {}};
    states[1].coordinate = 5.0;
    double from = 0.4;
    for (int k = 0; k < 50; ++k) {
        const double x = uniform(random, -0.1, 1.1);
        const auto before = states[0].stretch;
        const EnvironmentSample trial = object.at(x, states[0]);
        const EnvironmentSample sample = object.move(x, states[0]);
        EXPECT_EQ(trial.force, sample.force);
        EXPECT_EQ(trial.slope, sample.slope);
        EXPECT_EQ(trial.energy, sample.energy);
        const double moved = ratio.at(x).integral - ratio.at(from).integral;
        for (std::size_t j = 0; j < 8; ++j) {
            const double e = states[0].stretch[j];
            EXPECT_NEAR((e - before[j] - moved) / period_s,
                        -e / model.memory()->parameters().time_constant_s[j], 1e-9);
        }
        expect_sums(model, x, sample, states[0].stretch);
        EXPECT_EQ(states[1].coordinate, 5.0);
        from = x;
    }
}

// The reference integrates de/dt = du/dt - e / tau with the midpoint method in 1000 steps. The slope is compared with
// differences.
TEST(Memory, RecordedMotionIsTheSolutionOfTheDifferentialEquation) {
    Random random{30};
    const ForceModel model =
        ForceModel{test::random_network(random, 2), test::unit_domain()}.with_memory(eight_branches());
    const auto object = force_of(model, 1e-3);
    const NetworkCurve& ratio = model.memory()->ratio();
    std::array<MemoryForce<NetworkCurve>::State, 2> states{object.start(0.4), {}};
    states[1].coordinate = 5.0;
    double from = 0.4;
    for (int k = 0; k < 30; ++k) {
        const double x = uniform(random, 0.05, 0.95);
        const double seconds = uniform(random, 0.001, 0.05);
        const auto before = states[0];
        const auto recorded = object.move_for(x, seconds, states[0]);
        EXPECT_EQ(recorded.factor, 1.0);
        const double moved = ratio.at(x).integral - ratio.at(from).integral;
        for (std::size_t j = 0; j < 8; ++j) {
            const double tau = model.memory()->parameters().time_constant_s[j];
            const double step = seconds / 1000.0;
            double e = before.stretch[j];
            for (int i = 0; i < 1000; ++i) {
                const double middle = e + 0.5 * step * (moved / seconds - e / tau);
                e += step * (moved / seconds - middle / tau);
            }
            EXPECT_NEAR(states[0].stretch[j], e, 1e-5);
        }
        expect_sums(model, x, recorded.sample, states[0].stretch);
        EXPECT_EQ(states[1].coordinate, 5.0);
        const auto force_near = [&](double h) {
            auto state = before;
            return object.move_for(x + h, seconds, state).sample.force;
        };
        const double slope = (force_near(1e-6) - force_near(-1e-6)) / 2e-6;
        EXPECT_NEAR(recorded.sample.slope, slope, 1e-5 * (1.0 + std::abs(slope)));
        from = x;
    }
}

TEST(Memory, SuddenRecordedMotionStretchesEachBranchByTheMotion) {
    const ForceModel model = standard_linear_solid(3.0, 5.0, 0.4);
    const auto object = force_of(model, 1e-3);
    auto state = object.start(0.2);
    EXPECT_DOUBLE_EQ(object.move_for(0.5, 0.0, state).sample.force, 1.5 + 5.0 * 0.3);
    EXPECT_DOUBLE_EQ(state.stretch[0], 0.3);
    EXPECT_DOUBLE_EQ(object.move_for(0.5, 0.0, state).sample.slope, 8.0);
}

// All stretches are multiplied by one factor from 0 to 1, so that the force is at its limit.
TEST(Memory, LimitedForceReducesAllStretchesByOneFactor) {
    Random random{31};
    int limited = 0;
    int released = 0;
    for (int k = 0; k < cases(200); ++k) {
        const Domain domain = test::unit_domain(random_side(random), random_side(random));
        const ForceModel model =
            ForceModel{test::random_network(random, 2), domain}.with_memory(eight_branches());
        const double limit = uniform(random, 0.5, 3.0);
        const auto object = force_of(model, 1e-3, limit);
        constexpr double seconds = 0.01;
        const double first = uniform(random, 0.0, 1.0);
        const double x = uniform(random, 0.0, 1.0);
        std::array<MemoryForce<NetworkCurve>::State, 2> states{object.start(first), {}};
        states[1].coordinate = 5.0;
        const auto recorded = object.move_for(x, seconds, states[0]);
        const Curve g = model.network()->curve().at(x);
        const Curve p = model.memory()->ratio().at(x);
        double branches = 0.0;
        double reduced = 0.0;
        double stored = 0.0;
        for (std::size_t j = 0; j < 8; ++j) {
            const double stiffness = model.memory()->parameters().stiffness[j];
            const double tau = model.memory()->parameters().time_constant_s[j];
            const double moved = states[0].coordinate - object.start(first).coordinate;
            const double e = moved * tau / seconds * (1.0 - std::exp(-seconds / tau));
            branches += stiffness * e;
            reduced += stiffness * states[0].stretch[j];
            stored += 0.5 * stiffness * states[0].stretch[j] * states[0].stretch[j];
            EXPECT_NEAR(states[0].stretch[j], recorded.factor * e, 1e-12);
        }
        const double rest = std::clamp(g.value, -limit, limit);
        const double least = model.memory()->contact() > 0 ? std::min(rest, 0.0) : -limit;
        const double most = model.memory()->contact() < 0 ? std::max(rest, 0.0) : limit;
        const double expected = std::clamp(rest + p.value * branches, least, most);
        EXPECT_NEAR(recorded.sample.force, expected, 1e-12) << k;
        EXPECT_NEAR(recorded.sample.force, rest + p.value * reduced, 1e-12) << k;
        EXPECT_NEAR(recorded.sample.energy, g.integral + stored, 1e-12) << k;
        EXPECT_GE(recorded.factor, 0.0);
        EXPECT_LE(recorded.factor, 1.0);
        EXPECT_EQ(recorded.sample.slope == 0.0, recorded.factor < 1.0) << k;
        EXPECT_EQ(states[1].coordinate, 5.0);
        limited += recorded.factor < 1.0 ? 1 : 0;
        released += recorded.factor < 1.0 && least == 0.0 && expected == 0.0 && rest > 1.0 ? 1 : 0;
    }
    EXPECT_GT(limited, 20);
    EXPECT_GT(released, 0) << "a fast release of an object that pushes with more than 1 N at rest";
}

TEST(Memory, RefusesWrongParametersByName) {
    const auto refusal = [](const MemoryParameters& memory, const Domain& domain = test::unit_domain()) {
        return test::refusal([&] { validate(memory, domain); });
    };
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    constexpr double infinity = std::numeric_limits<double>::infinity();
    EXPECT_EQ(refusal(one_branch(0.0, 1.0)), "");
    EXPECT_EQ(refusal(one_branch(1.0, std::numeric_limits<double>::denorm_min())), "");
    EXPECT_EQ(refusal(one_branch(-1.0, 1.0)), "stiffness[0] is -1.000000, must be >= 0");
    EXPECT_EQ(refusal(one_branch(infinity, 1.0)), "stiffness[0] is inf, must be >= 0");
    EXPECT_EQ(refusal(one_branch(nan, 1.0)), "stiffness[0] is nan, must be >= 0");
    EXPECT_EQ(refusal(one_branch(1.0, 0.0)), "time_constant_s[0] is 0.000000, must be > 0");
    EXPECT_EQ(refusal(one_branch(1.0, infinity)), "");
    EXPECT_EQ(refusal(one_branch(1.0, nan)), "time_constant_s[0] is nan, must be > 0");
    MemoryParameters memory = eight_branches();
    EXPECT_EQ(refusal(memory), "");
    memory.stiffness[7] = -1.0;
    EXPECT_EQ(refusal(memory), "stiffness[7] is -1.000000, must be >= 0");
    memory.stiffness.push_back(1.0);
    EXPECT_EQ(refusal(memory), "stiffness has 9 values, must have 1 to 8");
    memory.stiffness = {1.0, 2.0};
    EXPECT_EQ(refusal(memory), "time_constant_s has 8 values, must have 2");
    EXPECT_EQ(refusal(MemoryParameters{}), "stiffness has 0 values, must have 1 to 8");
    memory = one_branch(1.0, 1.0);
    memory.yield_stretch = {0.0};
    EXPECT_EQ(refusal(memory), "yield_stretch[0] is 0.000000, must be > 0");
    memory.yield_stretch = {nan};
    EXPECT_EQ(refusal(memory), "yield_stretch[0] is nan, must be > 0");
    memory.yield_stretch = {1.0, 1.0};
    EXPECT_EQ(refusal(memory), "yield_stretch has 2 values, must have 1");
    memory.yield_stretch = {infinity};
    EXPECT_EQ(refusal(memory), "");
    memory = one_branch(1.0, 1.0);
    memory.ratio.bias = nan;
    EXPECT_EQ(refusal(memory), "bias is not a finite number");
    memory.ratio = {2, {}, {}, {}, {1.0, 1.0}, 1.0};
    EXPECT_EQ(refusal(memory, {{0.0, 0.0}, {1.0, 1.0}, {}, {}, std::nullopt}),
              "the network has 2 inputs, must have 1");
    EXPECT_EQ(refusal(one_branch(1.0, 1.0), {{0.0}, {1.0}, {}, {}, 1.0}),
              "period is set, but a force with memory cannot be periodic");
    // The loop over the branches ends at the last one: the memory behind it contains an invalid number.
    memory = one_branch(1.0, 1.0);
    memory.stiffness.reserve(2);
    memory.stiffness.push_back(-1.0);
    memory.stiffness.pop_back();
    EXPECT_EQ(refusal(memory), "");
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
