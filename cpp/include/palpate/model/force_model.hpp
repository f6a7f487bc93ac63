// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <variant>

#include "palpate/inline.hpp"
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

    ForceModel(NetworkParameters network, Domain domain);
    ForceModel(const NetworkParameters& network, const HysteresisParameters& hysteresis, const Domain& domain,
               std::optional<double> play_radius);
    ForceModel(const ForceModel&);
    ForceModel(ForceModel&&) noexcept;
    ForceModel& operator=(const ForceModel&);
    ForceModel& operator=(ForceModel&&) noexcept;
    ~ForceModel();

    /// Makes a force of position and velocity: the second input of the network is the velocity.
    [[nodiscard]] static ForceModel of_velocity(NetworkParameters network, Domain domain);

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
    [[nodiscard]] Interval slope_bounds(std::optional<double> radius = std::nullopt) const;

    /// Throws std::invalid_argument if the slope bounds stored in a model file do not contain the slopes of this
    /// network of one input; accepts networks of several inputs. A difference of 1 % of the steepest slope is accepted,
    /// because two releases of the program may compute bounds that differ by this amount.
    void require_slopes_within(Interval stored) const;

    /// Returns the smallest width of a wavelet along the position [m], at most the length of the domain.
    [[nodiscard]] double finest_width() const noexcept {
        const double width = palpate::finest_width(parameters(), domain().upper[0] - domain().lower[0]);
        return memory_ ? memory_->finest_width(width) : width;
    }

    /// Returns a copy of a force of position without hysteresis, with this memory. The force becomes the force at rest.
    [[nodiscard]] ForceModel with_memory(MemoryParameters parameters) const;

    /// Returns a copy of the model with this play radius [m]. A model without hysteresis is copied unchanged.
    [[nodiscard]] ForceModel with_play_radius(double radius) const;

    /// Returns a copy of the model whose numbers are given in these units. The numbers do not change.
    [[nodiscard]] ForceModel with_units(ModelUnits units) const;

  private:
    explicit ForceModel(Kind kind);

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

#ifndef PALPATE_COMPILED
#include "palpate/model/detail/force_model.hpp"
#endif
