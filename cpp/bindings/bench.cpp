// SPDX-License-Identifier: Apache-2.0
#include "palpate/bench.hpp"

#include <optional>
#include <string>

#include <pybind11/stl.h>

#include "bindings.hpp"
#include "fields.hpp"

namespace palpate::bindings {

namespace py = pybind11;
using namespace py::literals;

void bind_bench(py::module_& module) {
    py::class_<Bench> type(
        module, "Bench",
        "A simulated device with a hand on it that suits a model, and the rendering's numbers in its scale.");
    type.def(py::init([](const DeviceProfile& device, const Hand& hand, double length, double stiffness) {
                 return Bench{device, hand, length, stiffness};
             }),
             py::kw_only(), "device"_a, "hand"_a, "length"_a = 1.0, "stiffness"_a = 1.0)
        .def_readonly("device", &Bench::device)
        .def_readonly("hand", &Bench::hand)
        .def_readonly("length", &Bench::length, "Positions, over those of the default knob.")
        .def_readonly("stiffness", &Bench::stiffness, "Force per position, over that of the default knob.")
        .def(
            "scheme",
            [](const Bench& bench, const ForceModel& model, const std::optional<std::string>& structure,
               std::optional<bool> compensated, std::optional<double> coupling_stiffness,
               std::optional<double> coupling_damping, std::optional<double> mass,
               std::optional<double> damping, std::optional<double> play_radius, std::optional<int> predict) {
                SchemeChoices chosen{std::nullopt, compensated, coupling_stiffness, coupling_damping,
                                     mass,         damping,     play_radius,        predict};
                if (structure) {
                    chosen.structure = structure_named(*structure);
                }
                return bench.scheme(model, chosen);
            },
            "model"_a, py::kw_only(), "structure"_a = py::none(), "compensated"_a = py::none(),
            "coupling_stiffness"_a = py::none(), "coupling_damping"_a = py::none(), "mass"_a = py::none(),
            "damping"_a = py::none(), "play_radius"_a = py::none(), "predict"_a = py::none(),
            "What is given, in the model's own units; what is None follows the model in this bench's scale.");
    define_by_fields(type, {"device", "hand", "length", "stiffness"});
    module.def(
        "bench_for", &bench_for, "model"_a, "is_angle"_a, "period_s"_a = DeviceProfile{}.period_s,
        "The bench on which a model of one position is tried. An angle is tried on the default knob;\n"
        "for any other unit it is the same knob as a scale model: lengths and forces are multiplied so\n"
        "that travel and largest force stand to the device as in the knob's own scene.");
}

}  // namespace palpate::bindings
