// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "palpate/model/compiled_network.hpp"
#include "palpate/model/environment.hpp"
#include "palpate/model/network_curve.hpp"
#include "palpate/model/parameters.hpp"

namespace palpate {

/// Largest number of branches of a memory. A state with this number of branches fits into two cache lines.
inline constexpr std::size_t most_branches = 8;

/// Parameters of a memory: the ratio p, a network of one input without unit, and its branches.
struct MemoryParameters {
    NetworkParameters ratio{.linear = {0.0}, .bias = 1.0};  ///< p, change of the coordinate by position [-]
    std::vector<double> stiffness;                          ///< stiffness k_j of each branch, >= 0 [N/m]
    std::vector<double> time_constant_s;                    ///< time constant tau_j of each branch, > 0 [s]
    std::vector<double> yield_stretch{};  ///< stretch Y_j at which each branch slips, > 0 [m]; or none

    /// Returns the yield stretch Y_j of a branch [m]; infinite if no branch slips.
    [[nodiscard]] double yield_at(std::size_t j) const noexcept {
        return yield_stretch.empty() ? std::numeric_limits<double>::infinity() : yield_stretch[j];
    }
};

/// Throws std::invalid_argument if a parameter of a memory is invalid. The message states its name and the rule.
inline void validate(const MemoryParameters& memory, const Domain& domain) {
    validate(memory.ratio, domain);
    require_one_input(memory.ratio);
    const std::size_t n = memory.stiffness.size();
    detail::require(
        n >= 1 && n <= most_branches,
        "stiffness has " + std::to_string(n) + " values, must have 1 to " + std::to_string(most_branches));
    detail::require_size(memory.time_constant_s, n, "time_constant_s");
    if (!memory.yield_stretch.empty()) {
        detail::require_size(memory.yield_stretch, n, "yield_stretch");
    }
    const auto require_positive = [](const std::vector<double>& values, const char* name) {
        for (std::size_t j = 0; j < values.size(); ++j) {
            detail::require(values[j] > 0.0, std::string(name) + "[" + std::to_string(j) + "] is " +
                                                 std::to_string(values[j]) + ", must be > 0");
        }
    };
    require_positive(memory.time_constant_s, "time_constant_s");
    require_positive(memory.yield_stretch, "yield_stretch");
    for (std::size_t j = 0; j < n; ++j) {
        const double k = memory.stiffness[j];
        detail::require(k >= 0.0 && std::isfinite(k),
                        "stiffness[" + std::to_string(j) + "] is " + std::to_string(k) + ", must be >= 0");
    }
    detail::require(!domain.period, "period is set, but a force with memory cannot be periodic");
}

/// Memory of an object that relaxes or slips: springs in series with a dashpot and a slider (branches), in parallel with
/// the force at rest g.
///
/// The coordinate u with du/dx = p(x) moves one end of each branch. The dashpot moves the other end z_j, and the slider
/// moves it as far as |e_j| would exceed the yield stretch Y_j:
///
///     f = g(x) + p(x) sum_j k_j e_j,   e_j = u - z_j,   dz_j/dt = e_j / tau_j,   |e_j| <= Y_j.
///
/// Branches that only slip (tau_j infinite) are those of Masing and Iwan: loops whose width grows with their length. The
/// ratio p gives an object other forces of the branches at other positions. The object stores the energy
/// G(x) + sum_j k_j e_j^2 / 2, with the antiderivative G of g. It dissipates the power sum_j k_j e_j dz_j/dt >= 0, so no
/// closed motion generates energy, for any p.
class MemoryNetwork {
  public:
    /// Makes the memory of a model with the force at rest `force`. Outside the domain, p is constant, or with a free
    /// continuation p decreases to zero over the distance over which g does.
    MemoryNetwork(MemoryParameters parameters, const NetworkCurve& force, const Domain& domain)
        : parameters_{(validate(parameters, domain), std::move(parameters))},
          ratio_{parameters_.ratio, domain} {
        if (domain.below == Continuation::Free || domain.above == Continuation::Free) {
            contact_ = force.above().at_edge.integral >= force.below().at_edge.integral ? 1 : -1;
        }
        const double travel = domain.upper[0] - domain.lower[0];
        const auto line = [&](const EdgeLine& g, const EdgeLine& edge, double outward,
                              Continuation continuation) {
            return continue_hysteresis(edge.edge, edge.at_edge, outward, continuation,
                                       std::max(g.reach, 0.02 * travel));
        };
        ratio_.continue_with(line(force.below(), ratio_.below(), -1.0, domain.below),
                             line(force.above(), ratio_.above(), +1.0, domain.above));
        const Interval values = ratio_.value_bounds();
        largest_ratio_ = values.largest();
        steepest_ratio_ = ratio_.slope_bounds().largest();
        double beyond = 0.0;
        for (const EdgeLine& edge : {ratio_.below(), ratio_.above()}) {
            steepest_ratio_ = std::max(steepest_ratio_, std::abs(edge.at_edge.slope));
            beyond += std::isfinite(edge.reach) ? 0.5 * std::abs(edge.at_edge.value) * edge.reach : 0.0;
        }
        const double range = ratio_.above().at_edge.integral - ratio_.below().at_edge.integral;
        largest_stretch_ = beyond + (values.lower >= 0.0 ? range : largest_ratio_ * travel);
    }

