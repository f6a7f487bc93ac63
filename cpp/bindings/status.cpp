// SPDX-License-Identifier: Apache-2.0
#include "palpate/status.hpp"

#include "bindings.hpp"

namespace palpate::bindings {

namespace py = pybind11;

void bind_status(py::module_& module) {
    py::enum_<Status> status(
        module, "Status",
        "Result of one step of the control loop or of a solver. C++ and recordings use the same words.");
    py::dict meanings;
    for (std::size_t k = 0; k < status_texts.size(); ++k) {
        status.value(status_texts[k].word, static_cast<Status>(k), status_texts[k].meaning);
        meanings[status_texts[k].word] = status_texts[k].meaning;
    }
    module.attr("status_meanings") = meanings;
}

}  // namespace palpate::bindings
