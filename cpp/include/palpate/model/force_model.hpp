// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "palpate/fields/readable.hpp"
#include "palpate/model/hysteresis.hpp"
#include "palpate/model/memory.hpp"
#include "palpate/model/network.hpp"
#include "palpate/model/radial_network.hpp"
#include "palpate/model/velocity_network.hpp"

namespace palpate {

/// Largest number of wavelets of a model that can be rendered. A solver evaluates the force at most 64 times
/// (`LoadLineSolver`). Without a table each wavelet takes up to 10 ns, so 1000 of them leave a third of a tick of 1 ms.
/// A harmonic, with its sine and cosine, takes as long as two wavelets.
inline constexpr std::size_t most_wavelets = 1000;

/// SI units in which the numbers of a model are given; an empty unit is not stated. They do not change the force.
struct ModelUnits {
    std::string position;  ///< rad, m or count
    std::string force;     ///< N*m, N or A
    bool operator==(const ModelUnits&) const = default;
};

/// An identified force law of any kind that a model file can hold.
///
/// A hysteresis model identified from separate press and release strokes does not have a play radius. The rendering
/// then sets a play radius with `with_play_radius`.
class ForceModel {
  public:
    using Kind = std::variant<WaveletNetwork, HysteresisNetwork, RadialNetwork, VelocityNetwork>;

    ForceModel(NetworkParameters network, Domain domain)
        : kind_{make_network(std::move(network), std::move(domain))} {}

    ForceModel(const NetworkParameters& network, const HysteresisParameters& hysteresis, const Domain& domain,
               std::optional<double> play_radius)
        : kind_{make_hysteresis(network, hysteresis, domain, play_radius)}, play_radius_{play_radius} {}

    /// Makes a force of position and velocity: the second input of the network is the velocity.
    [[nodiscard]] static ForceModel of_velocity(NetworkParameters network, Domain domain) {
        return ForceModel{VelocityNetwork{std::move(network), std::move(domain)}};
    }

    /// Returns the force law: a network of position, a network with hysteresis, a network of position and velocity, or
    /// a network of several inputs.
    [[nodiscard]] const Kind& kind() const noexcept { return kind_; }
    /// Returns the wavelet network of one input, or null if the model is of another kind.
    [[nodiscard]] const WaveletNetwork* network() const noexcept {
        return std::get_if<WaveletNetwork>(&kind_);
    }
    /// Returns the hysteresis network, or null if the model is of another kind.
    [[nodiscard]] const HysteresisNetwork* hysteresis() const noexcept {
        return std::get_if<HysteresisNetwork>(&kind_);
    }
    /// Returns the force of position and velocity, or null if the model is of another kind.
    [[nodiscard]] const VelocityNetwork* velocity() const noexcept {
        return std::get_if<VelocityNetwork>(&kind_);
    }
    /// Returns the network of several inputs, with or without velocity, or null if the model is of another kind.
    [[nodiscard]] const RadialNetwork* radial() const noexcept {
        return velocity() != nullptr ? &velocity()->network() : std::get_if<RadialNetwork>(&kind_);
    }
    /// Returns the memory of a force of position, or null if the model has no memory. `network` is then the force at
    /// rest.
    [[nodiscard]] const MemoryNetwork* memory() const noexcept { return memory_ ? &*memory_ : nullptr; }
    /// Returns the units of the model's numbers.
    [[nodiscard]] const ModelUnits& units() const noexcept { return units_; }
    /// Returns the play radius [m], or nothing if the model was identified without a play radius.
    [[nodiscard]] std::optional<double> play_radius() const noexcept { return play_radius_; }

    [[nodiscard]] const NetworkParameters& parameters() const noexcept {
        if (const WaveletNetwork* single = network()) {
            return single->parameters();
        }
        return hysteresis() != nullptr ? hysteresis()->parameters() : radial()->parameters();
    }
    [[nodiscard]] const Domain& domain() const noexcept {
        if (const WaveletNetwork* single = network()) {
            return single->domain();
        }
        return hysteresis() != nullptr ? hysteresis()->domain() : radial()->domain();
    }

