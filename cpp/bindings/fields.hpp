// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "palpate/fields/field_table.hpp"

namespace palpate::bindings {

/// Type in which a struct field is passed to Python: std::string for an enumeration, otherwise the field's own type.
template <class V>
using PythonType = std::conditional_t<HasWords<V>, std::string, V>;

/// True for an optional struct with a table of fields.
template <class V>
inline constexpr bool is_optional_part = false;
template <HasFields V>
inline constexpr bool is_optional_part<std::optional<V>> = true;

/// Converts the value of a struct field to its Python type.
template <class V>
PythonType<V> to_python(const V& value) {
    if constexpr (HasWords<V>) {
        return std::string(name_of(value));
    } else {
        return value;
    }
}

template <class T, std::size_t k>
using FieldType = std::remove_cvref_t<decltype(fields_of<T>.template get<k>().of(std::declval<T&>()))>;

template <class T, std::size_t k>
void set_field(T& object, PythonType<FieldType<T, k>>&& value) {
    const auto& field = fields_of<T>.template get<k>();
    if constexpr (HasWords<FieldType<T, k>>) {
        field.of(object) = named<FieldType<T, k>>(value, field.name);
    } else {
        field.of(object) = std::move(value);
    }
}

/// Returns the Python keyword argument for a struct field. The first `required` fields of the struct have no default.
template <class T, std::size_t k, std::size_t required>
auto argument_of(const T& standard) {
    const auto& field = fields_of<T>.template get<k>();
    if constexpr (k < required) {
        return pybind11::arg(field.name);
    } else {
        return pybind11::arg(field.name) = to_python(field.of(standard));
    }
}

/// Field of a struct in the dict of a Python object.
struct FieldKey {
    const char* name = "";
    bool stored = true;    ///< false: not written to files
    bool is_part = false;  ///< true: an optional struct with a table of fields, which is a dict in a file
};

/// Adds to_dict, pickling, copying, comparison, hash and, if `with_repr` is true, repr to a Python class.
void bind_protocol(const pybind11::object& type, const std::vector<FieldKey>& keys, bool with_repr);

/// Makes a C++ struct a Python class, from the table of the struct's fields: keyword arguments, attributes, `to_dict`,
/// pickling, copying, comparison, hash and repr. `with_repr` is false for a class that defines its repr separately;
/// `check` throws if the fields contradict each other. A copy of an instance of a Python subclass has the type of the
/// subclass.
template <class T, std::size_t required = 0>
void bind_fields(
    pybind11::class_<T>& type, bool with_repr = true,
    void (*check)(const std::type_identity_t<T>&) = [](const T&) {}) {
    namespace py = pybind11;
    constexpr std::size_t n = fields_of<T>.size;
    const T standard{};
    [&]<std::size_t... k>(std::index_sequence<k...>) {
        type.def(py::init([check](PythonType<FieldType<T, k>>... value) {
                     T made;
                     (set_field<T, k>(made, std::move(value)), ...);
                     check(made);
                     return made;
                 }),
                 py::kw_only(), argument_of<T, k, required>(standard)...);
    }(std::make_index_sequence<n>{});
    std::vector<FieldKey> keys;
    for_each_field<T>([&](const auto& field) {
        using F = std::remove_cvref_t<decltype(field)>;
        using V = std::remove_cvref_t<decltype(F::of(std::declval<T&>()))>;
        // A function pointer: the code that calls it is the same for all fields of one type
        PythonType<V> (*const read)(const T&) = [](const T& object) { return to_python(F::of(object)); };
        type.def_property_readonly(field.name, read, field.doc);
        keys.push_back({field.name, field.stored, is_optional_part<V>});
    });
    bind_protocol(type, keys, with_repr);
}

}  // namespace palpate::bindings
