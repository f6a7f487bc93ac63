// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "palpate/fields/readable.hpp"

// Tables that describe the fields of a struct: name, member, meaning and rule of every field, one table for each
// struct. Checks, files, fingerprints, comparisons and Python classes use these tables.
namespace palpate {

/// Rule that the number in a field must satisfy: no rule (any number), finite, >= 0, or > 0.
enum class Rule : std::uint8_t { Any, Finite, NotNegative, Positive };

/// Returns the rule as text for an error message, for example "> 0".
[[nodiscard]] constexpr const char* text(Rule rule) noexcept {
    constexpr const char* texts[]{"a number", "a finite number", ">= 0", "> 0"};
    return texts[static_cast<std::size_t>(rule)];
}

/// Returns true if the number `value` satisfies `rule`.
[[nodiscard]] inline bool satisfies(double value, Rule rule) noexcept {
    return rule == Rule::Any || (std::isfinite(value) && (rule == Rule::Finite || value > 0.0 ||
                                                          (rule == Rule::NotNegative && value == 0.0)));
}

/// Description of one field of a struct. `path` lists the members that lead from the struct to the field.
template <auto... path>
struct Field {
    const char* name = "";
    const char* doc = "";  ///< meaning and unit of the field
    Rule rule = Rule::Any;
    bool stored = true;  ///< false: the field is not written to files, because the program can compute it
    std::span<const std::string_view> words = {};  ///< texts that the field may contain; empty list: any text

    template <class S>
    [[nodiscard]] static constexpr auto& of(S& object) noexcept {
        return (object.*....*path);
    }
};

/// Returns the description of the same field for a larger struct whose member `outer` contains the field, under the
/// name `name`.
template <auto outer, auto... path>
[[nodiscard]] constexpr Field<outer, path...> within(const Field<path...>& field, const char* name) noexcept {
    return {name, field.doc, field.rule, field.stored, field.words};
}

namespace detail {

/// Entry number k of a table of fields.
template <std::size_t k, class F>
struct TableEntry {
    F field;
};

template <class Numbers, class... Fields>
struct TableEntries;
template <std::size_t... k, class... Fields>
struct TableEntries<std::index_sequence<k...>, Fields...> : TableEntry<k, Fields>... {};

template <std::size_t k, class F>
[[nodiscard]] constexpr const F& entry(const TableEntry<k, F>& found) noexcept {
    return found.field;
}

}  // namespace detail

/// List of descriptions. A std::tuple of this size takes several times as long to compile.
template <class... Fields>
class FieldTable {
  public:
    static constexpr std::size_t size = sizeof...(Fields);

    constexpr explicit FieldTable(Fields... fields) noexcept : entries_{{fields}...} {}

    /// Returns description number k.
    template <std::size_t k>
    [[nodiscard]] constexpr const auto& get() const noexcept {
        return detail::entry<k>(entries_);
    }

    /// Calls `visit` once, with all descriptions as its arguments, and returns the result.
    template <class Visit>
    constexpr auto apply(const Visit& visit) const {  // NOLINT(modernize-use-nodiscard): void for some visits
        return apply(visit, std::index_sequence_for<Fields...>{});
    }

  private:
    template <class Visit, std::size_t... k>
    // NOLINTNEXTLINE(modernize-use-nodiscard): void for some visits
    constexpr auto apply(const Visit& visit, std::index_sequence<k...> /*numbers*/) const {
        return visit(static_cast<const detail::TableEntry<k, Fields>&>(entries_).field...);
    }

