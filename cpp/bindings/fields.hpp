// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <initializer_list>
#include <string>
#include <vector>

#include <pybind11/pybind11.h>

namespace palpate::bindings {

/// Defines pickling, copying, comparison, hash and repr of a class by one list of names: the keyword arguments of its
/// constructor, which are also its attributes. `with_repr` is false for a class with a shorter repr. A Python subclass with the same constructor is kept.
template <class T>
void define_by_fields(pybind11::class_<T>& type, std::initializer_list<const char*> names,
                      bool with_repr = true) {
    namespace py = pybind11;
    const std::vector<std::string> fields(names.begin(), names.end());
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

}  // namespace palpate::bindings
