// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>

#include "palpate/model/environment.hpp"
#include "palpate/rendering/structure.hpp"

namespace palpate {

/// F = f(x), x the measured position: no coupling, no state but the environment's own.
template <Environment E>
class Direct {
  public:
    explicit Direct(E environment) : environment_{std::move(environment)} { reset(0.0); }

    void reset(double position) noexcept { state_ = environment_.start(position); }

    [[nodiscard]] Rendered step(double position) noexcept {
        const EnvironmentSample sample = environment_.at(position, state_);
        if (!std::isfinite(position) || !std::isfinite(sample.force)) {
            return detail::refused(position);
        }
        environment_.advance(position, state_);
        return {sample.force, position, 1, Status::Ok, sample.extrapolated};
    }

  private:
    E environment_;
    typename E::State state_;
};

}  // namespace palpate
