// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "palpate/fields/field_table.hpp"
#include "palpate/io/json_text.hpp"

namespace palpate::detail {

/// A value of a JSON file with its path, the keys that lead to the value. Its functions return the value as the
/// requested type, or throw std::invalid_argument with the path, the value and the required values.
class JsonField {
  public:
    JsonField(const Json& value, std::string path) : value_{value}, path_{std::move(path)} {}

    /// Throws std::invalid_argument with the path of this value, the value and `right`, the description of valid
    /// values.
    [[noreturn]] void refuse(std::string_view right) const {
        std::string shown = value_.is_number_float() && !std::isfinite(value_.get<double>())
                                ? readable(value_.get<double>())  // not valid JSON
                                : value_.dump();
        shown = shown.size() > 40 ? shown.substr(0, 37) + "..." : shown;
        throw std::invalid_argument((path_.empty() ? "the content is " : path_ + " is ") + shown +
                                    ": must be " + std::string{right});
    }
    /// Throws std::invalid_argument if `holds` is false; `right` describes valid values in the error message.
    void require(bool holds, std::string_view right) const {
        if (!holds) {
            refuse(right);
        }
    }
    /// Throws std::invalid_argument if the number of elements of this JSON list is not `length`.
    void require_length(std::size_t length, const char* meaning) const {
        if (value_.size() != length) {
            throw std::invalid_argument(path_ + " has " + std::to_string(value_.size()) +
                                        " values: must have " + std::to_string(length) + ", " + meaning);
        }
    }

    /// Throws std::invalid_argument if this JSON list has more than `longest` elements.
    void require_at_most(std::size_t longest, const char* meaning) const {
        if (value_.size() > longest) {
            throw std::invalid_argument(path_ + " has " + std::to_string(value_.size()) +
                                        " values: must have at most " + std::to_string(longest) + ", " +
                                        meaning);
        }
    }

    [[nodiscard]] bool is_null() const { return value_.is_null(); }

    /// Returns the value of a key of this object. Throws if the key is missing.
    [[nodiscard]] JsonField operator[](std::string_view key) const {
        const std::string path = (path_.empty() ? "" : path_ + ".") + readable_key(key);
        require(value_.is_object(), "an object");
        const auto found = value_.find(std::string{key});
        if (found == value_.end()) {
            throw std::invalid_argument(path + " is missing");
        }
        return {*found, path};
    }
    /// Throws if this object has a key that is not in `keys`.
    void require_keys(const std::vector<std::string_view>& keys, const char* cure = "") const {
        require(value_.is_object(), "an object");
        for (const auto& item : value_.items()) {
            if (std::find(keys.begin(), keys.end(), item.key()) == keys.end()) {
                throw std::invalid_argument((path_.empty() ? "" : path_ + ".") + readable_key(item.key()) +
                                            " is not a key of this format" + cure);
            }
        }
    }
    /// Returns the elements of this JSON list, each with its path in the file, which error messages name.
    [[nodiscard]] std::vector<JsonField> items() const {
        require(value_.is_array(), "a list");
        std::vector<JsonField> fields;
        fields.reserve(value_.size());
        for (std::size_t k = 0; k < value_.size(); ++k) {
            fields.emplace_back(value_[k], path_ + "[" + std::to_string(k) + "]");
        }
        return fields;
    }

