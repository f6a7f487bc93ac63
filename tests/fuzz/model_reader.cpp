// SPDX-License-Identifier: Apache-2.0
// The reader of model files in C++ as a C function, for compare_readers.py.
#include <algorithm>
#include <cstddef>
#include <exception>
#include <stdexcept>
#include <string>
#include <string_view>

#include "palpate/io/parse_model.hpp"
#include "palpate/model/fingerprint.hpp"

/// Reads a model file. Returns 0 and writes the fingerprint of the model to `text`, or returns 1 and writes the reason
/// why the file is refused, or returns 2 and writes an exception that no reader may throw.
extern "C" int read_model(const char* bytes, std::size_t size, char* text, std::size_t capacity) {
    const auto write = [&](std::string_view written) { text[written.copy(text, capacity - 1)] = '\0'; };
    try {
        write(palpate::fingerprint(palpate::parse_model(palpate::parse_json({bytes, size})).model));
        return 0;
    } catch (const std::invalid_argument& error) {
        write(error.what());
        return 1;
    } catch (const std::exception& error) {
        write(error.what());
        return 2;
    }
}
