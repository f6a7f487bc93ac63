// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "palpate/model/environment.hpp"
#include "palpate/model/network.hpp"
#include "palpate/model/network_curve.hpp"
#include "palpate/model/parameters.hpp"

namespace palpate {

/// Weights of the hysteresis h in a hysteresis network. The hysteresis h and the mean force g use the same wavelets.
struct HysteresisParameters {
    std::vector<double> weight;  ///< weights of the wavelets in the hysteresis h [N]
    double linear = 0.0;         ///< slope of the straight line in the hysteresis h [N/m]
    double bias = 0.0;           ///< constant term of the hysteresis h [N]
};

/// Returns the new position of the play operator of radius r, a slot of width 2r that the position x moves with its
/// edges,
///
///     play_k = min(x_k + r, max(x_k - r, play_{k-1})).
[[nodiscard]] inline double play(double position, double previous, double radius) noexcept {
    return std::min(position + radius, std::max(position - radius, previous));
}

/// Usual play radius over the length of the domain [-].
inline constexpr double play_share_of_travel = 0.01;
/// Least play radius over the encoder step [-]. A motion of the hand then changes the direction state, and encoder
/// noise does not.
inline constexpr double fewest_encoder_steps_in_play = 4.0;

/// Returns the play radius for a model without its own play radius [m], from the length of its domain and the encoder
/// step of the device [m].
[[nodiscard]] inline double usual_play_radius(double travel, double encoder_step = 0.0) noexcept {
    return std::max(fewest_encoder_steps_in_play * encoder_step, play_share_of_travel * travel);
}

/// A force with hysteresis: mean force g, hysteresis h and direction state s,
///
///     f(x, s) = g(x) + s h(x),   s = (x - play) / r in [-1, 1].
///
/// While h >= 0 no closed motion generates energy. The stored energy is G(x) + (1/r) int_play^x (xi - play) h(xi) dxi
/// with the antiderivative G of g. With it, a motion that leaves the play operator at its position (|s| < 1, sticking)
/// dissipates no energy, and a motion that moves the play operator (|s| = 1, sliding) dissipates energy. `C` is the
/// type of the functions g and h.
template <class C>
class HysteresisPair {
  public:
    struct State {
        double play = 0.0;  ///< position of the play operator [m]
    };

    HysteresisPair(C force, C hysteresis, double play_radius)
        : force_{std::move(force)}, hysteresis_force_{std::move(hysteresis)}, play_radius_{play_radius} {}

    /// Returns the play radius [m].
    [[nodiscard]] double play_radius() const noexcept { return play_radius_; }

    /// Returns the function g, the mean of press force and release force.
    [[nodiscard]] const C& force() const noexcept { return force_; }
    /// Returns the function h, half the difference between press force and release force.
    [[nodiscard]] const C& hysteresis_force() const noexcept { return hysteresis_force_; }

    /// Returns force and slope at position x for a direction state s that does not change (+1 press, -1 release), and
    /// the energy of the mean force.
    [[nodiscard]] EnvironmentSample sliding(double x, double s) const noexcept {
        const Curve g = force_.at(x);
        const Curve h = hysteresis_force_.at(x);
        return {g.value + s * h.value, g.slope + s * h.slope, g.integral, force_.extrapolated(x)};
    }

    /// Returns force, slope and energy after a motion to position x that starts with the play operator in `state`.
    [[nodiscard]] EnvironmentSample at(double x, const State& state) const noexcept {
        const double play = palpate::play(x, state.play, play_radius_);
        const double s = (x - play) / play_radius_;
        const Curve g = force_.at(x);
        const Curve h = hysteresis_force_.at(x);
        const bool sticks = play == state.play;
        // Integration by parts: integral of (xi - play) h(xi) from play to x = (x - play) H(x) - integral of H from
        // play to x; H is the antiderivative of h
        const double stored =
            (x - play) * h.integral - (h.double_integral - hysteresis_force_.at(play).double_integral);
        return {g.value + s * h.value, g.slope + s * h.slope + (sticks ? h.value / play_radius_ : 0.0),
                g.integral + stored / play_radius_, force_.extrapolated(x)};
    }

    /// Updates the play operator in `state` for a motion to position x.
    void advance(double x, State& state) const noexcept {
        state.play = palpate::play(x, state.play, play_radius_);
    }

    /// Returns the state of an object at rest at position x: direction state s = 0, so the hysteresis adds no force.
    [[nodiscard]] State start(double x) const noexcept { return {x}; }

  private:
    C force_;
    C hysteresis_force_;
    double play_radius_;
};

/// A force with hysteresis whose mean force and hysteresis are networks with the same wavelets and the same domain.
class HysteresisNetwork : public HysteresisPair<NetworkCurve> {
  public:
    HysteresisNetwork(const NetworkParameters& network, const HysteresisParameters& hysteresis,
                      const Domain& domain, double play_radius)
        : HysteresisNetwork{
              network, hysteresis, domain, play_radius,
              (check(network, hysteresis, domain, play_radius), continued_force(network, domain))} {}

    [[nodiscard]] const NetworkParameters& parameters() const noexcept { return force().parameters(); }
    [[nodiscard]] const Domain& domain() const noexcept { return domain_; }

  private:
    HysteresisNetwork(const NetworkParameters& network, const HysteresisParameters& hysteresis,
                      const Domain& domain, double play_radius, const NetworkCurve& force)
        : HysteresisPair{force, continued_hysteresis(network, hysteresis, domain, force), play_radius},
          domain_{domain} {}

    static void check(const NetworkParameters& network, const HysteresisParameters& hysteresis,
                      const Domain& domain, double play_radius) {
        validate(network, domain);
        require_one_input(network);
        detail::require_size(hysteresis.weight, network.weight.size(), "weight_hysteresis");
        detail::require_finite(hysteresis.weight, "weight_hysteresis");
        detail::require(std::isfinite(hysteresis.linear), "linear_hysteresis is not a finite number");
        detail::require(std::isfinite(hysteresis.bias), "bias_hysteresis is not a finite number");
        detail::require(play_radius > 0.0 && std::isfinite(play_radius),
                        "play_radius is " + std::to_string(play_radius) + ", must be > 0");
    }

    [[nodiscard]] static NetworkCurve continued_hysteresis(const NetworkParameters& network,
                                                           const HysteresisParameters& hysteresis,
                                                           const Domain& domain, const NetworkCurve& force) {
        NetworkParameters h = network;
        h.weight = hysteresis.weight;
        h.linear = {hysteresis.linear};
        h.bias = hysteresis.bias;
        NetworkCurve curve{h, domain};
        const double travel = domain.upper[0] - domain.lower[0];
        // With a free continuation the hysteresis h decreases to zero over the same distance as the mean force g. This
        // distance is at least 2 % of the length of the domain, so that h has neither a jump nor a steep slope.
        const auto line = [&](const EdgeLine& g, const EdgeLine& edge, double outward,
                              Continuation continuation) {
            return continue_hysteresis(edge.edge, edge.at_edge, outward, continuation,
                                       std::max(g.reach, 0.02 * travel));
        };
        curve.continue_with(line(force.below(), curve.below(), -1.0, domain.below),
                            line(force.above(), curve.above(), +1.0, domain.above));
        return curve;
    }

    Domain domain_;
};

static_assert(Environment<HysteresisNetwork>);

}  // namespace palpate
