// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include <pybind11/pybind11.h>

namespace palpate::bindings {

/// Returns UTF-8 as a Python text. Other bytes, which the name of a file may contain, become the surrogates that
/// os.fsencode converts back.
[[nodiscard]] inline pybind11::str text_of(std::string_view text) {
    return pybind11::reinterpret_steal<pybind11::str>(
        PyUnicode_DecodeUTF8(text.data(), static_cast<pybind11::ssize_t>(text.size()), "surrogateescape"));
}

// Each function adds Python types and functions to a submodule. module.cpp calls the functions in an order in which
// each type is added before it is used.
void bind_status(pybind11::module_& module);
void bind_model(pybind11::module_& module);
void bind_wavelet(pybind11::module_& module);
void bind_dynamics(pybind11::module_& module);
void bind_device(pybind11::module_& module);
void bind_rendering(pybind11::module_& module);
void bind_stability(pybind11::module_& module);
void bind_portable(pybind11::module_& module);
void bind_io(pybind11::module_& module);
void bind_simulation(pybind11::module_& module);
void bind_run(pybind11::module_& module);

}  // namespace palpate::bindings
