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
        "Proved bounds of a force over all positions, continuations included.\n\n"
        "With hysteresis, f = g + s h with a play of radius r, the slope of a path is g' + s h'. While it\n"
        "sticks, h / r is added.");
    bind_fields<ForceBounds, 4>(type);
    constexpr double none = std::numeric_limits<double>::infinity();
    module.def(
        "force_bounds", &force_bounds, "model"_a, "play_radius"_a = 0.0, "force_limit"_a = none,
        "Returns proved bounds of a model of one position, or of position and velocity, on a device with a\n"
        "force limit. A play_radius above 0 replaces the model's own.");
    module.def(
        "passive_shift", py::overload_cast<const ForceModel&, double>(&passive_shift), "model"_a,
        "force_limit"_a,
        "Returns the shift of a periodic force for which the mean of the limited force is not active; 0\n"
        "for other models. Add it to the bias of the network.");
    module.def(
        "renderable_slopes",
        [](const DeviceProfile& device, double stick, double rising, double falling) {
            const Interval slopes = renderable_slopes(device, stick, {rising, falling});
            return std::pair{slopes.lower, slopes.upper};
        },
        "device"_a, "stick"_a = 0.0, py::kw_only(), "rising"_a = none, "falling"_a = none,
        "Returns the (lowest, highest) slope for which direct rendering is certified; infinite without a\n"
        "limit.\n\n"
        "First finds the largest k for which slopes of -k and k are certified together, limited to "
        "`falling`\n"
        "and `rising`. Then finds the largest falling slope, and after that the largest rising one. With\n"
        "hysteresis these are slopes while sliding; sticking adds h / r = `stick`.");
    module.def("steepest_stick", &steepest_stick, "device"_a,
               "Returns the slope h / r that leaves half of the device's largest slope for sliding.");
    module.def(
        "narrowest_play", &narrowest_play, "sliding"_a, "device"_a, "least"_a, "most"_a,
        "Returns the narrowest play radius from `least` to `most` for which hysteresis is certified;\n"
        "infinite without one. `sliding` are bounds of the model with a play so wide that sticking adds\n"
        "no slope.");
}

void bind_inequality(py::module_& module) {
    py::class_<Inequality> type(module, "Inequality",
                                "One line of a certificate: left >= right, or left > right if it is strict.");
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
                                 "Proved properties of a model that a scheme renders on a device.");
    bind_fields<Certificate, 8>(type, false);
    type.def_property_readonly("certified", &Certificate::certified)
        .def_property_readonly(
            "refused", [](const Certificate& certificate) { return certificate.verdict == Verdict::Refused; })
        .def("check", &checked, "model"_a,
             "Computes the certificate again and returns the result. ValueError names the first field that "
             "differs.");
    type.def("__repr__", [](const Certificate& certificate) {
        return "<Certificate for " + certificate.device.id + ": " +
               std::string(name_of(certificate.verdict)) + "; " + certificate.reason + ">";
    });
    module.def(
        "certify",
        [](const ForceModel& model, const Scheme& scheme, const DeviceProfile& device) {
            const py::gil_scoped_release unlocked;
            return certify(model, scheme, device);
        },
        "model"_a, "scheme"_a, "device"_a,
        "Certifies a model that a scheme renders on a device. A refusal is a result with a reason; an\n"
        "impossible scheme or device raises ValueError.");
    module.def(
        "certify_bounds",
        [](const ForceBounds& bounds, const Scheme& scheme, const DeviceProfile& device) {
            return certify(bounds, scheme, device);
        },
        "bounds"_a, "scheme"_a, "device"_a, "Certifies any force within bounds.");
    module.def("stiffest_coupling", &stiffest_coupling, py::kw_only(), "coupling_damping"_a, "falling"_a,
               "device"_a, "share"_a = usual_coupling_share,
               "Returns the largest coupling stiffness K_c for which a share of the device's damping is "
               "sufficient; 0\n"
               "if no stiffness is certified. `coupling_damping` is B_c; `falling` is the steepest falling "
               "slope of\n"
               "the object's force.");
    module.attr("usual_coupling_share") = usual_coupling_share;
    module.def(
        "explicit_scheme",
        [](const ForceBounds& bounds, const DeviceProfile& device, const py::kwargs& fields) {
            SchemeChoices chosen;
            set_fields(chosen, fields);
            return explicit_scheme(bounds, device, chosen);
        },
        "bounds"_a, "device"_a,
        "Returns the explicit structure with the stiffest coupling, then the least object damping, for "
        "which\n"
        "it is stable; otherwise the last one tried. Keywords: mass, object_damping, coupling_stiffness,\n"
        "coupling_damping and play_radius; None: chosen by the search.");
    module.def(
        "device_difference", &device_difference, "certified"_a, "device"_a,
        "Returns a sentence about the first field in which a device differs from the certified one; empty\n"
        "without a difference.");
    module.def("slope_behind_coupling", &slope_behind_coupling, "slope"_a, "coupling_stiffness"_a,
               "Returns K_c k / (K_c + k), the slope of an object of slope k > -K_c behind a coupling.");
}

}  // namespace palpate::bindings
