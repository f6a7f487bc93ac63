// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <span>
#include <vector>

#include "palpate/inline.hpp"
#include "palpate/model/bounds.hpp"
#include "palpate/model/parameters.hpp"
#include "palpate/model/radial_sum.hpp"

namespace palpate {

/// Lower and upper bounds of value and gradient of a network of d inputs over a box of inputs.
struct RadialBounds {
    Interval value;
    std::vector<Interval> gradient;  ///< bounds of each component of the gradient
};

namespace detail {

/// Returns a lower and an upper bound of the quadratic function c + b't + t'A t / 2 plus a remainder of at most `rest`,
/// for all vectors t with |t_j| <= 1. The bounds of the terms of t_j and t_j^2 are exact; a product of two components
/// is replaced by the absolute value of its coefficient.
[[nodiscard]] inline Interval quadratic_range(std::size_t d, double c, const double* b, const double* a,
                                              double rest) noexcept {
    Interval range{c - rest, c + rest};
    for (std::size_t j = 0; j < d; ++j) {
        const double slope = std::abs(b[j]);
        const double bend = a[j * d + j];
        Interval along{0.5 * bend - slope, 0.5 * bend + slope};
        if (slope < std::abs(bend)) {
            const double vertex = -0.5 * slope * slope / bend;
            along = along.with({vertex, vertex});
        }
        double products = 0.0;
        for (std::size_t k = 0; k < j; ++k) {
            products += std::abs(a[j * d + k]);
        }
        range = {range.lower + along.lower - products, range.upper + along.upper + products};
    }
    return range;
}

/// Computes bounds of value and gradient of a network over a box of inputs by Taylor's formula about the middle of the
/// box. The bound of the fourth derivative is a sum over the wavelets, each at its smallest distance from the box.
class RadialEnclosure {
  public:
    RadialEnclosure(const NetworkParameters& network, const RadialSum& hats)
        : network_{network},
          hats_{hats},
          sums_{hats.expansion()},
          middle_(network.dimension),
          radius_(network.dimension) {
        gradient.resize(network.dimension);
        ranges.gradient.resize(network.dimension);
    }

    /// Computes bounds of value and gradient over the box from `lower` to `upper`.
    void over(const double* lower, const double* upper) noexcept {
        const std::size_t d = network_.dimension;
        for (std::size_t j = 0; j < d; ++j) {
            middle_[j] = 0.5 * (lower[j] + upper[j]);
            // Half the width of the box along input j. It is rounded up and above 0, because the gradient is divided by
            // it.
            radius_[j] = std::max(upper[j] - middle_[j], middle_[j] - lower[j]) * (1.0 + 1e-15) + 1e-200;
        }
        hats_.expand(middle_.data(), radius_.data(), sums_);
        value = sums_.value + network_.bias;
        double third_derivatives = 0.0;
        for (const double component : sums_.third_derivative) {
            third_derivatives += std::abs(component);
        }
        // The factor covers the rounding errors of the remainder, and of all terms of a wavelet that is narrow compared
        // with the box.
        constexpr double rounded_up = 1.0 + 1e-9;
        const double fourth = rounded_up * std::reduce(sums_.rest.begin(), sums_.rest.end());
        for (std::size_t j = 0; j < d; ++j) {
            value += network_.linear[j] * middle_[j];
            sums_.gradient[j] += network_.linear[j] * radius_[j];
            gradient[j] = sums_.gradient[j] / radius_[j];
            const Interval scaled = quadratic_range(d, sums_.gradient[j], &sums_.second_derivative[j * d],
                                                    &sums_.third_derivative[j * d * d],
                                                    std::sqrt(rounded_up * sums_.rest[j] * fourth) / 6.0);
            ranges.gradient[j] = {scaled.lower / radius_[j], scaled.upper / radius_[j]};
        }
        ranges.value = quadratic_range(d, value, sums_.gradient.data(), sums_.second_derivative.data(),
                                       third_derivatives / 6.0 + fourth / 24.0);
    }

