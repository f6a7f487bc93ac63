// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>

#include "palpate/model/continuation.hpp"
#include "palpate/model/environment.hpp"
#include "palpate/model/network_curve.hpp"
#include "palpate/model/parameters.hpp"

namespace palpate {

/// Returns the force of a network of one input over all positions: the network inside the domain, and its continuations
/// outside the domain.
[[nodiscard]] inline NetworkCurve continued_force(const NetworkParameters& network, const Domain& domain) {
    NetworkCurve curve{network, domain};
    const CurveExtent extent = curve.extent();
    curve.continue_with(continue_force(domain.lower[0], curve.below().at_edge, -1.0, domain.below, extent),
                        continue_force(domain.upper[0], curve.above().at_edge, +1.0, domain.above, extent));
    return curve;
}

/// A wavelet network of one position with its domain (paper eq. 5),
///
///     f(x) = sum_i w_i psi(alpha_i (x - beta_i)) + c x + b,
///
/// continued outside the domain as `Domain` defines. For networks with several inputs see `RadialNetwork`.
class WaveletNetwork {
  public:
    using State = Stateless;

    WaveletNetwork(const NetworkParameters& network, Domain domain)
        : domain_{std::move(domain)}, curve_{(check(network, domain_), continued_force(network, domain_))} {}

    [[nodiscard]] const NetworkParameters& parameters() const noexcept { return curve_.parameters(); }
    [[nodiscard]] const Domain& domain() const noexcept { return domain_; }
    /// Returns the wavelet network and its continuations, which give the force at all positions.
    [[nodiscard]] const NetworkCurve& curve() const noexcept { return curve_; }

    /// Returns force, slope and energy at position x.
    [[nodiscard]] EnvironmentSample at(double x, State) const noexcept {
        const Curve curve = curve_.at(x);
        return {curve.value, curve.slope, curve.integral, curve_.extrapolated(x)};
    }
    void advance(double /*x*/, State&) const noexcept {}
    [[nodiscard]] State start(double /*x*/) const noexcept { return {}; }

  private:
    static void check(const NetworkParameters& network, const Domain& domain) {
        validate(network, domain);
        require_one_input(network);
    }

    Domain domain_;
    NetworkCurve curve_;
};

static_assert(Environment<WaveletNetwork>);

}  // namespace palpate
