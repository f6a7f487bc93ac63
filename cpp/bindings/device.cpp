// SPDX-License-Identifier: Apache-2.0
#include "bindings.hpp"
#include "fields.hpp"
#include "palpate/device/device_profile.hpp"

namespace palpate::bindings {

namespace py = pybind11;

void bind_device(py::module_& module) {
    py::class_<DeviceProfile> type(
        module, "DeviceProfile",
        "Properties of a haptic device of one degree of freedom, in SI units; a knob (rad) or a straight "
        "handle (m).");
    bind_fields(type, true, [](const DeviceProfile& made) { validate(made); });
    type.def_property_readonly("late_samples", &DeviceProfile::late_samples,
                               "Delay in periods, rounded up to a whole number.")
        .def_property_readonly("longest_period_s", &DeviceProfile::longest_period_s,
                               "period_s + jitter_s, the longest time between two samples [s].");
}

}  // namespace palpate::bindings
