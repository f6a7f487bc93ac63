// SPDX-License-Identifier: Apache-2.0
#include "fields.hpp"

#include <string>
#include <utility>
#include <vector>

#include <pybind11/pybind11.h>

namespace palpate::bindings {

namespace py = pybind11;

namespace {

/// Adds a method to a Python class.
template <class F>
void define(const py::object& type, const char* name, F function, const char* doc = "") {
    type.attr(name) = py::cpp_function(std::move(function), py::name(name), py::is_method(type),
                                       py::sibling(py::getattr(type, name, py::none())), doc);
}

/// Returns the fields of an object as a Python dict.
py::dict dict_of(const py::object& object, const std::vector<FieldKey>& keys) {
    py::dict values;
    for (const FieldKey& key : keys) {
        values[key.name] = object.attr(key.name);
    }
    return values;
}

}  // namespace

void bind_protocol(const py::object& type, const std::vector<FieldKey>& keys, bool with_repr) {
    define(
        type, "to_dict",
        [keys](const py::object& self) {
            py::dict values;
            for (const FieldKey& key : keys) {
                const py::object value = self.attr(key.name);
                if (key.stored && !value.is_none()) {
                    values[key.name] = key.is_part ? py::object(value.attr("to_dict")()) : value;
                }
            }
            return values;
        },
        "Returns the fields that are written to a file, by name. Optional fields without a value are left "
        "out.");
    define(type, "__reduce__", [keys](const py::object& self) {
        const py::object rebuild = py::module_::import("functools").attr("partial");
        return py::make_tuple(rebuild(py::type::of(self), **dict_of(self, keys)), py::tuple());
    });
    // A handle, because the function is part of the class
    define(type, "__eq__", [keys, type = py::handle(type)](const py::object& self, const py::object& other) {
        return py::isinstance(other, type)
                   ? py::object(py::bool_(dict_of(self, keys).equal(dict_of(other, keys))))
                   : py::reinterpret_borrow<py::object>(Py_NotImplemented);
    });
    define(type, "__hash__", [keys](const py::object& self) {
        py::list items;
        for (const auto& [name, value] : dict_of(self, keys)) {
            items.append(py::isinstance<py::list>(value)
                             ? py::object(py::tuple(py::reinterpret_borrow<py::list>(value)))
                             : py::reinterpret_borrow<py::object>(value));
        }
        return py::hash(py::tuple(items));
    });
    if (with_repr) {
        define(type, "__repr__", [keys](const py::object& self) {
            std::string text;
            for (const auto& [name, value] : dict_of(self, keys)) {
                text += (text.empty() ? "" : ", ") + std::string(py::str(name)) + "=" +
                        std::string(py::repr(value));
            }
            return py::type::of(self).attr("__name__").cast<std::string>() + "(" + text + ")";
        });
    }
}

}  // namespace palpate::bindings
