// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <limits>
#include <numbers>
#include <vector>

#include "palpate/device/device_profile.hpp"
#include "palpate/dynamics/servo.hpp"
#include "palpate/rendering/admittance.hpp"

namespace palpate {

/// Slope that the object damping of an admittance display must outweigh at each frequency theta [N/m or N*m/rad]:
///
///     need(theta) = sigma + k_h (1/2 + Re L)^+ + b_h (-Re D1)^+ + m_h (-Re D2)^+,
///     L = sum over j >= 1 of (1 - sigma_j) z^-j,   D1 = sum of sigma'_j z^-j,   D2 = sum of sigma''_j z^-j.
///
/// Here z is e^(i theta), and sigma_j = sigma(j T - t_d) the step response of the servo at the samples. The positive
/// part (.)^+ is taken because the hand may have any stiffness, damping and mass up to k_h, b_h and m_h. `sigma` is the
/// slope that the step of the object costs. A feed-forward of a periods multiplies the commands by 1 + a (1 - 1/z).
class AdmittanceNeed {
  public:
    AdmittanceNeed(const DeviceProfile& device, double step_slope) : step_slope_{step_slope} {
        const AdmittanceDisplay display = device.admittance.value_or(AdmittanceDisplay{});
        servo_ = servo_of(display);
        limits_ = {display.hand_stiffness, display.hand_damping, display.hand_mass + display.handle_mass};
        ahead_ = display.feed_forward_s / device.period_s;
        delay_ = device.whole_delay_samples();
        transition_ = servo_.transition(device.period_s);
        first_ = after(servo_.transition((1.0 - device.delay_fraction()) * device.period_s),
                       servo_.moved({}, 1.0));
        curvature_ = curvatures();
    }

    /// Returns the need at a frequency theta, 0 <= theta <= pi.
    [[nodiscard]] double at(double theta) const noexcept { return bound(theta, 0.0); }

    /// Returns an upper bound, within about 1e-6, of the largest need(theta) - (m / T^2)(1 - cos theta) over all
    /// frequencies; `inertial` is m / T^2. The search divides intervals of theta until no frequency in an interval can
    /// exceed the largest value found by more than the tolerance. Infinite if the servo oscillates too long to be summed.
    ///
    /// At the frequency t of the largest value the derivative is zero, so the slopes w g'(t) of the sums g that are
    /// positive there add to `inertial` sin t. Taylor's formula about t then gives, with the middle m of an interval of
    /// half length h that contains t, sum of w g(t) <= sum of w (g(m) + c h^2 / 2) + (t - m) `inertial` sin t. The last
    /// term is at most `inertial` (cos(m - h) - cos t), because the sine is concave.
    [[nodiscard]] double largest(double inertial) const {
        struct Part {
            double middle, half;
        };
        constexpr double relative = 1e-6;
        constexpr int most_evaluations = 262'144;
        constexpr int first_parts = 64;
        std::vector<Part> open;
        double found = at(0.0);
        if (!std::isfinite(curvature_[0] + curvature_[1] + curvature_[2])) {
            return std::numeric_limits<double>::infinity();
        }
        for (int k = 0; k < first_parts; ++k) {
            const double half = 0.5 * std::numbers::pi / first_parts;
            open.push_back({(2 * k + 1) * half, half});
        }
        double highest = found;
        for (int evaluations = 0; !open.empty(); ++evaluations) {
            const auto [middle, half] = open.back();
            open.pop_back();
            found = std::max(found, at(middle) - inertial * (1.0 - std::cos(middle)));
            // The part of the mass falls with theta, so it is largest at the lower end of the interval
            const double sine = std::sin(0.5 * (middle - half));
            const double above = bound(middle, half) - 2.0 * inertial * sine * sine;
            const double tolerance = relative * std::max(std::abs(found), step_slope_ + limits_[0]);
            if (above <= found + tolerance || evaluations >= most_evaluations) {
                highest = std::max(highest, above);
            } else {
                open.push_back({middle + 0.5 * half, 0.5 * half});
                open.push_back({middle - 0.5 * half, 0.5 * half});
            }
        }
        return std::max(highest, found);
    }

    /// Returns the least m / T^2 for which the largest need(theta) - (m / T^2)(1 - cos theta) is that at theta = 0,
    /// which no mass reduces; from samples of theta.
    [[nodiscard]] double least_inertial() const noexcept {
        constexpr int frequencies = 4096;
        double least = 0.0;
        for (int k = 1; k <= frequencies; ++k) {
            const double theta = std::numbers::pi * k / frequencies;
            least = std::max(least, (at(theta) - at(0.0)) / (1.0 - std::cos(theta)));
        }
        return least;
    }

