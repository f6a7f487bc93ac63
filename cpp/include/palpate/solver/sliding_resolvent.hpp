// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "palpate/model/bounds.hpp"
#include "palpate/model/environment.hpp"
#include "palpate/model/hysteresis.hpp"
#include "palpate/solver/load_line.hpp"
#include "palpate/solver/newton.hpp"
#include "palpate/solver/piecewise_force.hpp"
#include "palpate/solver/resolvent.hpp"

namespace palpate {

/// The resolvent of a hysteresis pair: one table for the slide while pressing, g + h, one for the slide while
/// releasing, g - h, and Newton's method in between, where the object sticks.
///
/// Where p + g' - |h'| > 0 and h >= 0 the whole of f + p y rises, sticking or sliding. Its solution is then the
/// one of the pressing slide if that lies at or above play + r, the one of the releasing slide if that lies at or
/// below play - r, and else lies in between. Where this is not certified all is left to `LoadLineSolver`.
class SlidingResolvent {
  public:
    struct Memory {
        WarmStart newton;
        Resolvent::Memory press;
        Resolvent::Memory release;

        Memory() = default;
        explicit Memory(double position) noexcept : newton{position} {}
    };

    SlidingResolvent(const HysteresisNetwork& pair, double p, const ResolventOptions& options = {})
        : press_{piecewise(pair, 1.0), p, options},
          release_{piecewise(pair, -1.0), p, options},
          radius_{pair.play_radius()},
          slope_{p} {
        const double gain = std::min(pair.loss().value_bounds().lower, 0.0) / radius_;
        stick_.least_slope = std::min(press_.solver().least_slope, release_.solver().least_slope) + gain;
        stick_.longest_step = std::min(press_.solver().longest_step, 0.5 * radius_);
        unique_ = stick_.unique(p);
        certify_curvature(pair);
    }

    /// Whether both slides have a table.
    [[nodiscard]] bool tabulated() const noexcept {
        return unique_ && press_.tabulated() && release_.tabulated();
    }
    /// Whether every load line of this slope is certified to have one solution.
    [[nodiscard]] bool unique(double p) const noexcept { return stick_.unique(p); }
    /// The search for a force of which nothing is certified.
    [[nodiscard]] LoadLineSolver uncertified() const noexcept { return stick_.uncertified(); }
    [[nodiscard]] std::size_t cells() const noexcept { return press_.cells() + release_.cells(); }
    [[nodiscard]] double position_error() const noexcept {
        return std::max(press_.position_error(), release_.position_error());
    }

    template <Environment E>
    [[nodiscard, gnu::always_inline]] inline Solution solve(const E& environment,
                                                            const typename E::State& state, LoadLine line,
                                                            Memory& memory) const noexcept {
        if (unique_ && line.slope == slope_) {
            const Solution press = press_.solve(Slide<E>{environment, 1.0}, {}, line, memory.press);
            if (press.position >= state.play + radius_) {
                memory.newton = WarmStart{press.position};
                return press;
            }
            const Solution release = release_.solve(Slide<E>{environment, -1.0}, {}, line, memory.release);
            if (release.position <= state.play - radius_) {
                memory.newton = WarmStart{release.position};
                return release;
            }
        }
        return stick(environment, state, line, memory.newton);
    }

  private:
    /// The pair as it is while it slides.
    template <class E>
    struct Slide {
        using State = Stateless;
        const E& environment;
        double s;

        [[nodiscard]] EnvironmentSample at(double x, const State& /*stateless*/) const noexcept {
            return environment.sliding(x, s);
        }
        void advance(double /*x*/, State& /*stateless*/) const noexcept {}
        [[nodiscard]] State start(double /*x*/) const noexcept { return {}; }
    };

    template <Environment E>
    [[nodiscard, gnu::noinline]] Solution stick(const E& environment, const typename E::State& state,
                                                LoadLine line, WarmStart& memory) const noexcept {
        LoadLineSolver solver = stick_;
        solver.smooth_from = std::max(solver.smooth_from, state.play - radius_);
        solver.smooth_to = std::min(solver.smooth_to, state.play + radius_);
        return solver.solve(environment, state, line, memory);
    }

    /// f'' = g'' + s h'' + 2 h' / r while it sticks.
    void certify_curvature(const HysteresisNetwork& pair) {
        const NetworkCurve& g = pair.force();
        const NetworkCurve& h = pair.loss();
        if (g.periodic()) {
            return;
        }
        constexpr int cuts = 256;
        const double step = (g.upper() - g.lower()) / cuts;
        stick_.curvature = 0.0;
        for (int k = 0; k < cuts; ++k) {
            const double from = g.lower() + k * step;
            const DerivativeBounds of_g = derivative_bounds(g.parameters(), from, from + step);
            const DerivativeBounds of_h = derivative_bounds(h.parameters(), from, from + step);
            stick_.curvature = std::max(stick_.curvature, of_g[2] + of_h[2] + 2.0 * of_h[1] / radius_);
        }
        stick_.smooth_from = g.lower();
        stick_.smooth_to = g.upper();
    }

    Resolvent press_;
    Resolvent release_;
    double radius_;
    double slope_;
    bool unique_ = false;
    LoadLineSolver stick_;  ///< and for all that is not certified
};

}  // namespace palpate
