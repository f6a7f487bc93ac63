// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>

#include "palpate/inline.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/run/live_device.hpp"
#include "palpate/run/measure.hpp"
#include "palpate/run/render.hpp"

namespace palpate {

/// Opens a device for rendering by its name, which has one of the forms in `transports`. Throws std::invalid_argument
/// with the reason if the device cannot be opened or does not fit the model.
[[nodiscard]] PALPATE_INLINE std::unique_ptr<LiveDevice> open_device(const RenderOptions& options,
                                                                     const PlannedModel& model);

/// Returns a device for a measurement by its name, not open yet. The model `object` is mounted on the handle of the
/// simulated device. Sets options of the measurement that depend on the device.
[[nodiscard]] PALPATE_INLINE std::unique_ptr<LiveDevice> device_to_measure(
    MeasureOptions& options, const std::optional<ForceModel>& object);

}  // namespace palpate

#ifndef PALPATE_COMPILED
#include "palpate/simulation/detail/open_device.hpp"
#endif
