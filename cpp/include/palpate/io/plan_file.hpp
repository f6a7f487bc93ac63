// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "palpate/inline.hpp"
#include "palpate/io/json_field.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/stability/certificate.hpp"

// Readers for the two parts of a model file that describe its rendering: the plan and the certificate of the plan.
namespace palpate::detail {

/// Returns the structure and its numbers from the plan of a model file; std::nullopt if the plan is null.
[[nodiscard]] PALPATE_INLINE std::optional<Scheme> read_plan(const JsonField& plan);

/// Reads the certificate of a plan and computes it again from the rendered model and the device. Throws if the stored
/// certificate does not agree with the computed certificate (`checked`).
[[nodiscard]] PALPATE_INLINE std::optional<Certificate> read_certificate(const JsonField& file,
                                                                         const std::optional<Scheme>& plan,
                                                                         const ForceModel& model,
                                                                         const std::string& position_unit);

}  // namespace palpate::detail

#ifndef PALPATE_COMPILED
#include "palpate/io/detail/plan_file.hpp"
#endif
