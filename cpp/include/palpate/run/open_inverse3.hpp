// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "palpate/inline.hpp"
#include "palpate/run/live_device.hpp"
#include "palpate/run/render.hpp"

namespace palpate {

/// Opens a Haply Inverse3 device for rendering. Throws std::invalid_argument with the reason if that is not possible.
[[nodiscard]] PALPATE_INLINE std::unique_ptr<LiveDevice> open_inverse3(const RenderOptions& options,
                                                                       const PlannedModel& model);

}  // namespace palpate

#ifndef PALPATE_COMPILED
#include "palpate/run/detail/open_inverse3.hpp"
#endif
