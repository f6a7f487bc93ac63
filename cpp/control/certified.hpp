// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "options.hpp"
#include "palpate/device/device_profile.hpp"
#include "palpate/io/model_file.hpp"
#include "palpate/simulation/test_rig.hpp"
#include "rendering.hpp"

namespace palpate::control {

/// Below this share of its rate the certificate of a run no longer holds: it is for the period asked for.
inline constexpr double certified_rate_share = 0.99;

/// Sets what a certified run keeps to: no slew limit and no tick without a force, because the proofs do not cover them;
/// the certified force limit; no longer time between two ticks than certified. The energy tank counts on the certified
/// damping and friction.
void keep_to(const Certificate& certificate, GuardSettings& guards, LoopSettings& loop);

/// Why a model may not move a device, whose own word is `device`: empty where its certificate is for this device, at
/// this rate, and for the rendering that was asked for. That it fits the model was seen to when the file was read.
[[nodiscard]] std::string not_certified(const ModelFile& file, const Options& options,
                                        const DeviceProfile& device);

/// What is done on a real device, which `rig` describes: what the model's certificate is for, or, where the risk was
/// typed in full, what the options say. Throws where neither allows it.
[[nodiscard]] Job job_on_real_device(const Options& options, ModelFile file, RecordUnits units,
                                     const TestRig& rig);

}  // namespace palpate::control