  private:
    /// Returns the need at theta with 1/2 c half^2 added to each of the three sums; c is the bound of the sum's second
    /// derivative. For `half` = 0 this is the need itself.
    [[nodiscard]] double bound(double theta, double half) const noexcept {
        using Complex = std::complex<double>;
        const Complex back = std::polar(1.0, -theta);
        Complex waiting = 0.0;
        Complex power = back;
        for (int j = 0; j < delay_; ++j) {
            waiting += power;
            power *= back;
        }
        // The deviations after the delay are a geometric series: the sum is (1 - transition / z)^-1 of the first one
        const auto& a = transition_;
        const Complex position_left = 1.0 - a[0] * back;
        const Complex velocity_left = 1.0 - a[3] * back;
        const Complex determinant = position_left * velocity_left - a[1] * a[2] * back * back;
        const Complex x =
            power * (first_.position * velocity_left + a[1] * first_.velocity * back) / determinant;
        const Complex v =
            power * (a[2] * first_.position * back + first_.velocity * position_left) / determinant;
        const Complex forward = 1.0 + ahead_ * (1.0 - back);
        // The deviations are 1 - sigma, so the sums of their derivatives are -D1 and -D2
        const std::array<Complex, 3> sums{
            0.5 + forward * (waiting + x) - ahead_ * back, forward * v,
            forward * (servo_.acceleration({1.0, 0.0}) * x + servo_.acceleration({0.0, 1.0}) * v)};
        double need = step_slope_;
        for (std::size_t k = 0; k < sums.size(); ++k) {
            const double highest = sums[k].real() + (half > 0.0 ? 0.5 * curvature_[k] * half * half : 0.0);
            need += limits_[k] == 0.0 ? 0.0 : limits_[k] * std::max(0.0, highest);
        }
        return need;
    }

    [[nodiscard]] static ServoDeviation after(const std::array<double, 4>& transition,
                                              const ServoDeviation& now) noexcept {
        return {transition[0] * now.position + transition[1] * now.velocity,
                transition[2] * now.position + transition[3] * now.velocity};
    }

    /// Returns bounds of the second derivatives of the three sums by theta: sums of j^2 times the size of each
    /// coefficient, and of the lower powers of j with a feed-forward.
    [[nodiscard]] std::array<double, 3> curvatures() const noexcept {
        constexpr int most_terms = 1'048'576;
        constexpr double negligible = 1e-15;
        std::array<std::array<double, 3>, 3> sums{};  // of j^0, j^1 and j^2 for each of the three
        const auto add = [&](std::size_t k, double j, double coefficient) {
            sums[k][0] += coefficient;
            sums[k][1] += j * coefficient;
            sums[k][2] += j * j * coefficient;
        };
        for (int j = 1; j <= delay_; ++j) {
            add(0, j, 1.0);
        }
        ServoDeviation now = first_;
        const auto size = [&] { return std::abs(now.position) + servo_.lag_s() * std::abs(now.velocity); };
        const double start = size();
        for (int j = delay_ + 1; size() > negligible * start; ++j) {
            if (j > most_terms) {
                constexpr double infinite = std::numeric_limits<double>::infinity();
                return {infinite, infinite, infinite};
            }
            add(0, j, std::abs(now.position));
            add(1, j, std::abs(now.velocity));
            add(2, j, std::abs(servo_.acceleration(now)));
            now = after(transition_, now);
        }
        std::array<double, 3> curvature{};
        for (std::size_t k = 0; k < sums.size(); ++k) {
            curvature[k] = (1.0 + 2.0 * ahead_) * sums[k][2] + ahead_ * (2.0 * sums[k][1] + sums[k][0]);
        }
        curvature[0] += ahead_;
        return curvature;
    }

    Servo servo_;
    double step_slope_;                   ///< sigma [N/m or N*m/rad]
    std::array<double, 3> limits_{};      ///< k_h, b_h and m_h
    double ahead_ = 0.0;                  ///< feed-forward [periods]
    int delay_ = 0;                       ///< whole samples of delay
    std::array<double, 4> transition_{};  ///< of the servo in one period
    ServoDeviation first_;  ///< deviation at the first sample after a unit step of the command has arrived
    std::array<double, 3> curvature_{};  ///< bounds of the second derivatives of the three sums by theta
};

}  // namespace palpate
