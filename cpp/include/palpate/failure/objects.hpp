// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "palpate/model/continuation.hpp"
#include "palpate/model/environment.hpp"
#include "palpate/model/hysteresis.hpp"

namespace palpate {

/// f = stiffness x: the object that every bound is known of.
struct LinearObject {
    using State = Stateless;
    double stiffness = 0.0;

    [[nodiscard]] EnvironmentSample at(double x, const State& /*stateless*/) const noexcept {
        return {stiffness * x, stiffness, 0.5 * stiffness * x * x, false};
    }
    void advance(double /*x*/, State& /*stateless*/) const noexcept {}
    [[nodiscard]] State start(double /*x*/) const noexcept { return {}; }
};

/// f = falling (x^3 / width^2 - x): falls at 0 with the slope -falling, and snaps from -width to width.
struct SnappingObject {
    using State = Stateless;
    double falling = 0.0;
    double width = 0.1;

    [[nodiscard]] EnvironmentSample at(double x, const State& /*stateless*/) const noexcept {
        const double u = x / width;
        return {falling * x * (u * u - 1.0), falling * (3.0 * u * u - 1.0),
                0.5 * falling * x * x * (0.5 * u * u - 1.0), false};
    }
    void advance(double /*x*/, State& /*stateless*/) const noexcept {}
    [[nodiscard]] State start(double /*x*/) const noexcept { return {}; }
};

/// A straight line as one of the two curves of a hysteresis.
struct StraightCurve {
    double slope = 0.0;
    double offset = 0.0;

    [[nodiscard]] Curve at(double x) const noexcept {
        return {slope * x + offset, slope, (0.5 * slope * x + offset) * x,
                (slope * x / 6.0 + 0.5 * offset) * x * x};
    }
    [[nodiscard]] bool extrapolated(double /*x*/) const noexcept { return false; }
};

/// f = g x + s h: a spring with an even loss.
using EvenHysteresis = HysteresisPair<StraightCurve>;

static_assert(Environment<LinearObject> && Environment<EvenHysteresis> && Environment<SnappingObject>);

}  // namespace palpate