    detail::TableEntries<std::index_sequence_for<Fields...>, Fields...> entries_;
};

/// Returns a table with the descriptions of both tables.
template <class... First, class... Second>
[[nodiscard]] constexpr auto operator+(const FieldTable<First...>& first,
                                       const FieldTable<Second...>& second) noexcept {
    return first.apply([&](const auto&... a) {
        return second.apply([&](const auto&... b) { return FieldTable<First..., Second...>{a..., b...}; });
    });
}

/// Returns the descriptions `fields` of a struct for a larger struct whose member `outer` is this struct.
template <auto outer, class... Fields>
[[nodiscard]] constexpr auto all_within(const FieldTable<Fields...>& fields) noexcept {
    return fields.apply([](const auto&... field) { return FieldTable{within<outer>(field, field.name)...}; });
}

/// True if the type V is std::optional. A file may omit a field of such a type.
template <class V>
inline constexpr bool is_optional = false;
template <class V>
inline constexpr bool is_optional<std::optional<V>> = true;

/// Table of the fields of the struct S: a `FieldTable`. Each struct with a table specialises this variable.
template <class S>
inline constexpr auto fields_of = nullptr;

/// True for a struct with a table of fields.
template <class S>
concept HasFields = !std::is_null_pointer_v<std::remove_cv_t<decltype(fields_of<S>)>>;

/// Calls `visit` with every field of a struct.
template <HasFields S, class Visit>
constexpr void for_each_field(Visit visit) {
    fields_of<S>.apply([&](const auto&... field) { (visit(field), ...); });
}

/// Names of the values of an enumeration as they appear in files and messages, in the order of the values. Each
/// enumeration with names specialises this variable.
template <class Enum>
inline constexpr auto words_of = nullptr;

/// True for an enumeration whose values have names (`words_of`).
template <class Enum>
concept HasWords = !std::is_null_pointer_v<std::remove_cv_t<decltype(words_of<Enum>)>>;

/// Returns the name of a value of an enumeration, as it appears in files and messages.
template <HasWords Enum>
[[nodiscard]] constexpr std::string_view name_of(Enum value) noexcept {
    return words_of<Enum>[static_cast<std::size_t>(value)];
}

/// Joins the words to one text for an error message, for example "direct, massless or implicit".
[[nodiscard]] inline std::string either(std::span<const std::string_view> words) {
    std::string text;
    for (std::size_t k = 0; k < words.size(); ++k) {
        text += (k == 0 ? "" : k + 1 == words.size() ? " or " : ", ") + std::string(words[k]);
    }
    return text;
}

/// Returns the value of an enumeration that has the name `word`. If no value has this name, throws
/// std::invalid_argument with the name of the field, the word and the allowed names.
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

/// Throws std::invalid_argument unless `holds` is true. The message contains the name of the field, its value, and the
/// text `right`, for example "> 0".
inline void require_field(bool holds, std::string_view field, double value, std::string_view right) {
    if (!holds) {
        throw std::invalid_argument(std::string{field} + " is " + readable(value) + ", must be " +
                                    std::string{right});
    }
}

template <HasFields S>
void check_fields(const S& object, std::string_view prefix = "");

/// Throws std::invalid_argument if a number does not satisfy the rule of its field or a text is not an allowed text of
/// its field; checks each field of a struct. Accepts values of other types.
template <class V>
void check_value(std::string_view prefix, const char* name, Rule rule,
                 std::span<const std::string_view> words, const V& value) {
    if constexpr (is_optional<V>) {
        if (value) {
            check_value(prefix, name, rule, words, *value);
        }
    } else if constexpr (HasFields<V>) {
        check_fields(value, std::string{prefix} + name + ".");
    } else if constexpr (std::is_arithmetic_v<V>) {
        const auto number = static_cast<double>(value);
        if (!satisfies(number, rule)) {
            require_field(false, std::string{prefix} + name, number, text(rule));
        }
    } else if constexpr (std::is_same_v<V, std::string>) {
        if (!words.empty() && std::find(words.begin(), words.end(), value) == words.end()) {
            throw std::invalid_argument(std::string{prefix} + name + " is '" + value + "', must be " +
                                        either(words));
        }
    }
}

/// Checks the numbers and texts in all fields of one object. If a value is not allowed, throws std::invalid_argument
/// with the name of the field, its value and the rule. In the message `prefix` precedes the name.
template <HasFields S>
void check_fields(const S& object, std::string_view prefix) {
    for_each_field<S>([&](const auto& field) {
        check_value(prefix, field.name, field.rule, field.words, field.of(object));
    });
}

}  // namespace palpate
