// SPDX-License-Identifier: Apache-2.0
#include <iostream>
#include <palpate/palpate.hpp>

int main() {
    std::cout << "palpate " << palpate::library_version << ": " << palpate::text(palpate::Status::Ok).word
              << "\n";
}
