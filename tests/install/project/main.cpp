// SPDX-License-Identifier: Apache-2.0
#include <cstring>
#include <palpate/palpate.hpp>

const char* word_of(palpate::Status status);

int main() {
    return std::strcmp(word_of(palpate::Status::Limited), "Limited");
}
