// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <string>

#include "palpate/model/parameters.hpp"

// Definition of validate, which every model contains.
namespace palpate {

PALPATE_INLINE void validate(const NetworkParameters& network, const Domain& domain) {
    using detail::require;
    const std::size_t d = network.dimension;
    const std::size_t n = network.weight.size();
    require(d >= 1, "dimension is 0, must be at least 1");
    detail::require_size(network.alpha, n * d, "alpha");
    detail::require_size(network.beta, n * d, "beta");
    detail::require_size(network.linear, d, "linear");
    detail::require_size(domain.lower, d, "lower");
    detail::require_size(domain.upper, d, "upper");
    detail::require_finite(network.alpha, "alpha");
    detail::require_finite(network.beta, "beta");
    detail::require_finite(network.weight, "weight");
    detail::require_finite(network.linear, "linear");
    require(std::isfinite(network.bias), "bias is not a finite number");
    detail::require_finite(domain.lower, "lower");
    detail::require_finite(domain.upper, "upper");
    for (std::size_t i = 0; i < network.alpha.size(); ++i) {
        require(network.alpha[i] > 0.0, "alpha[" + std::to_string(i / d) + "][" + std::to_string(i % d) +
                                            "] is " + std::to_string(network.alpha[i]) + ", must be > 0");
    }
    for (std::size_t j = 0; j < d; ++j) {
        require(domain.lower[j] < domain.upper[j],
                "lower[" + std::to_string(j) + "] is " + std::to_string(domain.lower[j]) +
                    ", must be below upper " + std::to_string(domain.upper[j]));
    }
    if (domain.period) {
        const double travel = domain.upper[0] - domain.lower[0];
        require(d == 1, "period is set, but the network has " + std::to_string(d) + " inputs, must have 1");
        require(std::abs(*domain.period - travel) <= 1e-9 * travel,
                "period is " + std::to_string(*domain.period) + ", must equal upper - lower, " +
                    std::to_string(travel));
    }
    require(network.harmonics <= n, "harmonics is " + std::to_string(network.harmonics) +
                                        ", must be at most the number of wavelets, " + std::to_string(n));
    require(network.harmonics == 0 || domain.period,
            "harmonics is " + std::to_string(network.harmonics) + ", must be 0 in a network without period");
    for (std::size_t i = network.hats(); i < n; ++i) {
        require(is_harmonic(network.alpha[i], *domain.period),
                "alpha[" + std::to_string(i) + "] is " + std::to_string(network.alpha[i]) +
                    ": must be a whole multiple of 2 pi / period, because it belongs to a harmonic");
    }
}

}  // namespace palpate
