// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>

#include "palpate/fields/readable.hpp"

// One table for each struct: the name, place, meaning and rule of every field. It drives the checks, the files, the
// fingerprints, the comparisons and the Python classes.
namespace palpate {

/// What a number may be.
enum class Rule : std::uint8_t { Any, Finite, NotNegative, Positive };

[[nodiscard]] constexpr const char* text(Rule rule) noexcept {
    constexpr const char* texts[]{"a number", "a finite number", ">= 0", "> 0"};
    return texts[static_cast<std::size_t>(rule)];
}

[[nodiscard]] inline bool obeys(double value, Rule rule) noexcept {
    return rule == Rule::Any || (std::isfinite(value) && (rule == Rule::Finite || value > 0.0 ||
                                                          (rule == Rule::NotNegative && value == 0.0)));
}

/// A field that is reached by a path of members.
template <auto... path>
struct Field {
    const char* name = "";
    const char* doc = "";  ///< meaning and unit
    Rule rule = Rule::Any;
    bool stored = true;  ///< false: not written to a file, because it can be computed
    std::span<const std::string_view> words = {};  ///< the values of a text; empty = any

    template <class S>
    [[nodiscard]] static constexpr auto& of(S& object) noexcept {
        return (object.*....*path);
    }
};

/// The same field inside a struct that holds it as `outer`.
template <auto outer, auto... path>
[[nodiscard]] constexpr Field<outer, path...> within(const Field<path...>& field, const char* name) noexcept {
    return {name, field.doc, field.rule, field.stored, field.words};
}

/// A field that need not be given: a file may leave it out.
template <class V>
inline constexpr bool is_optional = false;
template <class V>
inline constexpr bool is_optional<std::optional<V>> = true;

/// A tuple of `Field`, to be specialised for each struct.
template <class S>
inline constexpr auto fields_of = nullptr;

template <class S>
concept HasFields = !std::is_null_pointer_v<std::remove_cv_t<decltype(fields_of<S>)>>;

template <HasFields S, class Visit>
constexpr void for_each_field(Visit visit) {
    std::apply([&](const auto&... field) { (visit(field), ...); }, fields_of<S>);
}

/// The words of an enumeration in the order of its values, to be specialised for each.
template <class Enum>
inline constexpr auto words_of = nullptr;

template <class Enum>
concept HasWords = !std::is_null_pointer_v<std::remove_cv_t<decltype(words_of<Enum>)>>;

template <HasWords Enum>
[[nodiscard]] constexpr std::string_view name_of(Enum value) noexcept {
    return words_of<Enum>[static_cast<std::size_t>(value)];
}

/// "direct, massless or implicit"
[[nodiscard]] inline std::string either(std::span<const std::string_view> words) {
    std::string text;
    for (std::size_t k = 0; k < words.size(); ++k) {
        text += (k == 0 ? "" : k + 1 == words.size() ? " or " : ", ") + std::string(words[k]);
    }
    return text;
}

/// The value of a word. Throws std::invalid_argument with the name of the field.
template <HasWords Enum>
[[nodiscard]] Enum named(std::string_view word, const char* field) {
    for (std::size_t k = 0; k < words_of<Enum>.size(); ++k) {
        if (words_of<Enum>[k] == word) {
            return static_cast<Enum>(k);
        }
    }
    throw std::invalid_argument(std::string(field) + " is '" + std::string(word) + "', must be " +
                                either(words_of<Enum>));
}

/// Checks a number or a word by the rule of its field; other values pass.
template <class F, class V>
void check_value(const F& field, const V& value, const std::string& prefix) {
    if constexpr (is_optional<V>) {
        if (value) {
            check_value(field, *value, prefix);
        }
    } else if constexpr (std::is_arithmetic_v<V>) {
        if (!obeys(static_cast<double>(value), field.rule)) {
            throw std::invalid_argument(prefix + field.name + " is " + readable(static_cast<double>(value)) +
                                        ", must be " + text(field.rule));
        }
    } else if constexpr (std::is_same_v<V, std::string>) {
        bool known = field.words.empty();
        for (const std::string_view word : field.words) {
            known = known || value == word;
        }
        if (!known) {
            throw std::invalid_argument(prefix + field.name + " is '" + value + "', must be " +
                                        either(field.words));
        }
    }
}

/// Checks the numbers and words of one object. Throws std::invalid_argument: the field, its value, what would be right.
/// The message puts `prefix` before each name.
template <HasFields S>
void check_fields(const S& object, const std::string& prefix = "") {
    for_each_field<S>([&](const auto& field) { check_value(field, field.of(object), prefix); });
}

}  // namespace palpate
