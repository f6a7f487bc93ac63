// SPDX-License-Identifier: Apache-2.0
#include <exception>
#include <stdexcept>
#include <utility>

#include "bindings.hpp"

namespace {

/// Bad input reaches Python as palpate.InputError, which is a ValueError.
void translate_invalid_argument(std::exception_ptr thrown) {
    try {
        std::rethrow_exception(std::move(thrown));
    } catch (const std::invalid_argument& error) {
        const pybind11::object type = pybind11::module_::import("palpate.errors").attr("InputError");
        pybind11::set_error(type, error.what());
    }
}

}  // namespace

PYBIND11_MODULE(_core, module) {
    module.doc() = "The C++ core of palpate: evaluation, filters, solvers, structures and simulation.";
    module.attr("__version__") = PALPATE_VERSION;

    pybind11::register_local_exception_translator(&translate_invalid_argument);
    palpate::bindings::bind_status(module);
    palpate::bindings::bind_wavelet(module);
    palpate::bindings::bind_model(module);
    palpate::bindings::bind_dynamics(module);
    palpate::bindings::bind_device(module);
    palpate::bindings::bind_rendering(module);
    palpate::bindings::bind_failure(module);
    palpate::bindings::bind_stability(module);
    palpate::bindings::bind_bench(module);
    palpate::bindings::bind_session(module);
    palpate::bindings::bind_measure(module);
}
