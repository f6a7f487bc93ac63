// SPDX-License-Identifier: Apache-2.0
#include "palpate/dynamics/servo.hpp"

#include <array>
#include <cmath>
#include <optional>

#include <gtest/gtest.h>

namespace palpate::admittance_tests {
namespace {

constexpr double servo_frequency = 2.0 * 3.14159265358979323846 * 20.0;

/// Returns the deviation after steps of 1 us of the servo's equation, integrated by the midpoint rule.
ServoDeviation integrated(const Servo& servo, ServoDeviation now, double time_s) {
    const int steps = static_cast<int>(std::lround(time_s / 1e-6));
    for (int k = 0; k < steps; ++k) {
        const ServoDeviation middle{now.position + 0.5e-6 * now.velocity,
                                    now.velocity + 0.5e-6 * servo.acceleration(now)};
        now = {now.position + 1e-6 * middle.velocity, now.velocity + 1e-6 * servo.acceleration(middle)};
    }
    return now;
}

TEST(Servo, TransitionSolvesTheEquationOfTheServoForEveryDamping) {
    for (const std::optional<double> damping :
         std::array<std::optional<double>, 5>{std::nullopt, 0.3, 1.0, 1.0 + 1e-9, 2.5}) {
        const Servo servo{20.0, damping};
        const ServoDeviation start = servo.moved({}, 1.0);
        const std::array<double, 4> t = servo.transition(0.01);
        const ServoDeviation expected = integrated(servo, start, 0.01);
        EXPECT_NEAR(t[0] * start.position + t[1] * start.velocity, expected.position, 1e-6);
        EXPECT_NEAR(t[2] * start.position + t[3] * start.velocity, expected.velocity, 1e-5 * servo_frequency);
    }
}

TEST(Servo, LagIsTheAreaAboveTheStepResponse) {
    for (const std::optional<double> damping : std::array<std::optional<double>, 3>{std::nullopt, 0.3, 2.0}) {
        const Servo servo{20.0, damping};
        const std::array<double, 4> t = servo.transition(1e-5);
        ServoDeviation now = servo.moved({}, 1.0);
        double area = 0.0;
        for (int k = 0; k < 200'000; ++k) {
            const ServoDeviation next{t[0] * now.position + t[1] * now.velocity,
                                      t[2] * now.position + t[3] * now.velocity};
            area += 0.5e-5 * (now.position + next.position);
            now = next;
        }
        EXPECT_NEAR(area, servo.lag_s(), 1e-5 * servo.lag_s());
    }
}

TEST(Servo, ImpulseNormsBoundTheResponse) {
    for (const std::optional<double> damping : std::array<std::optional<double>, 3>{std::nullopt, 0.3, 2.0}) {
        const Servo servo{20.0, damping};
        const std::array<double, 4> t = servo.transition(1e-5);
        // The step response is 1 minus the deviation, so the impulse response is minus its velocity
        ServoDeviation now = servo.moved({}, 1.0);
        std::array<double, 3> sums{0.0, std::abs(now.velocity), std::abs(servo.acceleration(now))};
        for (int k = 0; k < 200'000; ++k) {
            const ServoDeviation next{t[0] * now.position + t[1] * now.velocity,
                                      t[2] * now.position + t[3] * now.velocity};
            sums[0] += std::abs(next.position - now.position);
            sums[1] += std::abs(next.velocity - now.velocity);
            sums[2] += std::abs(servo.acceleration(next) - servo.acceleration(now));
            now = next;
        }
        for (std::size_t k = 0; k < 3; ++k) {
            EXPECT_LE(sums[k], servo.impulse_norms()[k] * (1.0 + 1e-9));
        }
        EXPECT_NEAR(sums[0], servo.impulse_norms()[0], 1e-4);
    }
}

}  // namespace
}  // namespace palpate::admittance_tests
