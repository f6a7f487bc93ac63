// SPDX-License-Identifier: Apache-2.0
#include "bindings.hpp"

PYBIND11_MODULE(_core, module) {
    module.doc() = "The C++ core of palpate: evaluation, filters, solvers, structures and simulation.";
    module.attr("__version__") = PALPATE_VERSION;

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
