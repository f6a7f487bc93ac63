// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "palpate/model/bounds.hpp"
#include "palpate/model/derivatives.hpp"
#include "palpate/model/parameters.hpp"
#include "palpate/model/wavelet.hpp"

namespace palpate {

/// Where a network of d inputs and its gradient lie over a box.
struct RadialBounds {
    Interval value;
    std::vector<Interval> gradient;  ///< by component
};

namespace detail {

/// Bounds of |D^4 psi(a, b, c, e)| for unit vectors, of the radial hat of d inputs: psi is the Laplacian of a
/// Gaussian, so along a direction it is a sum of Hermite functions of order 6 and 4; the largest value of a
/// symmetric form is taken on equal vectors. Cramer's inequality gives what is left at a distance r from the
/// centre, times e^{-r^2/4}.
struct FourthDerivative {
    double supremum;
    double tail;

    explicit FourthDerivative(std::size_t dimension) noexcept {
        const double others = static_cast<double>(dimension) - 1.0;
        supremum = hat_suprema[4] + std::max(others, 0.7358) * hat_suprema[2];
        tail = hat_tails[4] + std::max(others, 1.4716) * hat_tails[2];
    }

    [[nodiscard]] double beyond(double square) const noexcept {
        return std::min(supremum, tail * std::exp(-0.25 * std::min(square, 2800.0)));
    }
};

/// A box in the search, with the ranges of value and gradient over it: Taylor's formula about its middle, with
/// the fourth derivative bounded wavelet by wavelet at the least distance.
class RadialBox {
  public:
    RadialBox(const NetworkParameters& network, std::vector<double> middle, std::vector<double> radius)
        : middle_{std::move(middle)}, radius_{std::move(radius)} {
        const std::size_t d = network.dimension;
        const auto inputs = static_cast<double>(d);
        const FourthDerivative fourth{d};
        std::vector<double> u(d);
        std::vector<double> bend(d * d, 0.0);       // D^2 f at the middle
        std::vector<double> twist(d * d * d, 0.0);  // D^3 f
        std::vector<double> gradient_rest(d, 0.0);
        gradient = network.linear;
        value = network.bias;
        for (std::size_t j = 0; j < d; ++j) {
            value += network.linear[j] * middle_[j];
        }
        double value_rest = 0.0;
        for (std::size_t i = 0; i < network.weight.size(); ++i) {
            const double* alpha = &network.alpha[i * d];
            double square = 0.0;
            double least_square = 0.0;
            double spread = 0.0;
            for (std::size_t j = 0; j < d; ++j) {
                const double distance = middle_[j] - network.beta[i * d + j];
                u[j] = std::clamp(alpha[j] * distance, -wavelet_reach, wavelet_reach);
                square += u[j] * u[j];
                const double least = alpha[j] * std::max(std::abs(distance) - radius_[j], 0.0);
                least_square += least * least;
                spread += alpha[j] * radius_[j] * (alpha[j] * radius_[j]);
            }
            // With A_n = w (d + n - r^2) E: psi = -A_0, D psi = A_2 u, D^2 psi = A_2 I - A_4 u u', and D^3 psi =
            // A_6 u u u less A_4 u_j wherever the other two indices are equal.
            const double factor = network.weight[i] * std::exp(-0.5 * std::min(square, 1600.0));
            const double first = (inputs + 2.0 - square) * factor;
            const double second = (inputs + 4.0 - square) * factor;
            const double third = (inputs + 6.0 - square) * factor;
            value += (square - inputs) * factor;
            for (std::size_t j = 0; j < d; ++j) {
                gradient[j] += first * alpha[j] * u[j];
                for (std::size_t k = 0; k <= j; ++k) {
                    const double by_two = alpha[j] * alpha[k];
                    bend[j * d + k] += by_two * ((j == k ? first : 0.0) - second * u[j] * u[k]);
                    for (std::size_t l = 0; l <= k; ++l) {
                        twist[(j * d + k) * d + l] +=
                            by_two * alpha[l] *
                            (third * u[j] * u[k] * u[l] -
                             second *
                                 ((j == k ? u[l] : 0.0) + (j == l ? u[k] : 0.0) + (k == l ? u[j] : 0.0)));
                    }
                }
            }
            const double rest = std::abs(network.weight[i]) * fourth.beyond(least_square) * spread;
            value_rest += rest * spread / 24.0;
            for (std::size_t j = 0; j < d; ++j) {
                gradient_rest[j] += rest * std::sqrt(spread) / 6.0 * alpha[j];
            }
        }
        for (std::size_t j = 0; j < d; ++j) {
            double by_component = std::abs(gradient[j]);
            double rest = gradient_rest[j];
            for (std::size_t k = 0; k < d; ++k) {
                const double once = std::abs(bend[std::max(j, k) * d + std::min(j, k)]) * radius_[k];
                by_component += once / 2.0;
                rest += once;
                for (std::size_t l = 0; l < d; ++l) {
                    std::array<std::size_t, 3> at{j, k, l};
                    std::sort(at.begin(), at.end());
                    const double twice =
                        std::abs(twist[(at[2] * d + at[1]) * d + at[0]]) * radius_[k] * radius_[l];
                    by_component += twice / 6.0;
                    rest += twice / 2.0;
                }
            }
            value_rest += by_component * radius_[j];
            ranges.gradient.push_back({gradient[j] - rest, gradient[j] + rest});
        }
        ranges.value = {value - value_rest, value + value_rest};
    }

