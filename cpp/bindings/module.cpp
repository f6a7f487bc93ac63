// SPDX-License-Identifier: Apache-2.0
#include <exception>
#include <stdexcept>
#include <utility>

#include "bindings.hpp"
#include "palpate/version.hpp"

namespace {

/// Converts std::invalid_argument to the Python exception palpate.InputError, which is a ValueError.
void translate_invalid_argument(std::exception_ptr thrown) {
    try {
        std::rethrow_exception(std::move(thrown));
    } catch (const std::invalid_argument& error) {
        const pybind11::object type = pybind11::module_::import("palpate.errors").attr("InputError");
        pybind11::set_error(type, palpate::bindings::text_of(error.what()));
    }
}

}  // namespace

// The objects of the module have no locks. By default pybind11 turns on the global lock of a Python without one.
PYBIND11_MODULE(_core, module) {
    module.doc() = "The C++ core of palpate, one submodule for each folder of its headers.";
    module.attr("__version__") = palpate::library_version;
    pybind11::register_local_exception_translator(&translate_invalid_argument);

    using namespace palpate::bindings;
    const auto submodule = [&](const char* name, const char* doc, auto... bind) {
        pybind11::module_ made = module.def_submodule(name, doc);
        // the import `from palpate._core.model import ...` finds the submodule in sys.modules
        pybind11::module_::import("sys").attr("modules")[made.attr("__name__")] = made;
        (bind(made), ...);
    };
    submodule("status", "Status of a tick of the control loop or of a solver.", bind_status);
    submodule("model", "Force laws and their proved bounds.", bind_wavelet, bind_model);
    submodule("dynamics", "Transfer functions and the filters of the paper.", bind_dynamics);
    submodule("device", "Profiles of devices, and the packets of USB devices.", bind_device);
    submodule("rendering", "Structures between a model and a device.", bind_rendering);
    submodule("stability", "Certificates and their inequalities.", bind_stability);
    submodule("portable", "Models as tables for programs in C.", bind_portable);
    submodule("io", "Model files.", bind_io);
    submodule("simulation", "Rendering in virtual time on a simulated device.", bind_simulation);
#ifdef __linux__
    submodule("run", "Rendering and measuring in real time.", bind_run);
#endif
}
