// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "palpate/rendering/structure.hpp"

namespace palpate {

/// No virtual object at all: the handle is free, and what moves it is watched.
class FreeMotion {
  public:
    void reset(double /*position*/) noexcept {}

    [[nodiscard]] Rendered step(double position) noexcept {
        return std::isfinite(position) ? Rendered{0.0, position, 0, Status::Ok, false}
                                       : detail::refused(position);
    }
};

}  // namespace palpate
