// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace palpate {

/// Version of these headers; a test compares it with the version in CMakeLists.txt.
inline constexpr const char* library_version = "0.1.0";

}  // namespace palpate
