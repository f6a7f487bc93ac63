// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "limits/trials.hpp"
#include "palpate/rendering/direct.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/run/session_text.hpp"
#include "palpate/simulation/closed_loop.hpp"
#include "support.hpp"

namespace palpate {
namespace {

using bench::ConstantHysteresis;
using test::Spring;

TEST(Prediction, AdvancesARampByHalfASampleForEveryNumberOfTaps) {
    for (int m = 1; m <= most_prediction_taps; ++m) {
        HalfSamplePrediction prediction{m};
        prediction.reset(3.0);
        for (int k = 0; k < 40; ++k) {
            const double x = 3.0 - 0.25 * k;
            if (k >= m) {
                EXPECT_NEAR(prediction.ahead(x), x - 0.125, 1e-15) << m << " taps, tick " << k;
            }
            prediction.advance(x);
        }
    }
}

TEST(Prediction, MeanFormulaEqualsWeightedStepsFromTheFirstTick) {
    test::Random random{11};
    for (const int m : {1, 2, 3, 8, 16}) {
        HalfSamplePrediction prediction{m};
        std::vector<double> x{0.4};  // positions; the handle rests at 0.4 before the first tick
        prediction.reset(x[0]);
        for (int k = 0; k < 40; ++k) {
            const double now = x.back() + (k == 0 ? 0.0 : test::uniform(random, -1.0, 1.0));
            x.push_back(now);
            const auto past = [&](int j) {
                return x[static_cast<std::size_t>(std::max<int>(0, static_cast<int>(x.size()) - 1 - j))];
            };
            double mean = 0.0;
            double steps = 0.0;
            for (int j = 1; j <= m; ++j) {
                mean += past(j) / m;
                steps += prediction_weight(m, j) * (past(j - 1) - past(j));
            }
            EXPECT_NEAR(prediction.ahead(now), now + (now - mean) / (m + 1), 1e-14);
            EXPECT_NEAR(prediction.ahead(now), now + steps, 1e-14);
            prediction.advance(now);
        }
    }
}

/// Returns the damping that a prediction adds to the need of a spring, divided by K T: max over theta of -Re of sum
/// v_j z^-j at frequency theta, with the filter taps v_j.
double largest_advance(const std::vector<double>& v) {
    double largest = -1.0;
    for (int k = 0; k <= 2000; ++k) {
        double real = 0.0;
        for (std::size_t j = 0; j < v.size(); ++j) {
            real -= v[j] * std::cos(std::numbers::pi * k / 2000.0 * static_cast<double>(j + 1));
        }
        largest = std::max(largest, real);
    }
    return largest;
}

// With p_k = sum v_j d_{k-j} and sum v = 1/2, a spring needs K T (1/2 + max of -Re V). The minimum is 1/(2 m) by Fejer.
TEST(Prediction, WeightsNeedTheLeastDampingForTheirNumberOfTaps) {
    test::Random random{5};
    for (const int m : {1, 2, 4, 8}) {
        std::vector<double> w;
        for (int j = 1; j <= m; ++j) {
            w.push_back(prediction_weight(m, j));
        }
        const double best = largest_advance(w);
        EXPECT_NEAR(best, 0.5 / m, 1e-5);
        for (int trial = 0; trial < 200; ++trial) {
            std::vector<double> other = w;
            double sum = 0.0;
            for (double& weight : other) {
                weight += 0.1 * test::uniform(random, -1.0, 1.0);
                sum += weight;
            }
            for (double& weight : other) {
                weight += (0.5 - sum) / m;
            }
            EXPECT_GE(largest_advance(other), best - 1e-5) << m;
        }
    }
}

TEST(PredictedDirect, RendersTheForceAtThePredictedPosition) {
    PredictedDirect structure{Spring{10.0}, 4};
    structure.reset(0.5);
    EXPECT_DOUBLE_EQ(structure.step(0.5).force, 5.0);
    HalfSamplePrediction expected{4};
    expected.reset(0.5);
    expected.advance(0.5);
    for (const double x : {0.51, 0.53, 0.52, 0.5}) {
        const Rendered rendered = structure.step(x);
        EXPECT_DOUBLE_EQ(rendered.force, 10.0 * expected.ahead(x));
        EXPECT_DOUBLE_EQ(rendered.environment_position, expected.ahead(x));
        expected.advance(x);
    }
}

TEST(PredictedDirect, PositionThatIsNotFiniteGivesZeroForceAndKeepsTheState) {
    constexpr double largest = std::numeric_limits<double>::max();  // its prediction overflows
    for (const double bad :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), largest}) {
        PredictedDirect structure{ConstantHysteresis{{10.0, 0.0}, {0.0, 1.0}, 0.02}, 3};
        PredictedDirect reference = structure;
        for (const double x : {0.0, 0.01, 0.03}) {
            (void)structure.step(x);
            (void)reference.step(x);
        }
        const Rendered refused = structure.step(bad);
        EXPECT_EQ(refused.status, Status::NonFinite);
        EXPECT_EQ(refused.force, 0.0);
        for (const double x : {0.05, 0.04, 0.0}) {
            EXPECT_EQ(structure.step(x).force, reference.step(x).force);
        }
    }
}

