// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "palpate/inline.hpp"
#include "palpate/model/continuation.hpp"

namespace palpate {

/// Parameters of a network of N wavelets with d inputs. Matrices are stored row by row, one row for each wavelet.
///
/// The last `harmonics` of the N wavelets are w cos(alpha (x - beta)) in place of w psi(alpha (x - beta)). Such a
/// harmonic has the order alpha period / (2 pi), a whole number, the amplitude w and the phase alpha beta [rad].
struct NetworkParameters {
    std::size_t dimension = 1;      ///< number of inputs d
    std::vector<double> alpha{};    ///< N x d dilations, > 0 [1/m]
    std::vector<double> beta{};     ///< N x d translations [m]
    std::vector<double> weight{};   ///< N weights [N]
    std::vector<double> linear{0};  ///< d slopes of the straight line [N/m]
    double bias = 0.0;              ///< constant b of the network [N]
    std::size_t harmonics = 0;  ///< number of harmonics among the N wavelets; 0 unless the force is periodic

    /// Returns the number of wavelets that are Mexican hats; the harmonics follow them.
    [[nodiscard]] std::size_t hats() const noexcept { return weight.size() - harmonics; }
};

/// Smallest and largest value of each input in the recording from which a network was identified, and the kind of force
/// outside these values.
struct Domain {
    std::vector<double> lower{0.0};             ///< smallest recorded value of each of the d inputs
    std::vector<double> upper{1.0};             ///< largest recorded value of each of the d inputs
    Continuation below = Continuation::Linear;  ///< continuation below the domain, if d = 1
    Continuation above = Continuation::Linear;  ///< continuation above the domain, if d = 1.
    /// Length after which a periodic force repeats, if d = 1; equals upper - lower
    std::optional<double> period = std::nullopt;
};

namespace detail {

/// Throws std::invalid_argument with the message `sentence` unless `holds` is true.
inline void require(bool holds, std::string_view sentence) {
    if (!holds) {
        throw std::invalid_argument(std::string{sentence});
    }
}

/// Throws std::invalid_argument with the name `field` and the index of the first value that is not finite.
inline void require_finite(const std::vector<double>& values, const char* field) {
    for (std::size_t i = 0; i < values.size(); ++i) {
        require(std::isfinite(values[i]),
                std::string(field) + "[" + std::to_string(i) + "] is not a finite number");
    }
}

/// Throws std::invalid_argument with the name `field` unless `values` has `size` elements.
inline void require_size(const std::vector<double>& values, std::size_t size, const char* field) {
    require(values.size() == size, std::string(field) + " has " + std::to_string(values.size()) +
                                       " values, must have " + std::to_string(size));
}

}  // namespace detail

/// Returns the smallest width of a wavelet along the first input, 1 / dilation, and at most `travel`, the length of the
/// domain along this input [m].
[[nodiscard]] inline double finest_width(const NetworkParameters& network, double travel) noexcept {
    double finest = travel;
    for (std::size_t k = 0; k < network.alpha.size(); k += network.dimension) {
        finest = std::min(finest, 1.0 / network.alpha[k]);
    }
    return finest;
}

/// Returns true if cos(alpha x) is a harmonic of the period: a whole number of its waves fits into it.
[[nodiscard]] inline bool is_harmonic(double alpha, double period) noexcept {
    const double order = alpha * period / (2.0 * std::numbers::pi);
    return std::abs(order - std::round(order)) <= 1e-9 * order;
}

/// Throws std::invalid_argument if a parameter of the network or its domain is invalid. The message states the name of
/// the parameter and the rule.
PALPATE_INLINE void validate(const NetworkParameters& network, const Domain& domain);

/// Throws std::invalid_argument unless the network has one input.
inline void require_one_input(const NetworkParameters& network) {
    detail::require(network.dimension == 1,
                    "the network has " + std::to_string(network.dimension) + " inputs, must have 1");
}

}  // namespace palpate

#ifndef PALPATE_COMPILED
#include "palpate/model/detail/validate.hpp"
#endif
