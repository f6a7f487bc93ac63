// SPDX-License-Identifier: Apache-2.0
#include <pybind11/complex.h>
#include <pybind11/stl.h>

#include "arrays.hpp"
#include "bindings.hpp"
#include "palpate/dynamics/filters.hpp"
#include "palpate/dynamics/transfer_function.hpp"

namespace palpate::bindings {

namespace py = pybind11;
using namespace py::literals;

void bind_dynamics(py::module_& module) {
    py::class_<TransferFunction>(module, "TransferFunction",
                                 "Filter H(z) = (b0 z^2 + b1 z + b2) / (z^2 + a1 z + a2) and its state.")
        .def(py::init<std::array<double, 3>, std::array<double, 3>>(), "numerator"_a, "denominator"_a)
        .def_property_readonly("numerator", &TransferFunction::numerator)
        .def_property_readonly("denominator", &TransferFunction::denominator)
        .def("step", &TransferFunction::step, "input"_a,
             "Filters the next input sample and returns the output sample.")
        .def("reset", &TransferFunction::reset, "Sets the state of the filter to zero.")
        .def("at", &TransferFunction::at, "z"_a, "Returns H(z), for instance at z = exp(1j * omega * T).")
        .def("poles", &TransferFunction::poles)
        .def(
            "filter",
            [](TransferFunction filter, const Array& input) {
                require_vector(input, "input");
                py::array_t<double> output(input.size());
                for (py::ssize_t k = 0; k < input.size(); ++k) {
                    output.mutable_data()[k] = filter.step(input.data()[k]);
                }
                return output;
            },
            "input"_a,
            "Returns the filtered signal for an input signal (n,). The filter starts from its present\n"
            "state and keeps this state.");

    py::class_<EnvironmentFilters>(
        module, "EnvironmentFilters",
        "The paper's discrete integrators I1, I2 and differentiators G1, G2 (figures 10 to 14).")
        .def_readonly("i1", &EnvironmentFilters::i1)
        .def_readonly("i2", &EnvironmentFilters::i2)
        .def_readonly("g1", &EnvironmentFilters::g1)
        .def_readonly("g2", &EnvironmentFilters::g2);
    module.attr("paper_sample_time_s") = paper_sample_time;
    module.def(
        "environment_filters",
        [](const std::string& pair, const std::string& design) {
            return environment_filters(named<FilterPair>(pair, "pair"),
                                       named<FilterDesign>(design, "design"));
        },
        "pair"_a, "design"_a = "paper",
        "Returns the paper's integrators and differentiators for the period T = 1 ms (section 4.3): as "
        "published,\nor such that integrator times differentiator is 1 at low frequency.");
}

}  // namespace palpate::bindings