    /// Returns proved bounds of the slope of the force inside the domain [N/m], for press and release, at velocity zero,
    /// and at rest. With a play radius r and h >= 0, the bounds also hold during the motion after a reversal that changes
    /// press force to release force, which adds h / r (hysteresis / play radius) to the slope. Throws
    /// std::invalid_argument for models that cannot be rendered (`require_renderable`).
    [[nodiscard]] Interval slope_bounds(std::optional<double> radius = std::nullopt) const {
        if (const WaveletNetwork* single = network()) {
            return single->curve().slope_bounds();
        }
        if (velocity() != nullptr) {
            return velocity()->resting_bounds(0.01).gradient[0];
        }
        require_one_input(parameters());
        const Interval common = hysteresis()->force().slope_bounds();
        const double hysteresis_slope = hysteresis()->hysteresis_force().slope_bounds().largest();
        const double sticking_slope =
            radius ? hysteresis()->hysteresis_force().value_bounds().largest() / *radius : 0.0;
        return {common.lower - hysteresis_slope, common.upper + hysteresis_slope + sticking_slope};
    }

    /// Throws std::invalid_argument if the slope bounds stored in a model file do not contain the slopes of this
    /// network of one input; accepts networks of several inputs. A difference of 1 % of the steepest slope is accepted,
    /// because two releases of the program may compute bounds that differ by this amount.
    void require_slopes_within(Interval stored) const {
        if (parameters().dimension != 1) {
            return;
        }
        const Interval slopes = slope_bounds();
        const double slack = 0.01 * slopes.largest();
        const auto sentence = [](const char* name, double value, const char* side, double bound) {
            return std::string("slope_bounds.") + name + " is " + readable(value) + ": must be " + side +
                   " " + readable(bound) + ", the bound of this network's slope";
        };
        detail::require(stored.lower <= slopes.lower + slack,
                        sentence("min", stored.lower, "at most", slopes.lower));
        detail::require(stored.upper >= slopes.upper - slack,
                        sentence("max", stored.upper, "at least", slopes.upper));
    }

    /// Returns the smallest width of a wavelet along the position [m], at most the length of the domain.
    [[nodiscard]] double finest_width() const noexcept {
        const double width = palpate::finest_width(parameters(), domain().upper[0] - domain().lower[0]);
        return memory_ ? memory_->finest_width(width) : width;
    }

    /// Returns a copy of a force of position without hysteresis, with this memory. The force becomes the force at rest.
    [[nodiscard]] ForceModel with_memory(MemoryParameters parameters) const {
        detail::require(network() != nullptr,
                        "only a force of position without hysteresis can have a memory");
        ForceModel model = *this;
        model.memory_.emplace(std::move(parameters), network()->curve(), domain());
        return model;
    }

    /// Returns a copy of the model with this play radius [m]. A model without hysteresis is copied unchanged.
    [[nodiscard]] ForceModel with_play_radius(double radius) const {
        const HysteresisNetwork* both = hysteresis();
        if (both == nullptr) {
            return *this;
        }
        const NetworkParameters& h = both->hysteresis_force().parameters();
        return ForceModel{both->parameters(), {h.weight, h.linear[0], h.bias}, both->domain(), radius}
            .with_units(units_);
    }

    /// Returns a copy of the model whose numbers are given in these units. The numbers do not change.
    [[nodiscard]] ForceModel with_units(ModelUnits units) const {
        ForceModel model = *this;
        model.units_ = std::move(units);
        return model;
    }

  private:
    explicit ForceModel(Kind kind) : kind_{std::move(kind)} {}

    static Kind make_network(NetworkParameters network, Domain domain) {
        if (network.dimension == 1) {
            return WaveletNetwork{network, std::move(domain)};
        }
        return RadialNetwork{std::move(network), std::move(domain)};
    }

    static HysteresisNetwork make_hysteresis(const NetworkParameters& network,
                                             const HysteresisParameters& hysteresis, const Domain& domain,
                                             std::optional<double> play_radius) {
        detail::require(domain.lower.size() == 1 && domain.upper.size() == 1,
                        "a hysteresis network has one input");
        const double radius =
            play_radius.value_or(usual_play_radius(std::abs(domain.upper[0] - domain.lower[0])));
        return {network, hysteresis, domain, radius};
    }

    Kind kind_;
    std::optional<double> play_radius_;
    std::optional<MemoryNetwork> memory_;
    ModelUnits units_;
};

/// Throws std::invalid_argument unless the model is a force of position, with or without hysteresis or velocity. Models
/// with other inputs cannot be rendered.
inline void require_renderable(const ForceModel& model) {
    if (model.velocity() == nullptr) {
        require_one_input(model.parameters());
    }
}

}  // namespace palpate