    [[nodiscard]] const MemoryParameters& parameters() const noexcept { return parameters_; }
    /// Returns the ratio p over all positions; its antiderivative is the coordinate u.
    [[nodiscard]] const NetworkCurve& ratio() const noexcept { return ratio_; }
    /// Returns the sign of the mean force at rest if the tool can leave the object, else 0. The memory then never pulls
    /// the tool against this sign, and no branch is stretched while the tool is away.
    [[nodiscard]] int contact() const noexcept { return contact_; }
    /// Return bounds of |p| and |dp/dx| over all positions.
    [[nodiscard]] double largest_ratio() const noexcept { return largest_ratio_; }
    [[nodiscard]] double steepest_ratio() const noexcept { return steepest_ratio_; }
    /// Returns the largest stretch of branch j [m], min(U, Y_j) with the coordinate's range U over the domain: a motion
    /// outside the domain does not stretch a branch further.
    [[nodiscard]] double largest_stretch(std::size_t j) const noexcept {
        return std::min(largest_stretch_, parameters_.yield_at(j));
    }
    /// Returns the largest force of the branches along their coordinate, sum_j k_j min(U, Y_j) [N].
    [[nodiscard]] double largest_tension() const noexcept {
        double sum = 0.0;
        for (std::size_t j = 0; j < parameters_.stiffness.size(); ++j) {
            sum += parameters_.stiffness[j] * largest_stretch(j);
        }
        return sum;
    }
    /// Returns the largest energy that the branches store, sum_j k_j min(U, Y_j)^2 / 2 [J].
    [[nodiscard]] double largest_energy() const noexcept {
        double sum = 0.0;
        for (std::size_t j = 0; j < parameters_.stiffness.size(); ++j) {
            sum += 0.5 * parameters_.stiffness[j] * largest_stretch(j) * largest_stretch(j);
        }
        return sum;
    }
    /// Returns the smallest width of a wavelet of the ratio, at most `travel` [m].
    [[nodiscard]] double finest_width(double travel) const noexcept {
        return palpate::finest_width(parameters_.ratio, travel);
    }

  private:
    MemoryParameters parameters_;
    NetworkCurve ratio_;
    int contact_ = 0;
    double largest_ratio_ = 0.0;
    double steepest_ratio_ = 0.0;
    double largest_stretch_ = 0.0;
};

/// Exact change of a branch's stretch over a time in which du/dt is constant: e <- kept e + moved du.
struct BranchStep {
    double kept;   ///< exp(-seconds / tau), share of the stretch that is left [-]
    double moved;  ///< share of the motion du that stretches the spring [-]

    BranchStep(double seconds, double time_constant_s) noexcept {
        const double ratio = seconds / time_constant_s;
        kept = std::exp(-ratio);
        moved = ratio > 0.0 ? -std::expm1(-ratio) / ratio : 1.0;
    }
};

/// A force with memory that is computed once in each period. `C` is the type of the curves: `NetworkCurve` or
/// `CompiledCurve`.
///
/// The branches use the backward Euler method, e_j <- (e_j + du) / (1 + T / tau_j), limited to Y_j, without iteration. If the
/// force would exceed the force limit, or would pull a tool that can leave the object, all stretches are multiplied by
/// one factor from 0 to 1, so that the force is at this limit. Where the ratio has ended and the tool is away, the factor
/// is 0: a fast tool passes the end of the ratio between two periods. The stored energy then only decreases.
template <class C>
class MemoryForce {
  public:
    struct State {
        double coordinate = 0.0;                      ///< u at the last position [m]
        std::array<double, most_branches> stretch{};  ///< stretch e_j of the spring of each branch [m]
    };

    /// Makes the force for the period `period_s` [s] on a device with this force limit [N].
    MemoryForce(C force, C ratio, const MemoryNetwork& memory, double period_s,
                double force_limit = std::numeric_limits<double>::infinity())
        : force_{std::move(force)},
          ratio_{std::move(ratio)},
          branches_{memory.parameters().stiffness.size()},
          contact_{memory.contact()},
          force_limit_{force_limit} {
        for (std::size_t j = 0; j < branches_; ++j) {
            stiffness_[j] = memory.parameters().stiffness[j];
            time_constant_s_[j] = memory.parameters().time_constant_s[j];
            largest_stretch_[j] = memory.largest_stretch(j);
            kept_[j] = 1.0 / (1.0 + period_s / time_constant_s_[j]);
        }
    }

