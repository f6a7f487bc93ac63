// SPDX-License-Identifier: Apache-2.0
#include "bindings.hpp"
#include "fields.hpp"
#include "palpate/device/device_profile.hpp"

namespace palpate::bindings {

namespace py = pybind11;
using namespace py::literals;

void bind_device(py::module_& module) {
    py::class_<OnDevice> timing(
        module, "OnDevice", "Timing of a model that runs on the motor controller of a device, in SI units.");
    bind_fields(timing);
    timing.def(
        py::init([](const py::dict& fields) { return py::type::of<OnDevice>()(**fields).cast<OnDevice>(); }),
        "fields"_a);
    py::implicitly_convertible<py::dict, OnDevice>();
    py::class_<DeviceProfile> type(
        module, "DeviceProfile",
        "Properties of a haptic device of one degree of freedom, in SI units; a knob (rad) or a straight "
        "handle (m).");
    bind_fields(type, true, [](const DeviceProfile& made) { validate(made); });
    type.def_property_readonly("late_samples", &DeviceProfile::late_samples,
                               "Delay in periods, rounded up to a whole number.")
        .def_property_readonly("longest_period_s", &DeviceProfile::longest_period_s,
                               "period_s + jitter_s, the longest time between two samples [s].");
    module.def(
        "on_device", &on_device, "profile"_a, "rate_hz"_a,
        "Returns the profile of a device whose motor controller runs the model rate_hz times a second. "
        "Raises "
        "ValueError\nif the controller does not reach this rate, or if its delay is longer than 16 periods.");
}

}  // namespace palpate::bindings