    /// Returns the index of the input along which the value of the network is likely to change most in the box.
    [[nodiscard]] std::size_t widest() const noexcept {
        std::size_t widest = 0;
        double largest_change = 0.0;
        for (std::size_t j = 0; j < network_.dimension; ++j) {
            const double change = std::abs(sums_.gradient[j]) + sums_.rest[j];
            if (change > largest_change) {
                widest = j;
                largest_change = change;
            }
        }
        return widest;
    }

    double value = 0.0;            ///< value of the network in the middle of the box
    std::vector<double> gradient;  ///< gradient of the network in the middle of the box
    RadialBounds ranges;

  private:
    const NetworkParameters& network_;
    const RadialSum& hats_;
    RadialExpansion sums_;
    std::vector<double> middle_;
    std::vector<double> radius_;
};

/// Smallest and largest value of a function at the positions computed so far. They decide whether a cell is divided
/// again.
struct SampledRange {
    Interval range{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};

    void add(double value) noexcept { range = range.with({value, value}); }
    /// Returns true if a cell with the bounds `possible` cannot contain a value that exceeds the sampled values by more
    /// than `slack`.
    [[nodiscard]] bool is_finished(Interval possible, double slack) const noexcept {
        return possible.upper <= range.upper + slack && possible.lower >= range.lower - slack;
    }
};

/// Bounds of the rounding errors of value and gradient of a network of N wavelets and d inputs in a box: 64 (N + 8)
/// epsilon times the sums of absolute terms. The sums use |psi| <= d, and |grad psi| and its terms <= d + 4, for the
/// radial Mexican hat psi.
struct RadialRounding {
    double value;
    std::vector<double> gradient;

    RadialRounding(const NetworkParameters& network, std::span<const double> lower,
                   std::span<const double> upper)
        : value{std::abs(network.bias)}, gradient(network.dimension) {
        const std::size_t d = network.dimension;
        const double units =
            64.0 * static_cast<double>(network.weight.size() + 8) * std::numeric_limits<double>::epsilon();
        for (std::size_t j = 0; j < d; ++j) {
            value += std::abs(network.linear[j]) * std::max(std::abs(lower[j]), std::abs(upper[j]));
            gradient[j] = std::abs(network.linear[j]);
        }
        for (std::size_t i = 0; i < network.weight.size(); ++i) {
            const double weight = std::abs(network.weight[i]);
            value += weight * static_cast<double>(d);
            for (std::size_t j = 0; j < d; ++j) {
                gradient[j] += weight * network.alpha[i * d + j] * static_cast<double>(d + 4);
            }
        }
        value *= units;
        for (double& component : gradient) {
            component *= units;
        }
    }
};

/// Calls visit(x) at inputs x at which the value or the gradient of the network is probably large: at the centre of
/// each wavelet and on its flanks.
template <class Visitor>
void visit_steep_positions(const NetworkParameters& network, std::span<const double> lower,
                           std::span<const double> upper, Visitor visit) {
    const std::size_t d = network.dimension;
    std::vector<double> x(d);
    for (std::size_t i = 0; i < network.weight.size(); ++i) {
        const double* centre = &network.beta[i * d];
        for (std::size_t j = 0; j < d; ++j) {
            x[j] = std::clamp(centre[j], lower[j], upper[j]);
        }
        visit(x);
        for (std::size_t j = 0; j < d; ++j) {
            const double inside = x[j];
            for (const double side : {-0.742, 0.742}) {
                x[j] = std::clamp(centre[j] + side / network.alpha[i * d + j], lower[j], upper[j]);
                visit(x);
            }
            x[j] = inside;
        }
    }
}

}  // namespace detail

/// Returns proved bounds of value and gradient of a network of any number of inputs, without continuation, over the box
/// from `lower` to `upper`, by bisection of the box. The bounds are wider than the true minimum and maximum by at most
/// `relative` times the largest |f| and |df/dx_j|. `budget` limits the number of boxes; boxes that are still too wide
/// at this limit only make the bounds wider.
[[nodiscard]] PALPATE_INLINE RadialBounds
radial_bounds(const NetworkParameters& network, std::span<const double> lower, std::span<const double> upper,
              double relative = 0.01, std::size_t budget = 50'000,
              const detail::HatKernel& kernel = detail::hat_kernel());

}  // namespace palpate

#ifndef PALPATE_COMPILED
#include "palpate/model/detail/radial_bounds.hpp"
#endif
