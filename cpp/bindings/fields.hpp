// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "palpate/fields/field_table.hpp"

namespace palpate::bindings {

/// Type in which a struct field is passed to Python: std::string for an enumeration, otherwise the field's own type.
template <class V>
using PythonType = std::conditional_t<HasWords<V>, std::string, V>;

/// True for an optional struct with a table of fields. Its values in a dict are a dict.
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

/// Returns all fields of a struct as a Python dict.
template <class T>
pybind11::dict dict_of(const T& object) {
    pybind11::dict values;
    for_each_field<T>([&](const auto& field) { values[field.name] = to_python(field.of(object)); });
    return values;
}

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
    for_each_field<T>([&](const auto& field) {
        type.def_property_readonly(
            field.name, [field](const T& object) { return to_python(field.of(object)); }, field.doc);
    });
    type.def(
        "to_dict",
        [](const T& object) {
            py::dict values = dict_of(object);
            for_each_field<T>([&](const auto& field) {
                if (!field.stored || values[field.name].is_none()) {
                    values.attr("pop")(field.name);
                } else if constexpr (is_optional_part<std::remove_cvref_t<decltype(field.of(object))>>) {
                    values[field.name] = values[field.name].attr("to_dict")();
                }
            });
            return values;
        },
        "Returns the fields that are written to a file, by name. Optional fields without a value are left "
        "out.");
    type.def("__reduce__", [](const py::object& self) {
        const py::object rebuild = py::module_::import("functools").attr("partial");
        return py::make_tuple(rebuild(py::type::of(self), **dict_of(self.cast<const T&>())), py::tuple());
    });
    type.def("__eq__", [](const T& self, const py::object& other) -> py::object {
        return py::isinstance<T>(other) ? py::bool_(dict_of(self).equal(dict_of(other.cast<const T&>())))
                                        : py::reinterpret_borrow<py::object>(Py_NotImplemented);
    });
    type.def("__hash__", [](const T& self) {
        py::list items;
        for (const auto& [name, value] : dict_of(self)) {
            items.append(py::isinstance<py::list>(value)
                             ? py::object(py::tuple(py::reinterpret_borrow<py::list>(value)))
                             : py::reinterpret_borrow<py::object>(value));
        }
        return py::hash(py::tuple(items));
    });
    if (with_repr) {
        type.def("__repr__", [](const py::object& self) {
            std::string text;
            for (const auto& [name, value] : dict_of(self.cast<const T&>())) {
                text += (text.empty() ? "" : ", ") + std::string(py::str(name)) + "=" +
                        std::string(py::repr(value));
            }
            return py::type::of(self).attr("__name__").cast<std::string>() + "(" + text + ")";
        });
    }
}

}  // namespace palpate::bindings
