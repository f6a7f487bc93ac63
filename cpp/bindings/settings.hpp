// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "palpate/fields/field_table.hpp"

namespace palpate::bindings {

/// Converts the Python value of a keyword argument to the type V of a struct field; an enumeration is a str in Python.
template <class V>
[[nodiscard]] V value_of(const pybind11::handle& given, const char* field) {
    if constexpr (requires(V value) { requires HasWords<typename V::value_type>; }) {
        return named<typename V::value_type>(given.cast<std::string>(), field);
    } else if constexpr (std::is_same_v<V, std::string>) {
        return given.cast<std::filesystem::path>().string();  // may be a file name that is not UTF-8
    } else {
        return given.cast<V>();
    }
}

/// Sets the fields of a settings struct from Python keyword arguments with the names of the fields; None keeps the
/// default. Raises TypeError for an unknown keyword and InputError for a value of a wrong type.
template <HasFields T>
void set_fields(T& settings, const pybind11::kwargs& given) {
    namespace py = pybind11;
    for (const auto& [key, value] : given) {
        const std::string name = py::str(key);
        bool known = false;
        for_each_field<T>([&, &value = value](const auto& field) {
            if (name != field.name) {
                return;
            }
            known = true;
            auto& member = field.of(settings);
            try {
                if (!value.is_none()) {
                    member = value_of<std::remove_reference_t<decltype(member)>>(value, field.name);
                }
            } catch (const py::cast_error&) {
                throw std::invalid_argument(name + " is " + std::string(py::repr(value)) +
                                            ", which is of the wrong type");
            }
        });
        if (!known) {
            throw py::type_error("there is no argument '" + name + "'");
        }
    }
}

}  // namespace palpate::bindings
