// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

namespace palpate::detail {

/// A value of a JSON file together with its path: it answers with what was asked for, or throws
/// std::invalid_argument with path, value and what would be right.
class JsonField {
  public:
    using Json = nlohmann::json;

    JsonField(const Json& value, std::string path) : value_{value}, path_{std::move(path)} {}

    [[noreturn]] void refuse(const std::string& right) const {
        std::string shown = value_.dump();
        shown = shown.size() > 40 ? shown.substr(0, 37) + "..." : shown;
        throw std::invalid_argument((path_.empty() ? "the file holds " : path_ + " is ") + shown +
                                    ": must be " + right);
    }
    void require(bool holds, const std::string& right) const {
        if (!holds) {
            refuse(right);
        }
    }
    void require_length(std::size_t length, const char* meaning) const {
        if (value_.size() != length) {
            throw std::invalid_argument(path_ + " has " + std::to_string(value_.size()) +
                                        " values: must have " + std::to_string(length) + ", " + meaning);
        }
    }

    [[nodiscard]] bool is_null() const { return value_.is_null(); }

    /// A member of an object.
    [[nodiscard]] JsonField operator[](const char* key) const {
        const std::string path = path_.empty() ? key : path_ + "." + key;
        require(value_.is_object(), "an object");
        const auto found = value_.find(key);
        if (found == value_.end()) {
            throw std::invalid_argument(path + " is missing");
        }
        return {*found, path};
    }
    /// An object with no key but these.
    const JsonField& only(std::initializer_list<std::string_view> keys) const {
        require(value_.is_object(), "an object");
        for (const auto& item : value_.items()) {
            bool known = false;
            for (const std::string_view key : keys) {
                known = known || item.key() == key;
            }
            if (!known) {
                const std::string key = Json(item.key()).dump();  // without control characters
                throw std::invalid_argument((path_.empty() ? "" : path_ + ".") +
                                            key.substr(1, key.size() - 2) +
                                            " is not a key of this format (free keys go under notes)");
            }
        }
        return *this;
    }
    [[nodiscard]] std::vector<JsonField> items() const {
        require(value_.is_array(), "a list");
        std::vector<JsonField> fields;
        for (std::size_t k = 0; k < value_.size(); ++k) {
            fields.emplace_back(value_[k], path_ + "[" + std::to_string(k) + "]");
        }
        return fields;
    }

    [[nodiscard]] double number() const {
        require(value_.is_number(), "a number");
        return value_.get<double>();
    }
    [[nodiscard]] double positive() const {
        require(number() > 0.0, "> 0");
        return number();
    }
    [[nodiscard]] double not_negative() const {
        require(number() >= 0.0, ">= 0");
        return number();
    }
    [[nodiscard]] std::uint64_t count(std::uint64_t least) const {
        require(value_.is_number_integer(), "a whole number");
        require(number() >= static_cast<double>(least), ">= " + std::to_string(least));
        return value_.get<std::uint64_t>();
    }
    [[nodiscard]] bool flag() const {
        require(value_.is_boolean(), "true or false");
        return value_.get<bool>();
    }
    [[nodiscard]] std::string words() const {
        require(value_.is_string(), "text");
        return value_.get<std::string>();
    }
    [[nodiscard]] std::string one_of(std::initializer_list<const char*> choices) const {
        std::string right;
        for (const char* choice : choices) {
            if (value_.is_string() && value_.get<std::string>() == choice) {
                return choice;
            }
            right += (right.empty() ? "'" : ", '") + std::string(choice) + "'";
        }
        refuse(choices.size() > 1 ? "one of " + right : right);
    }
    [[nodiscard]] std::vector<double> numbers() const {
        std::vector<double> values;
        for (const JsonField& item : items()) {
            values.push_back(item.number());
        }
        return values;
    }
    void require_object() const { require(value_.is_object(), "an object"); }
    [[nodiscard]] const Json& value() const { return value_; }

  private:
    const Json& value_;
    std::string path_;
};

}  // namespace palpate::detail