    /// Returns force, slope and energy after a motion of one period to position x.
    [[nodiscard]] EnvironmentSample at(double x, const State& state) const noexcept {
        State moved = state;
        return move(x, moved);
    }
    /// Updates the state for a motion of one period to position x.
    void advance(double x, State& state) const noexcept { (void)move(x, state); }
    /// Returns the state of an object at rest at position x: no branch is stretched.
    [[nodiscard]] State start(double x) const noexcept { return {ratio_.at(x).integral, {}}; }

    /// Updates the state for a motion of one period to position x, and returns force, slope and energy there.
    EnvironmentSample move(double x, State& state) const noexcept {
        const Curve p = ratio_.at(x);
        const double moved = p.integral - state.coordinate;
        state.coordinate = p.integral;
        Sum sum;
        for (std::size_t j = 0; j < branches_; ++j) {
            stretch(j, kept_[j] * (state.stretch[j] + moved), kept_[j], state, sum);
        }
        return relaxed(x, p, sum, state).sample;
    }

    /// Force of the recorded motion at one row, and the factor by which the stretches were reduced [-].
    struct Recorded {
        EnvironmentSample sample;
        double factor = 1.0;
    };

    /// Updates the state for a motion to position x at constant speed du/dt during the time `seconds`, which may differ
    /// from the period. The stretches are exact for this motion.
    Recorded move_for(double x, double seconds, State& state) const noexcept {
        const Curve p = ratio_.at(x);
        const double moved = p.integral - state.coordinate;
        state.coordinate = p.integral;
        Sum sum;
        for (std::size_t j = 0; j < branches_; ++j) {
            const BranchStep share{seconds, time_constant_s_[j]};
            stretch(j, share.kept * state.stretch[j] + share.moved * moved, share.moved, state, sum);
        }
        return relaxed(x, p, sum, state);
    }

  private:
    /// Sum of the forces of the branches along u, and of their stiffnesses along u.
    struct Sum {
        double force = 0.0;
        double stiffness = 0.0;
    };

    /// Sets the stretch of branch j, limited, and adds its force to `sum`; `share` of a motion stretches it until it
    /// slips.
    void stretch(std::size_t j, double free, double share, State& state, Sum& sum) const noexcept {
        state.stretch[j] = std::clamp(free, -largest_stretch_[j], largest_stretch_[j]);
        sum.force += stiffness_[j] * state.stretch[j];
        sum.stiffness += std::abs(free) > largest_stretch_[j] ? 0.0 : stiffness_[j] * share;
    }

    /// Returns force, slope and energy for the sum of the branches, and reduces the stretches if the force is outside
    /// its limits.
    Recorded relaxed(double x, const Curve& p, const Sum& sum, State& state) const noexcept {
        const Curve g = force_.at(x);
        const double rest = std::clamp(g.value, -force_limit_, force_limit_);
        const double least = contact_ > 0 ? std::min(rest, 0.0) : -force_limit_;
        const double most = contact_ < 0 ? std::max(rest, 0.0) : force_limit_;
        const double unlimited = rest + p.value * sum.force;
        Recorded result{{unlimited, g.slope + p.slope * sum.force + p.value * p.value * sum.stiffness,
                         g.integral, force_.extrapolated(x)},
                        1.0};
        const double limit = std::clamp(unlimited, least, most);
        if (limit != unlimited) {
            result.factor = std::clamp((limit - rest) / (unlimited - rest), 0.0, 1.0);
            result.sample.force = limit;
            result.sample.slope = 0.0;
        }
        if (contact_ != 0 && p.value == 0.0) {
            result.factor = 0.0;
        }
        for (std::size_t j = 0; j < branches_; ++j) {
            state.stretch[j] *= result.factor;
            result.sample.energy += 0.5 * stiffness_[j] * state.stretch[j] * state.stretch[j];
        }
        return result;
    }

    C force_;
    C ratio_;
    std::array<double, most_branches> stiffness_{};
    std::array<double, most_branches> time_constant_s_{};
    std::array<double, most_branches>
        kept_{};  ///< share of a stretch that is left after a period at rest [-]
    std::size_t branches_;
    int contact_;
    double force_limit_;
    std::array<double, most_branches> largest_stretch_{};
};

static_assert(Environment<MemoryForce<NetworkCurve>>);
static_assert(Environment<MemoryForce<CompiledCurve>>);

}  // namespace palpate
