// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "palpate/fields/field_table.hpp"

namespace palpate::bindings {

/// Defines pickling, copying, comparison, hash and repr of a class from one list of names: the keyword arguments of its
/// constructor, which are also its attributes. `with_repr` is false for a class with a shorter repr. An instance of a
/// Python subclass with the same constructor keeps its type.
template <class T>
void define_by_fields(pybind11::class_<T>& type, const std::vector<std::string>& fields,
                      bool with_repr = true) {
    namespace py = pybind11;
    const auto values = [fields](const py::object& self) {
        py::dict given;
        for (const std::string& name : fields) {
            given[py::str(name)] = self.attr(name.c_str());
        }
        return given;
    };
    type.def("__reduce__", [values](const py::object& self) {
        const py::object rebuild = py::module_::import("functools").attr("partial");
        return py::make_tuple(rebuild(py::type::of(self), **values(self)), py::tuple());
    });
    type.def("__eq__", [values](const py::object& self, const py::object& other) -> py::object {
        if (!py::isinstance<T>(other)) {
            return py::reinterpret_borrow<py::object>(Py_NotImplemented);
        }
        return py::bool_(values(self).equal(values(other)));
    });
    type.def("__hash__", [values](const py::object& self) {
        py::list items;
        const py::dict given = values(self);
        for (const auto& [name, value] : given) {
            items.append(py::isinstance<py::list>(value)
                             ? py::object(py::tuple(py::reinterpret_borrow<py::list>(value)))
                             : py::reinterpret_borrow<py::object>(value));
        }
        return py::hash(py::tuple(items));
    });
    if (!with_repr) {
        return;
    }
    type.def("__repr__", [values](const py::object& self) {
        std::string text = py::type::of(self).attr("__name__").cast<std::string>() + "(";
        const char* comma = "";
        const py::dict given = values(self);
        for (const auto& [name, value] : given) {
            text += comma + std::string(py::str(name)) + "=" + std::string(py::repr(value));
            comma = ", ";
        }
        return text + ")";
    });
}

/// Type of a field in Python: str for an enumeration.
template <class V>
using PythonType = std::conditional_t<HasWords<V>, std::string, V>;

/// Converts a field to its Python type.
template <class V>
PythonType<V> to_python(const V& value) {
    if constexpr (HasWords<V>) {
        return std::string(name_of(value));
    } else {
        return value;
    }
}

template <class T, std::size_t k>
using FieldType = std::remove_cvref_t<decltype(std::get<k>(fields_of<T>).of(std::declval<T&>()))>;

template <class T, std::size_t k>
void set_field(T& object, PythonType<FieldType<T, k>>&& value) {
    const auto& field = std::get<k>(fields_of<T>);
    if constexpr (HasWords<FieldType<T, k>>) {
        field.of(object) = named<FieldType<T, k>>(value, field.name);
    } else {
        field.of(object) = std::move(value);
    }
}

/// Returns the keyword argument of a field. The first `required` fields are without a default.
template <class T, std::size_t k, std::size_t required>
auto argument_of(const T& standard) {
    const auto& field = std::get<k>(fields_of<T>);
    if constexpr (k < required) {
        return pybind11::arg(field.name);
    } else {
        return pybind11::arg(field.name) = to_python(field.of(standard));
    }
}

/// Binds a struct by its table of fields: keyword arguments, attributes, `to_dict`, and the methods of
/// `define_by_fields`. `check` throws if the fields contradict each other.
template <class T, std::size_t required = 0, class Check>
void bind_fields(pybind11::class_<T>& type, Check check, bool with_repr = true) {
    namespace py = pybind11;
    constexpr std::size_t n = std::tuple_size_v<std::remove_cvref_t<decltype(fields_of<T>)>>;
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
    std::vector<std::string> names;
    for_each_field<T>([&](const auto& field) {
        names.emplace_back(field.name);
        type.def_property_readonly(
            field.name, [field](const T& object) { return to_python(field.of(object)); }, field.doc);
    });
    type.def(
        "to_dict",
        [](const T& object) {
            py::dict values;
            for_each_field<T>([&](const auto& field) {
                if (const py::object value = py::cast(to_python(field.of(object)));
                    field.stored && !value.is_none()) {
                    values[field.name] = value;
                }
            });
            return values;
        },
        "The fields that are written to a file, by name; without optional ones that are not given.");
    define_by_fields(type, names, with_repr);
}

template <class T, std::size_t required = 0>
void bind_fields(pybind11::class_<T>& type, bool with_repr = true) {
    bind_fields<T, required>(type, [](const T&) {}, with_repr);
}

}  // namespace palpate::bindings
