// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <utility>

#include "palpate/model/velocity_network.hpp"
#include "palpate/rendering/structure.hpp"

namespace palpate {

/// F = f(x, v), v = (x_k - x_{k-1}) / T: direct rendering of a force of position and velocity. The difference is
/// that of two samples and no more, because the proof of its certificate is about that one.
class DirectVelocity {
  public:
    DirectVelocity(VelocityNetwork force, double period_s) : force_{std::move(force)}, period_s_{period_s} {}

    void reset(double position) noexcept { last_ = position; }

    [[nodiscard]] Rendered step(double position) noexcept {
        const double velocity = (position - last_) / period_s_;
        const double force = force_.force(position, velocity);
        if (!std::isfinite(position) || !std::isfinite(force)) {
            return detail::refused(position);
        }
        last_ = position;
        return {force, position, 1, Status::Ok, force_.extrapolated(position, velocity)};
    }

  private:
    VelocityNetwork force_;
    double period_s_;
    double last_ = 0.0;
};

static_assert(Structure<DirectVelocity>);

}  // namespace palpate
