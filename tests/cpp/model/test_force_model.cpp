// SPDX-License-Identifier: Apache-2.0
#include "palpate/model/force_model.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "palpate/fields/readable.hpp"
#include "support.hpp"

namespace palpate {
namespace {

const Domain one_input{{1.0}, {3.0}, {}, {}, std::nullopt};
const Domain two_inputs{{1.0, -1.0}, {3.0, 1.0}, {}, {}, std::nullopt};
const NetworkParameters spring{1, {}, {}, {}, {2.0}, 0.1};
const NetworkParameters plane{2, {}, {}, {}, {2.0, 0.5}, 0.1};

ForceModel with_hysteresis(std::optional<double> play_radius) {
    return {spring, {{}, 0.3, 0.4}, one_input, play_radius};
}

MemoryParameters memory_of(const NetworkParameters& ratio) {
    return {ratio, {2.0}, {0.1}};
}

TEST(ForceModel, HasExactlyOneKind) {
    const ForceModel position{spring, one_input};
    const ForceModel pair = with_hysteresis(0.1);
    const ForceModel positions{plane, two_inputs};
    const ForceModel moving = ForceModel::of_velocity(plane, two_inputs);
    EXPECT_NE(position.network(), nullptr);
    EXPECT_NE(pair.hysteresis(), nullptr);
    EXPECT_NE(moving.velocity(), nullptr);
    EXPECT_EQ(moving.radial(), &moving.velocity()->network());
    EXPECT_EQ(positions.radial(), std::get_if<RadialNetwork>(&positions.kind()));
    for (const auto* model : {&pair, &positions, &moving}) {
        EXPECT_EQ(model->network(), nullptr);
    }
    for (const auto* model : {&position, &positions, &moving}) {
        EXPECT_EQ(model->hysteresis(), nullptr);
    }
    for (const auto* model : {&position, &pair, &positions}) {
        EXPECT_EQ(model->velocity(), nullptr);
    }
    for (const auto* model : {&position, &pair}) {
        EXPECT_EQ(model->radial(), nullptr);
        EXPECT_EQ(model->parameters().linear, spring.linear);
        EXPECT_EQ(model->domain().upper, one_input.upper);
        EXPECT_NO_THROW(require_renderable(*model));
    }
    for (const auto* model : {&positions, &moving}) {
        EXPECT_EQ(model->parameters().linear, plane.linear);
        EXPECT_EQ(model->domain().lower, two_inputs.lower);
    }
    EXPECT_NO_THROW(require_renderable(moving));
    EXPECT_EQ(test::refusal([&] { require_renderable(positions); }), "the network has 2 inputs, must have 1");
    EXPECT_EQ(test::refusal([&] { (void)positions.slope_bounds(); }),
              "the network has 2 inputs, must have 1");
}

// For straight lines the bounds have formulas: g' = 2, h' = 0.3 and max h = h(3) = 1.3.
TEST(ForceModel, SlopeBoundsIncludePressReleaseAndSticking) {
    const auto expect = [](Interval bounds, double lower, double upper) {
        EXPECT_NEAR(bounds.lower, lower, 1e-12);
        EXPECT_NEAR(bounds.upper, upper, 1e-12);
    };
    expect(ForceModel{spring, one_input}.slope_bounds(), 2.0, 2.0);
    expect(ForceModel{spring, one_input}.slope_bounds(0.1), 2.0, 2.0);
    expect(ForceModel::of_velocity(plane, two_inputs).slope_bounds(), 2.0, 2.0);
    expect(with_hysteresis(0.2).slope_bounds(), 1.7, 2.3);
    expect(with_hysteresis(std::nullopt).slope_bounds(0.1), 1.7, 2.3 + 13.0);
}

TEST(ForceModel, SlopeBoundsOfAVelocityForceAreTight) {
    test::Random random{71};
    for (int k = 0; k < test::cases(20); ++k) {
        NetworkParameters network = test::random_network(random, 5, 2);
        for (double& alpha : network.alpha) {
            alpha = std::min(alpha, 20.0);
        }
        const ForceModel model =
            ForceModel::of_velocity(network, {{0.0, -1.0}, {1.0, 1.0}, {}, {}, std::nullopt});
        Interval sampled{1e300, -1e300};
        for (int j = 0; j <= 5'000; ++j) {
            std::array<double, 2> gradient{};
            (void)model.radial()->at(std::array{j / 5e3, 0.0}, gradient);
            sampled = sampled.with({gradient[0], gradient[0]});
        }
        const Interval bounds = model.slope_bounds();
        const double slack = 0.0101 * sampled.largest();
        EXPECT_LE(bounds.lower, sampled.lower + 1e-9);
        EXPECT_GE(bounds.upper, sampled.upper - 1e-9);
        EXPECT_GE(bounds.lower, sampled.lower - slack);
        EXPECT_LE(bounds.upper, sampled.upper + slack);
    }
}

TEST(ForceModel, StoredSlopeBoundsMayDifferByOnePercentOfTheSteepestSlope) {
    const ForceModel model = with_hysteresis(std::nullopt);
    const Interval own = model.slope_bounds();
    const double slack = 0.01 * own.largest();
    EXPECT_NEAR(slack, 0.023, 1e-12);
    const auto message = [&](double lower, double upper) {
        return test::refusal([&] { model.require_slopes_within({lower, upper}); });
    };
    EXPECT_EQ(message(own.lower, own.upper), "");
    EXPECT_EQ(message(-1e9, 1e9), "");
    const auto refused_min = [](double stored, double bound) {
        return "slope_bounds.min is " + readable(stored) + ": must be at most " + readable(bound) +
               ", the bound of this network's slope";
    };
    const auto refused_max = [](double stored, double bound) {
        return "slope_bounds.max is " + readable(stored) + ": must be at least " + readable(bound) +
               ", the bound of this network's slope";
    };
    EXPECT_EQ(message(own.lower + 0.999 * slack, own.upper - 0.999 * slack), "");
    const double most = own.lower + 1.001 * slack;
    EXPECT_EQ(message(most, own.upper), refused_min(most, own.lower));
    const double fewest = own.upper - 1.001 * slack;
    EXPECT_EQ(message(own.lower, fewest), refused_max(fewest, own.upper));
    // The bounds of a constant force are exactly 0, so that only 0 is accepted.
    const ForceModel constant{{1, {}, {}, {}, {0.0}, 0.5}, one_input};
    EXPECT_EQ(test::refusal([&] { constant.require_slopes_within({0.0, 0.0}); }), "");
    EXPECT_EQ(test::refusal([&] { constant.require_slopes_within({1e-300, 0.0}); }),
              refused_min(1e-300, 0.0));
    EXPECT_EQ(test::refusal([&] { constant.require_slopes_within({0.0, -1e-300}); }),
              refused_max(-1e-300, 0.0));
    EXPECT_EQ(test::refusal([] { ForceModel{plane, two_inputs}.require_slopes_within({5.0, 4.0}); }), "");
    EXPECT_EQ(
        test::refusal([] { ForceModel::of_velocity(plane, two_inputs).require_slopes_within({5.0, 4.0}); }),
        "");
}

TEST(ForceModel, FinestWidthIncludesTheRatioOfTheMemory) {
    EXPECT_EQ((ForceModel{spring, one_input}.finest_width()), 2.0);
    const ForceModel model{{1, {4.0}, {2.0}, {0.5}, {2.0}, 0.0}, one_input};
    EXPECT_EQ(model.finest_width(), 0.25);
    EXPECT_EQ(model.with_memory(memory_of({1, {}, {}, {}, {0.0}, 1.0})).finest_width(), 0.25);
    EXPECT_EQ(model.with_memory(memory_of({1, {8.0}, {2.0}, {0.5}, {0.0}, 1.0})).finest_width(), 0.125);
}

TEST(ForceModel, OnlyAForceOfPositionCanHaveAMemory) {
    const MemoryParameters memory = memory_of({1, {}, {}, {}, {0.0}, 1.0});
    const ForceModel position{spring, one_input};
    EXPECT_EQ(position.memory(), nullptr);
    const ForceModel relaxing = position.with_memory(memory);
    ASSERT_NE(relaxing.memory(), nullptr);
    EXPECT_EQ(relaxing.memory()->parameters().stiffness, memory.stiffness);
    EXPECT_EQ(relaxing.parameters().linear, spring.linear);
    EXPECT_EQ(position.memory(), nullptr) << "the first model is not changed";
    for (const ForceModel& model : {with_hysteresis(0.1), ForceModel{plane, two_inputs}}) {
        EXPECT_EQ(test::refusal([&] { (void)model.with_memory(memory); }),
                  "only a force of position without hysteresis can have a memory");
    }
}

TEST(ForceModel, PlayRadiusIsUsualUnlessItIsGiven) {
    const ForceModel unset = with_hysteresis(std::nullopt);
    EXPECT_EQ(unset.play_radius(), std::nullopt);
    EXPECT_DOUBLE_EQ(unset.hysteresis()->play_radius(), 0.02) << "1 % of the domain";
    const ForceModel set = unset.with_play_radius(0.3);
    EXPECT_EQ(set.play_radius(), 0.3);
    EXPECT_EQ(set.hysteresis()->play_radius(), 0.3);
    for (const double x : {0.5, 1.0, 2.2, 3.5}) {
        EXPECT_EQ(set.hysteresis()->sliding(x, 0.7).force, unset.hysteresis()->sliding(x, 0.7).force);
    }
    const ForceModel position{spring, one_input};
    EXPECT_EQ(position.with_play_radius(0.3).play_radius(), std::nullopt);
    EXPECT_NE(position.with_play_radius(0.3).network(), nullptr);
}

TEST(ForceModel, HysteresisNeedsADomainOfOneInput) {
    const auto message = [](const Domain& domain) {
        return test::refusal([&] { (void)ForceModel{spring, {{}, 0.3, 0.4}, domain, 0.1}; });
    };
    EXPECT_EQ(message(one_input), "");
    const std::string refused = "a hysteresis network has one input";
    EXPECT_EQ(message(two_inputs), refused);
    EXPECT_EQ(message({{1.0, 2.0}, {3.0}, {}, {}, std::nullopt}), refused);
    EXPECT_EQ(message({{1.0}, {3.0, 4.0}, {}, {}, std::nullopt}), refused);
}

}  // namespace
}  // namespace palpate
