// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/pybind11.h>

namespace palpate::bindings {

// Each function adds Python types and functions to a submodule. module.cpp calls the functions in an order in which
// each type is added before it is used.
void bind_status(pybind11::module_& module);
void bind_model(pybind11::module_& module);
void bind_wavelet(pybind11::module_& module);
void bind_dynamics(pybind11::module_& module);
void bind_device(pybind11::module_& module);
void bind_wire(pybind11::module_& module);
void bind_rendering(pybind11::module_& module);
void bind_stability(pybind11::module_& module);
void bind_portable(pybind11::module_& module);
void bind_io(pybind11::module_& module);
void bind_simulation(pybind11::module_& module);
void bind_run(pybind11::module_& module);

}  // namespace palpate::bindings
