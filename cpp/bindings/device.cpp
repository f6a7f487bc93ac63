// SPDX-License-Identifier: Apache-2.0
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>

#include "bindings.hpp"
#include "fields.hpp"
#include "palpate/device/device_profile.hpp"
#include "palpate/device/hid_descriptor.hpp"
#include "palpate/device/pid_reports.hpp"
#include "palpate/device/wire.hpp"

namespace palpate::bindings {

namespace py = pybind11;
using namespace py::literals;

namespace {

py::dict decode_info(const py::bytes& data) {
    const auto text = data.cast<std::string>();
    wire::Info info;
    const std::string fault =
        wire::decode({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}, info);
    if (!fault.empty()) {
        throw std::invalid_argument(fault);
    }
    return py::dict(
        "firmware"_a = info.firmware, "counts_per_rev"_a = info.counts_per_rev,
        "encoder_step"_a = wire::position_of(1, info.counts_per_rev),
        "max_torque"_a = -wire::force_of(info.max_torque_uNm), "rate_hz"_a = info.rate_hz,
        "watchdog_ms"_a = info.watchdog_ms, "transducer"_a = (info.capabilities & wire::has_transducer) != 0,
        "measures_velocity"_a = (info.capabilities & wire::measures_velocity) != 0, "uid"_a = info.uid);
}

py::dict decode_model(const py::bytes& data) {
    const auto text = data.cast<std::string>();
    wire::DeviceModel model;
    const std::string fault =
        wire::decode({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}, model);
    if (!fault.empty()) {
        throw std::invalid_argument(fault);
    }
    return py::dict("fingerprint"_a = wire::fingerprint_text(model.fingerprint),
                    "certificate"_a = wire::fingerprint_text(model.certificate), "rate_hz"_a = model.rate_hz,
                    "is_rendered"_a = model.renderer == wire::Renderer::Device);
}

std::optional<bool> wheel_has_springs(const py::bytes& descriptor) {
    const auto text = descriptor.cast<std::string>();
    try {
        return hid::pid::Layout{
            hid::read_descriptor({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()})}
            .has_springs();
    } catch (const std::runtime_error&) {
        return std::nullopt;
    }
}

}  // namespace

void bind_device(py::module_& module) {
    py::class_<OnDevice> timing(
        module, "OnDevice", "Timing of a model that runs on the motor controller of a device, in SI units.");
    bind_fields(timing);
    timing.def(
        py::init([](const py::dict& fields) { return py::type::of<OnDevice>()(**fields).cast<OnDevice>(); }),
        "fields"_a);
    py::implicitly_convertible<py::dict, OnDevice>();
    py::class_<AdmittanceDisplay> display(
        module, "AdmittanceDisplay",
        "Hand, handle and position servo of a device that measures the force and moves to a commanded\n"
        "position, in SI units. A certificate holds for every hand within the stated limits.");
    bind_fields(display);
    display.def(py::init([](const py::dict& fields) {
                    return py::type::of<AdmittanceDisplay>()(**fields).cast<AdmittanceDisplay>();
                }),
                "fields"_a);
    py::implicitly_convertible<py::dict, AdmittanceDisplay>();
    py::class_<HeldLine> loop(
        module, "HeldLine",
        "Loop of a motor controller that holds a line between two commands, in SI units.");
    bind_fields(loop);
    loop.def(
        py::init([](const py::dict& fields) { return py::type::of<HeldLine>()(**fields).cast<HeldLine>(); }),
        "fields"_a);
    py::implicitly_convertible<py::dict, HeldLine>();
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
    module.def("decode_info", &decode_info, "data"_a,
               "Returns the properties in a USB device's answer to the request GET_INFO, by name. Raises\n"
               "InputError with the wrong field.\n\n"
               "firmware, counts_per_rev, encoder_step [rad], max_torque [N*m], rate_hz, watchdog_ms,\n"
               "transducer, measures_velocity, uid.");
    module.def("decode_model", &decode_model, "data"_a,
               "Returns the model in a USB device's answer to the request GET_MODEL, by name. Raises\n"
               "InputError with the wrong field.\n\n"
               "fingerprint and certificate (16 hexadecimal digits each), rate_hz (certified), is_rendered\n"
               "(now, by the device).");
    module.def("wheel_has_springs", &wheel_has_springs, "descriptor"_a,
               "Returns whether a force-feedback wheel with this report descriptor has springs; None if the\n"
               "descriptor lacks a report that the adapter needs.");
    module.def("usb_cause", &wire::usb_cause, "code"_a,
               "Returns cause and cure for an error code of libusb; empty for a code without a text.");
    py::enum_<wire::Request>(
        module, "UsbRequest",
        "Numbers of the control requests to a USB device (field bRequest of a control transfer).")
        .value("GetInfo", wire::Request::GetInfo)
        .value("Enable", wire::Request::Enable)
        .value("Zero", wire::Request::Zero)
        .value("Watchdog", wire::Request::Watchdog)
        .value("Clear", wire::Request::Clear)
        .value("GetModel", wire::Request::GetModel)
        .value("Renderer", wire::Request::Renderer);
    module.attr("usb_vendor") = wire::vendor_id;
    module.attr("usb_product") = wire::product_id;
    module.attr("usb_timeout_ms") = wire::request_timeout_ms;
    module.attr("usb_interface") = wire::interface_number;
    module.attr("usb_interface_kind") =
        py::make_tuple(wire::interface_kind[0], wire::interface_kind[1], wire::interface_kind[2]);
    module.attr("usb_to_host") = wire::request_to_host;
    module.attr("usb_to_device") = wire::request_to_device;
    module.attr("usb_largest_packet") = wire::largest_packet;
    module.attr("shortest_watchdog_ms") = wire::shortest_watchdog_ms;
    module.attr("longest_watchdog_ms") = wire::longest_watchdog_ms;
}

}  // namespace palpate::bindings
