// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/stl.h>

#include "bindings.hpp"
#include "fields.hpp"
#include "palpate/stability/account_certificate.hpp"
#include "palpate/stability/admittance_inequalities.hpp"
#include "palpate/stability/certificate.hpp"
#include "palpate/stability/certificate_check.hpp"
#include "palpate/stability/coupled_inequalities.hpp"
#include "palpate/stability/renderable_slopes.hpp"
#include "palpate/stability/tangent_inequalities.hpp"
#include "settings.hpp"

namespace palpate::bindings {

namespace py = pybind11;
using namespace py::literals;

namespace {

void bind_bounds(py::module_& module) {
    py::class_<ForceBounds> type(
        module, "ForceBounds",
        "Proved bounds of a model's force and slope at all positions, inside and outside the domain.\n\n"
        "With hysteresis the force is f = g + s h: the mean force g of press and release, the hysteresis\n"
        "h and the direction state s. During a stroke the slope is g' + s h'; after a reversal h / r is\n"
        "added, with the play radius r.");
    bind_fields<ForceBounds, 4>(type);
    constexpr double none = std::numeric_limits<double>::infinity();
    module.def(
        "force_bounds", &force_bounds, "model"_a, "play_radius"_a = 0.0, "force_limit"_a = none,
        "Returns proved bounds of the force of a model of position, or of position and velocity, limited to\n"
        "force_limit. A play_radius above 0 replaces the play radius of the model.");
    module.def("passive_shift", py::overload_cast<const ForceModel&, double>(&passive_shift), "model"_a,
               "force_limit"_a,
               "Returns the force to add to the bias of a periodic model, so that its force, limited to\n"
               "force_limit, gives no energy over a period [N or N*m]; 0 for other models.");
    module.def(
        "renderable_slopes",
        [](const DeviceProfile& device, double stick, double rising, double falling) {
            const Interval slopes = renderable_slopes(device, stick, {rising, falling});
            return std::pair{slopes.lower, slopes.upper};
        },
        "device"_a, "stick"_a = 0.0, py::kw_only(), "rising"_a = none, "falling"_a = none,
        "Returns the (lowest, highest) slope of a model for which direct rendering on a device is\n"
        "certified; infinite if every slope is certified.\n\n"
        "First finds the largest k for which slopes from -k to k are certified, with at most `falling`\n"
        "and `rising`. Then finds the steepest falling slope, and after that the steepest rising slope.\n"
        "With hysteresis these are slopes during a stroke; after a reversal h / r = `stick` is added\n"
        "(hysteresis by play radius).");
    module.def("steepest_stick", &steepest_stick, "device"_a,
               "Returns the largest slope h / r (hysteresis by play radius) that is certified for a model\n"
               "whose strokes have slopes as large as h / r.");
    module.def("narrowest_play", &narrowest_play, "sliding"_a, "device"_a, "least"_a, "most"_a,
               "Returns the smallest play radius from `least` to `most` for which a hysteresis model is\n"
               "certified; infinity if there is none. `sliding` are bounds of the model's force with a play\n"
               "radius so large that a reversal adds no slope.");
}

void bind_inequality(py::module_& module) {
    py::class_<Inequality> type(
        module, "Inequality",
        "One inequality of a certificate: left >= right, or left > right if `strict` is true.");
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
                                 "Inequalities and verdict for a model that a scheme renders on a device.");
    bind_fields<Certificate, 8>(type, false);
    type.def_property_readonly("certified", &Certificate::certified)
        .def_property_readonly("held_by_account", &Certificate::held_by_account)
        .def_property_readonly(
            "refused", [](const Certificate& certificate) { return certificate.verdict == Verdict::Refused; })
        .def("check", &checked, "model"_a,
             "Computes the certificate again from the model and returns it. Raises ValueError with the first "
             "field that differs.");
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
        "Returns the certificate of a model that a scheme renders on a device. If stability is not\n"
        "proved, the certificate states the reason. Raises ValueError for an invalid scheme or device.");
    module.def(
        "certify_with_account",
        [](const ForceModel& model, const Scheme& scheme, const DeviceProfile& device) {
            const py::gil_scoped_release unlocked;
            return certify_with_account(model, scheme, device);
        },
        "model"_a, "scheme"_a, "device"_a,
        "Returns the certificate of a rendering that the energy account limits: in no motion does a hand\n"
        "take out more energy than the object can store. It is refused if the account cannot hold the\n"
        "largest force at rest. Raises ValueError for an invalid scheme or device.");
    module.def(
        "certify_bounds",
        [](const ForceBounds& bounds, const Scheme& scheme, const DeviceProfile& device) {
            return certify(bounds, scheme, device);
        },
        "bounds"_a, "scheme"_a, "device"_a,
        "Returns the certificate of every force within the bounds, rendered by "
        "a scheme on a device.");
    module.def(
        "with_force_error", &with_force_error, "certificate"_a, "force_error"_a,
        "Returns the certificate of the same rendering by another program, such as an exported model, whose\n"
        "force differs by at most `force_error`.");
    module.def(
        "stiffest_coupling", &stiffest_coupling, py::kw_only(), "coupling_damping"_a, "falling"_a, "device"_a,
        "share"_a = usual_coupling_share,
        "Returns the largest coupling stiffness K_c that is certified with only the given share of the\n"
        "device's damping; 0 if no stiffness is certified. `coupling_damping` is B_c; `falling` is the\n"
        "steepest falling slope of the object's force.");
    module.attr("usual_coupling_share") = usual_coupling_share;
    module.def(
        "explicit_scheme",
        [](const ForceBounds& bounds, const DeviceProfile& device, const py::kwargs& fields) {
            SchemeChoices chosen;
            set_fields(chosen, fields);
            return explicit_scheme(bounds, device, chosen);
        },
        "bounds"_a, "device"_a,
        "Searches the explicit structure with the stiffest coupling, then the least object damping, for\n"
        "which the structure is stable, and returns its scheme. If none is stable, returns the last\n"
        "scheme that was tried. Keywords: mass, object_damping, coupling_stiffness, coupling_damping and\n"
        "play_radius; None: a default, or the result of the search.");
    module.def(
        "admittance_scheme",
        [](const ForceBounds& bounds, const std::string& structure, const DeviceProfile& device, double mass,
           double object_damping, std::optional<double> fixed_mass, std::optional<double> fixed_damping,
           double play_radius) {
            Scheme scheme;
            scheme.structure = named<StructureKind>(structure, "structure");
            scheme.coupling = {0.0, 0.0};
            scheme.inertia = admittance_object(scheme.structure, bounds, {mass, object_damping}, device,
                                               fixed_mass, fixed_damping);
            scheme.play_radius = play_radius;
            return scheme;
        },
        "bounds"_a, "structure"_a, "device"_a, py::kw_only(), "mass"_a, "object_damping"_a,
        "fixed_mass"_a = py::none(), "fixed_damping"_a = py::none(), "play_radius"_a = 0.0,
        "Returns the scheme with the least damping, and the least mass for it, with which a structure\n"
        "renders a force on an admittance display. Both are at least those of the model, `mass` and\n"
        "`object_damping`. A fixed value replaces the choice.");
    module.def(
        "stiffest_hand", &stiffest_hand, "bounds"_a, "scheme"_a, "device"_a,
        "Returns the largest stiffness of a hand for which a scheme is proved on an admittance display,\n"
        "with the other limits of the hand unchanged [N/m or N*m/rad]; 0 if none is.");
    module.def(
        "line_for",
        [](const ForceModel& model, const DeviceProfile& device, double motion, double play_radius) {
            ForceBounds bounds = force_bounds(model, play_radius, device.force_limit);
            bounds.bend = bend_bounds(model);
            return line_for(bounds, device, motion);
        },
        "model"_a, "device"_a, "motion"_a, "play_radius"_a = 0.0,
        "Returns the line of the simplest rule that is certified for a model on a device, for motions up to\n"
        "`motion` in a period; if none is certified, the line that needs least.");
    module.def(
        "stiffest_line_wall", &stiffest_line_wall, "device"_a, "width"_a, "motion"_a = py::none(),
        "Returns the largest stiffness of a wall whose slope rises over `width`, f'(x) = K / (1 + exp(-x /\n"
        "width)), that a held line renders, certified for motions up to `motion` in a period. None: "
        "certified\n"
        "for every motion.");
    module.def(
        "inner_need", &detail::inner_need, "held_line"_a, "stiffness"_a,
        "Returns the device damping that the loop of a controller needs for a line of this stiffness.");
    module.def(
        "fast_motion_energy", &fast_motion_energy, "device"_a,
        "Returns the largest energy that a hand can take out after a motion faster than the certified one,\n"
        "until the zero force of the guard acts [J]: (T + t_d) (F_max - f_c)^2 / 4 b.");
    module.def("device_difference", &device_difference, "certified"_a, "device"_a,
               "Returns a sentence about the first field in which a device profile differs from the "
               "certified profile;\n"
               "empty without a difference.");
    module.def(
        "slope_behind_coupling", &slope_behind_coupling, "slope"_a, "coupling_stiffness"_a,
        "Returns K_c k / (K_c + k), the slope that the device feels for an object of slope k > -K_c behind a "
        "coupling\nof stiffness K_c.");
}

}  // namespace palpate::bindings