    /// Both halves across the side that spans most wavelets.
    [[nodiscard]] std::pair<RadialBox, RadialBox> halves(const NetworkParameters& network,
                                                         std::span<const double> finest) const {
        std::size_t widest = 0;
        for (std::size_t j = 1; j < radius_.size(); ++j) {
            widest = radius_[j] * finest[j] > radius_[widest] * finest[widest] ? j : widest;
        }
        std::vector<double> radius = radius_;
        radius[widest] *= 0.5;
        std::vector<double> left = middle_;
        std::vector<double> right = middle_;
        left[widest] -= radius[widest];
        right[widest] += radius[widest];
        return {RadialBox{network, std::move(left), radius}, RadialBox{network, std::move(right), radius}};
    }

    double value = 0.0;            ///< in the middle
    std::vector<double> gradient;  ///< in the middle
    RadialBounds ranges;

  private:
    std::vector<double> middle_;
    std::vector<double> radius_;
};

/// Largest and smallest value met so far, and how far beyond it a cell may reach and still be done.
struct Seen {
    Interval range{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};

    void add(double value) noexcept { range = range.with({value, value}); }
    [[nodiscard]] bool settles(Interval possible, double slack) const noexcept {
        return possible.upper <= range.upper + slack && possible.lower >= range.lower - slack;
    }
};

}  // namespace detail

/// Proved bounds over the box [lower, upper] of a network of any number of inputs without continuation, at most
/// `relative` times the largest |f| and |df/dx_j| wider than their true ranges, by bisection of the box. Boxes
/// that are still too coarse when the budget ends only make the result wider.
[[nodiscard]] inline RadialBounds radial_bounds(const NetworkParameters& network,
                                                std::span<const double> lower, std::span<const double> upper,
                                                double relative = 0.01, int budget = 50'000) {
    const std::size_t d = network.dimension;
    std::vector<double> middle(d);
    std::vector<double> radius(d);
    std::vector<double> finest(d, 0.0);
    // 64 (N + 8) units of the sums of absolute terms: |psi| <= d, |grad psi| and its terms <= d + 4.
    const double units =
        64.0 * static_cast<double>(network.weight.size() + 8) * std::numeric_limits<double>::epsilon();
    double value_margin = std::abs(network.bias);
    std::vector<double> margin(d);
    for (std::size_t j = 0; j < d; ++j) {
        middle[j] = 0.5 * (lower[j] + upper[j]);
        radius[j] = std::max(upper[j] - middle[j], middle[j] - lower[j]);
        value_margin += std::abs(network.linear[j]) * std::max(std::abs(lower[j]), std::abs(upper[j]));
        margin[j] = std::abs(network.linear[j]);
        for (std::size_t i = 0; i < network.weight.size(); ++i) {
            const double alpha = network.alpha[i * d + j];
            margin[j] += std::abs(network.weight[i]) * alpha * static_cast<double>(d + 4);
            finest[j] = std::max(finest[j], alpha);
        }
        margin[j] *= units;
    }
    for (const double weight : network.weight) {
        value_margin += std::abs(weight) * static_cast<double>(d);
    }
    value_margin *= units;

    detail::Seen value;
    std::vector<detail::Seen> gradient(d);
    const auto look = [&](const detail::RadialBox& box) {
        value.add(box.value);
        for (std::size_t j = 0; j < d; ++j) {
            gradient[j].add(box.gradient[j]);
        }
    };
    const auto done = [&](const RadialBounds& box) {
        bool all = value.settles(box.value, relative * value.range.largest() + value_margin);
        for (std::size_t j = 0; j < d && all; ++j) {
            all = gradient[j].settles(box.gradient[j], relative * gradient[j].range.largest() + margin[j]);
        }
        return all;
    };
    // What may be largest is looked at first: a search that has met it settles the rest sooner.
    for (std::size_t i = 0; i < network.weight.size(); ++i) {
        std::vector<double> centre(d);
        for (std::size_t j = 0; j < d; ++j) {
            centre[j] = std::clamp(network.beta[i * d + j], lower[j], upper[j]);
        }
        look(detail::RadialBox{network, centre, std::vector<double>(d, 0.0)});
        for (std::size_t j = 0; j < d; ++j) {
            for (const double side : {-1.0, 1.0}) {
                std::vector<double> flank = centre;
                const double steepest = network.beta[i * d + j] + side * 0.742 / network.alpha[i * d + j];
                flank[j] = std::clamp(steepest, lower[j], upper[j]);
                look(detail::RadialBox{network, std::move(flank), std::vector<double>(d, 0.0)});
            }
        }
    }
    std::vector<detail::RadialBox> open{detail::RadialBox{network, middle, radius}};
    look(open.front());
    RadialBounds bounds{value.range, {}};
    for (const detail::Seen& seen : gradient) {
        bounds.gradient.push_back(seen.range);
    }
    for (int boxes = 1; !open.empty(); ++boxes) {
        const detail::RadialBox box = std::move(open.back());
        open.pop_back();
        if (done(box.ranges) || boxes >= budget) {
            bounds.value = bounds.value.with(box.ranges.value);
            for (std::size_t j = 0; j < d; ++j) {
                bounds.gradient[j] = bounds.gradient[j].with(box.ranges.gradient[j]);
            }
            continue;
        }
        auto [left, right] = box.halves(network, finest);
        look(left);
        look(right);
        open.push_back(std::move(right));
        open.push_back(std::move(left));
    }
    bounds.value = {bounds.value.lower - value_margin, bounds.value.upper + value_margin};
    for (std::size_t j = 0; j < d; ++j) {
        bounds.gradient[j] = {bounds.gradient[j].lower - margin[j], bounds.gradient[j].upper + margin[j]};
    }
    return bounds;
}

}  // namespace palpate
