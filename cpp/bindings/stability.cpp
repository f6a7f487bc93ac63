// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/stl.h>

#include "bindings.hpp"
#include "fields.hpp"
#include "palpate/stability/certificate.hpp"
#include "palpate/stability/certificate_check.hpp"
#include "palpate/stability/renderable_slopes.hpp"
#include "settings.hpp"

namespace palpate::bindings {

namespace py = pybind11;
using namespace py::literals;

namespace {

void bind_bounds(py::module_& module) {
    py::class_<ForceBounds> type(
        module, "ForceBounds",
        "Proved bounds of a force over every position that can be reached, continuations "
        "included.\n\n"
        "With hysteresis, f = g + s h with a play of radius r, a path's slope is g' + s h', "
        "and h / r more while it sticks.");
    bind_fields<ForceBounds, 4>(type);
    constexpr double none = std::numeric_limits<double>::infinity();
    module.def(
        "force_bounds", &force_bounds, "model"_a, "play_radius"_a = 0.0, "force_limit"_a = none,
        "Returns proved bounds of a model of one position, or of position and velocity, on a device with a\n"
        "force limit. A play_radius above 0 replaces the model's own.");
    module.def("balancing_shift", py::overload_cast<const ForceModel&, double>(&balancing_shift), "model"_a,
               "force_limit"_a,
               "Shift of a force that repeats with which the limited force does not push on average; 0 for "
               "other\n"
               "models. Add it to the bias of the network.");
    module.def(
        "renderable_slopes",
        [](const DeviceProfile& device, double stick, double rising, double falling) {
            const Interval slopes = renderable_slopes(device, stick, {rising, falling});
            return std::pair{slopes.lower, slopes.upper};
        },
        "device"_a, "stick"_a = 0.0, py::kw_only(), "rising"_a = none, "falling"_a = none,
        "(lowest, highest) slope that direct rendering is certified for; infinite where nothing limits "
        "it.\n\n"
        "First as steep a slope on both sides as is certified, but none steeper than `rising` and "
        "`falling`;\n"
        "then as steep a fall, and after it a rise, as is still certified. With hysteresis these are slopes\n"
        "while sliding, and a stick adds h / r = `stick`.");
    module.def("steepest_stick", &steepest_stick, "device"_a,
               "Slope h / r that leaves half of what the device holds to sliding.");
    module.def("narrowest_play", &narrowest_play, "sliding"_a, "device"_a, "least"_a, "most"_a,
               "Narrowest play radius between `least` and `most` for which hysteresis is certified; infinite "
               "if none\n"
               "is. `sliding` bounds the model with a play so wide that sticking adds no slope.");
}

void bind_inequality(py::module_& module) {
    py::class_<Inequality> type(
        module, "Inequality",
        "One line of a certificate: left >= right, or left > right where it is strict.");
    bind_fields<Inequality, 3>(type, false);
    type.def_property_readonly("margin", &Inequality::margin, "left - right")
        .def_property_readonly("holds", &Inequality::holds);
    type.def("__repr__", [](const Inequality& line) {
        return "<Inequality " + line.formula + ": " + readable(line.left) + " against " +
               readable(line.right) + (line.holds() ? ", holds>" : ", fails>");
    });
}

}  // namespace

void bind_stability(py::module_& module) {
    bind_bounds(module);
    bind_inequality(module);
    py::class_<Certificate> type(module, "Certificate",
                                 "What is proved of a model, rendered by a scheme, on a device.");
    bind_fields<Certificate, 8>(type, false);
    type.def_property_readonly("certified", &Certificate::certified)
        .def_property_readonly(
            "refused", [](const Certificate& certificate) { return certificate.verdict == Verdict::Refused; })
        .def("check", &checked, "model"_a,
             "Computes the certificate again and returns the result. ValueError names the first field that "
             "differs.");
    type.def("__repr__", [](const Certificate& certificate) {
        return "<Certificate for " + certificate.device.id + ": " +
               std::string(name_of(certificate.verdict)) + "; " + certificate.why + ">";
    });
    module.def(
        "certify",
        [](const ForceModel& model, const Scheme& scheme, const DeviceProfile& device) {
            const py::gil_scoped_release unlocked;
            return certify(model, scheme, device);
        },
        "model"_a, "scheme"_a, "device"_a,
        "What is proved of a model rendered by a scheme on a device. A refusal is an answer, with its "
        "reason;\n"
        "ValueError where scheme or device is impossible.");
    module.def(
        "certify_bounds",
        [](const ForceBounds& bounds, const Scheme& scheme, const DeviceProfile& device) {
            return certify(bounds, scheme, device);
        },
        "bounds"_a, "scheme"_a, "device"_a, "The same for any force within bounds.");
    module.def(
        "stiffest_coupling", &stiffest_coupling, py::kw_only(), "damping"_a, "falling"_a, "device"_a,
        "share"_a = usual_coupling_share,
        "Largest coupling stiffness K_c for which a share of the device's damping is enough; 0 if there is "
        "none.\n"
        "`damping` is B_c; `falling` the steepest fall of the object's force.");
    module.attr("usual_coupling_share") = usual_coupling_share;
    module.def(
        "explicit_scheme",
        [](const ForceBounds& bounds, const DeviceProfile& device, const py::kwargs& fields) {
            SchemeChoices chosen;
            set_fields(chosen, fields);
            return explicit_scheme(bounds, device, chosen);
        },
        "bounds"_a, "device"_a,
        "Explicit structure with the stiffest coupling, then the least object damping, for which it is "
        "stable; the\n"
        "last one tried if none is. mass, damping, coupling_stiffness, coupling_damping and play_radius by\n"
        "keyword, None: chosen.");
    module.def(
        "device_difference", &device_difference, "certified"_a, "device"_a,
        "The first field in which a device is not the certified one, as a sentence; empty where it is.");
    module.def(
        "felt_slope", &felt_slope, "slope"_a, "coupling_stiffness"_a,
        "K_c k / (K_c + k): the slope that is felt through a coupling where the object's is k > -K_c.");
}

}  // namespace palpate::bindings
