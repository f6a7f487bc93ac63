// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include "../support.hpp"
#include "palpate/model/environment.hpp"
#include "palpate/model/hysteresis.hpp"
#include "palpate/model/network_curve.hpp"
#include "palpate/stability/force_bounds.hpp"

namespace palpate::energy_search {

/// Force law of straight pieces between points of equal distance; outside the points the force is constant or
/// periodic. The worst cases of the proofs have this shape, with only two slopes: the steepest rise M and the steepest
/// fall -s.
class Pieces {
  public:
    Pieces(double from, double step, std::vector<double> force, bool repeats = false)
        : from_{from}, step_{step}, force_{std::move(force)}, repeats_{repeats} {
        if (repeats_) {
            force_.push_back(force_.front());
        }
        integral_.push_back(0.0);
        for (std::size_t k = 0; k < cells(); ++k) {
            integral_.push_back(integral_.back() + 0.5 * (force_[k] + force_[k + 1]) * step_);
        }
    }

    [[nodiscard]] double from() const noexcept { return from_; }
    [[nodiscard]] double step() const noexcept { return step_; }
    [[nodiscard]] std::size_t cells() const noexcept { return force_.size() - 1; }
    [[nodiscard]] const std::vector<double>& points() const noexcept { return force_; }

    /// Returns force, slope and energy of a force that consists of straight pieces, at the position x.
    [[nodiscard]] Curve at(double x) const noexcept {
        double u = (x - from_) / step_;
        const auto last = static_cast<double>(cells());
        const double turns = repeats_ ? std::floor(u / last) : 0.0;
        u -= last * turns;
        if (!repeats_ && (u <= 0.0 || u >= last)) {
            const double edge = u <= 0.0 ? 0.0 : last;
            const double force = u <= 0.0 ? force_.front() : force_.back();
            const double integral = u <= 0.0 ? 0.0 : integral_.back();
            return {force, 0.0, integral + force * (u - edge) * step_, 0.0};
        }
        const auto cell = std::min(static_cast<std::size_t>(u), cells() - 1);
        const double force = force_[cell];
        const double rise = force_[cell + 1] - force;
        const double part = u - static_cast<double>(cell);
        return {force + part * rise, rise / step_,
                turns * integral_.back() + integral_[cell] + step_ * part * (force + 0.5 * part * rise), 0.0};
    }
    [[nodiscard]] bool extrapolated(double /*x*/) const noexcept { return false; }

    [[nodiscard]] Interval slopes() const noexcept {
        Interval range{repeats_ ? std::numeric_limits<double>::infinity() : 0.0,
                       repeats_ ? -std::numeric_limits<double>::infinity() : 0.0};
        for (std::size_t k = 0; k < cells(); ++k) {
            const double slope = (force_[k + 1] - force_[k]) / step_;
            range = {std::min(range.lower, slope), std::max(range.upper, slope)};
        }
        return range;
    }

  private:
    double from_;
    double step_;
    std::vector<double> force_;
    std::vector<double> integral_;
    bool repeats_;
};

/// An object whose force consists of straight pieces, without hysteresis and velocity.
struct PieceObject {
    using State = Stateless;
    Pieces pieces;

