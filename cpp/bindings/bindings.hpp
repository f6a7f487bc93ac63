// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/pybind11.h>

namespace palpate::bindings {

// One function a topic, in the file of that name. Later topics may use the types of earlier ones.
void bind_status(pybind11::module_& module);
void bind_wavelet(pybind11::module_& module);
void bind_model(pybind11::module_& module);
void bind_dynamics(pybind11::module_& module);
void bind_device(pybind11::module_& module);
void bind_rendering(pybind11::module_& module);
void bind_failure(pybind11::module_& module);
void bind_stability(pybind11::module_& module);
void bind_bench(pybind11::module_& module);
void bind_session(pybind11::module_& module);
void bind_measure(pybind11::module_& module);

}  // namespace palpate::bindings
