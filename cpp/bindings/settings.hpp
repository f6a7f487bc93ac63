// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <stdexcept>
#include <string>

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "palpate/rendering/scale.hpp"

namespace palpate::bindings {

/// Map from a keyword to a function that sets a field of a settings struct.
template <class T>
using Setters = std::map<std::string, std::function<void(T&, const pybind11::handle&)>>;

/// Returns a function that sets the field at the end of a path of members.
template <class T, class... Path>
[[nodiscard]] auto setter(Path... path) {
    return [=](T& settings, const pybind11::handle& value) {
        auto& field = (settings.*....*path);
        field = value.cast<std::remove_reference_t<decltype(field)>>();
    };
}

/// Sets the fields of a settings struct by keyword; None keeps the default. Raises TypeError for an unknown keyword and
/// InputError for a value of a wrong type.
template <class T>
void set_fields(T& settings, const pybind11::kwargs& given, const Setters<T>& setters) {
    namespace py = pybind11;
    for (const auto& [key, value] : given) {
        const std::string name = py::str(key);
        const auto known = setters.find(name);
        if (known == setters.end()) {
            throw py::type_error("there is no argument '" + name + "'");
        }
        if (value.is_none()) {
            continue;
        }
        try {
            known->second(settings, value);
        } catch (const py::cast_error&) {
            throw std::invalid_argument(name + " is " + std::string(py::repr(value)) +
                                        ", which is of the wrong type");
        }
    }
}

/// Adds the fields of `SchemeChoices`; `path` leads to the member of that type.
template <class T, class... Path>
void add_scheme_choices(Setters<T>& setters, Path... path) {
    setters["structure"] = [=](T& settings, const pybind11::handle& value) {
        (settings.*....*path).structure = named<StructureKind>(value.cast<std::string>(), "structure");
    };
    setters["compensated"] = setter<T>(path..., &SchemeChoices::compensated);
    setters["coupling_stiffness"] = setter<T>(path..., &SchemeChoices::coupling_stiffness);
    setters["coupling_damping"] = setter<T>(path..., &SchemeChoices::coupling_damping);
    setters["mass"] = setter<T>(path..., &SchemeChoices::mass);
    setters["damping"] = setter<T>(path..., &SchemeChoices::damping);
    setters["play_radius"] = setter<T>(path..., &SchemeChoices::play_radius);
    setters["predict"] = setter<T>(path..., &SchemeChoices::predict);
}

}  // namespace palpate::bindings