    /// Returns this JSON value as a finite number. Throws if the number does not satisfy `rule`, for example > 0.
    [[nodiscard]] double number(Rule rule = Rule::Finite) const {
        require(value_.is_number(), "a number");
        const auto number = value_.get<double>();
        require(std::isfinite(number), "a finite number");
        require(satisfies(number, rule), text(rule));
        return number;
    }
    [[nodiscard]] double positive() const { return number(Rule::Positive); }
    [[nodiscard]] double not_negative() const { return number(Rule::NotNegative); }
    /// Returns this value as an integer. Throws if the integer is smaller than `least`.
    [[nodiscard]] std::uint64_t count(std::uint64_t least) const {
        require(value_.is_number_integer(), "a whole number");
        require(number() >= static_cast<double>(least), ">= " + std::to_string(least));
        return value_.get<std::uint64_t>();
    }
    /// Returns this value as true or false. Throws if it is not a boolean.
    [[nodiscard]] bool flag() const {
        require(value_.is_boolean(), "true or false");
        return value_.get<bool>();
    }
    /// Returns this value as a text. Throws if it is not a text.
    [[nodiscard]] std::string string() const {
        require(value_.is_string(), "text");
        return value_.get<std::string>();
    }
    /// Returns the index of this text in the list `choices`. Throws if the text is not in the list.
    [[nodiscard]] std::size_t one_of(std::span<const std::string_view> choices) const {
        std::string right;
        for (std::size_t k = 0; k < choices.size(); ++k) {
            if (value_.is_string() && value_.get<std::string>() == choices[k]) {
                return k;
            }
            right += (k == 0                    ? "'"
                      : k + 1 == choices.size() ? " or '"
                                                : ", '") +
                     std::string(choices[k]) + "'";
        }
        refuse(right);
    }
    /// Returns this text. Throws if the text is not in the list `choices`.
    [[nodiscard]] std::string one_of(const std::vector<std::string_view>& choices) const {
        return std::string(choices[one_of(std::span{choices})]);
    }
    /// Returns this list of numbers. Throws if an element is not a finite number.
    [[nodiscard]] std::vector<double> numbers() const {
        std::vector<double> values;
        for (const JsonField& item : items()) {
            values.push_back(item.number());
        }
        return values;
    }
    /// Throws std::invalid_argument if this value is not a JSON object.
    void require_object() const { require(value_.is_object(), "an object"); }
    [[nodiscard]] const Json& value() const { return value_; }

    /// Throws if a number in this value, or in its nested lists and objects, is not finite: JSON cannot store it.
    void require_finite() const {
        if (value_.is_object()) {
            for (const auto& item : value_.items()) {
                (*this)[item.key()].require_finite();
            }
        } else if (value_.is_array()) {
            for (const JsonField& item : items()) {
                item.require_finite();
            }
        } else if (value_.is_number()) {
            (void)number();
        }
    }

    /// Returns this value as the C++ type T, after checking the rule. For a struct, this value must be an object with a
    /// key for each stored field of the struct and no other key; only optional fields may be missing.
    template <class T>
    [[nodiscard]] T as(Rule rule = Rule::Any, std::span<const std::string_view> choices = {}) const {
        if constexpr (HasFields<T>) {
            auto names = fields_of<T>.apply([](const auto&... field) {
                return std::vector<std::string_view>{(field.stored ? field.name : "")...};
            });
            std::erase(names, "");
            require_keys(names);
            T read;
            for_each_field<T>([&](const auto& field) {
                if (field.stored) {
                    read_key(field.name, field.of(read), field.rule, field.words);
                }
            });
            return read;
        } else if constexpr (is_optional<T>) {
            return as<typename T::value_type>(rule, choices);
        } else if constexpr (HasWords<T>) {
            return static_cast<T>(one_of(words_of<T>));
        } else if constexpr (std::is_same_v<T, bool>) {
            return flag();
        } else if constexpr (std::is_arithmetic_v<T>) {
            return static_cast<T>(number(rule));
        } else {
            return choices.empty() ? string() : std::string(choices[one_of(choices)]);
        }
    }

  private:
    /// Reads the value of a key; leaves `read` as it is if it may be missing, and is.
    template <class T>
    void read_key(std::string_view key, T& read, Rule rule, std::span<const std::string_view> words) const {
        if (!is_optional<T> || value_.contains(std::string{key})) {
            read = (*this)[key].template as<T>(rule, words);
        }
    }

    /// Returns a key without control characters, for a message.
    [[nodiscard]] static std::string readable_key(std::string_view key) {
        const std::string quoted = Json(std::string{key}).dump();
        return quoted.substr(1, quoted.size() - 2);
    }

    const Json& value_;
    std::string path_;
};

}  // namespace palpate::detail
