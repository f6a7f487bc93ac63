// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include <nlohmann/json.hpp>

namespace palpate {

/// JSON value whose objects keep their keys in the order of the file.
using Json = nlohmann::ordered_json;

// Bounds of a JSON file, so that reading one takes limited time and memory. A model of 1000 wavelets has 30 kB.
inline constexpr std::size_t largest_json_bytes = std::size_t{8} << 20U;  ///< largest size of a file [bytes]
inline constexpr int deepest_json = 100;             ///< largest allowed depth of nested lists and objects
inline constexpr std::size_t most_json_keys = 1000;  ///< largest number of keys of one object

/// Returns the error message for content that is nested too deeply.
[[nodiscard]] inline std::string too_deep() {
    return "the file is nested more than " + std::to_string(deepest_json) + " levels deep";
}

/// Returns the error message for an object with too many keys.
[[nodiscard]] inline std::string too_many_keys() {
    return "an object has more than " + std::to_string(most_json_keys) + " keys: store its values in lists";
}

/// Parses JSON by RFC 8259, and refuses content that other readers interpret differently: a byte order mark, NUL bytes,
/// repeated keys, unpaired surrogates, numbers too large for a double, more than `deepest_json` levels, or
/// `most_json_keys` keys in an object. Throws std::invalid_argument with the reason in one sentence.
[[nodiscard]] inline Json parse_json(std::string_view text) {
    if (text.starts_with("\xEF\xBB\xBF")) {
        throw std::invalid_argument("the file begins with a byte order mark: save it as UTF-8 without one");
    }
    if (text.find('\0') != std::string_view::npos) {
        throw std::invalid_argument("the file contains a NUL byte: it is damaged, or not UTF-8");
    }
    std::vector<std::set<std::string>> keys;
    const Json::parser_callback_t check = [&](int depth, Json::parse_event_t event, Json& parsed) {
        const bool starts =
            event == Json::parse_event_t::object_start || event == Json::parse_event_t::array_start;
        if (starts && depth >= deepest_json) {
            throw std::invalid_argument(too_deep());
        }
        if (event == Json::parse_event_t::object_start) {
            keys.emplace_back();
        } else if (event == Json::parse_event_t::object_end) {
            keys.pop_back();
        } else if (event == Json::parse_event_t::key) {
            if (const auto key = parsed.get<std::string>(); !keys.back().insert(key).second) {
                throw std::invalid_argument("the key " + Json(key).dump() + " occurs twice in one object");
            }
            if (keys.back().size() > most_json_keys) {
                throw std::invalid_argument(too_many_keys());
            }
        }
        return true;
    };
    try {
        return Json::parse(text, check);
    } catch (const Json::exception& error) {
        const std::string reason = error.what();
        const std::size_t begin = reason.find("] ") + 2;
        // The end of the parser's message is cut off: it quotes raw bytes of the file, which must not reach a terminal.
        throw std::invalid_argument(
            "this is not JSON: " + reason.substr(begin, reason.find("; last read") - begin) +
            "; a model is a .json file that palpate identify writes");
    }
}

/// Reads a JSON file. Throws std::invalid_argument with one sentence that begins with the name of the file.
[[nodiscard]] inline Json read_json(const std::string& path) {
    std::error_code none;
    std::ifstream stream;
    if (std::filesystem::is_regular_file(path,
                                         none)) {  // opening a pipe would wait for a writing program
        stream.open(path, std::ios::binary);
    }
    if (!stream.is_open()) {
        throw std::invalid_argument(path + ": there is no such file, or it cannot be read");
    }
    if (const std::uintmax_t size = std::filesystem::file_size(path, none); size > largest_json_bytes) {
        throw std::invalid_argument(path + ": the file has " + std::to_string(size) +
                                    " bytes: must have at most " + std::to_string(largest_json_bytes) +
                                    "; remove notes, or identify the model with fewer wavelets");
    }
    const std::string text{std::istreambuf_iterator<char>{stream}, {}};
    try {
        return parse_json(text);
    } catch (const std::invalid_argument& error) {
        throw std::invalid_argument(path + ": " + error.what());
    }
}

}  // namespace palpate
