// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "palpate/inline.hpp"
#include "palpate/io/json_text.hpp"

namespace palpate {

struct ModelFile;

/// Returns the content of a model file that a rendering uses, and checks the whole file. Throws std::invalid_argument
/// with the path of the first wrong field, its value and the rule.
[[nodiscard]] PALPATE_INLINE ModelFile parse_model(const Json& content);

}  // namespace palpate

// Below the declaration, because it can contain the definition
#include "palpate/io/model_file.hpp"
