// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "palpate/inline.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/stability/certificate.hpp"

namespace palpate {

/// Content of a model file that a rendering uses: model, units, plan and certificate.
struct ModelFile {
    ForceModel model;                        ///< the identified model
    std::string position_unit;               ///< unit of position: rad, m, count; "": not stated
    std::string force_unit;                  ///< unit of force: N*m, N, A; "": not stated
    std::vector<std::string> inputs;         ///< names of the model's inputs
    std::optional<Scheme> plan;              ///< the plan: structure and its numbers; unset: no plan
    std::optional<ForceModel> limited;       ///< model that the plan renders instead of the identified model
    std::optional<Certificate> certificate;  ///< certificate of the plan, recomputed on reading
    std::vector<std::string>
        findings{};  ///< defects that the identification found, as a verdict repeats them
    std::optional<std::string> refusal{};  ///< the defect with which the verdict on the model is no

    /// Returns the model that the plan renders.
    [[nodiscard]] const ForceModel& planned() const noexcept { return limited ? *limited : model; }
};

/// Reads a model file. Throws std::invalid_argument with one sentence that begins with the name of the file.
[[nodiscard]] PALPATE_INLINE ModelFile load_model_file(const std::string& path);

}  // namespace palpate

#ifndef PALPATE_COMPILED
#include "palpate/io/detail/model_file.hpp"
#endif
