// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "palpate/model/continuation.hpp"
#include "palpate/model/parameters.hpp"
#include "palpate/model/radial_bounds.hpp"
#include "palpate/model/radial_network.hpp"

namespace palpate {

/// A force of position x and velocity v, as it is rendered: the network N of eq. 4 inside its domain of positions and
/// velocities,
///
///     f(x, v) = N(clip x, clip v) + s (x - clip x).
///
/// clip limits position and velocity to their values in the domain. Outside the domain of positions the force continues
/// as a straight line. At every velocity the slope s of this line is that for velocity zero. (`RadialNetwork` does not
/// limit the slope outside its domain in this way.)
class VelocityNetwork {
  public:
    VelocityNetwork(NetworkParameters network, Domain domain)
        : network_{checked(std::move(network)), std::move(domain)} {
        const double margin = uncertain_end * travel();
        const Interval slopes = resting_bounds(lower() + margin, upper() - margin, 0.01).gradient[0];
        const CurveExtent extent{travel(), resting_bounds(0.01).value.largest(), std::max(0.0, slopes.upper)};
        below_ = continue_force(lower(), resting(lower()), -1.0, Continuation::Linear, extent);
        above_ = continue_force(upper(), resting(upper()), +1.0, Continuation::Linear, extent);
    }

    [[nodiscard]] const RadialNetwork& network() const noexcept { return network_; }
    [[nodiscard]] double lower() const noexcept { return network_.domain().lower[0]; }
    [[nodiscard]] double upper() const noexcept { return network_.domain().upper[0]; }
    [[nodiscard]] double travel() const noexcept { return upper() - lower(); }
    /// Return the straight lines that continue the force at velocity zero below and above the domain. The
    /// antiderivatives in these lines are not set.
    [[nodiscard]] const EdgeLine& below() const noexcept { return below_; }
    [[nodiscard]] const EdgeLine& above() const noexcept { return above_; }

    /// Returns the force at a position and a velocity [N], continuation included.
    [[nodiscard]] double force(double position, double velocity) const noexcept {
        const double inside = std::clamp(position, lower(), upper());
        const double slope = (position < inside ? below_ : above_).at_edge.slope;
        return network_.value(std::array{inside, clipped(velocity)}) + slope * (position - inside);
    }

    [[nodiscard]] bool extrapolated(double position, double velocity) const noexcept {
        return network_.extrapolated(std::array{position, velocity});
    }

    /// Returns the smallest width of a wavelet along the position [m], at most the length of the domain.
    [[nodiscard]] double finest_width() const noexcept {
        return palpate::finest_width(network_.parameters(), travel());
    }

    /// Returns proved bounds of the force and its gradient over the domain of positions and velocities, wider than the
    /// true ones by at most `relative` times their largest absolute values.
    [[nodiscard]] RadialBounds moving_bounds(double relative) const {
        return radial_bounds(network_.parameters(), network_.domain().lower, network_.domain().upper,
                             relative);
    }

    /// Returns proved bounds of the force and its gradient over the domain of positions, at velocity zero.
    [[nodiscard]] RadialBounds resting_bounds(double relative) const {
        return resting_bounds(lower(), upper(), relative);
    }

  private:
    static NetworkParameters checked(NetworkParameters network) {
        detail::require(network.dimension == 2, "the network has " + std::to_string(network.dimension) +
                                                    " inputs, must have 2: position and velocity");
        return network;
    }

    [[nodiscard]] RadialBounds resting_bounds(double from, double to, double relative) const {
        const double rest = clipped(0.0);
        return radial_bounds(network_.parameters(), std::array{from, rest}, std::array{to, rest}, relative);
    }

    [[nodiscard]] double clipped(double velocity) const noexcept {
        return std::clamp(velocity, network_.domain().lower[1], network_.domain().upper[1]);
    }

    /// Returns the force and its slope by position, at velocity zero.
    [[nodiscard]] Curve resting(double position) const noexcept {
        std::array<double, 2> gradient{};
        const double value = network_.at(std::array{position, clipped(0.0)}, gradient);
        return {.value = value, .slope = gradient[0]};
    }

    RadialNetwork network_;
    EdgeLine below_;
    EdgeLine above_;
};

}  // namespace palpate
