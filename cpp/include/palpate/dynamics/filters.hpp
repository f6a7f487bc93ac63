// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "palpate/dynamics/transfer_function.hpp"
#include "palpate/fields/field_table.hpp"

namespace palpate {

/// Sample period [s] for which the paper designed its differentiators.
inline constexpr double paper_sample_time = 1e-3;

/// Selects one of the two sets of integrators and differentiators in section 4.3 of the paper.
enum class FilterPair : std::uint8_t { Implicit, Explicit };

/// Choice of the gain of each differentiator G. G must invert the integrator I, so the product G I should be 1.
enum class FilterDesign : std::uint8_t {
    Paper,  ///< gains of the paper, 14.8379 and 31: the product G I at low frequency is 1.0032 and 1.048
    /// Gains for which the product of differentiator G and integrator I is exactly 1 at frequency 0
    Matched,
};

template <>
inline constexpr auto words_of<FilterPair> = std::array<std::string_view, 2>{"implicit", "explicit"};
template <>
inline constexpr auto words_of<FilterDesign> = std::array<std::string_view, 2>{"paper", "matched"};

/// The integrators I1 (force to velocity) and I2 (velocity to position) of a virtual object with mass, and the
/// differentiators G1 and G2 that approximate the inverses of I1 and I2 in identification (paper figures 10 to 14).
struct EnvironmentFilters {
    TransferFunction i1;
    TransferFunction i2;
    TransferFunction g1;
    TransferFunction g2;
};

/// Returns the integrators and differentiators of the paper. Both differentiators G have the denominator z^2 - 1.6556 z
/// + 0.68518 with the poles 0.836 and 0.819 (179 and 199 rad/s), so |G I| with the integrator I is about 0.8 at 100
/// rad/s. With c = 1 - 1.6556 + 0.68518 and the sample time T, the gain for which G I = 1 at frequency 0 (z = 1) is c /
/// (2T) for the numerator z^2 - 1 and c / T for z - 1.
[[nodiscard]] constexpr EnvironmentFilters environment_filters(FilterPair pair,
                                                               FilterDesign design = FilterDesign::Paper) {
    constexpr double period = paper_sample_time;
    constexpr double at_dc = 1.0 - 1.6556 + 0.68518;
    const bool paper = design == FilterDesign::Paper;
    const double central_gain = paper ? 14.8379 : at_dc / (2.0 * period);
    const double forward_gain = paper ? 31.0 : at_dc / period;

    const TransferFunction integrator{{period, 0.0, 0.0}, {1.0, -1.0, 0.0}};          // I(z) = T z / (z - 1)
    const TransferFunction delayed_integrator{{0.0, period, 0.0}, {1.0, -1.0, 0.0}};  // I(z) = T / (z - 1)
    const TransferFunction central{{central_gain, 0.0, -central_gain}, {1.0, -1.6556, 0.68518}};
    const TransferFunction forward{{0.0, forward_gain, -forward_gain}, {1.0, -1.6556, 0.68518}};
    if (pair == FilterPair::Implicit) {
        return {integrator, integrator, central, central};
    }
    return {delayed_integrator, integrator, forward, central};
}

}  // namespace palpate
