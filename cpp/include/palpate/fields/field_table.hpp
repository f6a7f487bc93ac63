// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>

#include "palpate/fields/readable.hpp"

// One table for each struct with name, member, meaning and rule of every field. Checks, files, fingerprints,
// comparisons and Python classes use it.
namespace palpate {

/// Rule for a number.
enum class Rule : std::uint8_t { Any, Finite, NotNegative, Positive };

/// Returns the rule in words.
[[nodiscard]] constexpr const char* text(Rule rule) noexcept {
    constexpr const char* texts[]{"a number", "a finite number", ">= 0", "> 0"};
    return texts[static_cast<std::size_t>(rule)];
}

/// Returns true if a value satisfies a rule.
[[nodiscard]] inline bool obeys(double value, Rule rule) noexcept {
    return rule == Rule::Any || (std::isfinite(value) && (rule == Rule::Finite || value > 0.0 ||
                                                          (rule == Rule::NotNegative && value == 0.0)));
}

/// A field at the end of a path of members.
template <auto... path>
struct Field {
    const char* name = "";
    const char* doc = "";  ///< meaning and unit
    Rule rule = Rule::Any;
    bool stored = true;  ///< false: not written to files, because it can be computed
    std::span<const std::string_view> words = {};  ///< allowed texts; empty = any

    template <class S>
    [[nodiscard]] static constexpr auto& of(S& object) noexcept {
        return (object.*....*path);
    }
};

/// Returns the same field of a struct that contains it as `outer`.
template <auto outer, auto... path>
[[nodiscard]] constexpr Field<outer, path...> within(const Field<path...>& field, const char* name) noexcept {
    return {name, field.doc, field.rule, field.stored, field.words};
}

/// Tuple of `Field`; each struct specialises it.
template <class S>
inline constexpr auto fields_of = nullptr;

/// True for a struct with a table of fields.
template <class S>
concept HasFields = !std::is_null_pointer_v<std::remove_cv_t<decltype(fields_of<S>)>>;

/// Calls `visit` with every field of a struct.
template <HasFields S, class Visit>
constexpr void for_each_field(Visit visit) {
    std::apply([&](const auto&... field) { (visit(field), ...); }, fields_of<S>);
}

/// Words of an enumeration in the order of its values; each enumeration specialises it.
template <class Enum>
inline constexpr auto words_of = nullptr;

/// True for an enumeration with words.
template <class Enum>
concept HasWords = !std::is_null_pointer_v<std::remove_cv_t<decltype(words_of<Enum>)>>;

/// Returns the word of a value.
template <HasWords Enum>
[[nodiscard]] constexpr std::string_view name_of(Enum value) noexcept {
    return words_of<Enum>[static_cast<std::size_t>(value)];
}

/// Returns a text such as "direct, massless or implicit".
[[nodiscard]] inline std::string either(std::span<const std::string_view> words) {
    std::string text;
    for (std::size_t k = 0; k < words.size(); ++k) {
        text += (k == 0 ? "" : k + 1 == words.size() ? " or " : ", ") + std::string(words[k]);
    }
    return text;
}

/// Returns the value of a word. Throws std::invalid_argument with the name of the field.
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

/// Checks the numbers and words of one object. Throws std::invalid_argument with the field, its value and the rule. The
/// message has `prefix` before each name.
template <HasFields S>
void check_fields(const S& object, const std::string& prefix = "") {
    for_each_field<S>([&](const auto& field) {
        const auto& value = field.of(object);
        using V = std::remove_cvref_t<decltype(value)>;
        if constexpr (std::is_arithmetic_v<V>) {
            if (!obeys(static_cast<double>(value), field.rule)) {
                throw std::invalid_argument(prefix + field.name + " is " +
                                            readable(static_cast<double>(value)) + ", must be " +
                                            text(field.rule));
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
    });
}

}  // namespace palpate