TEST(PredictedDirect, ResetClearsThePastMotion) {
    PredictedDirect structure{ConstantHysteresis{{10.0, 0.0}, {0.0, 1.0}, 0.02}, 8};
    for (int k = 0; k < 20; ++k) {
        (void)structure.step(0.1 * k);
    }
    structure.reset(0.25);
    EXPECT_DOUBLE_EQ(structure.step(0.25).force, 2.5) << "at rest: no advance, no loss";
}

TEST(PredictedDirect, PlayFollowsTheMeasuredPosition) {
    const ConstantHysteresis object{{0.0, 0.0}, {0.0, 1.0}, 0.1};
    PredictedDirect structure{object, 1};
    structure.reset(0.0);
    // The predicted position is 0.225. The play operator follows the measured position 0.15, so it moves to 0.05; with
    // the predicted position it would move to 0.125.
    (void)structure.step(0.15);
    // Direction state: (predicted position - position 0.05 of the play operator) / play radius 0.1. The predicted
    // positions of these two ticks are 0.15 and 0.
    EXPECT_NEAR(structure.step(0.15).force, 1.0, 1e-12);
    EXPECT_NEAR(structure.step(0.05).force, -0.5, 1e-12);
    // The predicted position equals the position 0.05 of the play operator
    EXPECT_NEAR(structure.step(0.05).force, 0.0, 1e-12);
}

TEST(PredictedDirect, SchemeBuildsItForEveryModelOfPosition) {
    test::Random random{3};
    const NetworkParameters network = test::random_network(random, 8);
    const ForceModel plain{network, test::unit_domain()};
    const ForceModel lossy{network, {std::vector<double>(8, 0.0), 0.0, 0.1}, test::unit_domain(), 0.01};
    Scheme scheme;
    scheme.structure = StructureKind::Direct;
    const std::vector<double> ramp{0.1, 0.12, 0.14, 0.16, 0.18, 0.20, 0.22};
    for (const ForceModel* model : {&plain, &lossy}) {
        scheme.predict = 2;
        const double ahead = motion_driven(*model, scheme, ramp, 1e-3).back().force;
        scheme.predict = 0;
        const std::vector<double> later{0.1, 0.12, 0.14, 0.16, 0.18, 0.20, 0.22, 0.23};
        EXPECT_NEAR(ahead, motion_driven(*model, scheme, later, 1e-3).back().force, 1e-9);
    }
}

TEST(PredictedDirect, ForceOfVelocityIsRefused) {
    test::Random random{3};
    const ForceModel model = ForceModel::of_velocity(test::random_network(random, 8, 2),
                                                     {{0.0, -1.0}, {1.0, 1.0}, {}, {}, std::nullopt});
    Scheme scheme;
    scheme.structure = StructureKind::Direct;
    validate(scheme, model);
    scheme.predict = 1;
    EXPECT_THROW(validate(scheme, model), std::invalid_argument);
}

TEST(PredictedDirect, DescriptionNamesTheTaps) {
    Scheme scheme;
    scheme.structure = StructureKind::Direct;
    scheme.predict = 4;
    EXPECT_EQ(describe(scheme), "direct, predict 4");
}

}  // namespace
}  // namespace palpate
