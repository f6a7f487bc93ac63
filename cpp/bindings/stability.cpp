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

namespace palpate::bindings {

namespace py = pybind11;
using namespace py::literals;

namespace {

template <class Enum, std::size_t n>
Enum named(const std::string& name, const std::array<std::string_view, n>& names, const char* field) {
    const auto found = std::find(names.begin(), names.end(), name);
    detail::require(found != names.end(),
                    std::string(field) + " is '" + name + "', which is none of its words");
    return static_cast<Enum>(found - names.begin());
}

void bind_bounds(py::module_& module) {
    const auto end = [](auto member, auto side) {
        return [member, side](const ForceBounds& bounds) { return bounds.*member.*side; };
    };
    py::class_<ForceBounds> type(
        module, "ForceBounds",
        "Proved bounds of a force over every position that can be reached, continuations "
        "included.\n\n"
        "With hysteresis, f = g + s h with a play of radius r, a path's slope is g' + s h', "
        "and h / r more while it sticks.");
    type.def(py::init([](double slope_min, double slope_max, double steepest, double sliding, double loss_min,
                         double loss_max, double loss_per_play, double mean_force, double drag,
                         bool hysteresis) {
                 return ForceBounds{hysteresis,           {slope_min, slope_max}, steepest,   sliding,
                                    {loss_min, loss_max}, loss_per_play,          mean_force, drag};
             }),
             py::kw_only(), "slope_min"_a, "slope_max"_a, "steepest"_a, "sliding"_a, "loss_min"_a = 0.0,
             "loss_max"_a = 0.0, "loss_per_play"_a = 0.0, "mean_force"_a = 0.0, "drag"_a = 0.0,
             "hysteresis"_a = false)
        .def_readonly("hysteresis", &ForceBounds::hysteresis)
        .def_property_readonly("slope_min", end(&ForceBounds::slope, &Interval::lower), "Of every path.")
        .def_property_readonly("slope_max", end(&ForceBounds::slope, &Interval::upper), "Of every path.")
        .def_readonly("steepest", &ForceBounds::steepest, "L = max |f'|, or max(|g'| + |h'| + h / r).")
        .def_readonly("sliding", &ForceBounds::sliding, "max |f'|, or max(|g'| + |h'|).")
        .def_property_readonly("loss_min", end(&ForceBounds::loss, &Interval::lower), "Smallest h.")
        .def_property_readonly("loss_max", end(&ForceBounds::loss, &Interval::upper), "Largest h.")
        .def_readonly("loss_per_play", &ForceBounds::loss_per_play, "max h / r")
        .def_readonly("mean_force", &ForceBounds::mean_force,
                      "How much a limited force that repeats pushes on average, beyond its loss.")
        .def_readonly("drag", &ForceBounds::drag, "B_v = max |f(x, v) - f(x, 0)| / |v|.");
    define_by_fields(type, {"slope_min", "slope_max", "steepest", "sliding", "loss_min", "loss_max",
                            "loss_per_play", "mean_force", "drag", "hysteresis"});
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
    type.def(py::init([](std::string id, double left, double right, std::string name, std::string formula,
                         const std::string& rests_on, std::string source, bool strict) {
                 return Inequality{std::move(id),
                                   std::move(name),
                                   std::move(formula),
                                   left,
                                   right,
                                   named<Basis>(rests_on, basis_names, "rests_on"),
                                   std::move(source),
                                   strict};
             }),
             py::kw_only(), "id"_a, "left"_a, "right"_a, "name"_a = "", "formula"_a = "",
             "rests_on"_a = name_of(Basis::Proved), "source"_a = "", "strict"_a = false)
        .def_readonly("id", &Inequality::id, "Stable name; texts may change between releases.")
        .def_readonly("name", &Inequality::name)
        .def_readonly("formula", &Inequality::formula)
        .def_readonly("left", &Inequality::left, "What there is.")
        .def_readonly("right", &Inequality::right, "What is needed.")
        .def_property_readonly("margin", &Inequality::margin, "left - right")
        .def_readonly("strict", &Inequality::strict)
        .def_property_readonly("holds", &Inequality::holds)
        .def_property_readonly(
            "rests_on", [](const Inequality& line) { return std::string(name_of(line.rests_on)); },
            "proved, linear (the linearised system only) or none (no bound is known beyond).")
        .def_readonly("source", &Inequality::source);
    define_by_fields(type, {"id", "left", "right", "name", "formula", "rests_on", "source", "strict"}, false);
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
    type.def(py::init([](const Scheme& scheme, const DeviceProfile& device, std::string model,
                         const ForceBounds& bounds, std::vector<Inequality> inequalities,
                         const std::string& verdict, double longest_period_s, std::string fingerprint,
                         std::string why) {
                 return Certificate{scheme,
                                    device,
                                    std::move(model),
                                    bounds,
                                    std::move(inequalities),
                                    named<Verdict>(verdict, verdict_names, "verdict"),
                                    std::move(why),
                                    longest_period_s,
                                    std::move(fingerprint)};
             }),
             py::kw_only(), "scheme"_a, "device"_a, "model"_a, "bounds"_a, "inequalities"_a, "verdict"_a,
             "longest_period_s"_a, "fingerprint"_a, "why"_a = "",
             "A certificate as stored in a file. Use the result of `check`.")
        .def_readonly("scheme", &Certificate::scheme)
        .def_readonly("device", &Certificate::device)
        .def_readonly("model", &Certificate::model, "Fingerprint of the model.")
        .def_readonly("bounds", &Certificate::bounds, "Of the force that is rendered, compensation included.")
        .def_readonly("inequalities", &Certificate::inequalities)
        .def_property_readonly(
            "verdict",
            [](const Certificate& certificate) { return std::string(name_of(certificate.verdict)); })
        .def_property_readonly("certified", &Certificate::certified)
        .def_property_readonly(
            "refused", [](const Certificate& certificate) { return certificate.verdict == Verdict::Refused; })
        .def_readonly("why", &Certificate::why, "One sentence.")
        .def_readonly(
            "longest_period_s", &Certificate::longest_period_s,
            "Time between two samples up to which every inequality holds [s]; 0 where one does not.")
        .def_readonly("fingerprint", &Certificate::fingerprint,
                      "16 hexadecimal digits over every number and name of the certificate.")
        .def("check", &checked, "model"_a,
             "Computes the certificate again and returns the result. ValueError names the first field that "
             "differs.");
    define_by_fields(type,
                     {"scheme", "device", "model", "bounds", "inequalities", "verdict", "longest_period_s",
                      "fingerprint", "why"},
                     false);
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
        "share"_a = 1.0,
        "Largest coupling stiffness K_c for which a share of the device's damping is enough; 0 if there is "
        "none.\n"
        "`damping` is B_c; `falling` the steepest fall of the object's force.");
    module.def(
        "device_difference", &device_difference, "certified"_a, "device"_a,
        "The first field in which a device is not the certified one, as a sentence; empty where it is.");
    module.def(
        "felt_slope", &felt_slope, "slope"_a, "coupling_stiffness"_a,
        "K_c k / (K_c + k): the slope that is felt through a coupling where the object's is k > -K_c.");
}

}  // namespace palpate::bindings
