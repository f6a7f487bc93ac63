// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "palpate/model/parameters.hpp"
#include "palpate/model/radial_bounds.hpp"
#include "palpate/model/radial_sum.hpp"
#include "palpate/model/wavelet.hpp"

namespace palpate {

/// A wavelet network of d inputs with its domain (paper eq. 4),
///
///     f(x) = sum_i w_i psi(alpha_i o (x - beta_i)) + c'x + b,
///
/// where psi is the radial Mexican hat and o is the product component by component. Outside the domain, f is the value
/// at the nearest point of the domain plus the gradient at this point times the distance from this point. Each
/// component of that gradient is limited to values from 0 to the largest value found inside the domain
/// (`largest_gradient`).
class RadialNetwork {
  public:
    RadialNetwork(NetworkParameters network, Domain domain,
                  const detail::HatKernel& kernel = detail::hat_kernel())
        : network_{valid(std::move(network), domain)},
          domain_{std::move(domain)},
          hats_{network_, domain_.lower, domain_.upper, kernel} {
        gradient_cap_ = largest_gradient();
    }

    [[nodiscard]] const NetworkParameters& parameters() const noexcept { return network_; }
    [[nodiscard]] const Domain& domain() const noexcept { return domain_; }
    [[nodiscard]] std::size_t dimension() const noexcept { return network_.dimension; }
    [[nodiscard]] std::size_t size() const noexcept { return network_.weight.size(); }

    /// Returns true if the input x (d values) lies outside the domain.
    [[nodiscard]] bool extrapolated(std::span<const double> x) const noexcept {
        for (std::size_t j = 0; j < dimension(); ++j) {
            if (x[j] != projected(x, j)) {
                return true;
            }
        }
        return false;
    }

    /// Returns the value of the network at the input x (d values), continuation included.
    [[nodiscard]] double value(std::span<const double> x) const noexcept {
        double sum = network_.bias;
        for (std::size_t j = 0; j < dimension(); ++j) {
            const double inside = projected(x, j);
            sum += network_.linear[j] * inside;
            if (x[j] != inside) {
                sum += clamped_partial(x, j) * (x[j] - inside);
            }
        }
        hats_.add(x.data(), sum, nullptr);
        return sum;
    }

    /// Returns the value of the network at the input x (d values), continuation included, and writes its d partial
    /// derivatives to `gradient`. Where x lies outside along one input, the slope of the continuation changes with the
    /// other inputs, which adds d2f/dx_j dx_l times the distance from the domain.
    [[nodiscard]] double at(std::span<const double> x, std::span<double> gradient) const noexcept {
        double sum = network_.bias;
        for (std::size_t j = 0; j < dimension(); ++j) {
            sum += network_.linear[j] * projected(x, j);
            gradient[j] = network_.linear[j];
        }
        hats_.add(x.data(), sum, gradient.data());
        for (std::size_t j = 0; j < dimension(); ++j) {
            const double beyond = x[j] - projected(x, j);
            if (beyond != 0.0) {
                const double slope = std::clamp(gradient[j], 0.0, gradient_cap_[j]);
                if (slope == gradient[j]) {  // a limited slope does not change with the other inputs
                    add_mixed(x, j, beyond, gradient);
                }
                gradient[j] = slope;
                sum += slope * beyond;
            }
        }
        return sum;
    }

  private:
    [[nodiscard]] static NetworkParameters valid(NetworkParameters network, const Domain& domain) {
        validate(network, domain);
        return network;
    }

    [[nodiscard]] double projected(std::span<const double> x, std::size_t j) const noexcept {
        return std::clamp(x[j], domain_.lower[j], domain_.upper[j]);
    }

    [[nodiscard]] double scaled(std::size_t i, std::span<const double> x, std::size_t j) const noexcept {
        const std::size_t k = i * dimension() + j;
        return network_.alpha[k] * (projected(x, j) - network_.beta[k]);
    }

    /// Returns df/dx_j, component j of the gradient, at the point of the domain that is nearest to x.
    [[nodiscard]] double partial(std::span<const double> x, std::size_t j) const noexcept {
        double sum = network_.linear[j];
        for (std::size_t i = 0; i < size(); ++i) {
            double square = 0.0;
            for (std::size_t l = 0; l < dimension(); ++l) {
                square += scaled(i, x, l) * scaled(i, x, l);
            }
            const RadialMexicanHat psi = radial_mexican_hat(square, static_cast<double>(dimension()));
            sum += network_.weight[i] * network_.alpha[i * dimension() + j] * scaled(i, x, j) *
                   psi.gradient_over_u;
        }
        return sum;
    }

    /// Adds `beyond` times d2f/dx_j dx_l, at the point of the domain that is nearest to x, to `gradient[l]` for each
    /// input l along which x lies inside the domain.
    void add_mixed(std::span<const double> x, std::size_t j, double beyond,
                   std::span<double> gradient) const noexcept {
        const std::size_t d = dimension();
        for (std::size_t i = 0; i < size(); ++i) {
            double square = 0.0;
            for (std::size_t l = 0; l < d; ++l) {
                square += scaled(i, x, l) * scaled(i, x, l);
            }
            const RadialMexicanHat psi = radial_mexican_hat(square, static_cast<double>(d));
            for (std::size_t l = 0; l < d; ++l) {
                if (x[l] == projected(x, l)) {
                    gradient[l] += beyond * network_.weight[i] * network_.alpha[i * d + j] *
                                   network_.alpha[i * d + l] * psi.mixed(scaled(i, x, j), scaled(i, x, l));
                }
            }
        }
    }

    [[nodiscard]] double clamped_partial(std::span<const double> x, std::size_t j) const noexcept {
        return std::clamp(partial(x, j), 0.0, gradient_cap_[j]);
    }

    /// Returns the largest partial derivative by each input, at least 0, over the wavelets' centres and 1024 points
    /// that are distributed evenly over the domain. The points are an additive recurrence: multiples of the powers of
    /// 1/g, where g solves g^(d+1) = g + 1.
    [[nodiscard]] std::vector<double> largest_gradient() const {
        const std::size_t d = dimension();
        std::vector<double> largest(d, 0.0);
        std::vector<double> gradient;
        const auto visit = [&](std::span<const double> x) {
            double value = 0.0;
            gradient = network_.linear;
            hats_.add(x.data(), value, gradient.data());
            for (std::size_t j = 0; j < d; ++j) {
                largest[j] = std::max(largest[j], gradient[j]);
            }
        };
        for (std::size_t i = 0; i < size(); ++i) {
            visit(std::span{network_.beta}.subspan(i * d, d));
        }
        double ratio = 1.5;
        for (int iteration = 0; iteration < 32; ++iteration) {
            ratio = std::pow(1.0 + ratio, 1.0 / static_cast<double>(d + 1));
        }
        std::vector<double> x(d);
        constexpr int points = 1024;
        for (int k = 1; k <= points; ++k) {
            double step = 1.0;
            for (std::size_t j = 0; j < d; ++j) {
                step /= ratio;
                const double fraction = k * step - std::floor(k * step);
                x[j] = domain_.lower[j] + fraction * (domain_.upper[j] - domain_.lower[j]);
            }
            visit(x);
        }
        return largest;
    }

    NetworkParameters network_;
    Domain domain_;
    RadialSum hats_;
    std::vector<double> gradient_cap_;
};

}  // namespace palpate
