// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include "palpate/model/continuation.hpp"
#include "palpate/model/environment.hpp"

namespace palpate::rivals {

/// A force that is linear between equally spaced positions. Its slopes are bounded by its secants, and every method of
/// the bench evaluates it in the same few nanoseconds. Outside the table the first and the last line continue.
class TableCurve {
  public:
    /// Makes the curve through `values` at equally spaced positions from `lower` to `upper`.
    TableCurve(double lower, double upper, const std::vector<double>& values)
        : lower_{lower}, step_{(upper - lower) / static_cast<double>(values.size() - 1)} {
        std::vector<Curve> nodes;
        double integral = 0.0;
        double double_integral = 0.0;
        for (std::size_t k = 0; k + 1 < values.size(); ++k) {
            const double slope = (values[k + 1] - values[k]) / step_;
            nodes.push_back({values[k], slope, integral, double_integral});
            const Curve end = along(nodes.back(), step_);
            integral = end.integral;
            double_integral = end.double_integral;
        }
        nodes_ = std::make_shared<const std::vector<Curve>>(std::move(nodes));
    }

    /// Returns the curve multiplied by a factor.
    [[nodiscard]] TableCurve scaled(double factor) const {
        TableCurve result = *this;
        result.factor_ *= factor;
        return result;
    }

    [[nodiscard]] Curve at(double x) const noexcept {
        const auto last = static_cast<double>(nodes_->size() - 1);
        const double cell = std::clamp(std::floor((x - lower_) / step_), 0.0, last);
        const Curve found = along((*nodes_)[static_cast<std::size_t>(cell)], x - lower_ - cell * step_);
        return {factor_ * found.value, factor_ * found.slope, factor_ * found.integral,
                factor_ * found.double_integral};
    }
    [[nodiscard]] static bool extrapolated(double /*x*/) noexcept { return false; }

    [[nodiscard]] std::size_t size() const noexcept { return nodes_->size() + 1; }
    [[nodiscard]] double position(std::size_t k) const noexcept {
        return lower_ + step_ * static_cast<double>(k);
    }
    [[nodiscard]] double step() const noexcept { return step_; }
    [[nodiscard]] std::vector<double> values() const {
        std::vector<double> all;
        for (std::size_t k = 0; k < size(); ++k) {
            all.push_back(at(position(k)).value);
        }
        return all;
    }
    /// Returns the curve of other values at the same positions.
    [[nodiscard]] TableCurve with(const std::vector<double>& values) const {
        return {lower_, position(size() - 1), values};
    }

    /// Returns, at each position of the table, the smallest slope >= 0 of a line through the force whose potential lies
    /// above that of the curve up to the distance `reach`, plus `more`.
    [[nodiscard]] TableCurve majorant_slopes(double reach, double more) const {
        const int parts = static_cast<int>(std::ceil(reach / step_));
        std::vector<double> slopes(size(), 0.0);
        for (std::size_t k = 0; k < size(); ++k) {
            const Curve here = at(position(k));
            for (int j = -parts; j <= parts; ++j) {
                const double d = j == 0 ? step_ : j * reach / parts;
                const double lack = at(position(k) + d).integral - here.integral - here.value * d;
                slopes[k] = std::max(slopes[k], 2.0 * lack / (d * d));
            }
        }
        for (double& slope : slopes) {
            slope += more;
        }
        return with(slopes);
    }

    /// Returns the nearest curve (largest error between the positions `from` and `to`) whose slopes are between
    /// -steepest and `steepest`: the middle between the smallest such curve above this one and the largest below it.
    /// Outside these positions the steps of the curve are limited.
    [[nodiscard]] TableCurve slope_limited(double from, double to, double steepest) const {
        const double step = steepest * step_;
        const std::vector<double> wanted = values();
        std::vector<double> upper = wanted;
        std::vector<double> lower = wanted;
        const auto pull = [&](std::size_t k, std::size_t neighbour) {
            upper[k] = std::max(upper[k], upper[neighbour] - step);
            lower[k] = std::min(lower[k], lower[neighbour] + step);
        };
        const auto first = static_cast<std::size_t>((from - lower_) / step_);
        const auto last = static_cast<std::size_t>((to - lower_) / step_);
        for (std::size_t k = first + 1; k <= last; ++k) {
            pull(k, k - 1);
        }
        for (std::size_t k = last; k > first; --k) {
            pull(k - 1, k);
        }
        std::vector<double> near = wanted;
        for (std::size_t k = first; k <= last; ++k) {
            near[k] = 0.5 * (upper[k] + lower[k]);
        }
        for (std::size_t k = last + 1; k < near.size(); ++k) {
            near[k] = near[k - 1] + std::clamp(wanted[k] - wanted[k - 1], -step, step);
        }
        for (std::size_t k = first; k > 0; --k) {
            near[k - 1] = near[k] + std::clamp(wanted[k - 1] - wanted[k], -step, step);
        }
        return with(near);
    }

  private:
    [[nodiscard]] static Curve along(const Curve& node, double t) noexcept {
        return {node.value + node.slope * t, node.slope,
                node.integral + (node.value + 0.5 * node.slope * t) * t,
                node.double_integral + (node.integral + (0.5 * node.value + node.slope * t / 6.0) * t) * t};
    }

    double lower_;
    double step_;
    double factor_ = 1.0;
    std::shared_ptr<const std::vector<Curve>> nodes_;
};

/// A force of position alone.
struct StaticForce {
    using State = Stateless;
    TableCurve curve;

    [[nodiscard]] EnvironmentSample at(double x, const State& /*stateless*/) const noexcept {
        const Curve found = curve.at(x);
        return {found.value, found.slope, found.integral, false};
    }
    void advance(double /*x*/, State& /*stateless*/) const noexcept {}
    [[nodiscard]] State start(double /*x*/) const noexcept { return {}; }
};

static_assert(Environment<StaticForce>);

}  // namespace palpate::rivals