    [[nodiscard]] EnvironmentSample at(double x, const State& /*state*/) const noexcept {
        const Curve here = pieces.at(x);
        return {here.value, here.slope, here.integral, false};
    }
    void advance(double /*x*/, State& /*state*/) const noexcept {}
    [[nodiscard]] State start(double /*x*/) const noexcept { return {}; }
};

/// Returns the exact bounds of force and slope of a force that consists of straight pieces.
[[nodiscard]] inline ForceBounds bounds_of(const Pieces& pieces) {
    ForceBounds bounds;
    bounds.slope = pieces.slopes();
    bounds.steepest = bounds.sliding = std::max(std::abs(bounds.slope.lower), std::abs(bounds.slope.upper));
    return bounds;
}

/// Returns the exact bounds of a force g + s h with mean force g, hysteresis h and direction state s. Both g and h are
/// straight pieces between the same points.
[[nodiscard]] inline ForceBounds bounds_of(const HysteresisPair<Pieces>& pair) {
    const Pieces& g = pair.force();
    const Pieces& h = pair.hysteresis_force();
    ForceBounds bounds;
    bounds.hysteresis = true;
    bounds.slope = {0.0, 0.0};
    bounds.hysteresis_force = {h.points().front(), h.points().front()};
    for (std::size_t k = 0; k < g.cells(); ++k) {
        const double slope = (g.points()[k + 1] - g.points()[k]) / g.step();
        const double bend = std::abs(h.points()[k + 1] - h.points()[k]) / h.step();
        for (const double hysteresis : {h.points()[k], h.points()[k + 1]}) {
            const double stick = hysteresis / pair.play_radius();
            bounds.slope = {std::min(bounds.slope.lower, slope - bend),
                            std::max(bounds.slope.upper, slope + bend + stick)};
            bounds.sliding = std::max(bounds.sliding, std::abs(slope) + bend);
            bounds.steepest = std::max(bounds.steepest, std::abs(slope) + bend + stick);
            bounds.hysteresis_force = {std::min(bounds.hysteresis_force.lower, hysteresis),
                                       std::max(bounds.hysteresis_force.upper, hysteresis)};
            bounds.hysteresis_per_play = std::max(bounds.hysteresis_per_play, stick);
        }
    }
    return bounds;
}

/// Steepest rising slope M and steepest falling slope s that a random force may have.
struct Slopes {
    double M = 1.0;
    double s = 0.0;
};

/// Shape of a random force: any shape, or one of the shapes for which the bounds are closest: long runs of the extreme
/// slopes, falling slopes limited to the steepest rising slope, or a force that never rises.
enum class Shapes { Any, Steep };

/// Returns slopes that only rise, only fall, or rise and fall.
[[nodiscard]] inline Slopes random_slopes(test::Random& random, Shapes shapes = Shapes::Any) {
    const double M = std::exp(test::uniform(random, 0.0, 4.0));
    switch (random() % (shapes == Shapes::Any ? 4 : 3)) {
        case 0:
            return {M, 0.0};
        case 1:
            return {0.0, M};
        case 2:
            return {M, M * test::uniform(random, 0.0, 1.0)};
        default:
            return {M, M * test::uniform(random, 1.0, 4.0)};
    }
}

/// Returns a random force at `count` positions. Its shape is one of four: long parts with the steepest slopes, random
/// slopes, a wall, or a spring.
[[nodiscard]] inline std::vector<double> random_forces(test::Random& random, int count, double step,
                                                       Slopes slopes, Shapes shapes = Shapes::Any) {
    std::vector<double> force{0.0};
    const bool steep = shapes == Shapes::Steep;
    const auto kind = steep ? 3 * (random() % 2) : random() % 4;
    const int run = steep ? std::max(2, count / 4) : 1 + static_cast<int>(random() % 5);
    const int wall = static_cast<int>(random() % static_cast<std::uint64_t>(count));
    const double rising = test::uniform(random, 0.2, 0.8);
    bool up = random() % 2 == 0;
    for (int k = 1; k < count; ++k) {
        double slope = slopes.M > 0.0 ? slopes.M : -slopes.s;
        if (kind == 0) {
            if (k % run == 0) {
                up = test::uniform(random, 0.0, 1.0) < rising;
            }
            slope = up ? slopes.M : -slopes.s;
        } else if (kind == 1) {
            slope = std::clamp(
                test::uniform(random, -1.5 * slopes.s - 0.2 * slopes.M, 1.5 * slopes.M + 0.2 * slopes.s),
                -slopes.s, slopes.M);
        } else if (kind == 2 && k < wall) {
            slope = random() % 4 == 0 ? -slopes.s : 0.0;
        }
        force.push_back(force.back() + slope * step);
    }
    const double shift = force[random() % static_cast<std::uint64_t>(count)];
    for (double& value : force) {
        value -= shift;
    }
    return force;
}

/// Returns the force of a wheel over one revolution: random values at `count` points with mean `mean`.
[[nodiscard]] inline std::vector<double> random_wheel(test::Random& random, int count, double size,
                                                      double mean) {
    std::vector<double> force;
    const bool peak = random() % 2 == 0;
    double sum = 0.0;
    for (int k = 0; k < count; ++k) {
        force.push_back(peak ? (k == 0 ? size : 0.0) + 0.1 * test::uniform(random, -size, size)
                             : test::uniform(random, -size, size));
        sum += force.back();
    }
    for (double& value : force) {
        value += mean - sum / count;
    }
    return force;
}

}  // namespace palpate::energy_search
