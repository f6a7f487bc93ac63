// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/stability/direct_inequalities.hpp"
#include "palpate/stability/predicted_force.hpp"

namespace palpate {
namespace {

/// Period of the devices, not 1 [s]
constexpr double period = 0.5;

/// Returns a device whose delay and jitter are given in periods.
DeviceProfile late_device(double delay, double jitter = 0.0) {
    DeviceProfile profile;
    profile.period_s = period;
    profile.delay_s = delay * period;
    profile.jitter_s = jitter * period;
    return profile;
}

/// Returns the position error of a prediction from m samples that is `whole` samples late, for these positions. The
/// last position is the one of the handle.
double position_error(const std::vector<double>& x, int whole, int m) {
    const std::size_t read = x.size() - 1 - static_cast<std::size_t>(whole);
    double mean = 0.0;
    for (int j = 1; j <= m; ++j) {
        mean += x[read - static_cast<std::size_t>(j)] / m;
    }
    return x.back() - (x[read] + (x[read] - mean) / (m + 1));
}

TEST(PredictedForce, TapsGiveThePositionErrorOfEveryMotion) {
    std::mt19937 random{3};
    std::normal_distribution<double> normal;
    for (int whole = 0; whole <= 3; ++whole) {
        for (const int m : {1, 2, 5, 16}) {
            const std::vector<double> taps = prediction_taps(whole, m);
            ASSERT_EQ(taps.size(), static_cast<std::size_t>(whole + m));
            std::vector<double> x(25);
            for (double& position : x) {
                position = normal(random);
            }
            double filtered = 0.0;
            for (std::size_t j = 1; j <= taps.size(); ++j) {
                filtered += taps[j - 1] * (x[x.size() - j] - x[x.size() - 1 - j]);
            }
            EXPECT_NEAR(filtered, position_error(x, whole, m), 1e-13) << whole << " " << m;
        }
    }
    EXPECT_EQ(prediction_taps(2, 0), (std::vector<double>{1.0, 1.0}));
}

// Each reading is wrong by at most one unit; the largest error of the predicted position is the sum of the absolute
// weights of the readings.
TEST(PredictedForce, EncoderGainIsTheSumOfTheAbsoluteWeights) {
    for (int m = 1; m <= 16; ++m) {
        const double last = 1.0 + 1.0 / (m + 1);
        const double before = m * (1.0 / m / (m + 1));
        EXPECT_DOUBLE_EQ(predicted_encoder_gain(m), last + before) << m;
    }
    EXPECT_EQ(predicted_encoder_gain(0), 1.0);
}

TEST(PredictedForce, NeedOfAnyForceIsThatOfTheUnpredictedForcePlusHalfASlope) {
    for (const SlopeRange slopes : {SlopeRange{1.0, 0.0}, {0.5, 3.0}, {2.0, 2.0}}) {
        for (const double delay : {0.0, 0.5, 1.0}) {
            EXPECT_DOUBLE_EQ(
                predicted_path_need(late_device(delay), slopes),
                device_need(late_device(delay), slopes) + std::max(slopes.rising, slopes.falling) / 2.0);
        }
    }
}

TEST(PredictedForce, WholeDelayNeedsThatOfTheFilterOrOfThePath) {
    for (const SlopeRange slopes : {SlopeRange{1.0, 0.0}, {0.5, 3.0}, {1.0, 1.0}, {0.0, 1.0}}) {
        for (int whole = 0; whole <= 2; ++whole) {
            for (const int m : {1, 4}) {
                const double expected = std::min(filtered_need(prediction_taps(whole, m), slopes),
                                                 predicted_path_need(late_device(whole), slopes));
                EXPECT_EQ(predicted_need(late_device(whole), m, slopes), expected) << whole << " " << m;
            }
        }
        // Without delay, jitter does not change the ratio of damping and longest period.
        EXPECT_EQ(predicted_need(late_device(0.0, 0.3), 2, slopes),
                  predicted_need(late_device(0.0), 2, slopes));
        EXPECT_EQ(predicted_need(late_device(0.0, 1.5), 2, slopes),
                  predicted_need(late_device(0.0), 2, slopes));
    }
}

TEST(PredictedForce, WithoutASlopeOrABoundTheSimpleNeedRemains) {
    const double infinite = std::numeric_limits<double>::infinity();
    EXPECT_EQ(predicted_need(late_device(0.5), 2, {0.0, 0.0}), 0.0);
    EXPECT_EQ(predicted_need(late_device(0.5), 2, {infinite, 0.0}), infinite);
    EXPECT_EQ(predicted_need(late_device(0.0), 2, {infinite, 0.0}), infinite);
}

/// Returns the need of a force that changes within a sample: the parts of a sample before and after the change last at
/// most `first` and `rest` periods of the longest length.
double split_need(int whole, int m, SlopeRange slopes, double first, double rest) {
    const std::vector<double> taps = prediction_taps(whole, m);
    return std::max(filtered_need(taps, slopes), filtered_need(taps, first, slopes, rest));
}

TEST(PredictedForce, FractionOfASampleSplitsTheSample) {
    for (const SlopeRange slopes : {SlopeRange{1.0, 0.2}, {0.2, 1.0}}) {
        for (const double delay : {0.25, 1.25}) {
            const int whole = static_cast<int>(delay);
            const double expected = std::min(split_need(whole, 2, slopes, 0.25, 0.75),
                                             predicted_path_need(late_device(delay), slopes));
            EXPECT_DOUBLE_EQ(predicted_need(late_device(delay), 2, slopes), expected) << delay;
        }
    }
}

TEST(PredictedForce, JitterMakesBothPartsOfASampleLonger) {
    for (const SlopeRange slopes : {SlopeRange{1.0, 0.2}, {0.2, 1.0}}) {
        const auto expected = [&](double delay, double jitter, double first, double rest) {
            return std::min(split_need(static_cast<int>(delay), 2, slopes, first, rest),
                            predicted_path_need(late_device(delay, jitter), slopes));
        };
        // The force of a late sample acts before the next sample. The first part lasts as long as the delay, the
        // second part at most from the end of the delay to the latest next sample.
        EXPECT_DOUBLE_EQ(predicted_need(late_device(0.5, 0.25), 2, slopes),
                         expected(0.5, 0.25, 0.5 / 1.25, 0.75 / 1.25));
        EXPECT_DOUBLE_EQ(predicted_need(late_device(0.75, 0.25), 2, slopes),
                         expected(0.75, 0.25, 0.75 / 1.25, 0.5 / 1.25));
        // With a whole sample of delay both instants, of the sample and of the force, can be late.
        EXPECT_DOUBLE_EQ(predicted_need(late_device(1.5, 0.125), 2, slopes),
                         expected(1.5, 0.125, 0.625 / 1.125, 0.625 / 1.125));
        EXPECT_DOUBLE_EQ(predicted_need(late_device(1.25, 0.25), 2, slopes),
                         expected(1.25, 0.25, 0.5 / 1.25, 1.0 / 1.25));
        EXPECT_DOUBLE_EQ(predicted_need(late_device(1.75, 0.25), 2, slopes),
                         expected(1.75, 0.25, 1.0 / 1.25, 0.5 / 1.25));
    }
}

TEST(PredictedForce, JitterBeyondASampleRoundsTheDelay) {
    for (const SlopeRange slopes : {SlopeRange{1.0, 0.2}, {0.2, 1.0}}) {
        const auto expected = [&](double delay, double jitter, int nearest) {
            return std::min(
                detail::roughly_filtered_need(prediction_taps(nearest, 2), 5.0 / 3.0,
                                              detail::uncertain_time(delay, 1.0, jitter, nearest), slopes),
                predicted_path_need(late_device(delay, jitter), slopes));
        };
        EXPECT_DOUBLE_EQ(predicted_need(late_device(0.875, 0.0625 * 3), 2, slopes),
                         expected(0.875, 0.0625 * 3, 1));
        EXPECT_DOUBLE_EQ(predicted_need(late_device(1.0, 0.001), 2, slopes), expected(1.0, 0.001, 1));
        EXPECT_DOUBLE_EQ(predicted_need(late_device(1.0625, 0.125), 2, slopes), expected(1.0625, 0.125, 1));
        EXPECT_DOUBLE_EQ(predicted_need(late_device(1.9375, 0.125), 2, slopes), expected(1.9375, 0.125, 2));
        EXPECT_LT(expected(1.0, 0.001, 1), predicted_path_need(late_device(1.0, 0.001), slopes));
        for (const double jitter : {1.0, 1.5}) {
            EXPECT_EQ(predicted_need(late_device(1.0, jitter), 2, slopes),
                      predicted_path_need(late_device(1.0, jitter), slopes));
        }
    }
}

}  // namespace
}  // namespace palpate
