// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <optional>

#include "palpate/fields/field_table.hpp"
#include "palpate/inline.hpp"
#include "palpate/run/live_device.hpp"
#include "palpate/run/render.hpp"
#include "palpate/run/summary.hpp"

namespace palpate {

/// Options of a measurement of a real object on a device. Without `probe` and `push` a hand moves the handle.
struct MeasureOptions : RunOptions {
    RecordUnits units;
    bool probe = false;  ///< true: the device moves the handle slowly between lower and upper
    /// Settings of the slow motion; unset: defaults (`chosen_probe`)
    std::optional<double> lower, upper, speed, stiffness, force_limit;
    std::optional<double> push;   ///< force of the short pushes; unset: no pushes [N or N*m]
    bool keep = false;            ///< true: the summary contains the records of all ticks
    bool transducer = true;       ///< true: the simulated device has a force transducer
    double friction_share = 0.0;  ///< simulated device: Coulomb friction divided by force limit
    bool device_renders = false;  ///< true: the USB device renders its own model, and its force is recorded

    /// Returns true if the device moves the handle.
    [[nodiscard]] bool moves() const noexcept { return probe || push; }
};

template <>
inline constexpr auto fields_of<MeasureOptions> =
    fields_of<RunOptions> + FieldTable{Field<&MeasureOptions::probe>{"probe"},
                                       Field<&MeasureOptions::lower>{"lower"},
                                       Field<&MeasureOptions::upper>{"upper"},
                                       Field<&MeasureOptions::speed>{"speed"},
                                       Field<&MeasureOptions::stiffness>{"stiffness"},
                                       Field<&MeasureOptions::force_limit>{"force_limit"},
                                       Field<&MeasureOptions::push>{"push"},
                                       Field<&MeasureOptions::keep>{"keep"},
                                       Field<&MeasureOptions::transducer>{"transducer"},
                                       Field<&MeasureOptions::friction_share>{"friction_share"},
                                       Field<&MeasureOptions::device_renders>{"device_renders"}};

/// Opens a device and measures the force of a real object on it, while a hand, a probe or pushes move the handle.
[[nodiscard]] PALPATE_INLINE Summary measure(const MeasureOptions& options, LiveDevice& device,
                                             const std::atomic<bool>& stop_requested, const Watch& watch);

}  // namespace palpate

#ifndef PALPATE_COMPILED
#include "palpate/run/detail/measure.hpp"
#endif
