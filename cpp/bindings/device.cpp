// SPDX-License-Identifier: Apache-2.0
#include <pybind11/stl.h>

#include "bindings.hpp"
#include "fields.hpp"
#include "palpate/device/device_profile.hpp"

namespace palpate::bindings {

namespace py = pybind11;
using namespace py::literals;

void bind_device(py::module_& module) {
    module.def("longest_delay_s", &longest_delay_s, "period_s"_a,
               "Longest delay of a profile [s]: 16 periods.");
    const DeviceProfile profile;
    py::class_<DeviceProfile> device_profile(
        module, "DeviceProfile",
        "What is known of a haptic device of one degree of freedom; SI units, rotary or linear.");
    device_profile
        .def(py::init([](std::string id, double period_s, double inertia, double viscous_damping,
                         double coulomb_friction, double encoder_step, double force_step, double delay_s,
                         double force_limit, double jitter_s, std::string position_unit) {
                 DeviceProfile made{std::move(id),
                                    period_s,
                                    inertia,
                                    viscous_damping,
                                    coulomb_friction,
                                    encoder_step,
                                    force_step,
                                    delay_s,
                                    force_limit,
                                    jitter_s,
                                    std::move(position_unit)};
                 validate(made);
                 return made;
             }),
             py::kw_only(), "id"_a = profile.id, "period_s"_a = profile.period_s,
             "inertia"_a = profile.inertia, "viscous_damping"_a = profile.viscous_damping,
             "coulomb_friction"_a = profile.coulomb_friction, "encoder_step"_a = profile.encoder_step,
             "force_step"_a = profile.force_step, "delay_s"_a = profile.delay_s,
             "force_limit"_a = profile.force_limit, "jitter_s"_a = profile.jitter_s,
             "position_unit"_a = profile.position_unit)
        .def_readonly("id", &DeviceProfile::id)
        .def_readonly("period_s", &DeviceProfile::period_s, "T, time between two samples [s].")
        .def_readonly("inertia", &DeviceProfile::inertia, "[kg or kg*m^2]")
        .def_readonly("viscous_damping", &DeviceProfile::viscous_damping, "[N*s/m or N*m*s/rad]")
        .def_readonly("coulomb_friction", &DeviceProfile::coulomb_friction, "[N or N*m]")
        .def_readonly("encoder_step", &DeviceProfile::encoder_step, "[m or rad]; 0 = not quantised")
        .def_readonly("force_step", &DeviceProfile::force_step, "[N or N*m]; 0 = not quantised")
        .def_readonly("delay_s", &DeviceProfile::delay_s,
                      "Time from a sample to the force that is computed from it [s].")
        .def_property_readonly("whole_delay_samples", &DeviceProfile::whole_delay_samples,
                               "n: number of whole samples in the delay.")
        .def_property_readonly("delay_fraction", &DeviceProfile::delay_fraction,
                               "tau: rest of the delay [samples].")
        .def_property_readonly("late_samples", &DeviceProfile::late_samples,
                               "Smallest number of whole samples that is not shorter than the delay.")
        .def_readonly("force_limit", &DeviceProfile::force_limit, "[N or N*m]")
        .def_readonly("jitter_s", &DeviceProfile::jitter_s,
                      "How much longer than period_s the time between two samples can get [s].")
        .def_readonly("position_unit", &DeviceProfile::position_unit,
                      "rad, and forces are in N*m; or m, and they are in N.")
        .def_property_readonly("longest_period_s", &DeviceProfile::longest_period_s,
                               "period_s + jitter_s: what a certificate has to hold for [s].");
    define_by_fields(device_profile,
                     {"id", "period_s", "inertia", "viscous_damping", "coulomb_friction", "encoder_step",
                      "force_step", "delay_s", "force_limit", "jitter_s", "position_unit"});
}

}  // namespace palpate::bindings
