// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace palpate::test {

/// Returns the number of locks that this thread holds.
int lock_depth();

}  // namespace palpate::test
