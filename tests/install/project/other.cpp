// SPDX-License-Identifier: Apache-2.0
// A second translation unit: everything that the headers define must be inline.
#include <palpate/palpate.hpp>

const char* word_of(palpate::Status status) {
    return palpate::text(status).word;
}
